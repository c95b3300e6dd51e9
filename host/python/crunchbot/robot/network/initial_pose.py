"""Where a robot is, given by a person while it runs: messages of topic `initial_pose`, as those of ROS's /initialpose.

`prior_of` judges them, whichever door they came by. What a message leaves open is not certain: see SIGMA.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ...scene import Prior, Scene, independent
from .messages import Header, PoseWithCovariance, PoseWithCovarianceStamped
from .ros import MAP_FRAME, heading_of

if TYPE_CHECKING:
    from .link import Link

TOPIC = "initial_pose"
# m, m, rad where no variance is given: what RViz sends with a pose that is pointed at, and AMCL begins with.
SIGMA = (0.5, 0.5, math.pi / 12)
FINEST = 1e-3  # m and rad: nobody knows a pose better


class InitialPoseError(ValueError):
    """A pose that a navigator cannot begin from; one line: what, remedy."""


def message_of(
    pose: tuple[float, float, float], sigma: tuple[float, float, float] = SIGMA
) -> PoseWithCovarianceStamped:
    """x, y in m, heading in rad, on the map; standard deviations alike."""
    return PoseWithCovarianceStamped(
        Header.at(0, MAP_FRAME), PoseWithCovariance.planar(pose, np.diag(np.square(sigma)))
    )


def send(link: Link, pose: tuple[float, float, float], sigma: tuple[float, float, float] = SIGMA) -> None:
    """Tell the navigator of this link's robot that it is at this pose now, as `message_of` has it. One stream for each
    pose, so that the next may come from another process."""
    send_message(link, message_of(pose, sigma))


def send_message(link: Link, message: PoseWithCovarianceStamped) -> None:
    """The same, as a message of another program has it."""
    stream = link.publish(TOPIC)
    stream.send(message)
    stream.end(0, "reported")


def prior_of(message: PoseWithCovarianceStamped, scene: Scene) -> Prior:
    """The belief that such a message asks for, on the map; InitialPoseError when it is of another frame, has no heading,
    or is where no robot can be. A variance of 0 is one that was not given; what x, y and heading have in common widens it."""
    if message.header.frame_id not in ("", MAP_FRAME):
        raise InitialPoseError(f"frame '{message.header.frame_id}'; give a pose in frame '{MAP_FRAME}'")
    turn = message.pose.pose.orientation
    if heading_of(turn) is None:
        reported = ", ".join(f"{value:.3g}" for value in (turn.x, turn.y, turn.z, turn.w))
        raise InitialPoseError(
            f"orientation ({reported}) has no heading; give z = sin(heading / 2), w = cos(heading / 2)"
        )
    pose = tuple(map(float, message.pose.pose.xytheta))
    if fault := scene.fault_at(pose):
        raise InitialPoseError(f"({pose[0]:g}, {pose[1]:g}) is {fault}; give a place that is free")
    given = independent(message.pose.planar_covariance)
    sigma = (max(FINEST, width) if width > 0.0 else open_ for width, open_ in zip(given, SIGMA, strict=True))
    return Prior("gaussian", pose, tuple(sigma))
