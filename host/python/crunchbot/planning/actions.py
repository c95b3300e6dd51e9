"""What a robot may do next, as paths from where it stands: on as it goes, turn and drive, and along a wall."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

STEP_M, STEP_RAD = 0.1, math.radians(30.0)  # readings are foretold at steps of so much
REACH_M = 1.4
CUTS_M = (0.2, 0.4, 0.7, 1.0, REACH_M)  # lengths that a drive may have
ROW_S = 0.1

# Bhattacharyya distance, nats, of a texture window that is right in 85 % under two of three classes; and of a contact, 5 % of
# them missed and 1 % invented, from none.
TEXTURE_NATS, TOUCH_NATS = 0.545, 1.09
# Share that is new of a window that says what the one before said: log(2 / 6) / log(0.075), which is what the filters begin
# with (host/nav/measurement/repeat).
REPEATED = 0.42
SPACING_M = 0.02  # of travel, after which a distance counts in full (setting radial.spacing_m)
LEVER_M = 0.2  # from the robot's middle to a whisker's tip, about


@dataclass(frozen=True)
class Vehicle:
    """Speeds, m/s and rad/s; what a contact costs without and with a body whisk, s; `settle_s` after each
    change of speed, in which the floor is not read; `reads_always`: every contact is a reading,
    in every row, and stops nothing."""

    drive_m_s: float
    turn_rad_s: float
    contact_s: float = 0.0
    whisk_s: float = 0.0
    settle_s: float = 0.0
    reads_always: bool = False

    @property
    def stopped_s(self) -> float:
        """What it costs to be stopped: the way back, and a quarter turn away, for the way ahead is closed."""
        return self.contact_s + math.pi / 2.0 / self.turn_rad_s + 2.0 * self.settle_s


@dataclass(frozen=True)
class Leg:
    """Turn by `turn_rad`, then drive `drive_m`; the robot may choose again after the turn and at each of `cuts_m`."""

    turn_rad: float
    drive_m: float
    cuts_m: tuple[float, ...] = ()


@dataclass(frozen=True)
class Step:
    """As struct nav_planner_step of host/nav/planning; `leg` and `driven_m` (m) say where on a path it is."""

    pose: tuple[float, float, float]
    seconds: float
    texture_nats: float
    touch_nats: float
    turns: bool
    ends: bool
    leg: int
    driven_m: float


@dataclass(frozen=True)
class Path:
    """Legs, and the steps at which readings are foretold."""

    legs: tuple[Leg, ...]
    steps: tuple[Step, ...]

    @classmethod
    def of(cls, legs: Sequence[Leg], vehicle: Vehicle) -> "Path":
        """For a robot of these speeds."""
        x = y = heading = 0.0
        steps: list[Step] = []
        for number, leg in enumerate(legs):
            count = round(abs(leg.turn_rad) / STEP_RAD)
            for k in range(count):
                heading += leg.turn_rad / count
                angle = abs(leg.turn_rad) / count
                cost = angle / vehicle.turn_rad_s, k == 0, angle * LEVER_M
                steps.append(_step(vehicle, (x, y, heading), *cost, True, k == count - 1, number, 0.0))
            for k in range(1, round(leg.drive_m / STEP_M) + 1):
                x, y = x + STEP_M * math.cos(heading), y + STEP_M * math.sin(heading)
                ends = any(abs(k * STEP_M - cut) < STEP_M / 2.0 for cut in leg.cuts_m)
                cost = STEP_M / vehicle.drive_m_s, k == 1 and bool(steps), STEP_M
                steps.append(_step(vehicle, (x, y, heading), *cost, False, ends, number, k * STEP_M))
        return cls(tuple(legs), tuple(steps))


def _step(vehicle: Vehicle, pose, seconds: float, begins: bool, way: float, *rest) -> Step:
    """`begins`: after a change of speed; `way`: of a tip, m."""
    settle = vehicle.settle_s if begins else 0.0
    windows, touches = REPEATED * seconds / ROW_S, min(seconds / ROW_S, way / SPACING_M)
    return Step(pose, seconds + settle, TEXTURE_NATS * windows, TOUCH_NATS * touches, *rest)


def all_round(vehicle: Vehicle) -> list[Path]:
    """On as it goes, and every STEP_RAD to both sides, each with a drive of REACH_M."""
    half = round(math.pi / STEP_RAD)
    counts = [0, *(sign * n for n in range(1, half) for sign in (1, -1)), half]
    return [Path.of([Leg(n * STEP_RAD, REACH_M, CUTS_M)], vehicle) for n in counts]
