"""A scene and its rows from a robot's bag (bag.py), with the truth where a simulation reported it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...nav.observations import Observations, joined, observed
from ...observation import Quantity, parse
from ...recording.mcapfile import RecordingError
from ...recording.rosbag import open_bag
from ...scene import ARENA, Scene, load
from ..network.inbox import Received
from ..network.messages import Observation, PoseStamped
from ..network.rows import Follower
from ..network.streams import Envelope
from .played import BagError
from .played import read_bag as played_bag
from .topic_rows import read_by_table


def is_bag(path: Path) -> bool:
    """Whether there is anything of a bag in a file or folder."""
    try:
        with open_bag(path):
            return True
    except RecordingError:
        return False


def read_bag(
    path: Path, warn: Callable[[str], None], given: str | Scene | None, topics: Path | None
) -> tuple[Scene, Observations]:
    """(scene, rows) of a bag, each damage asked to `warn`; the scene is `given`, or its folder, or the bag's. `topics`: a
    table of them, if they are ordinary ones. BagError when it holds none."""
    scene = given if given is None or isinstance(given, Scene) else load(given)
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
    taken = _observations(scene, rows, truth)
    if missing := len(taken) - len(rows):
        warn(f"{path}: {missing} rows are missing; they are there without readings, their motion spread evenly")
    return scene, taken


def _observations(scene: Scene, rows: list[Observation], truth: list[PoseStamped]) -> Observations:
    """Rows that are missing in the bag are included, without readings, with their motion spread evenly in time, as in the
    navigator (Step.lead)."""
    poses = {pose.header.stamp.ns: pose.pose.xytheta for pose in truth}
    follower, parts, true, stream = Follower(), [], [], 0
    for n, row in enumerate(rows):
        stream += n > 0 and row.seq <= rows[n - 1].seq
        (step,) = follower.take([Received("observation", row, Envelope(stream, n, 0))])
        taken = [*step.lead(), step.last()]
        parts += [observed(one, scene) for one in taken]
        true += [(np.nan,) * 3] * (len(taken) - 1) + [poses.get(row.header.stamp.ns, (np.nan,) * 3)]
    touched = {parse(name).quantity for name in rows[0].names}
    lacking = [name for name in ("normal", "point") if Quantity[name.upper()] not in touched]
    return replace(joined(parts), truth=np.array(true) if truth else None, **dict.fromkeys(lacking))
