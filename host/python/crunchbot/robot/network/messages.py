"""The robot's messages (crunchbot/msgs) as Python objects, one class a schema, its fields in the schema's order; encode and
decode are CDR, as ROS 2 has it.

Units, meanings and constants are those of the .msg files; what ROS 2 itself defines is in ros. Times are ns of the bridge's
clock, 0 at its start.
"""

import math
import re
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from rosbags.typesys.store import Typestore

from ...errors import UserError
from ...recording.cdr import Malformed
from ...recording.types import make_store, prepare
from .judge import OutOfRange
from .judge import decode as judged
from .ranges import ROW
from .ros import (
    Header,
    JointState,
    KeyValue,
    MapMetaData,
    OccupancyGrid,
    Odometry,
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    Time,
    Twist,
    TwistWithCovariance,
    Vector3,
)

UNKNOWN, TIP, SHAFT = range(3)  # Contact.part
FACE, CORNER = 1, 2  # Contact.shape; or UNKNOWN


class MessageError(UserError, ValueError):
    """A message that is refused; one line: topic, field, what, remedy."""


@dataclass(eq=False)
class Observation:
    """A row (crunchbot.observation.Row), with its number and the sum of the motion: crunchbot.robot.network.rows."""

    header: Header
    seq: int
    kind: int
    motion: np.ndarray
    pose: np.ndarray
    names: list[str]
    cells: np.ndarray
    values: np.ndarray


@dataclass(eq=False)
class Contact:
    header: Header
    whisker: str
    touching: bool
    onset: Time
    release: Time = field(default_factory=Time)
    measured: bool = False
    radius_m: float = 0.0
    sigma_m: float = 0.0
    part: int = UNKNOWN
    shape: int = UNKNOWN


@dataclass(eq=False)
class Behaviour:
    header: Header
    state: str
    since: Time
    reason: str = ""


@dataclass(eq=False)
class Localisation:
    header: Header
    filter: str
    pose: PoseWithCovariance
    confidence: float
    observation_seq: int
    rows_integrated: int = 1
    rows_skipped: int = 0
    rows_missed: int = 0
    first_seq: int = 0
    prior: str = ""


@dataclass(eq=False)
class Belief:
    header: Header
    filter: str
    observation_seq: int
    components: int
    mass: float
    x: np.ndarray
    y: np.ndarray
    theta: np.ndarray
    weight: np.ndarray
    sigma_m: np.ndarray
    sigma_rad: np.ndarray


@dataclass(eq=False)
class TouchMap:
    header: Header
    observation_seq: int
    part: int
    textures: list[str]
    lattice: np.ndarray
    tile_column: np.ndarray
    tile_row: np.ndarray
    tile_texture: np.ndarray
    tile_probability: np.ndarray
    face_x0: np.ndarray
    face_y0: np.ndarray
    face_x1: np.ndarray
    face_y1: np.ndarray
    face_normal: np.ndarray
    face_normal_sd: np.ndarray
    face_offset_sd: np.ndarray
    corner_x: np.ndarray
    corner_y: np.ndarray
    corner_sd: np.ndarray


@dataclass(eq=False)
class ProcessHealth:
    header: Header
    process: str
    pid: int
    state: str
    counters: list[KeyValue] = field(default_factory=list)
    last_error: str = ""

    @property
    def counts(self) -> dict[str, str]:
        return {pair.key: pair.value for pair in self.counters}


@dataclass(eq=False)
class End:
    header: Header
    messages: int
    reason: str = ""


PACKAGES = {
    "builtin_interfaces": (Time,),
    "std_msgs": (Header,),
    "diagnostic_msgs": (KeyValue,),
    "geometry_msgs": (
        Vector3,
        Point,
        Quaternion,
        Pose,
        PoseStamped,
        PoseWithCovariance,
        PoseWithCovarianceStamped,
        Twist,
        TwistWithCovariance,
    ),
    "nav_msgs": (Odometry, MapMetaData, OccupancyGrid),
    "sensor_msgs": (JointState,),
    "whisker_msgs": (Observation, Contact, Behaviour, Localisation, Belief, TouchMap, ProcessHealth, End),
}
TYPES = {f"{package}/msg/{kind.__name__}": kind for package, kinds in PACKAGES.items() for kind in kinds}
SCHEMAS = {kind: schema for schema, kind in TYPES.items()}
ROUNDING = 1e-6  # relative, of sums
REMEDIES = ("install one release of crunchbot on both sides", "stop what sends it")  # not readable; not possible

# topic: the class of its messages. Health has a topic for each process, below "health/".
TOPICS = {
    "observation": Observation,
    "odometry": Odometry,
    "joints": JointState,
    "contact": Contact,
    "behaviour": Behaviour,
    "pose": PoseWithCovarianceStamped,
    "localisation": Localisation,
    "belief": Belief,
    "map": OccupancyGrid,
    "touch_map": TouchMap,
    "truth": PoseStamped,
    "initial_pose": PoseWithCovarianceStamped,
    "order": Behaviour,
}
HEALTH = "health"
NAME = re.compile(r"[A-Za-z0-9_-]{1,64}")  # of a process or a robot


