"""Where a robot is, given by a person while it runs: messages of topic `initial_pose`, as those of ROS's /initialpose."""

import math

import numpy as np

from ...scene import Arena, Prior
from .link import Link
from .messages import Header, PoseWithCovariance, PoseWithCovarianceStamped
from .ros import MAP_FRAME

TOPIC = "initial_pose"
SIGMA = (0.1, 0.1, 0.2)  # m, m, rad: of a pose that is pointed at
FINEST = 1e-3  # m and rad: nobody knows a pose better


class InitialPoseError(ValueError):
    """A pose that a navigator cannot begin from; one line: what, remedy."""


def send(link: Link, pose: tuple[float, float, float], sigma: tuple[float, float, float] = SIGMA) -> None:
    """Tell the navigator of this link's robot that it is at this pose now: x, y in m, heading in rad, in the arena's
    frame; standard deviations alike. One stream for each pose, so that the next may come from another process."""
    message = PoseWithCovariance.planar(pose, np.diag(np.square(sigma)))
    send_message(link, PoseWithCovarianceStamped(Header.at(0, MAP_FRAME), message))


def send_message(link: Link, message: PoseWithCovarianceStamped) -> None:
    """The same, as a message of another program has it."""
    stream = link.publish(TOPIC)
    stream.send(message)
    stream.end(0, "reported")


def prior_of(message: PoseWithCovarianceStamped, arena: Arena) -> Prior:
    """The belief that such a message asks for; InitialPoseError when it is of another frame, or outside the arena."""
    if message.header.frame_id not in ("", MAP_FRAME):
        raise InitialPoseError(f"{TOPIC}: frame '{message.header.frame_id}'; give a pose in frame '{MAP_FRAME}'")
    x, y, _ = message.pose.pose.xytheta
    if not (0.0 <= x <= arena.size_m[0] and 0.0 <= y <= arena.size_m[1]):
        raise InitialPoseError(f"{TOPIC}: ({x:.3g}, {y:.3g}) is outside the arena; give a place inside")
    variances = np.diag(message.pose.planar_covariance)
    sigma = tuple(max(FINEST, math.sqrt(variance)) for variance in variances.tolist())
    return Prior("gaussian", tuple(map(float, message.pose.pose.xytheta)), sigma)
