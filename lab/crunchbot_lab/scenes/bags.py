"""Scenes from a robot's bag (crunchbot.robot.bag): the rows that came, and the truth where a simulation reported it."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from crunchbot.errors import UserError
from crunchbot.nav.observations import Observations, observations_path, read_observations
from crunchbot.observation import TIME, TRUTH, Quantity, Row, cell
from crunchbot.recording.mcapfile import McapFile, RecordingError
from crunchbot.robot.network.inbox import Received
from crunchbot.robot.network.messages import MessageError, Observation, PoseStamped, decode
from crunchbot.robot.network.rows import Follower, time_text
from crunchbot.robot.network.streams import Envelope
from crunchbot.robot.played import RECORD, SCENE_FILES
from crunchbot.scene import Scene, load


class BagError(UserError):
    """A bag that no scene can be made from; one line."""


def is_bag(path: Path) -> bool:
    """Whether there is anything of a bag in a file."""
    try:
        with McapFile(path):
            return True
    except RecordingError:
        return False


def read_bag(path: Path, warn: Callable[[str], None]) -> tuple[Scene, Observations]:
    """(scene, rows) of a bag, each damage asked to `warn`; BagError when it holds none."""
    with McapFile(path) as bag:
        reported = bag.metadata.get(RECORD, {})
        robot = reported.get("robot", "")
        wanted = {f"/{robot}/observation": Observation, f"/{robot}/truth": PoseStamped}
        found = {topic: [] for topic in wanted}
        for message in bag.messages():
            if message.topic in wanted:
                found[message.topic] += _decoded(bag, wanted[message.topic], message)
        for line in bag.damage:
            warn(line)
    rows, truth = found.values()
    missing = [name for name in SCENE_FILES[:2] if name not in reported]
    if missing or not rows:
        what = f"holds no {missing[0]}" if missing else "holds no observations"
        raise BagError(f"{path}: {what}; give a bag of a robot that 'whisker bag --scene SCENE' made")
    return _as_folder({name: reported[name] for name in SCENE_FILES if name in reported}, rows, truth)


def _decoded(bag: McapFile, kind: type, message) -> list:
    try:
        return [decode(kind, bytes(message.data), message.topic)]
    except MessageError as error:
        bag.note(f"{error}; left out")
        return []


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


def _as_folder(files: dict[str, str], observations: list[Observation], truth: list[PoseStamped]):
    """Read as a scene folder is read, with all its checks."""
    with tempfile.TemporaryDirectory(prefix="whisker-") as place:
        for name, text in files.items():
            (Path(place) / name).write_text(text)
        scene = load(place)
        rows = _table(scene, observations, truth)
        lines = [",".join(rows[0]), *(",".join(row.values()) for row in rows)]
        observations_path(place).write_text("\n".join(lines) + "\n")
        return scene, read_observations(observations_path(place), scene)
