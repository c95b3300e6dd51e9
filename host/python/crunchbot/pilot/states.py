"""The behaviour's vocabulary: its states, the numbers it keeps to, one body whisk, and what the base can do and reports."""

import math
from dataclasses import dataclass
from enum import Enum

TICK_S = 500e-6
BLOCK_TICKS = 40
EFFECT_TICKS = 41  # an answer to the block ending at tick T moves the wheels from tick T + 41 on
ODOMETRY_TICKS = 200

# What a pilot wants; a base that cannot is slower (wheels.Wheels).
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
LOST_TICKS = 1000  # without an odometry report for 0.5 s the base is lost
HALT_TICKS = 200
WAIT_TICKS = 2000  # before it is asked again whether anything is worth doing
# The same place: a body's radius or so. Contacts so near each other so soon are one trap, not two finds.
CROWD_M = 0.3
CROWD_TICKS = 30_000
CROWD = 2  # earlier encounters here, or one and LINGER_TICKS in this place
LINGER_TICKS = 12_000  # 6 s: a body whisk and its way out take about so long
ESCAPE_M = 0.25
ESCAPE_MOST_M = 0.5
AROUND_M = 0.6
AWAY_SPREAD = 0.1  # of the free range's width, to either side of its middle
FLIPS = 1  # changes of the turn's side in one escape
TIP_PATIENCE_TICKS = 20_000  # in this place for so long: no further whisk for the tip
TIP_SLACK_RAD = math.radians(3.0)  # beyond the angle at which the tip should have met the object


class State(Enum):
    SETTLE = "settle"
    FORWARD = "forward"
    TURN = "turn"
    WAIT = "wait"
    BACK_OFF = "back off"
    WHISK_IN = "whisk in"
    PUSH = "push"
    WHISK_OUT = "whisk out"
    HOLD = "hold"
    RETREAT = "retreat for the tip"
    CLEAR = "clear"
    ESCAPE = "escape"
    TURN_AWAY = "turn away"
    HALT = "halt"
    STOPPED = "stopped"


WHISKING = {State.BACK_OFF, State.WHISK_IN, State.PUSH, State.WHISK_OUT, State.HOLD, State.RETREAT}

SLOW = {State.BACK_OFF, State.RETREAT}  # so slow that reports of 0.1 s do not tell whether something blocks


@dataclass(frozen=True)
class Habits:
    """What the behaviour does beyond exploring and whisking."""

    tip_tries: int = 2  # whisks that may follow a contact with the shaft, to meet the object with the tip
    escapes: bool = True  # from places where it meets something again and again


FULL, PLAIN = Habits(), Habits(tip_tries=0, escapes=False)


@dataclass(frozen=True)
class TipMove:
    """Back off by `retreat_m`, then turn by `turn_rad` (positive anticlockwise), and the tip touches."""

    retreat_m: float
    turn_rad: float


@dataclass
class Whisk:
    """One body whisk. Ticks are -1 until known."""

    lane: int  # the whisker whose contact began it, and the only one that is measured
    direction: float  # sign of the push's rotation
    search_rad: float = SEARCH_RAD[0]  # to this side ...
    other_rad: float | None = SEARCH_RAD[1]  # ... and then to the other; None: no more
    tries: int = 0  # whisks before this one at the same object, for the tip
    start: int = -1  # WHISK_IN began
    push_end: int = -1  # first tick that no longer pushes
    measured: bool = False
    tip_move: TipMove | None = None  # set once it is known to have been the shaft that touched
