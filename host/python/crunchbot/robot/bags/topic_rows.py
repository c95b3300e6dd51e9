"""Rows from a bag of ordinary topics, by a user's table of each column's topic (docs/formats.md).

The bag's times count, not those in the messages, which may be of several clocks, or none. A row holds what came in its
0.1 s; its motion is the odometry's between its ends.
"""

import math
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...files import UnreadableError, read_toml
from ...nav.faults import LEFT_MOST
from ...observation import EXPLORING, Quantity, Row
from ...pilot.pilot import compose
from ...recording.rosbag import RosBag
from ...scene import Scene
from ...scene_table import Table
from ..network.ros import heading_of
from ..network.rows import LEAP_NS, ROW_NS, between, to_message
from .played import BagError, Played, Said

MOTION = "motion"  # the column of an odometry
NUMBERS, NUMBER_MOST = ("scale", "offset", "contact"), 1e9
GAP_NS = 10**9  # odometry that comes less often than once a second has lost messages
# Fields that say whether there is a contact: of Bool, ros_gz_interfaces/Contacts and gazebo_msgs/ContactsState.
CONTACTS = ("data", "contacts", "states")


@dataclass(frozen=True)
class Source:
    """Of a column. reach_mm: of its whisker, None for a reading; numbers: those of NUMBERS that the table gives."""

    topic: str
    joint: str
    reach_mm: float | None
    numbers: dict[str, float]

    def cell(self, message: Any) -> float | None:
        """As Row has it; ValueError for a message that holds no such thing."""
        empty = 0.0 if self.reach_mm is None else None
        if hasattr(message, "range"):
            if not message.range >= message.min_range:  # REP 117: nan, or nearer than it can measure
                return math.nan
            if message.range >= message.max_range:
                return None
            value = message.range * (1.0 if self.reach_mm is None else 1000.0)
        elif hasattr(message, "position"):
            value = float(dict(zip(message.name, message.position, strict=False)).get(self.joint, math.nan))
        else:
            felt = next((getattr(message, name) for name in CONTACTS if hasattr(message, name)), None)
            if not isinstance(felt, bool | list) or "contact" not in self.numbers:
                what = (
                    "no JointState or Range, and no contact for which the table says what it counts as (contact = 1.0)"
                )
                raise ValueError(f"{message.__msgtype__} is {what}")
            return self.numbers["contact"] if felt else empty
        value = self.numbers.get("scale", 1.0) * value + self.numbers.get("offset", 0.0)
        return empty if self.reach_mm is not None and value > self.reach_mm else value


def read_by_table(path: Path, table: Path, scene: Scene | None) -> Played:
    """Rows as a robot of this scene would have published them; gaps are in `damage`."""
    if scene is None:
        raise BagError(f"{path}: a table of topics fills the columns of a scene; give the scene with --scene")
    sources = _sources(table, scene)
    cells: dict[str, list] = {column: [] for column in sources}
    joints: dict[str, set[str]] = {}  # by topic: each of its messages may be of other joints
    with RosBag(path) as bag:
        if missing := {source.topic for source in sources.values()} - bag.topics.keys():
            raise BagError(f"{path}: no topic {min(missing)}; it has {', '.join(sorted(bag.topics))}")
        count, damaged = Counter[str](), Counter[str]()
        for message in bag.messages():
            columns = [column for column, source in sources.items() if source.topic == message.topic]
            if not columns:
                continue
            count[message.topic] += 1
            try:
                decoded = bag.decoded(message)
            except ValueError:
                damaged[message.topic] += 1
                continue
            if hasattr(decoded, "position"):
                joints.setdefault(message.topic, set()).update(decoded.name)
            for column in columns:
                read = _place if column == MOTION else sources[column].cell
                try:
                    cells[column].append((message.log_time, read(decoded)))
                except ValueError as error:
                    raise BagError(f"{path}: {message.topic}: {error}") from None
        for topic, left in damaged.items():
            if left == count[topic]:
                raise BagError(f"{path}: {topic}: no message of {left} can be read; give another bag, or another topic")
            if left > LEFT_MOST * count[topic]:
                bag.note(f"{topic}: {left} of {count[topic]} messages are damaged and left out; look what wrote them")
        for source in sources.values():
            if source.joint not in (known := joints.get(source.topic, {source.joint})):
                raise BagError(f"{path}: {source.topic}: no joint '{source.joint}'; it has {', '.join(sorted(known))}")
        return Played("robot", scene, _said(bag, cells, scene), bag.damage)


