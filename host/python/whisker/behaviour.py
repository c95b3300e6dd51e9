"""Random exploration with the paper's body whisk, as a plain state machine: contacts and odometry in, wheel speeds out.

    SETTLE -> FORWARD -> (random) TURN -> FORWARD
    FORWARD -> contact -> BACK_OFF -> WHISK_IN -> PUSH -> WHISK_OUT -> HOLD -> CLEAR -> TURN
    TURN -> contact, or no motion though commanded -> CLEAR -> TURN

A contact that begins in a turn is not whisked at: the tip then meets a face at a slant, and its bending would say
nothing about the distance.

It sees `Contact` objects and reported odometry only; it knows neither arena nor pose.
"""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from .contact import Contact

TICK_S = 500e-6
BLOCK_TICKS = 40
EFFECT_TICKS = 41  # an answer to the block ending at tick T moves the wheels from tick T + 41 on
ODOMETRY_TICKS = 200

EXPLORE_M_S = 0.15
TURN_RAD_S = 0.71  # the texture tips, 0.21 m from the centre, then sweep the floor as fast as when driving straight
WHISK_RAD_S = math.pi / 24  # the paper's body whisk
# Slow, so that the whisker is but a millimetre free when the release is noticed. A tip that has met a face stands near
# the face's closest point to the robot's centre, and turning brings it only so much nearer: from 5 mm it would miss.
BACK_OFF_M_S = 0.03
BACK_OFF_LIMIT_M = 0.12
PUSH_TICKS = 1200  # 0.6 s of push from the onset: 4.5 degrees
SEARCH_RAD = (math.radians(5.0), math.radians(11.0))  # to one side, then to the other
OUT_LIMIT_RAD = math.radians(25.0)
CLEAR_M = 0.08
STUCK_REPORTS = 3  # of 0.1 s
STUCK_SHARE = 0.25  # of the commanded motion


class State(Enum):
    SETTLE = "settle"
    FORWARD = "forward"
    TURN = "turn"
    BACK_OFF = "back off"
    WHISK_IN = "whisk in"
    PUSH = "push"
    WHISK_OUT = "whisk out"
    HOLD = "hold"
    CLEAR = "clear"


WHISKING = {State.BACK_OFF, State.WHISK_IN, State.PUSH, State.WHISK_OUT, State.HOLD}


@dataclass
class Whisk:
    """One body whisk. Ticks are -1 until known."""

    lane: int  # the whisker whose contact began it, and the only one that is measured
    direction: float  # sign of the push's rotation
    start: int = -1  # WHISK_IN began
    push_end: int = -1  # first tick that no longer pushes
    measured: bool = False


