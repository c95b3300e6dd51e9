"""Random exploration with the paper's body whisk, as a plain state machine: contacts and odometry in, wheel speeds out.

What leads from which state to which is a table (`rules.RULES`), drawn in docs/methods/behaviour.md.

A contact that begins in a turn is not whisked at: the tip then meets a face at a slant, and its bending would say
nothing about the distance.

It sees `Contact` objects and reported odometry only; it knows neither arena nor pose.
"""

import math

import numpy as np

from ..touch.contact import Contact
from .choices import Choices, Random
from .rules import RULES, SPEEDS, Rule
from .states import (
    BACK_OFF_M_S,
    BLOCK_TICKS,
    EFFECT_TICKS,
    EXPLORE_M_S,
    FULL,
    ODOMETRY_TICKS,
    PUSH_TICKS,
    SEARCH_RAD,
    SLOW,
    STUCK_SHARE,
    TICK_S,
    TURN_RAD_S,
    WHISK_RAD_S,
    WHISKING,
    Habits,
    State,
    TipMove,
    Whisk,
)
from .wheels import EXACT, NO_BUMPS, Bumps, Wheels
from .whereabouts import Whereabouts

__all__ = [
    "BACK_OFF_M_S",
    "BLOCK_TICKS",
    "EFFECT_TICKS",
    "EXPLORE_M_S",
    "Habits",
    "ODOMETRY_TICKS",
    "PUSH_TICKS",
    "SEARCH_RAD",
    "TICK_S",
    "TURN_RAD_S",
    "WHISK_RAD_S",
    "Behaviour",
    "State",
    "Whisk",
]


class Behaviour:
    """`decide` once per block, `moved` once per odometry report; `whisk` is the present body whisk or None.

    For the table's conditions and effects: `since` (tick at which the state began), `done` (commanded m or rad since),
    `goal` (of the same), `sign` of a turn, `stuck` (reports in a row of no motion), `heard` (tick of the last report),
    `bumps` (as last reported), `side` to turn away from, `caught` (side of a floor whisker that is held), `escapes` in a row,
    tick of the last (`escaped`), its changes of side (`flips`), and the tick at which it was over (`turned_away`).
    """

    def __init__(
        self,
        contacts: dict[int, Contact],
        first_turn: dict[int, float],
        rng: np.random.Generator,
        sides: dict[int, float] | None = None,
        wheels: Wheels = EXACT,
        habits: Habits = FULL,
        choices: Choices | None = None,
    ):
        """By lane of the object whiskers: `contacts`, `first_turn` (sign of the search's first rotation) and `sides` (+1 left
        of the robot, -1 right). `choices`: None: random ones, of `rng`."""
        self.contacts = contacts
        self.first_turn = first_turn
        self.rng = rng
        self.sides, self.wheels, self.habits = sides or {}, wheels, habits
        self.choices = choices or Random(rng)
        self.state = State.SETTLE
        self.drive = (0.0, 0.0)
        self.drive_since = 0  # first tick at which the wheels have the present drive's speeds
        self.whisk: Whisk | None = None
        self.since, self.done, self.goal, self.sign, self.stuck = 0, 0.0, 0.0, 1.0, 0
        self.reason = "start"  # why the state before was left
        self.heard, self.bumps, self.side, self.caught = -1, NO_BUMPS, 0.0, 0.0
        self.escapes, self.escaped, self.flips, self.turned_away = 0, -1, 0, -1
        self.whereabouts = Whereabouts()

    @property
    def whisking(self) -> bool:
        return self.state in WHISKING

    def decide(self, tick: int) -> tuple[float, float]:
        """Wheel speeds (m/s, rad/s) in answer to the block that ends at `tick`."""
        v, omega = self.drive
        self.done += (abs(v) + abs(omega)) * BLOCK_TICKS * TICK_S
        rule = next((r for r in RULES if r.source in (None, self.state) and r.condition(self, tick)), None)
        if rule:
            self._take(rule, tick)
        drive = SPEEDS[self.state](self)
        if drive != self.drive:
            self.drive_since = tick + self.wheels.steady_ticks(self.drive, drive)
            self.drive = drive
            self.stuck = 0
        return drive

    def aim(self, move: TipMove) -> None:
        """The contact just measured was the shaft's, and this move leads the tip to the object."""
        if self.whisk and self.whisk.tries < self.habits.tip_tries:
            self.whisk.tip_move = move

    def catch(self, side: float) -> None:
        """The floor holds the tip on this side (+1 left, -1 right)."""
        if self.state == State.FORWARD and self.habits.escapes:
            self.caught = side

    def moved(self, tick: int, dx: float, dy: float, dtheta: float, bumps: Bumps = NO_BUMPS) -> None:
        """Reported motion of the 0.1 s that end at `tick`, and bumps: finds out that something blocks the body."""
        self.heard, self.bumps = tick, bumps
        self.whereabouts.moved(tick, dx, dy, dtheta)
        v, omega = self.drive
        if tick - ODOMETRY_TICKS < self.drive_since or self.state in SLOW or not any(self.drive):
            return
        period = ODOMETRY_TICKS * TICK_S
        blocked = (
            math.hypot(dx, dy) < STUCK_SHARE * abs(v) * period if v else abs(dtheta) < STUCK_SHARE * abs(omega) * period
        )
        self.stuck = self.stuck + 1 if blocked else 0

    def _take(self, rule: Rule, tick: int) -> None:
        self.state, self.since, self.done, self.goal, self.stuck = rule.target, tick, 0.0, 0.0, 0
        self.reason = rule.reason
        self.caught = self.caught if rule.target == State.CLEAR else 0.0
        if rule.target not in WHISKING:
            self.whisk = None
        if rule.effect:
            rule.effect(self, tick)
