"""Where the robot has been of late and where it met something, by its own odometry."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

AHEAD_M = 0.2  # from the robot's centre to what its whiskers or bumpers meet ...
ASIDE_RAD = math.radians(40.0)  # ... and how far to the side that is, if it is on one
BEHIND_RAD = math.pi


@dataclass
class Encounter:
    """Something was in the way: the tick, and the places of the robot and, about, of the thing by the robot's odometry."""

    tick: int
    x_m: float
    y_m: float
    thing_x_m: float
    thing_y_m: float


class Whereabouts:
    """Where the robot has been and met something in the last `MEMORY_TICKS`, by odometry alone: it drifts, but not by much
    in that time. Its frame is that of the start and means nothing to anybody else."""

    MEMORY_TICKS = 80_000

    def __init__(self):
        self._x = self._y = self._theta = 0.0
        self._path: deque[tuple[int, float, float]] = deque()
        self._met: list[Encounter] = []

    def moved(self, tick: int, dx: float, dy: float, dtheta: float) -> None:
        """Reported motion in the robot's frame at its start (m, m, rad)."""
        c, s = math.cos(self._theta), math.sin(self._theta)
        self._x, self._y, self._theta = self._x + c * dx - s * dy, self._y + s * dx + c * dy, self._theta + dtheta
        self._path.append((tick, self._x, self._y))
        while self._path and self._path[0][0] <= tick - self.MEMORY_TICKS:
            self._path.popleft()
        self._met = [m for m in self._met if m.tick > tick - self.MEMORY_TICKS]

    def meet(self, tick: int, bearing_rad: float) -> None:
        """Something is in the way, in this direction from the robot's centre (0 ahead, anticlockwise)."""
        bearing = self._theta + bearing_rad
        thing = (self._x + AHEAD_M * math.cos(bearing), self._y + AHEAD_M * math.sin(bearing))
        self._met.append(Encounter(tick, self._x, self._y, *thing))

    def encounters(self, since: int, radius_m: float) -> list[Encounter]:
        """Those after tick `since` with the robot within this distance of here, the oldest first."""
        return [m for m in self._met if m.tick > since and math.hypot(m.x_m - self._x, m.y_m - self._y) < radius_m]

    def things(self) -> np.ndarray:
        """(m, 2) places of what was met, in the robot's frame, m."""
        return self._from_here(np.array([(m.thing_x_m, m.thing_y_m) for m in self._met]).reshape(-1, 2))

    def places(self) -> np.ndarray:
        """(m, 2) where the robot was as it met each of them, likewise."""
        return self._from_here(np.array([(m.x_m, m.y_m) for m in self._met]).reshape(-1, 2))

    def been(self) -> np.ndarray:
        """(n, 2) where the robot was at its reports, likewise."""
        return self._from_here(np.array(self._path).reshape(-1, 3)[:, 1:])

    def _from_here(self, points: np.ndarray) -> np.ndarray:
        c, s = math.cos(self._theta), math.sin(self._theta)
        return (points - (self._x, self._y)) @ np.array([[c, -s], [s, c]])

    def gap(self, radius_m: float) -> tuple[float, float]:
        """The widest range of directions in which nothing was met around here: the turn (rad, in [-pi, pi]) to its middle,
        and its width. Everywhere: half a turn, 2 pi."""
        near = [m for m in self._met if math.hypot(m.x_m - self._x, m.y_m - self._y) < radius_m]
        ways = sorted(math.atan2(m.thing_y_m - self._y, m.thing_x_m - self._x) for m in near)
        if not ways:
            return math.pi, 2.0 * math.pi
        width, before = max(
            (after - way, way) for way, after in zip(ways, [*ways[1:], ways[0] + 2.0 * math.pi], strict=True)
        )
        return math.remainder(before + width / 2.0 - self._theta, 2.0 * math.pi), width

    def lingered(self, tick: int, radius_m: float) -> int:
        """Ticks since the robot was last further than this from where it is."""
        away = (t for t, x, y in reversed(self._path) if math.hypot(x - self._x, y - self._y) > radius_m)
        return tick - next(away, self._path[0][0] if self._path else tick)