@cache
def store() -> Typestore:
    """The types of crunchbot/msgs, whose messages are objects of the classes here."""
    made = make_store()
    made.types.update(TYPES)
    return made


def type_of(topic: str) -> type:
    """The class of a topic's messages; KeyError when there is no such topic."""
    kind, _, process = topic.partition("/")
    return ProcessHealth if kind == HEALTH and NAME.fullmatch(process) else TOPICS[topic]


def encode(message: Any) -> bytes:
    """CDR of a message; ValueError when a fixed array has another length than its schema says."""
    schema = SCHEMAS[type(message)]
    return bytes(store().serialize_cdr(prepare(store(), schema, message), schema, little_endian=True))


def decode(kind: type, data: bytes, topic: str = "") -> Any:
    """A message of class `kind`; MessageError names `topic`, field and remedy."""
    try:
        message = judged(store(), data, SCHEMAS[kind])
        CHECKS.get(kind, _check_nothing)(message)
    except Malformed as error:
        remedy = REMEDIES[isinstance(error, OutOfRange)]
        raise MessageError(f"{topic or SCHEMAS[kind]}: {error}; {remedy}") from None
    return message


def _check_nothing(message) -> None:
    """What the table of ranges says is all there is to say."""


def _check_observation(row: Observation) -> None:
    """A row's fields fit each other: it cannot have moved more than its rows could."""
    if not len(row.names) == len(row.cells) == len(row.values):
        raise Malformed(f"field cells: {len(row.names)} names, {len(row.cells)} cells, {len(row.values)} values")
    if len(set(row.names)) != len(row.names):
        raise OutOfRange("field names: a name that is there twice")
    if row.seq == 0 and np.abs(row.pose - row.motion).max() > ROUNDING:
        raise OutOfRange("field pose: of the first row it is its motion")
    rows = (row.seq + 1) * (1.0 + ROUNDING)
    if np.hypot(*row.pose[:2]) > rows * math.hypot(*ROW[:2]) or abs(row.pose[2]) > rows * ROW[2]:
        raise OutOfRange(f"field pose: more than {row.seq + 1} rows can add up to")


def _check_joints(joints: JointState) -> None:
    for name in ("position", "velocity", "effort"):
        if len(getattr(joints, name)) > len(joints.name):
            raise Malformed(f"field {name}: {len(getattr(joints, name))} elements, {len(joints.name)} names")


def _check_belief(belief: Belief) -> None:
    for name in ("y", "theta", "weight", "sigma_m", "sigma_rad"):
        if len(getattr(belief, name)) != len(belief.x):
            raise Malformed(f"field {name}: {len(getattr(belief, name))} elements")


def _check_grid(grid: OccupancyGrid) -> None:
    if len(grid.data) != grid.info.width * grid.info.height:
        raise Malformed(f"field data: {len(grid.data)} cells, {grid.info.width} by {grid.info.height} belong")


GROUPS = ("tile_column", "face_x0", "corner_x")  # the first of each group of sequences of a TouchMap


def _check_touch_map(touched: TouchMap) -> None:
    for first in GROUPS:
        group, length = first.partition("_")[0], len(getattr(touched, first))
        for name in (name for name in vars(touched) if name.startswith(f"{group}_")):
            if len(getattr(touched, name)) != length:
                raise Malformed(f"field {name}: {len(getattr(touched, name))} elements, {length} belong")
    if len(touched.tile_texture) and touched.tile_texture.max() >= len(touched.textures):
        raise OutOfRange("field tile_texture: no texture of this number")


def _check_covariance(name: str, values: np.ndarray) -> None:
    """No variance is negative, and none is smaller than what it shares with another."""
    matrix = np.reshape(values, (6, 6))
    variances = np.diagonal(matrix)
    shared = np.sqrt(np.outer(np.maximum(variances, 0.0), np.maximum(variances, 0.0)))
    if (variances < 0.0).any() or (np.abs(matrix) > shared * (1.0 + ROUNDING) + ROUNDING).any():
        raise OutOfRange(f"field {name}.covariance: no covariance")


def _check_odometry(odometry: Odometry) -> None:
    _check_covariance("pose", odometry.pose.covariance)
    _check_covariance("twist", odometry.twist.covariance)


def _check_pose(message: Localisation | PoseWithCovarianceStamped) -> None:
    _check_covariance("pose", message.pose.covariance)


# What a message must be besides the ranges of its fields, by its class.
CHECKS = {
    Observation: _check_observation,
    Belief: _check_belief,
    OccupancyGrid: _check_grid,
    TouchMap: _check_touch_map,
    JointState: _check_joints,
    Odometry: _check_odometry,
    Localisation: _check_pose,
    PoseWithCovarianceStamped: _check_pose,
}
