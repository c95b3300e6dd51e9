"""The behaviour as a table: in which state, on what condition, what happens and which state begins; and each state's speeds.

A condition's name, underscores aside, is what the picture in docs/methods/behaviour.md says of its arrow. The first rule that holds is taken, one per block; rules of any state stand first.
"""

from collections.abc import Callable
from dataclasses import dataclass

from . import conditions as when
from . import effects as then
from .states import State


@dataclass(frozen=True)
class Rule:
    """In `source` (None: in any state), once `condition` holds, `target` begins and then `effect` happens."""

    source: State | None
    condition: Callable[..., bool]
    target: State
    effect: Callable[..., None] | None = None

    @property
    def reason(self) -> str:
        """The condition in words."""
        return self.condition.__name__.replace("_", " ")


S = State
RULES = (
    Rule(None, when.wheels_dropped_or_base_lost, S.STOPPED),
    Rule(None, when.cliff, S.HALT, then.meet_bump),
    Rule(None, when.bumped_again_here, S.ESCAPE, then.escape_bump),
    Rule(None, when.bumped, S.CLEAR, then.clear_of_bump),
    Rule(S.SETTLE, when.rests_known, S.FORWARD, then.draw_distance),
    Rule(S.FORWARD, when.touched_again_here, S.ESCAPE, then.escape_touch),
    Rule(S.FORWARD, when.touched_and_worth_a_whisk, S.BACK_OFF, then.begin_whisk),
    Rule(S.FORWARD, when.touched, S.CLEAR, then.clear_of_touch),
    Rule(S.FORWARD, when.stuck_again_here, S.ESCAPE, then.escape_block),
    Rule(S.FORWARD, when.stuck, S.CLEAR, then.clear_of_block),
    Rule(S.FORWARD, when.floor_whisker_caught, S.CLEAR, then.clear_of_catch),
    Rule(S.FORWARD, when.far_enough_and_on_it_goes, S.FORWARD, then.go_on),
    Rule(S.FORWARD, when.far_enough, S.TURN, then.draw_small_turn),
    Rule(S.TURN, when.no_turn_is_worth_it, S.WAIT),
    Rule(S.TURN, when.touched_since_again_here, S.ESCAPE, then.escape_touch),
    Rule(S.TURN, when.touched_since, S.CLEAR, then.clear_of_touch),
    Rule(S.TURN, when.far_enough_or_stuck, S.FORWARD, then.draw_distance),
    Rule(S.WAIT, when.waited, S.TURN, then.draw_small_turn),
    Rule(S.BACK_OFF, when.far_enough_or_stuck, S.CLEAR, then.go_clear),
    Rule(S.BACK_OFF, when.whisker_free, S.WHISK_IN, then.begin_search),
    Rule(S.WHISK_IN, when.whisker_touches, S.PUSH),
    Rule(S.WHISK_IN, when.nothing_found, S.CLEAR, then.go_clear),
    Rule(S.WHISK_IN, when.nothing_on_this_side, S.WHISK_IN, then.search_other_side),
    Rule(S.PUSH, when.pushed_or_let_go, S.WHISK_OUT, then.end_push),
    Rule(S.WHISK_OUT, when.let_go_or_too_far, S.HOLD),
    Rule(S.HOLD, when.odometry_reported_of_a_shaft_contact, S.RETREAT, then.go_for_the_tip),
    Rule(S.HOLD, when.odometry_reported, S.CLEAR, then.go_clear),
    Rule(S.RETREAT, when.far_enough, S.WHISK_IN, then.begin_search),
    Rule(S.CLEAR, when.far_enough_or_stuck, S.TURN, then.draw_large_turn),
    Rule(S.ESCAPE, when.stuck, S.TURN_AWAY, then.turn_away_blocked_behind),
    Rule(S.ESCAPE, when.far_enough, S.TURN_AWAY, then.draw_turn_away),
    Rule(S.TURN_AWAY, when.touched_and_may_turn_round, S.ESCAPE, then.turn_round),
    Rule(S.TURN_AWAY, when.far_enough_or_stuck, S.FORWARD, then.leave),
    Rule(S.HALT, when.halted, S.ESCAPE, then.escape),
    Rule(S.STOPPED, when.wheels_down_and_base_heard, S.SETTLE),
)

STILL = (0.0, 0.0)
# Metres and radians per second: forward, anticlockwise.
SPEEDS = {
    S.SETTLE: lambda b: STILL,
    S.FORWARD: lambda b: (b.wheels.explore_m_s, 0.0),
    S.TURN: lambda b: (0.0, b.sign * b.wheels.turn_rad_s),
    S.WAIT: lambda b: STILL,
    S.BACK_OFF: lambda b: (-b.wheels.back_off_m_s, 0.0),
    S.WHISK_IN: lambda b: (0.0, b.wheels.whisk_rad_s * b.whisk.direction),
    S.PUSH: lambda b: (0.0, b.wheels.whisk_rad_s * b.whisk.direction),
    S.WHISK_OUT: lambda b: (0.0, -b.wheels.whisk_rad_s * b.whisk.direction),
    S.HOLD: lambda b: STILL,
    S.RETREAT: lambda b: (-b.wheels.back_off_m_s, 0.0),
    S.CLEAR: lambda b: (-b.wheels.explore_m_s, 0.0),
    S.ESCAPE: lambda b: (-b.wheels.explore_m_s, 0.0),
    S.TURN_AWAY: lambda b: (0.0, b.sign * b.wheels.turn_rad_s),
    S.HALT: lambda b: STILL,
    S.STOPPED: lambda b: STILL,
}
