"""Messages that ROS 2 itself defines, as Python objects: fields, their order and their units are those of its .msg files
(crunchbot/msgs)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

BASE_FRAME, ODOMETRY_FRAME, MAP_FRAME = "base_link", "odom", "map"


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
class KeyValue:
    key: str
    value: str


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


def heading_of(turn: Quaternion) -> float | None:
    """rad, -pi to pi; None: it is no rotation (all zeros, say), or lays the robot on its side."""
    if not turn.z**2 + turn.w**2 > turn.x**2 + turn.y**2:
        return None
    return math.remainder(2.0 * math.atan2(turn.z, turn.w), math.tau)


PLANAR = np.ix_([0, 1, 5], [0, 1, 5])  # x, y and rotation about z among the six of a ROS covariance


@dataclass(eq=False)
class PoseWithCovariance:
    pose: Pose = field(default_factory=Pose)
    covariance: np.ndarray = field(default_factory=lambda: np.zeros(36))

    @classmethod
    def planar(cls, pose: Sequence[float], covariance: ArrayLike) -> "PoseWithCovariance":
        """(x, y, theta) in m and rad, and their covariance (3, 3)."""
        return cls(Pose.planar(*pose), spread(covariance))

    @property
    def planar_covariance(self) -> np.ndarray:
        return np.asarray(self.covariance).reshape(6, 6)[PLANAR]


def spread(covariance: ArrayLike) -> np.ndarray:
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
    def planar(cls, speeds: Sequence[float], covariance: ArrayLike) -> "TwistWithCovariance":
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
    child_frame_id: str = BASE_FRAME
    pose: PoseWithCovariance = field(default_factory=PoseWithCovariance)
    twist: TwistWithCovariance = field(default_factory=TwistWithCovariance)


@dataclass(eq=False)
class JointState:
    """position: rad, two joints a whisker, `<whisker>/alpha` and `<whisker>/beta`; nan where a sample is bad."""

    header: Header
    name: list[str]
    position: np.ndarray
    velocity: np.ndarray = ()
    effort: np.ndarray = ()


@dataclass(eq=False)
class MapMetaData:
    """origin: pose of the corner of cell 0; resolution: m a cell."""

    map_load_time: Time = field(default_factory=Time)
    resolution: float = 0.0
    width: int = 0
    height: int = 0
    origin: Pose = field(default_factory=Pose)


@dataclass(eq=False)
class OccupancyGrid:
    """data: (width * height,) int8, the lowest row first: per cent that something solid is there; -1: not known."""

    header: Header
    info: MapMetaData
    data: np.ndarray
