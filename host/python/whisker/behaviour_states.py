"""The behaviour's vocabulary: its states, the numbers it keeps to, one body whisk, and what the base can do and tells."""

import math
from dataclasses import dataclass
from enum import Enum

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
    other_side: bool = False  # the search has turned round
