"""Scenes from a robot's bag (crunchbot.robot.bag): the rows that came, and the truth where a simulation reported it."""

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from crunchbot.nav.observations import Observations, observations_path, read_observations
from crunchbot.observation import TIME, TRUTH, Quantity, Row, cell
from crunchbot.recording.mcapfile import RecordingError
from crunchbot.recording.rosbag import open_bag
from crunchbot.robot.network.inbox import Received
from crunchbot.robot.network.messages import Observation, PoseStamped
from crunchbot.robot.network.rows import Follower, time_text
from crunchbot.robot.network.streams import Envelope
from crunchbot.robot.played import BagError
from crunchbot.robot.played import read_bag as played_bag
from crunchbot.robot.topic_rows import read_by_table
from crunchbot.scene import ARENA, Scene, load


def is_bag(path: Path) -> bool:
    """Whether there is anything of a bag in a file or folder."""
    try:
        with open_bag(path):
            return True
    except RecordingError:
        return False


def read_bag(
    path: Path, warn: Callable[[str], None], given: str | None, topics: Path | None
) -> tuple[Scene, Observations]:
    """(scene, rows) of a bag, each damage asked to `warn`; the scene is the folder `given`, or the bag's. `topics`: a
    table of them, if they are ordinary ones. BagError when it holds none."""
    scene = load(given) if given else None
    played = read_by_table(path, topics, scene) if topics else played_bag(path, ("observation", "truth"))
    for line in played.damage:
        warn(line)
    rows, truth = ([said.message for said in played.said if said.topic == name] for name in ("observation", "truth"))
    scene = scene or played.scene
    if scene is None or not rows:
        what = "observations; give another bag" if scene else f"{ARENA}; give the robot's scene with --scene"
        raise BagError(f"{path}: holds no {what}")
    robot = replace(scene.robot, sensors=tuple(s for s in scene.robot.sensors if s.name in rows[0].names))
    scene = replace(scene, robot=robot)
    needed = [*scene.layout.of(Quantity.TEXTURE), *scene.layout.of(Quantity.DISTANCE)]
    if lacking := [name for name in needed if name not in rows[0].names]:
        raise BagError(f"{path}: no column '{lacking[0]}' in its rows; give the scene of this very robot with --scene")
    table = _table(scene, rows, truth)
    if missing := len(table) - len(rows):
        warn(f"{path}: {missing} rows are missing; they are there without readings, their motion spread evenly")
    return _with_rows(scene, table)


def _table(scene: Scene, rows: list[Observation], truth: list[PoseStamped]) -> list[dict[str, str]]:
    """observations.csv as a list of rows. Rows that are missing in the bag are included, without readings, with their
    motion spread evenly in time, as in the navigator (Step.lead)."""
    poses = {pose.header.stamp.ns: pose.pose.xytheta for pose in truth}
    distances = set(scene.layout.of(Quantity.DISTANCE))
    follower, out, stream = Follower(), [], 0
    for n, row in enumerate(rows):
        stream += n > 0 and row.seq <= rows[n - 1].seq
        unread = {name: "nan" if name in distances else "" for name in row.names}
        (step,) = follower.take([Received("observation", row, Envelope(stream, n, 0))])
        out += [_cells(missing, poses, None) | unread for missing in step.lead()]
        out.append(_cells(step.last(), poses, row.header.stamp.ns))
    return out


def _cells(row: Row, poses: dict[int, tuple], stamp_ns: int | None) -> dict[str, str]:
    """A row as text, with the true pose at this time; nan if that is unknown. No columns where no pose is known."""
    cells = {name: cell(value) for name, value in row.items()} | {TIME: time_text(row)}
    if poses:
        pose = poses.get(stamp_ns, (np.nan,) * 3)
        cells |= {name: repr(float(value)) for name, value in zip(TRUTH, pose, strict=True)}
    return cells


def _with_rows(scene: Scene, rows: list[dict[str, str]]) -> tuple[Scene, Observations]:
    """Read as a scene folder's are read, with all checks."""
    with tempfile.TemporaryDirectory(prefix="whisker-") as place:
        lines = [",".join(rows[0]), *(",".join(row.values()) for row in rows)]
        observations_path(place).write_text("\n".join(lines) + "\n")
        return scene, read_observations(observations_path(place), scene)
