"""Messages of the robot's processes in, standard messages of ROS 2 out, by topic.

Frames are those of REP 105: map (the scene's), odom, base_link. map to odom is what localisation corrects of the
odometry. Stamps are the wall's, as in a bag.
"""

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...observation import VALUE, Quantity
from ...pilot.pilot import compose
from ...scene import Scene
from ..bags.log_clock import LogClock
from ..network.messages import HEALTH, End
from ..network.ros import (
    BASE_FRAME,
    MAP_FRAME,
    ODOMETRY_FRAME,
    Header,
    JointState,
    OccupancyGrid,
    Odometry,
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    Vector3,
)
from ..network.rows import between
from . import shapes
from .types import make

PATH_MOST, PATH_EVERY = 600, 10  # poses kept; rows from one to the next
ODOMETRIES_MOST = 100  # rows that localisation may be late
NEAR_NS = 2 * 10**8  # from a row to the base's report that is nearest
OK, ERROR = 0, 2  # DiagnosticStatus.level
KINDS = {
    "/tf": "tf2_msgs/TFMessage",
    "/map": "nav_msgs/OccupancyGrid",
    "/pose": "geometry_msgs/PoseWithCovarianceStamped",
    "/odom": "nav_msgs/Odometry",
    "/path": "nav_msgs/Path",
    "/belief": "nav_msgs/OccupancyGrid",
    "/joint_states": "sensor_msgs/JointState",
    "/robot": "visualization_msgs/MarkerArray",
    "/truth": "geometry_msgs/PoseStamped",
    "/diagnostics": "diagnostic_msgs/DiagnosticArray",
}
LATCHED = ("/map",)  # a subscriber that comes late gets the last one
POSE_TOPIC, POSE_KIND = "/initialpose", "geometry_msgs/PoseWithCovarianceStamped"  # obeyed
POSE_SCHEMA = POSE_KIND.replace("/", "/msg/")


@dataclass(frozen=True)
class Standard:
    """A message to publish. stamp_ns: of the wall's clock."""

    topic: str
    stamp_ns: int
    message: Any


