"""The robot's messages (whisker/msgs) as Python objects, one class a schema; encode and decode are CDR, as ROS 2 has it.

Units, meanings and constants are those of the .msg files. Times are ns of the bridge's clock, 0 at its start.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from ..errors import UserError
from ..recording.cdr import Malformed
from .schema import Codec
from .schema import encode as encode_as

BASE_FRAME, ODOMETRY_FRAME, ARENA_FRAME = "base_link", "odom", "arena"
EXPLORING, WHISK, RELEASE = range(3)  # Observation.kind
EMPTY, NOT_READ, VALUE = range(3)  # Observation.cells
UNKNOWN, TIP, SHAFT = range(3)  # Contact.part
FACE, CORNER = 1, 2  # Contact.shape; or UNKNOWN
BUMPS_MOST = 2000  # of a Belief


class MessageError(UserError, ValueError):
    """A message that is refused; one line: topic, field, what, remedy."""


@dataclass(eq=False)
class Time:
    sec: int = 0
    nanosec: int = 0

    @classmethod
    def of(cls, ns: int) -> "Time":
        return cls(*divmod(ns, 10**9))

    @property
    def ns(self) -> int:
        return self.sec * 10**9 + self.nanosec


@dataclass(eq=False)
class Header:
    stamp: Time = field(default_factory=Time)
    frame_id: str = ""

    @classmethod
    def at(cls, ns: int, frame_id: str = "") -> "Header":
        return cls(Time.of(ns), frame_id)


@dataclass(eq=False)
class Vector3:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(eq=False)
class Point(Vector3):
    pass


@dataclass(eq=False)
class Quaternion:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


@dataclass(eq=False)
class Pose:
    position: Point = field(default_factory=Point)
    orientation: Quaternion = field(default_factory=Quaternion)

    @classmethod
    def planar(cls, x: float, y: float, theta: float) -> "Pose":
        """m and rad."""
        return cls(Point(x, y, 0.0), Quaternion(0.0, 0.0, math.sin(theta / 2.0), math.cos(theta / 2.0)))

    @property
    def xytheta(self) -> tuple[float, float, float]:
        """m and rad, -pi to pi."""
        q = self.orientation
        return self.position.x, self.position.y, math.remainder(2.0 * math.atan2(q.z, q.w), math.tau)


PLANAR = np.ix_([0, 1, 5], [0, 1, 5])  # x, y and rotation about z among the six of a ROS covariance


@dataclass(eq=False)
class PoseWithCovariance:
    pose: Pose = field(default_factory=Pose)
    covariance: np.ndarray = field(default_factory=lambda: np.zeros(36))

    @classmethod
    def planar(cls, pose, covariance) -> "PoseWithCovariance":
        """(x, y, theta) in m and rad, and their covariance (3, 3)."""
        return cls(Pose.planar(*pose), spread(covariance))

    @property
    def planar_covariance(self) -> np.ndarray:
        return np.asarray(self.covariance).reshape(6, 6)[PLANAR]


def spread(covariance) -> np.ndarray:
    """A covariance (3, 3) of x, y, theta as the 36 numbers of a ROS message."""
    full = np.zeros((6, 6))
    full[PLANAR] = covariance
    return full.ravel()


@dataclass(eq=False)
class PoseStamped:
    header: Header
    pose: Pose


@dataclass(eq=False)
class PoseWithCovarianceStamped:
    header: Header
    pose: PoseWithCovariance


@dataclass(eq=False)
class Twist:
    linear: Vector3 = field(default_factory=Vector3)
    angular: Vector3 = field(default_factory=Vector3)


@dataclass(eq=False)
class TwistWithCovariance:
    twist: Twist = field(default_factory=Twist)
    covariance: np.ndarray = field(default_factory=lambda: np.zeros(36))

    @classmethod
    def planar(cls, speeds, covariance) -> "TwistWithCovariance":
        """(x, y, theta) per second, in m and rad, and their covariance (3, 3)."""
        x, y, turn = map(float, speeds)
        return cls(Twist(Vector3(x, y, 0.0), Vector3(0.0, 0.0, turn)), spread(covariance))


@dataclass(eq=False)
class Odometry:
    """pose: motion since the start, in the frame "odom"; twist: of the 0.1 s that end now, in the robot's frame then.

    The twist has the base's covariance. The pose has none (zeros): errors of scale are the same in every step, so that
    covariances of steps cannot be added up.
    """

    header: Header
    pose: PoseWithCovariance
    twist: TwistWithCovariance = field(default_factory=TwistWithCovariance)
    child_frame_id: str = BASE_FRAME


@dataclass(eq=False)
class JointState:
    """position: rad, two joints a whisker, `<whisker>/alpha` and `<whisker>/beta`; nan where a sample is bad."""

    header: Header
    name: list[str]
    position: np.ndarray
    velocity: np.ndarray = ()
    effort: np.ndarray = ()


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
class KeyValue:
    key: str
    value: str


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
