"""The behaviour as a table: in which state, on what condition, what happens and which state begins; and each state's speeds.

Conditions and effects are short functions of (behaviour, tick); a condition's name, underscores aside, is what the diagram
in docs/behaviour.md says beside its arrow (tools/behaviour_diagram.py draws it from `RULES`). The first rule of a state
that holds is taken, one per block.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from .behaviour_states import (
    BACK_OFF_LIMIT_M,
    BACK_OFF_M_S,
    CLEAR_M,
    EFFECT_TICKS,
    EXPLORE_M_S,
    ODOMETRY_TICKS,
    OUT_LIMIT_RAD,
    PUSH_TICKS,
    SEARCH_RAD,
    STUCK_REPORTS,
    TURN_RAD_S,
    WHISK_RAD_S,
    State,
    Whisk,
)


@dataclass(frozen=True)
class Rule:
    """In `source`, once `condition` holds, `target` begins and then `effect` happens."""

    source: State
    condition: Callable[..., bool]
    target: State
    effect: Callable[..., None] | None = None

    @property
    def reason(self) -> str:
        """The condition in words."""
        return self.condition.__name__.replace("_", " ")


# Conditions.


def rests_known(b, tick: int) -> bool:
    return all(contact.settled for contact in b.contacts.values())


def touched(b, tick: int) -> bool:
    return any(contact.touching for contact in b.contacts.values())


def touched_since(b, tick: int) -> bool:
    return any(contact.touching and contact.onset > b.since for contact in b.contacts.values())


def stuck(b, tick: int) -> bool:
    return b.stuck >= STUCK_REPORTS


def far_enough(b, tick: int) -> bool:
    return b.done >= b.goal


def far_enough_or_stuck(b, tick: int) -> bool:
    return far_enough(b, tick) or stuck(b, tick)


def whisker_free(b, tick: int) -> bool:
    return not b.contacts[b.whisk.lane].touching


def whisker_touches(b, tick: int) -> bool:
    return b.contacts[b.whisk.lane].touching


def nothing_on_either_side(b, tick: int) -> bool:
    return b.whisk.other_side and b.done >= SEARCH_RAD[1]


def nothing_on_this_side(b, tick: int) -> bool:
    return not b.whisk.other_side and b.done >= SEARCH_RAD[0]


def pushed_or_let_go(b, tick: int) -> bool:
    contact = b.contacts[b.whisk.lane]
    return tick >= contact.onset + PUSH_TICKS or not contact.touching


def let_go_or_too_far(b, tick: int) -> bool:
    return not b.contacts[b.whisk.lane].touching or b.done >= OUT_LIMIT_RAD


def odometry_reported(b, tick: int) -> bool:
    """The odometry row that holds the release closes within 0.1 s; until then the robot keeps the release's pose."""
    return tick - b.since >= ODOMETRY_TICKS


# Effects.


def draw_distance(b, tick: int) -> None:
    b.goal = EXPLORE_M_S * b.rng.uniform(3.0, 8.0)


def draw_turn(b, least_deg: float, most_deg: float) -> None:
    b.goal = math.radians(b.rng.uniform(least_deg, most_deg))
    b.sign = 1.0 if b.rng.random() < 0.5 else -1.0


def draw_small_turn(b, tick: int) -> None:
    draw_turn(b, 25.0, 90.0)


def draw_large_turn(b, tick: int) -> None:
    draw_turn(b, 60.0, 150.0)


def begin_whisk(b, tick: int) -> None:
    """The whisker that touched first is whisked with."""
    lane = min((n for n, c in b.contacts.items() if c.touching), key=lambda n: b.contacts[n].onset)
    b.whisk = Whisk(lane, b.first_turn[lane])
    b.goal = BACK_OFF_LIMIT_M


def begin_search(b, tick: int) -> None:
    b.whisk.start = tick


def search_other_side(b, tick: int) -> None:
    b.whisk.other_side, b.whisk.direction = True, -b.whisk.direction


def end_push(b, tick: int) -> None:
    b.whisk.push_end = tick + EFFECT_TICKS


def go_clear(b, tick: int) -> None:
    b.goal = CLEAR_M


S = State
RULES = (
    Rule(S.SETTLE, rests_known, S.FORWARD, draw_distance),
    Rule(S.FORWARD, touched, S.BACK_OFF, begin_whisk),
    Rule(S.FORWARD, stuck, S.CLEAR, go_clear),
    Rule(S.FORWARD, far_enough, S.TURN, draw_small_turn),
    Rule(S.TURN, touched_since, S.CLEAR, go_clear),
    Rule(S.TURN, far_enough_or_stuck, S.FORWARD, draw_distance),
    Rule(S.BACK_OFF, far_enough_or_stuck, S.CLEAR, go_clear),
    Rule(S.BACK_OFF, whisker_free, S.WHISK_IN, begin_search),
    Rule(S.WHISK_IN, whisker_touches, S.PUSH),
    Rule(S.WHISK_IN, nothing_on_either_side, S.CLEAR, go_clear),
    Rule(S.WHISK_IN, nothing_on_this_side, S.WHISK_IN, search_other_side),
    Rule(S.PUSH, pushed_or_let_go, S.WHISK_OUT, end_push),
    Rule(S.WHISK_OUT, let_go_or_too_far, S.HOLD),
    Rule(S.HOLD, odometry_reported, S.CLEAR, go_clear),
    Rule(S.CLEAR, far_enough_or_stuck, S.TURN, draw_large_turn),
)

# Metres and radians per second: forward, anticlockwise.
SPEEDS = {
    S.SETTLE: lambda b: (0.0, 0.0),
    S.FORWARD: lambda b: (EXPLORE_M_S, 0.0),
    S.TURN: lambda b: (0.0, b.sign * TURN_RAD_S),
    S.BACK_OFF: lambda b: (-BACK_OFF_M_S, 0.0),
    S.WHISK_IN: lambda b: (0.0, WHISK_RAD_S * b.whisk.direction),
    S.PUSH: lambda b: (0.0, WHISK_RAD_S * b.whisk.direction),
    S.WHISK_OUT: lambda b: (0.0, -WHISK_RAD_S * b.whisk.direction),
    S.HOLD: lambda b: (0.0, 0.0),
    S.CLEAR: lambda b: (-EXPLORE_M_S, 0.0),
}