class StandardView:
    """`take` every message of a robot; yields what follows from it. `first`: what holds before any has come."""

    def __init__(self, scene: Scene, wall_ns: int):
        self.scene, self._clock = scene, LogClock(wall_ns)
        self._odometry: deque = deque(maxlen=ODOMETRIES_MOST)  # ns, x, y, heading that does not wrap
        self._path: deque = deque(maxlen=PATH_MOST)
        self._rows, self._filter = 0, ""
        self._touching: dict[str, float] = {}

    @property
    def latest_ns(self) -> int:
        """The wall's time of the newest row."""
        return self._clock.latest

    def first(self) -> Iterator[Standard]:
        now = self._clock.latest
        yield Standard("/map", now, shapes.occupancy(self.scene, Header.at(now, MAP_FRAME)))

    def take(self, topic: str, message: Any) -> Iterator[Standard]:
        """A message of a topic of network.messages.TOPICS, or of health."""
        take = getattr(self, f"_take_{topic.partition('/')[0]}", None)
        if take is None or isinstance(message, End):
            return
        yield from take(message, message.header.stamp.ns, self.note(topic, message))

    def note(self, topic: str, message: Any) -> int:
        """The wall's time of a message, ns; those of observations set the clock."""
        stamp_ns = message.header.stamp.ns
        return self._clock.row(stamp_ns) if topic == "observation" else self._clock.other(stamp_ns)

    def _take_observation(self, row, _: int, wall_ns: int) -> Iterator[Standard]:
        self._touching = {}
        for name, cell, value in zip(row.names, row.cells.tolist(), row.values.tolist(), strict=True):
            column = self.scene.layout.get(name)
            if column is not None and column.quantity is Quantity.DISTANCE and cell == VALUE:
                self._touching[column.whisker] = value / 1000.0
        markers = shapes.robot_markers(self.scene.robot, self._touching, Header.at(wall_ns, BASE_FRAME))
        yield Standard("/robot", wall_ns, markers)

    def _take_odometry(self, odometry, stamp_ns: int, wall_ns: int) -> Iterator[Standard]:
        place = np.array(odometry.pose.pose.xytheta)
        before = self._odometry[-1][3] if self._odometry else 0.0
        self._odometry.append((stamp_ns, *place[:2], before + math.remainder(place[2] - before, math.tau)))
        yield _transform(wall_ns, ODOMETRY_FRAME, BASE_FRAME, place)
        header = Header.at(wall_ns, ODOMETRY_FRAME)
        yield Standard("/odom", wall_ns, Odometry(header, BASE_FRAME, odometry.pose, odometry.twist))

    def _take_pose(self, reported, stamp_ns: int, wall_ns: int) -> Iterator[Standard]:
        place, header = np.array(reported.pose.pose.xytheta), Header.at(wall_ns, MAP_FRAME)
        yield Standard("/pose", wall_ns, PoseWithCovarianceStamped(header, reported.pose))
        if (odometry := self._odometry_at(stamp_ns)) is not None:
            yield _transform(wall_ns, MAP_FRAME, ODOMETRY_FRAME, compose(place, between(odometry, np.zeros(3))))
        if self._rows % PATH_EVERY == 0:
            self._path.append(PoseStamped(header, Pose.planar(*map(float, place))))
            yield Standard("/path", wall_ns, make("nav_msgs/Path", header=header, poses=list(self._path)))
        self._rows += 1

    def _odometry_at(self, stamp_ns: int) -> np.ndarray | None:
        """The pose in the odometry's frame then, between those that were reported; None: too far from any."""
        if (
            not self._odometry
            or not stamp_ns - self._odometry[0][0] >= -NEAR_NS
            or stamp_ns - self._odometry[-1][0] > NEAR_NS
        ):
            return None
        reported = np.array(self._odometry)
        return np.array([np.interp(stamp_ns, reported[:, 0], column) for column in reported.T[1:]])

    def _take_localisation(self, reported, _: int, wall_ns: int) -> Iterator[Standard]:
        """Of several filters the first is the one whose pose is the robot's."""
        self._filter = self._filter or reported.filter
        yield from ()

    def _take_belief(self, reported, _: int, wall_ns: int) -> Iterator[Standard]:
        if reported.filter != self._filter:
            return
        grid = shapes.belief(reported, self.scene, Header.at(wall_ns, MAP_FRAME))
        yield Standard("/belief", wall_ns, grid)

    def _take_map(self, grid, _: int, wall_ns: int) -> Iterator[Standard]:
        """A mapper's, in place of the scene's."""
        yield Standard("/map", wall_ns, OccupancyGrid(Header.at(wall_ns, MAP_FRAME), grid.info, grid.data))

    def _take_joints(self, joints, _: int, wall_ns: int) -> Iterator[Standard]:
        message = JointState(Header.at(wall_ns, BASE_FRAME), joints.name, joints.position)
        yield Standard("/joint_states", wall_ns, message)

    def _take_truth(self, truth, _: int, wall_ns: int) -> Iterator[Standard]:
        yield Standard("/truth", wall_ns, PoseStamped(Header.at(wall_ns, MAP_FRAME), truth.pose))

    def _take_health(self, health, _: int, wall_ns: int) -> Iterator[Standard]:
        text = health.last_error or health.state
        status = make(
            "diagnostic_msgs/DiagnosticStatus",
            level=ERROR if health.last_error else OK,
            name=f"{HEALTH}: {health.process}",
            message=text,
            hardware_id=str(health.pid),
            values=health.counters,
        )
        array = make("diagnostic_msgs/DiagnosticArray", header=Header.at(wall_ns, ""), status=[status])
        yield Standard("/diagnostics", wall_ns, array)


def _transform(ns: int, parent: str, child: str, place: np.ndarray) -> Standard:
    x, y, theta = map(float, place)
    turn = Pose.planar(x, y, theta).orientation
    moved = make("geometry_msgs/Transform", translation=Vector3(x, y), rotation=turn)
    stamped = make(
        "geometry_msgs/TransformStamped", header=Header.at(ns, parent), child_frame_id=child, transform=moved
    )
    return Standard("/tf", ns, make("tf2_msgs/TFMessage", transforms=[stamped]))
