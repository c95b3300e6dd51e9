"""In the place of the pilot's random choices: `Mapping` visits what was not visited."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..pilot.choices import Choices
from ..pilot.conditions import touching
from ..pilot.states import ODOMETRY_TICKS, TICK_S
from ..pilot.whereabouts import AHEAD_M, ASIDE_RAD
from ..scene import Robot
from .coverage import NO_WAY, NOTHING_NEW, CoveragePlanner, Growing, Vehicle, Way, lanes, of_growing

STRAIGHT_ON_RAD = 1e-3  # a turn that is over at once
# A smaller turn, or one that leads no further aside, is not worth a stop.
STRAIGHT_RAD, STRAIGHT_M = math.radians(5.0), 0.035
DRIVE_M = 0.4  # before it is planned anew, without a stop
ESCAPED_M = 0.3  # of a drive after an escape
SOLID = 0.9  # probability from which a cell is taken for solid
FELT_M = 0.1  # a contact this near to something solid in the map is of it, and another whisk there gives nothing new
REST_TICKS = round(1.0 / TICK_S)  # before it is planned anew where nothing is worth its time
Pose = Callable[[], np.ndarray | None]  # (3,) of this moment in the map's frame; None: not known yet
NO_WHISKERS = "no whisker reads anything"


class Mapping:
    """Drives where most new floor is swept a second, on its own map and its own pose in it: turns and drives along a way. Where no
    pose is known, or no new floor is in reach, what `otherwise` says. Where it is refused for another reason the robot stands,
    and is asked again."""

    remembers = True

    def __init__(self, robot: Robot, vehicle: Vehicle, pose: Pose, known: Callable[[], Growing], otherwise: Choices):
        self._robot, self._pose, self._known, self._otherwise = robot, pose, known, otherwise
        self._planner = CoveragePlanner(vehicle, lanes(robot))
        self.way = Way(NO_WAY)
        self.plans = 0
        self._tick, self._first = -REST_TICKS, (0.0, 0.0)
        self._frame, self._seen = -1, -1  # `_seen`: tick up to which it is known where it was
        self._forget()

    def _forget(self) -> None:
        self._been: list[np.ndarray] = []
        self._met: list[np.ndarray] = []

    def on(self, b: Any, tick: int) -> float:
        """As in pilot.choices.Choices."""
        turn, drive = self._renewed(b, tick) or (0.0, 0.0)
        return drive if turn == 0.0 else 0.0

    def turn(self, b: Any, tick: int, least_deg: float, most_deg: float) -> float:
        """As in pilot.choices.Choices."""
        first = self._renewed(b, tick)
        if first is None:
            return self._otherwise.turn(b, tick, least_deg, most_deg)
        turn, drive = first
        return (turn or STRAIGHT_ON_RAD) if drive > 0.0 else 0.0

    def distance(self, b: Any, tick: int) -> float:
        """As in pilot.choices.Choices; none where no turn was asked for before, so that one is asked for at once."""
        if tick == b.turned_away:
            return ESCAPED_M
        first, self._first = self._first, (0.0, 0.0)
        return self._otherwise.distance(b, tick) if first is None else first[1]

    def whisk(self, b: Any, tick: int) -> bool:
        """As in pilot.choices.Choices: at what the map does not have yet."""
        pose, grid = self._pose(), self._known().grid
        if pose is None or grid is None or not grid.occupied.size:
            return True
        bearing = pose[2] + ASIDE_RAD * b.sides.get(touching(b)[0], 0.0)
        row, column = np.nonzero(grid.occupied > SOLID)
        x, y = grid.x + (column + 0.5) * grid.cell - pose[0], grid.y + (row + 0.5) * grid.cell - pose[1]
        off = np.hypot(x - AHEAD_M * math.cos(bearing), y - AHEAD_M * math.sin(bearing))
        return not (off < FELT_M).any()

    def _renewed(self, b: Any, tick: int) -> tuple[float, float] | None:
        """The first turn and drive of this tick's way; none to drive: it rests."""
        rests = self.way.refused and tick - self._tick < REST_TICKS
        if tick != self._tick and not rests:
            planned, self._tick = self._plan(b, tick), tick
            self.plans += planned is not None
            self.way, self._first = Way(NO_WAY), None
            if planned is not None:
                self.way, pose = planned
            if planned is not None and self.way.refused != NOTHING_NEW:
                self._first = _leg(self.way, pose)
        return self._first

    def _plan(self, b: Any, tick: int) -> tuple[Way, np.ndarray] | None:
        """The way, and the pose from which it leads; None: nothing is known yet."""
        pose = self._pose()
        if pose is None:
            return None
        if not self._robot.whiskers:
            return Way(NO_WAY, refused=NO_WHISKERS), pose
        known = self._known()
        if known.frame != self._frame:
            self._frame = known.frame
            self._forget()
        self._remember(b, tick, pose)
        field, here = of_growing(known, np.concatenate(self._been), np.concatenate(self._met), pose, self._robot)
        return self._planner.plan(field, here), here

    def _remember(self, b: Any, tick: int, pose: np.ndarray) -> None:
        """Where it was and what it met since it was last asked."""
        rows = 1 + (tick - self._seen) // ODOMETRY_TICKS
        met = len(b.whereabouts.encounters(self._seen, math.inf))
        self._been.append(_placed(pose, b.whereabouts.been()[-rows:]))
        self._met.append(_met(pose, b, len(b.whereabouts.things()) - met))
        self._seen = tick


def _leg(way: Way, pose: np.ndarray) -> tuple[float, float]:
    """Turn, rad, and drive, m, of what a robot at pose (3,) does next on a way."""
    turn, drive = way.first(pose) if len(way.corners) else (0.0, 0.0)
    aside = drive * abs(math.sin(turn)) if abs(turn) < math.pi / 2.0 else math.inf
    straight = abs(turn) < STRAIGHT_RAD or aside < STRAIGHT_M
    return 0.0 if straight else turn, min(drive, DRIVE_M)


def _placed(pose: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(n, 2) points of the robot's frame in the map's."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return points @ np.array([[c, s], [-s, c]]) + pose[:2]


def _met(pose: np.ndarray, b: Any, first: int) -> np.ndarray:
    """(m, 4) what the behaviour met, from number `first` on, and where the robot was then, in the map's frame."""
    return np.column_stack([_placed(pose, at[first:]) for at in (b.whereabouts.things(), b.whereabouts.places())])
