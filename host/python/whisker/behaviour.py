"""Random exploration with the paper's body whisk, as a plain state machine: contacts and odometry in, wheel speeds out.

What leads from which state to which is a table (`behaviour_rules.RULES`), drawn in docs/behaviour.md.

A contact that begins in a turn is not whisked at: the tip then meets a face at a slant, and its bending would say
nothing about the distance.

It sees `Contact` objects and reported odometry only; it knows neither arena nor pose.
"""

import math

import numpy as np

from .behaviour_rules import RULES, SPEEDS, Rule
from .behaviour_states import (
    BACK_OFF_M_S,
    BLOCK_TICKS,
    EFFECT_TICKS,
    EXPLORE_M_S,
    ODOMETRY_TICKS,
    PUSH_TICKS,
    SEARCH_RAD,
    STUCK_SHARE,
    TICK_S,
    TURN_RAD_S,
    WHISK_RAD_S,
    WHISKING,
    State,
    Whisk,
)
from .contact import Contact

__all__ = [
    "BACK_OFF_M_S",
    "BLOCK_TICKS",
    "EFFECT_TICKS",
    "EXPLORE_M_S",
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
    `goal` (of the same), `sign` of a turn, `stuck` (reports in a row of no motion).
    """

    def __init__(self, contacts: dict[int, Contact], first_turn: dict[int, float], rng: np.random.Generator):
        """`contacts` and `first_turn` (sign of the search's first rotation) by lane of the object whiskers."""
        self.contacts = contacts
        self.first_turn = first_turn
        self.rng = rng
        self.state = State.SETTLE
        self.drive = (0.0, 0.0)
        self.drive_since = 0  # first tick at which the present drive is in effect
        self.whisk: Whisk | None = None
        self.since, self.done, self.goal, self.sign, self.stuck = 0, 0.0, 0.0, 1.0, 0

    @property
    def whisking(self) -> bool:
        return self.state in WHISKING

    def decide(self, tick: int) -> tuple[float, float]:
        """Wheel speeds (m/s, rad/s) in answer to the block that ends at `tick`."""
        v, omega = self.drive
        self.done += (abs(v) + abs(omega)) * BLOCK_TICKS * TICK_S
        rule = next((r for r in RULES if r.source == self.state and r.condition(self, tick)), None)
        if rule:
            self._take(rule, tick)
        drive = SPEEDS[self.state](self)
        if drive != self.drive:
            self.drive = drive
            self.drive_since = tick + EFFECT_TICKS
            self.stuck = 0
        return drive

    def moved(self, tick: int, dx: float, dy: float, dtheta: float) -> None:
        """Reported motion of the 0.1 s that end at `tick`: finds out that something blocks the body."""
        v, omega = self.drive
        if tick - ODOMETRY_TICKS < self.drive_since or abs(v) + abs(omega) < 0.06:
            return
        period = ODOMETRY_TICKS * TICK_S
        blocked = (
            math.hypot(dx, dy) < STUCK_SHARE * abs(v) * period if v else abs(dtheta) < STUCK_SHARE * abs(omega) * period
        )
        self.stuck = self.stuck + 1 if blocked else 0

    def _take(self, rule: Rule, tick: int) -> None:
        self.state, self.since, self.done, self.goal, self.stuck = rule.target, tick, 0.0, 0.0, 0
        if rule.target not in WHISKING:
            self.whisk = None
        if rule.effect:
            rule.effect(self, tick)
