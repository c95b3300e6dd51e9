"""The demo's robot without its signals: the pilot's own behaviour (crunchbot.pilot.behaviour) on contacts from geometry.

Rows come out as the pilot makes them: odometry, textures and distances held back during a body whisk, a distance at the
release. What a whisk measures was taken from signal-level runs, and tests/scenes/test_levels.py holds the two against each other.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from crunchbot.pilot.behaviour import (
    BLOCK_TICKS,
    ODOMETRY_TICKS,
    TICK_S,
    Behaviour,
)
from crunchbot.pilot.choices import Choices
from crunchbot.pilot.states import PLAIN, Habits
from crunchbot.pilot.wheels import Wheels
from crunchbot.scene import Arena, Robot
from crunchbot.touch.mount import Mount

from .geometry import free_test, range_test

NOTICED_M = 0.001  # the sensor notices a contact when the whisker is pressed so far ...
RELEASED_M = 0.0003  # ... and its end when so little is left
TIP_M = 0.008  # a contact so near the whisker's end is the tip's, and reads as the whisker's length
SETTLE_TICKS = 300  # of steady motion before a texture window counts
DELAY_BLOCKS = 1  # an answer moves the wheels one block later
BLOCK_S = BLOCK_TICKS * TICK_S
BLOCKS_PER_ROW = ODOMETRY_TICKS // BLOCK_TICKS


@dataclass
class Explored:
    """An exploration of n rows."""

    path: np.ndarray  # (n + 1, 3) true poses
    held: np.ndarray  # (n,) odometry held back
    sweeping: np.ndarray  # (n,) texture windows are read
    radial_m: np.ndarray  # (n, rays) true distances at releases; inf no contact, nan not read


class _Feeler:
    """What Behaviour asks of a contact, from a true range."""

    def __init__(self, length_m: float):
        self.length_m, self.range_m = length_m, math.inf
        self.touching, self.settled, self.onset, self.release = False, True, -1, -1

    def look(self, tick: int, range_m: float) -> None:
        pressed = self.length_m - range_m
        if not self.touching and pressed > NOTICED_M:
            self.touching, self.onset = True, tick
        elif self.touching and pressed < RELEASED_M:
            self.touching, self.release = False, tick
        if self.touching:
            self.range_m = range_m


class Explorer:
    """The pilot's behaviour in an arena, row by row; `explored` gives all rows so far."""

    def __init__(
        self,
        arena: Arena,
        robot: Robot,
        start: Sequence[float],
        rng: np.random.Generator,
        habits: Habits = PLAIN,
        choices: Choices | None = None,
    ):
        self.pose = tuple(map(float, start))
        self.free = free_test(arena, robot.body_radius_m)
        self.rays = robot.of_role("object")
        self.reach = [range_test(arena, whisker) for whisker in self.rays]
        self.feelers = {n: _Feeler(whisker.length_m) for n, whisker in enumerate(self.rays)}
        self.mounts = {n: Mount.of(whisker) for n, whisker in enumerate(self.rays)}
        turns = {n: mount.corner_turn for n, mount in self.mounts.items()}
        sides = {n: -mount.face_turn for n, mount in self.mounts.items()}
        wheels = Wheels.without_driver(robot.base)
        self.behaviour = Behaviour(self.feelers, turns, rng, sides, wheels, habits, choices)
        self.waiting = [(0.0, 0.0)] * (1 + DELAY_BLOCKS)
        self.tick = 0
        self.measured: dict[int, float] = {}
        self.path, self._was_whisking = [self.pose], False
        self._held: list[bool] = []
        self._sweeping: list[bool] = []
        self._radial: list[list[float]] = []

    def row(self) -> None:
        """Explore for 0.1 s."""
        for _ in range(BLOCKS_PER_ROW):
            self.block()
        (x, y, heading), (to_x, to_y, to_heading) = self.path[-1], self.pose
        middle = (heading + to_heading) / 2.0
        ahead = (to_x - x) * math.cos(middle) + (to_y - y) * math.sin(middle)  # negative while it backs off
        self.behaviour.moved(self.tick - 1, ahead, 0.0, to_heading - heading)
        self._held.append(self.behaviour.whisking and not self.measured)
        self._sweeping.append(self.sweeping(self._was_whisking))
        self._radial.append(self.radial())
        self._was_whisking = self.behaviour.whisking
        self.path.append(self.pose)

    def explored(self, rows: int) -> Explored:
        """The rows so far; up to `rows` it stands still after them, and nothing is read."""
        more = rows - len(self._held)
        radial = np.array([*self._radial, *[[math.nan] * len(self.rays)] * more]).reshape(rows, len(self.rays))
        marks = (np.array([*mark, *[False] * more], bool) for mark in (self._held, self._sweeping))
        return Explored(np.array([*self.path, *[self.pose] * more]), *marks, radial)

    def block(self) -> None:
        self._move(*self.waiting.pop(0))
        last = self.tick + BLOCK_TICKS - 1
        for n, feeler in self.feelers.items():
            feeler.look(last, self.reach[n](*self.pose))
        self._measure()
        self.waiting.append(self.behaviour.decide(last))
        self.tick += BLOCK_TICKS

    def _move(self, v: float, omega: float) -> None:
        x, y, heading = self.pose
        ahead = heading + omega * BLOCK_S / 2
        to = (x + v * BLOCK_S * math.cos(ahead), y + v * BLOCK_S * math.sin(ahead))
        self.pose = (*(to if v and self.free(*to) else (x, y)), heading + omega * BLOCK_S)

    def _measure(self) -> None:
        whisk = self.behaviour.whisk
        if whisk is None or whisk.start < 0 or whisk.measured:
            return
        feeler = self.feelers[whisk.lane]
        if (
            whisk.start < feeler.onset <= whisk.push_end - self.behaviour.wheels.push_ticks
            and feeler.release > feeler.onset
        ):
            whisk.measured = True
            line_mm = 1000.0 * (feeler.range_m if feeler.range_m < feeler.length_m - TIP_M else feeler.length_m)
            reported = self.mounts[whisk.lane].distance(line_mm, whisk.direction)
            self.measured[whisk.lane] = math.nan if reported is None else reported / 1000.0

    def radial(self) -> list[float]:
        """Cells of the row that ends now."""
        whisking, released = self.behaviour.whisking, dict(self.measured)
        self.measured.clear()
        unread = whisking and not released
        return [
            released.get(n, math.nan if feeler.touching or unread else math.inf) for n, feeler in self.feelers.items()
        ]

    def sweeping(self, was_whisking: bool) -> bool:
        v, omega = self.behaviour.drive
        steady = self.behaviour.drive_since + SETTLE_TICKS <= self.tick
        return steady and self.behaviour.wheels.sweeps(v, omega) and not self.behaviour.whisking and not was_whisking


def explore(arena: Arena, robot: Robot, start: Sequence[float], rows: int, rng: np.random.Generator) -> Explored:
    """Let the pilot's behaviour explore for `rows` of 0.1 s."""
    explorer = Explorer(arena, robot, start, rng)
    for _ in range(rows):
        explorer.row()
    return explorer.explored(rows)
