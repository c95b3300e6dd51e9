"""What a base's odometry says, message by message, made into steps with errors, by the judge of the Create's driver.

A pose is of the whole way, so what was missed between two messages is in their difference. A pose that was set anew, a
publisher that began anew, and a base that was carried leave a difference that is no motion of the wheels: then the twist of both
messages counts, or what was ordered. A pose set anew may lie near, too: where pose and twist have agreed, what the twist does not
lead to is no motion.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...base_table import BaseTable
from ...native import ffi, lib

HELD_S = (
    0.03  # a message's motion may be of so much more time: as in host/create/src/odometry.c, by which adapters are late
)
LATE_S = 0.45  # by which messages come late at most, for later they count as silence
DRIFT_RAD_PER_M = 0.05  # of the heading: as create_odometry_defaults() assumes it
AGREED = 8  # messages in motion whose pose and twist agree, before a pose that the twist does not lead to was set anew
UNIFORM_SIGMA = 12.0**-0.5  # of a number anywhere between two that lie 1 apart


@dataclass(frozen=True)
class Said:
    """A message of odometry. covariance: of x, y, theta; arrived_s: by this machine's clock; publisher: its number."""

    stamp_s: float
    arrived_s: float
    publisher: int
    pose: tuple[float, float, float]
    twist: tuple[float, float]
    covariance: np.ndarray


class Way:
    """Steps summed up, with their covariance."""

    def __init__(self):
        self._motion = ffi.new("struct create_motion *")

    def add(self, step: dict[str, float]) -> None:
        """Of the fields of struct create_step."""
        lib.create_motion_add(self._motion, ffi.new("struct create_step *", step))

    def take(self) -> tuple[float, ...]:
        """x, y, theta, and the covariance xx, xy, xt, yy, yt, tt, since the last call."""
        c = ffi.new("double[3][3]")
        lib.create_motion_covariance(self._motion, c)
        motion = (self._motion.x, self._motion.y, self._motion.theta)
        self._motion = ffi.new("struct create_motion *")
        return (*motion, c[0][0], c[0][1], c[0][2], c[1][1], c[1][2], c[2][2])


