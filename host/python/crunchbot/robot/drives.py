"""A drive over known floor: samples of a recording or of a ring, and the way that a robot took, for `touch.texture.drive`."""

import threading
import time
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..bridge.ring import Reader, RingError
from ..errors import UserError
from ..nav import localise
from ..nav.observations import observations_path, read_observations
from ..occupancy import from_map
from ..recording import Recording
from ..scene import Scene
from ..tables import TableError, Warn, numbers, read_columns
from ..touch.texture.drive import Drive, Way
from .bags.rows import is_bag, read_bag

PLACE = ("x_m", "y_m", "theta_rad")
LOOK_S = 0.5  # how soon a signal is noticed while no frame comes


class DriveError(UserError):
    """A drive that nothing can be learnt from; one line."""


def recorded(recording: Recording, warn: Warn) -> Drive:
    """The samples of all lanes. Where the bridge began anew the longest part is taken, since ticks tell the time."""
    drive = _drive(recording.stamped_blocks(), recording.clock_hz, warn, str(recording.path))
    for line in recording.damage:
        warn(line)
    return drive


def live(reader: Reader, seconds: float, clock_hz: float, stop: threading.Event, warn: Warn) -> Drive:
    """The samples of the next so many seconds, or until `stop`."""
    return _drive(_coming(reader, seconds, clock_hz, stop), clock_hz, warn, f"ring {reader.name}")


def _coming(reader: Reader, seconds: float, clock_hz: float, stop: threading.Event) -> Iterable[tuple[int, np.ndarray]]:
    reader.seek_latest(0)
    first = None
    while not stop.is_set():
        try:
            frames = reader.take(LOOK_S)
        except RingError as error:
            if error.name != "OVERRUN":
                raise
            continue  # the ticks show the gap
        if frames is None:
            return
        if len(frames):
            yield time.time_ns(), frames
            first = int(frames["time_cycles"][0]) if first is None else first
            if int(frames["time_cycles"][-1]) - first >= seconds * clock_hz:
                return


def _drive(blocks: Iterable[tuple[int, np.ndarray]], clock_hz: float, warn: Warn, name: str) -> Drive:
    """Of frames with the host's time of the first, ns."""
    began_ns, ticks, cycles, lanes = 0, [], [], []
    for stamp_ns, frames in blocks:
        began_ns = began_ns or stamp_ns
        ticks.append(frames["tick"].astype(np.int64))
        cycles.append(frames["time_cycles"].astype(np.int64))
        lanes.append(_counts(frames["lane"]))
    if sum(map(len, ticks)) < 2:
        raise DriveError(f"{name}: no frames; let the bridge run, and record some seconds")
    tick, cycle, counts = np.concatenate(ticks), np.concatenate(cycles), np.concatenate(lanes)
    edges = [0, *(np.flatnonzero(np.diff(tick) <= 0) + 1), len(tick)]
    if len(edges) > 2:
        warn(f"{name}: the bridge began anew {len(edges) - 2} times; the longest part is used")
    at = int(np.argmax(np.diff(edges)))
    part = slice(edges[at], edges[at + 1])
    period_s = float(np.median(np.diff(cycle[part]) / np.diff(tick[part]))) / clock_hz
    return Drive((tick[part] + 1) * period_s, counts[part], began_ns)


def _counts(lane: np.ndarray) -> np.ndarray:
    """(n, lanes, 2), nan where a reading is not good; float32 holds 16 bits."""
    counts = np.stack([lane["alpha"], lane["beta"]], axis=-1).astype(np.float32)
    counts[lane["status"] != 0] = np.nan
    return counts


def way(source: Path, scene: Scene, warn: Warn) -> Way:
    """Where a robot was: of a CSV file the poses in it; of a bag or a scene folder with observations the default filter's, by
    odometry and object whiskers, from the prior of `scene`."""
    if source.suffix == ".csv":
        return _of_poses(source, scene)
    blind = replace(scene, robot=replace(scene.robot, whiskers=tuple(scene.robot.of_role("object")), sensors=()))
    if source.is_dir() and observations_path(source).exists():
        rows = read_observations(observations_path(source), blind)
    elif is_bag(source):
        _, rows = read_bag(source, warn, blind, None)
    else:
        text = (
            "no poses; give a CSV file with t_s, x_m, y_m, theta_rad, a robot's bag, or a folder with observations.csv"
        )
        raise DriveError(f"{source}: {text}")
    if scene.prior is None:
        raise DriveError(f"{source}: no prior.toml in the scene; give the pose at the start there, or poses")
    table = localise.run(localise.default_filter(), blind, rows).table
    covariance = table["covariance"]
    sd_m = np.sqrt(np.linalg.eigvalsh(covariance[:, :2, :2])[:, -1].clip(0.0))
    return Way(rows.t_s, from_map(table["pose"], scene.origin), sd_m, np.sqrt(covariance[:, 2, 2].clip(0.0)))


def _of_poses(source: Path, scene: Scene) -> Way:
    columns = read_columns(source, ["t_s", *PLACE])
    t_s, pose = numbers(columns["t_s"]), np.column_stack([numbers(columns[name]) for name in PLACE])
    good = np.isfinite(t_s) & np.isfinite(pose).all(axis=1)
    t_s, pose = t_s[good], pose[good]
    if len(t_s) < 2 or (np.diff(t_s) <= 0.0).any():
        raise TableError(source, None, "fewer than two poses, or times that do not increase; give each pose its time")
    return Way(t_s, from_map(pose, scene.origin), np.zeros(len(t_s)), np.zeros(len(t_s)))