class Behaviour:
    """`decide` once per block, `moved` once per odometry report; `whisk` is the present body whisk or None."""

    def __init__(self, contacts: dict[int, Contact], first_turn: dict[int, float], rng: np.random.Generator):
        """`contacts` and `first_turn` (sign of the search's first rotation) by lane of the object whiskers."""
        self.contacts = contacts
        self.first_turn = first_turn
        self.rng = rng
        self.state = State.SETTLE
        self.drive = (0.0, 0.0)
        self.drive_since = 0  # first tick at which the present drive is in effect
        self.whisk: Whisk | None = None
        self._since = 0
        self._done = 0.0  # commanded distance (m) or angle (rad) since the state began
        self._goal = 0.0
        self._sign = 1.0
        self._stuck = 0
        self._searched_one_side = False

    @property
    def whisking(self) -> bool:
        return self.state in WHISKING

    def decide(self, tick: int) -> tuple[float, float]:
        """Wheel speeds (m/s, rad/s) in answer to the block that ends at `tick`."""
        v, omega = self.drive
        self._done += (abs(v) + abs(omega)) * BLOCK_TICKS * TICK_S
        getattr(self, f"_{self.state.name.lower()}")(tick)
        drive = self._speeds()
        if drive != self.drive:
            self.drive = drive
            self.drive_since = tick + EFFECT_TICKS
            self._stuck = 0
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
        self._stuck = self._stuck + 1 if blocked else 0

    def _speeds(self) -> tuple[float, float]:
        push = WHISK_RAD_S * self.whisk.direction if self.whisk else 0.0
        return {
            State.SETTLE: (0.0, 0.0),
            State.FORWARD: (EXPLORE_M_S, 0.0),
            State.TURN: (0.0, self._sign * TURN_RAD_S),
            State.BACK_OFF: (-BACK_OFF_M_S, 0.0),
            State.WHISK_IN: (0.0, push),
            State.PUSH: (0.0, push),
            State.WHISK_OUT: (0.0, -push),
            State.HOLD: (0.0, 0.0),
            State.CLEAR: (-EXPLORE_M_S, 0.0),
        }[self.state]

    # One method per state: look, and perhaps go on to another state.

    def _settle(self, tick: int) -> None:
        if all(contact.settled for contact in self.contacts.values()):
            self._go_forward(tick)

    def _forward(self, tick: int) -> None:
        touching = self._touching()
        if touching:
            self._go_back_off(tick, touching[0])
        elif self._stuck >= STUCK_REPORTS:
            self._enter(State.CLEAR, tick)
        elif self._done >= self._goal:
            self._go_turn(tick, 25.0, 90.0)

    def _turn(self, tick: int) -> None:
        if any(contact.touching and contact.onset > self._since for contact in self.contacts.values()):
            self._enter(State.CLEAR, tick)
        elif self._done >= self._goal or self._stuck >= STUCK_REPORTS:
            self._go_forward(tick)

    def _back_off(self, tick: int) -> None:
        if self._done >= BACK_OFF_LIMIT_M or self._stuck >= STUCK_REPORTS:
            self._enter(State.CLEAR, tick)
        elif not self.contacts[self.whisk.lane].touching:
            self.whisk.start = tick
            self._enter(State.WHISK_IN, tick)

    def _whisk_in(self, tick: int) -> None:
        if self.contacts[self.whisk.lane].touching:
            self._enter(State.PUSH, tick)
        elif self._searched_one_side and self._done >= SEARCH_RAD[1]:
            self._enter(State.CLEAR, tick)
        elif not self._searched_one_side and self._done >= SEARCH_RAD[0]:
            self._searched_one_side = True
            self._done = 0.0
            self.whisk.direction = -self.whisk.direction

    def _push(self, tick: int) -> None:
        contact = self.contacts[self.whisk.lane]
        if tick >= contact.onset + PUSH_TICKS or not contact.touching:
            self.whisk.push_end = tick + EFFECT_TICKS
            self._enter(State.WHISK_OUT, tick)

    def _whisk_out(self, tick: int) -> None:
        if not self.contacts[self.whisk.lane].touching or self._done >= OUT_LIMIT_RAD:
            self._enter(State.HOLD, tick)

    def _hold(self, tick: int) -> None:
        # The odometry row that holds the release closes within 0.1 s; until then the robot keeps the release's pose.
        if tick - self._since >= ODOMETRY_TICKS:
            self._enter(State.CLEAR, tick)

    def _clear(self, tick: int) -> None:
        if self._done >= CLEAR_M or self._stuck >= STUCK_REPORTS:
            self._go_turn(tick, 60.0, 150.0)

    # Transitions.

    def _go_forward(self, tick: int) -> None:
        self._enter(State.FORWARD, tick)
        self._goal = EXPLORE_M_S * self.rng.uniform(3.0, 8.0)

    def _go_turn(self, tick: int, least_deg: float, most_deg: float) -> None:
        self._enter(State.TURN, tick)
        self._goal = math.radians(self.rng.uniform(least_deg, most_deg))
        self._sign = 1.0 if self.rng.random() < 0.5 else -1.0

    def _go_back_off(self, tick: int, lane: int) -> None:
        self._enter(State.BACK_OFF, tick)
        self.whisk = Whisk(lane, self.first_turn[lane])
        self._searched_one_side = False

    def _enter(self, state: State, tick: int) -> None:
        self.state, self._since, self._done, self._goal, self._stuck = state, tick, 0.0, 0.0, 0
        if state not in WHISKING:
            self.whisk = None

    def _touching(self) -> list[int]:
        """Lanes in contact, the earliest onset first."""
        return sorted((n for n, c in self.contacts.items() if c.touching), key=lambda n: self.contacts[n].onset)