def _sources(path: Path, scene: Scene) -> dict[str, Source]:
    """By column."""
    distances = scene.layout.of(Quantity.DISTANCE)
    reach = dict(zip(distances, (1000.0 * whisker.length_m for whisker in scene.robot.of_role("object")), strict=True))
    wanted, out = [MOTION, *distances, *scene.layout.of(Quantity.READING)], {}
    try:
        table = Table(path, *read_toml(path))
    except UnreadableError as error:
        raise BagError(f"{path}: {error}; give a table of topics (docs/formats.md)") from error
    for column, given in ({MOTION: table.take(MOTION)} | table.content).items():
        if column not in wanted:
            raise table.fail(column, f"is no column; give {', '.join(wanted)}")
        entry = Table(path, table.source, given if isinstance(given, dict) else {"topic": given})
        numbers = {key: entry.number(key, -NUMBER_MOST, NUMBER_MOST) for key in NUMBERS if key in entry.content}
        joint = entry.text("joint") if "joint" in entry.content else ""
        out[column] = Source(entry.text("topic"), joint, reach.get(column), numbers)
        entry.done()
    return out


def _place(odometry: Any) -> tuple[float, float, float]:
    if not hasattr(odometry, "twist") or not hasattr(odometry, "pose"):
        raise ValueError(f"{odometry.__msgtype__} is no Odometry; name the odometry's topic")
    pose = odometry.pose.pose
    turn = heading_of(pose.orientation)
    return pose.position.x, pose.position.y, math.nan if turn is None else turn


def _said(bag: RosBag, cells: dict[str, list], scene: Scene) -> list[Said]:
    poses = np.array([(at_ns, *place) for at_ns, place in cells[MOTION]]).reshape(-1, 4)
    known = np.isfinite(poses).all(axis=1)
    if not known.all():
        bag.note(f"{MOTION}: {np.count_nonzero(~known)} poses without a heading are left out")
    start, poses = poses[:1, 0].sum(), poses[known]
    times, poses[:, 3] = poses[:, 0] - start, np.unwrap(poses[:, 3])
    if np.diff(times).max(initial=0.0) > LEAP_NS:
        raise BagError(
            f"{bag.path}: its clock leaps by more than a day; give the part of the bag before or behind that"
        )
    ends = np.arange(0.0, times.max(initial=0.0) + 1.0, ROW_NS)
    if len(ends) < 2:
        raise BagError(f"{bag.path}: less than a row of odometry; give a bag of a longer drive")
    for n in np.flatnonzero(np.diff(times) > GAP_NS):
        bag.note(f"{MOTION}: none came from {1e-9 * times[n]:.1f} s to {1e-9 * times[n + 1]:.1f} s; taken as even")
    way = np.column_stack([np.interp(ends, times, column) for column in poses.T[1:]])
    distances, readings = scene.layout.of(Quantity.DISTANCE), scene.layout.of(Quantity.READING)
    names = (*scene.layout.of(Quantity.TEXTURE), *distances, *readings)
    read = {}  # by column: by a row's number, from 1 on, its newest value, or else what says that there is none
    for name in names:
        newest_last = sorted(cells.get(name, []), key=lambda cell: cell[1] is not None and not math.isnan(cell[1]))
        read[name] = {math.ceil((at_ns - start) / ROW_NS): value for at_ns, value in newest_last}
    for name in cells.keys() & read.keys():
        if lacking := len(set(range(1, len(ends))) - read[name].keys()):
            bag.note(f"{name}: not read in {lacking} of {len(ends) - 1} rows, in which no message came")
    said, summed = [], np.zeros(3)
    for n in range(1, len(ends)):
        values = [read[name].get(n, math.nan if name in distances else None) for name in names]
        row = Row.made(EXPLORING, 1e-9 * ends[n], between(way[n - 1], way[n]), names, values)
        said.append(Said(1e-9 * float(ends[n - 1]), "observation", to_message(row, n - 1, summed)))
        summed = compose(summed, row.motion)
    return said