class Judge:
    """Steps of messages in their order.

    resets: of the pose, which the twist bridged. carried: other poses to which no wheel can have come, so the base may be
    anywhere. covariance: whose counts.
    """

    def __init__(self, base: BaseTable, relative_sigma: float):
        self.carried, self.resets, self.covariance = 0, 0, "unknown"
        self._base, self._sigma = base, relative_sigma
        self._reach = ffi.new("struct create_reach *", (base.wheel_most_m_s, base.wheel_base_m))
        self._before: Said | None = None
        self._agreed = 0

    def take(self, said: Said, asked: tuple[float, float]) -> Iterator[dict[str, float]]:
        """asked: the speeds that were ordered since the message before, m/s and rad/s."""
        before, self._before = self._before, said
        if before is None:
            return
        elapsed_s, arrived_s = said.stamp_s - before.stamp_s, said.arrived_s - before.arrived_s
        anew = said.publisher != before.publisher or elapsed_s < 0.0
        time_s = arrived_s if anew else min(elapsed_s, arrived_s + LATE_S)
        distance, angle, side = difference(before, said, time_s)
        verdict, relies = self._verdict(distance, angle, asked, time_s), self._agreed >= AGREED
        agrees = self._agrees(before, said, (distance, angle), time_s)
        if anew or verdict == lib.CREATE_CARRIED or (relies and not agrees):
            bridged = relies and time_s < LATE_S and self._can_do(before, said)
            self.resets += bridged
            self.carried += not bridged
            yield self._estimate(before, said, asked, time_s, bridged)
            return
        step = {"distance": distance, "angle": angle} | self._errors(before, said, distance, angle)
        if verdict == lib.CREATE_PUSHED:
            step |= {"loose_distance": abs(distance), "loose_angle": abs(angle)}
        yield {"angle": side}  # in which direction the way went; together no turn
        yield step
        yield {"angle": -side}

    def _verdict(self, distance: float, angle: float, asked: tuple[float, float], time_s: float) -> int:
        asked_m_s = lib.create_wheel_way(self._reach, *asked)
        return lib.create_judge(self._reach, distance, angle, asked_m_s, time_s + HELD_S)

    def _agrees(self, before: Said, said: Said, moved: tuple[float, float], time_s: float) -> bool:
        """Whether the twists lead to this pose: but for what wheels do while a message is late, and in a part of the time
        between two. Of a gap they know nothing."""
        middle = tuple((a + b) / 2.0 for a, b in zip(before.twist, said.twist, strict=True))
        apart = min(
            lib.create_wheel_way(self._reach, moved[0] - v * time_s, moved[1] - omega * time_s)
            for v, omega in (before.twist, middle, said.twist)
        )
        agrees = time_s >= LATE_S or apart <= lib.create_driven_most(self._reach, HELD_S + time_s / 4.0)
        self._agreed = self._agreed + (any(moved) and any(said.twist)) if agrees else 0
        return agrees

    def _can_do(self, *messages: Said) -> bool:
        """Whether wheels can have the speeds of the twists."""
        return all(self._verdict(*one.twist, (0.0, 0.0), 1.0) == lib.CREATE_DRIVEN for one in messages)

    def _estimate(self, before: Said, said: Said, asked: tuple[float, float], time_s: float, bridged: bool):
        """By the twists; or what was ordered, in doubt by all that wheels can do."""
        if bridged:
            v, omega = (sum(both) / 2.0 for both in zip(before.twist, said.twist, strict=True))
            change = [UNIFORM_SIGMA * abs(b - a) * time_s for a, b in zip(before.twist, said.twist, strict=True)]
            step = {"distance": v * time_s, "angle": omega * time_s, "loose_distance": change[0]}
            return step | {"loose_angle": change[1]} | self._scales(v * time_s, omega * time_s)
        most_m = lib.create_driven_most(self._reach, time_s)
        step = {"distance": asked[0] * time_s, "angle": asked[1] * time_s, "loose_distance": most_m}
        return step | {"loose_angle": most_m / self._base.wheel_base_m}

    def _errors(self, before: Said, said: Said, distance: float, angle: float) -> dict[str, float]:
        """Scale errors, which are the same in every message and which no sum of its covariances has; with them what the
        covariance has grown by, where it grows with the motion."""
        grown = growth(before, said)
        if grown is not None:
            self.covariance = "odometry"
            return self._scales(distance, angle) | dict(zip(("loose_distance", "loose_angle"), grown, strict=True))
        if self.covariance == "unknown" and (distance or angle):
            self.covariance = "assumed"
        return self._scales(distance, angle)

    def _scales(self, distance: float, angle: float) -> dict[str, float]:
        scales = {"scale_distance": self._sigma * abs(distance), "scale_angle": self._sigma * abs(angle)}
        return scales | {"scale_drift": DRIFT_RAD_PER_M * abs(distance)}


def difference(before: Said, said: Said, time_s: float) -> tuple[float, float, float]:
    """Length and turn of the arc between two poses, and by how much it sets out to the side of the heading."""
    (x, y, heading), (x1, y1, heading1) = before.pose, said.pose
    turned = heading1 - heading
    expected = (before.twist[1] + said.twist[1]) / 2.0 * time_s
    turned += math.tau * (round((expected - turned) / math.tau) if math.isfinite(expected - turned) else 0)
    chord, half = math.hypot(x1 - x, y1 - y), turned / 2.0
    side = math.remainder(math.atan2(y1 - y, x1 - x) - heading - half, math.tau) if chord else 0.0
    if abs(side) > math.pi / 2.0:
        chord, side = -chord, side - math.copysign(math.pi, side)
    ratio = math.sin(half) / half if half and abs(half) < math.pi / 2.0 else 1.0
    return chord / ratio, turned, side


def growth(before: Said, said: Said) -> tuple[float, float] | None:
    """Standard deviations of distance and turn that the covariance has grown by; None: it says nothing of the motion."""
    dx, dy = said.pose[0] - before.pose[0], said.pose[1] - before.pose[1]
    carry = np.array([[1.0, 0.0, -dy], [0.0, 1.0, dx], [0.0, 0.0, 1.0]])
    added = said.covariance - carry @ before.covariance @ carry.T
    along = np.array([math.cos(before.pose[2]), math.sin(before.pose[2])])
    variances = np.array([along @ added[:2, :2] @ along, added[2, 2]])
    if not np.isfinite(variances).all() or not (variances > 0.0).all():
        return None
    distance, turn = np.sqrt(variances).tolist()
    return distance, turn
