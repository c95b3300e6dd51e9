"""The robot's messages (whisker/msgs) as Python objects, one class a schema; encode and decode are CDR, as ROS 2 has it.

Units, meanings and constants are those of the .msg files; what ROS 2 itself defines is in ros. Times are ns of the bridge's
clock, 0 at its start.
"""

from dataclasses import dataclass, field

import numpy as np

from ..errors import UserError
from ..recording.cdr import Malformed
from .ros import (
    Header,
    JointState,
    KeyValue,
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
from .schema import Codec
from .schema import encode as encode_as

EXPLORING, WHISK, RELEASE = range(3)  # Observation.kind
EMPTY, NOT_READ, VALUE = range(3)  # Observation.cells
UNKNOWN, TIP, SHAFT = range(3)  # Contact.part
FACE, CORNER = 1, 2  # Contact.shape; or UNKNOWN
BUMPS_MOST = 2000  # of a Belief


class MessageError(UserError, ValueError):
    """A message that is refused; one line: topic, field, what, remedy."""


@dataclass(eq=False)
class Observation:
    """A row; whisker.robot.rows makes one of the cells of observations.csv and back."""

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
    bumps: int
    mass: float
    x: np.ndarray
    y: np.ndarray
    theta: np.ndarray
    weight: np.ndarray
    sigma_m: np.ndarray
    sigma_rad: np.ndarray


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
    "nav_msgs": (Odometry,),
    "sensor_msgs": (JointState,),
    "whisker_msgs": (Observation, Contact, Behaviour, Localisation, Belief, ProcessHealth, End),
}
TYPES = {f"{package}/msg/{kind.__name__}": kind for package, kinds in PACKAGES.items() for kind in kinds}
SCHEMAS = {kind: schema for schema, kind in TYPES.items()}
# A joint whose sample is bad has no angle; a cell of a row is judged by the filter, which counts those it refuses.
MAY_BE_NAN = frozenset({"sensor_msgs/msg/JointState:position", "whisker_msgs/msg/Observation:values"})
CODEC = Codec(TYPES, MAY_BE_NAN)

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
    "truth": PoseStamped,
}
HEALTH = "health"


def type_of(topic: str) -> type:
    """The class of a topic's messages; KeyError when there is no such topic."""
    return ProcessHealth if topic.startswith(f"{HEALTH}/") else TOPICS[topic]


def encode(message) -> bytes:
    """CDR of a message; ValueError when a fixed array has another length than its schema says."""
    return encode_as(SCHEMAS[type(message)], message)


def decode(kind: type, data: bytes, topic: str = ""):
    """A message of class `kind`; MessageError names `topic`, field and remedy."""
    try:
        message = CODEC.decode(data, SCHEMAS[kind])
        if isinstance(message, Observation):
            _check_observation(message)
        elif isinstance(message, Belief):
            _check_belief(message)
    except Malformed as error:
        name = topic or SCHEMAS[kind]
        raise MessageError(f"{name}: {error}; install one release of whisker on both sides") from None
    return message


def _check_observation(row: Observation) -> None:
    if not len(row.names) == len(row.cells) == len(row.values):
        raise Malformed(f"field cells: {len(row.names)} names, {len(row.cells)} cells, {len(row.values)} values")
    if row.kind > RELEASE or (row.cells > VALUE).any():
        raise Malformed("field kind or cells: a value that Observation.msg does not name")


def _check_belief(belief: Belief) -> None:
    columns = ("x", "y", "theta", "weight", "sigma_m", "sigma_rad")
    for name in columns:
        if len(getattr(belief, name)) != len(belief.x) or len(belief.x) > BUMPS_MOST:
            raise Malformed(f"field {name}: {len(getattr(belief, name))} elements")
