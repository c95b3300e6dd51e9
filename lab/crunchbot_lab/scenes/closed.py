"""A robot of a family in closed loop: what it does next may depend on what it has read so far.

The same world, mechanics and readings as `making`; only the path is not drawn beforehand. A seed's arena, start, noise and
kidnap are the same for every policy, so that runs can be compared pair by pair.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from crunchbot.nav.filters import FAVOURITE, Filter
from crunchbot.nav.observations import Observations
from crunchbot.nav.scoring import LOCK_ROWS, lock_row, position_errors
from crunchbot.pilot.choices import Choices
from crunchbot.pilot.states import CLEAR_M, EXPLORE_M_S, FULL, ODOMETRY_TICKS, TICK_S, TURN_RAD_S
from crunchbot.pilot.whereabouts import Whereabouts
from crunchbot.planning.actions import Vehicle
from crunchbot.scene import Arena, Prior, Robot, Scene

from . import walk
from .explorer import SETTLE_TICKS, Explorer
from .families import Recipe, recipe
from .files import rounded
from .geometry import free_test
from .making import ROW_S, carried_to, explored_rows, streams, walked_rows
from .readings import odometry

SETTLE_S = (SETTLE_TICKS + ODOMETRY_TICKS) * TICK_S  # from a change of speed to the end of the first window that counts
LOOK_ROWS = 20  # between looks at whether it is locked
WHISK_S = 4.0  # of the explorer's body whisks, with its way back
AGAIN = 1_000_000  # added to the seed after a kidnap


class Stroller:
    """The walk of `walk.wander`, row by row, its turns and distances chosen: what `Explorer` is to robots with body whisks.

    It takes the place of the behaviour for its choices: `whereabouts`, of what was met, and `turned_away`, for it
    never escapes.
    """

    def __init__(
        self,
        arena: Arena,
        robot: Robot,
        start: Sequence[float],
        rng: np.random.Generator,
        pace: walk.Pace,
        choices: Choices,
    ):
        self._free, self._rng, self._pace, self.choices = free_test(arena, robot.body_radius_m), rng, pace, choices
        self.pose = tuple(map(float, start))
        self.path = [self.pose]
        self.whereabouts, self.turned_away = Whereabouts(), -1
        self._turn = self._drive = self._curve = 0.0
        self._met = True  # the last drive was stopped, or there was none

    def row(self) -> None:
        """Go on for 0.1 s."""
        x, y, heading = self.pose
        if self._turn == 0.0 and self._drive <= 0.0:
            self._choose()
        if self._turn:
            step = math.copysign(min(self._pace.turn_rad, abs(self._turn)), self._turn)
            self._turn, self.pose = self._turn - step, (x, y, heading + step)
        else:
            self._forward()
        dx, dy = self.pose[0] - x, self.pose[1] - y
        self.path.append(self.pose)
        self.whereabouts.moved(len(self.path) * ODOMETRY_TICKS, math.hypot(dx, dy), 0.0, self.pose[2] - heading)

    def _choose(self) -> None:
        tick = len(self.path) * ODOMETRY_TICKS
        self._drive = 0.0 if self._met else self.choices.on(self, tick)
        if self._drive > 0.0:
            return
        self._met = False
        self._turn = self.choices.turn(self, tick, 60.0, 180.0)
        self._drive = self.choices.distance(self, tick) if self._turn else 0.0
        self._curve = 0.0

    def _forward(self) -> None:
        x, y, heading = self.pose
        if self._drive <= 0.0:
            return
        self._curve = 0.9 * self._curve + self._rng.standard_normal() * self._pace.curve_rad
        ahead = heading + self._curve / 2
        to = x + self._pace.step_m * math.cos(ahead), y + self._pace.step_m * math.sin(ahead)
        self._drive -= self._pace.step_m
        if self._free(*to):
            self.pose = (*to, heading + self._curve)
        else:
            self._drive, self._met = 0.0, True
            self.whereabouts.meet(len(self.path) * ODOMETRY_TICKS, 0.0)


class RandomStroll:
    """As `walk.wander` chooses: straight on until the way is blocked, then a turn by 60 to 180 degrees."""

    remembers = False

    def __init__(self, rng: np.random.Generator):
        self._rng = rng

    def on(self, b: object, tick: int) -> float:
        """As in pilot.choices.Choices."""
        return 0.0

    def turn(self, b: object, tick: int, least_deg: float, most_deg: float) -> float:
        """As in pilot.choices.Choices."""
        return float(self._rng.uniform(math.pi / 3, math.pi) * self._rng.choice((-1.0, 1.0)))

    def distance(self, b: object, tick: int) -> float:
        """As in pilot.choices.Choices."""
        return math.inf

    def whisk(self, b: object, tick: int) -> bool:
        """As in pilot.choices.Choices; its robots have none."""
        return False


@dataclass(frozen=True)
class Outcome:
    """Of a closed loop: rows driven, those from the last start until lock (None: not locked), distances from the truth (rows,),
    true path (rows, 3), and the row of the last start."""

    rows: int
    lock_rows: int | None
    error_m: np.ndarray
    truth: np.ndarray
    begun: int


Policy = Callable[["Loop", Choices], Choices]  # what chooses, given the loop and the random choices of this seed


class Loop:
    """`run` one seed of a family with a policy. A filter reads along; `belief` is its belief at this moment."""

    look_rows = LOOK_ROWS

    def __init__(self, family: str | Recipe, seed: int, policy: Policy, rows: int, filter: str = FAVOURITE):
        self.recipe = recipe(family) if isinstance(family, str) else family
        if self.recipe.faults or self.recipe.slips or self.recipe.map_fault or self.recipe.moves:
            raise ValueError(
                f"family '{family}': faults, slips and moved boxes are of paths drawn beforehand; give one without"
            )
        self.seed, self._policy, self._rows = seed, policy, rows
        rng = streams(seed)
        self.robot = self.recipe.robot()
        self.arena = self.recipe.arena(rng["arena"], self.robot.body_radius_m)
        self.begin = walk.draw_pose(self.arena, self.robot.body_radius_m, rng["start"])
        prior = (
            Prior("uniform")
            if self.recipe.uniform
            else Prior("gaussian", tuple(map(float, self.begin)), (0.02, 0.02, 0.03))
        )
        self.scene = Scene(self._mapped(), self.robot, prior)
        self._filter = self._reads_along(filter)
        self._errors: list[np.ndarray] = []
        self._truth: list[np.ndarray] = []
        self._base = self._fed = 0

    def _mapped(self) -> Arena:
        """The arena as the robot is given it."""
        return self.arena

    def _reads_along(self, filter: str) -> Any:
        """What takes the rows by `replay`, and gives (rows,) of ESTIMATE."""
        return Filter(filter, self.scene, seed=self.seed)

    @property
    def vehicle(self) -> Vehicle:
        """Speeds and costs of this family's robot."""
        if self.recipe.body_whisks:
            return Vehicle(EXPLORE_M_S, TURN_RAD_S, CLEAR_M / EXPLORE_M_S, WHISK_S, SETTLE_S)
        pace = self.recipe.pace
        return Vehicle(pace.step_m / ROW_S, pace.turn_rad / ROW_S, settle_s=ROW_S, reads_always=True)

    @property
    def true_pose(self) -> tuple[float, float, float]:
        """Where it is: for policies that may know."""
        return self._mover.pose

    def run(self, until_locked: bool = True) -> Outcome:
        """Drives for at most as many rows as were given, from the start or from each."""
        begun = max(self.recipe.kidnap_rows, default=0)
        self._drive(self.begin, self.seed, begun or self._rows, until_locked and not begun)
        if begun:
            there = carried_to(
                self.arena, self.robot.body_radius_m, self._truth_so_far()[-1], streams(self.seed)["kidnap"]
            )
            self._drive(there, self.seed + AGAIN, self._rows, until_locked)
        errors = np.concatenate(self._errors)
        return Outcome(len(errors), lock_row(errors[begun:]), errors, self._truth_so_far(), begun)

    def belief(self) -> np.ndarray:
        """Components of the filter's belief after all rows so far."""
        self._read()
        return self._filter.components()

    def _truth_so_far(self) -> np.ndarray:
        return np.concatenate(self._truth)

    def _drive(self, start: Sequence[float], seed: int, rows: int, until_locked: bool) -> None:
        self._stream_seed, self._most, self._fed = seed, rows, 0
        self._base = sum(map(len, self._errors))
        rng = streams(seed)["path"]
        if self.recipe.body_whisks:
            self._mover = Explorer(self.arena, self.robot, start, rng, FULL)
            random = self._mover.behaviour.choices
            self._mover.behaviour.choices = self._policy(self, random)
        else:
            self._mover = Stroller(self.arena, self.robot, start, rng, self.recipe.pace, RandomStroll(rng))
            self._mover.choices = self._policy(self, RandomStroll(rng))
        for row in range(1, rows + 1):
            self._mover.row()
            if row % self.look_rows == 0 or row == rows:
                self._read()
                if self._is_over(row, until_locked):
                    return

    def _is_over(self, row: int, until_locked: bool) -> bool:
        """Whether the drive ends after this row."""
        return until_locked and row >= LOCK_ROWS and lock_row(np.concatenate(self._errors)[self._base :]) is not None

    def _read(self) -> None:
        """Lets the filter take the rows that were driven since the last time."""
        done = len(self._mover.path) - 1
        if done == self._fed:
            return
        rows = self._observations()
        table, _ = self._filter.replay(rows, self._fed, done - self._fed)
        self._take(rows, self._fed, table)
        self._fed = done

    def _take(self, rows: Observations, first: int, table: np.ndarray) -> None:
        """Rows from `first` on were read, and gave `table`, (n,) of ESTIMATE."""
        truth = rows.truth[first : first + len(table)]
        self._errors.append(position_errors(table["pose"], truth))
        self._truth.append(truth)

    def _observations(self) -> Observations:
        """All rows of this drive; those after the present one are of standing still. A row's readings depend on nothing later."""
        rng, r = streams(self._stream_seed), self.recipe
        if r.body_whisks:
            made = explored_rows(r, self.arena, self.robot, self._mover.explored(self._most), rng)
        else:
            path = np.array(self._mover.path)
            path = np.concatenate([path, np.repeat(path[-1:], self._most + 1 - len(path), axis=0)])
            made = walked_rows(r, self.arena, self.robot, path, odometry(path, r.world, rng["odometry"]), rng)
        made.t_s = (self._base + np.arange(self._most) + 1) * ROW_S
        made.truth[:, 2] = np.remainder(made.truth[:, 2] + math.pi, 2 * math.pi) - math.pi
        return rounded(made)
