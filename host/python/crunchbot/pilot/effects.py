"""What happens as a rule of the behaviour is taken: short functions of (behaviour, tick)."""

import math

from .conditions import touching
from .states import (
    AROUND_M,
    AWAY_SPREAD,
    BACK_OFF_LIMIT_M,
    CLEAR_M,
    CROWD_TICKS,
    ESCAPE_M,
    ESCAPE_MOST_M,
    TIP_SLACK_RAD,
    Whisk,
)
from .whereabouts import ASIDE_RAD, BEHIND_RAD


def draw_distance(b, tick: int) -> None:
    b.goal = b.choices.distance(b, tick)


def go_on(b, tick: int) -> None:
    b.goal = b.choices.on(b, tick)


def draw_turn(b, tick: int, least_deg: float, most_deg: float) -> None:
    turn = b.choices.turn(b, tick, least_deg, most_deg)
    b.goal, b.sign = abs(turn), math.copysign(1.0, turn) if turn else 0.0


def draw_small_turn(b, tick: int) -> None:
    draw_turn(b, tick, 25.0, 90.0)


def draw_large_turn(b, tick: int) -> None:
    """To any side, but away from what is known to be on one."""
    draw_turn(b, tick, 60.0, 150.0)
    b.sign, b.side = -b.side * abs(b.sign) or b.sign, 0.0


def draw_turn_away(b, tick: int) -> None:
    """To about the middle of where nothing was met around here."""
    turn, width = b.whereabouts.gap(AROUND_M)
    turn += width * b.rng.uniform(-AWAY_SPREAD, AWAY_SPREAD)
    b.goal, b.sign = abs(turn), math.copysign(1.0, turn)


def begin_whisk(b, tick: int) -> None:
    """The whisker that touched first is whisked with."""
    meet_touch(b, tick)
    lane = touching(b)[0]
    b.whisk = Whisk(lane, b.first_turn[lane])
    b.goal = BACK_OFF_LIMIT_M


def begin_search(b, tick: int) -> None:
    b.whisk.start = tick


def search_other_side(b, tick: int) -> None:
    whisk = b.whisk
    whisk.search_rad, whisk.other_rad, whisk.direction = whisk.other_rad, None, -whisk.direction


def end_push(b, tick: int) -> None:
    b.whisk.push_end = tick + b.wheels.effect_ticks


def go_for_the_tip(b, tick: int) -> None:
    move = b.whisk.tip_move
    reach = abs(move.turn_rad) + TIP_SLACK_RAD
    b.whisk = Whisk(b.whisk.lane, math.copysign(1.0, move.turn_rad), reach, None, b.whisk.tries + 1)
    b.goal = move.retreat_m


def go_clear(b, tick: int) -> None:
    b.goal = CLEAR_M


def clear_of_touch(b, tick: int) -> None:
    meet_touch(b, tick)
    go_clear(b, tick)


def clear_of_block(b, tick: int) -> None:
    b.whereabouts.meet(tick, 0.0)
    go_clear(b, tick)


def clear_of_bump(b, tick: int) -> None:
    meet_bump(b, tick)
    b.side = b.bumps.side
    go_clear(b, tick)


def clear_of_catch(b, tick: int) -> None:
    b.side, b.caught = b.caught, 0.0
    go_clear(b, tick)


def meet_touch(b, tick: int) -> None:
    b.whereabouts.meet(tick, ASIDE_RAD * b.sides.get(touching(b)[0], 0.0))


def meet_bump(b, tick: int) -> None:
    b.whereabouts.meet(tick, ASIDE_RAD * b.bumps.side)


def escape(b, tick: int) -> None:
    """Further back the more often in a row; and where the last one led, straight ahead, is no way out."""
    again = tick - b.escaped < CROWD_TICKS and b.escaped >= 0
    if again:
        b.whereabouts.meet(tick, 0.0)
    b.escapes, b.escaped, b.flips = b.escapes + 1 if again else 1, tick, 0
    b.goal = min(ESCAPE_M * b.escapes, ESCAPE_MOST_M)


def escape_touch(b, tick: int) -> None:
    meet_touch(b, tick)
    escape(b, tick)


def escape_block(b, tick: int) -> None:
    b.whereabouts.meet(tick, 0.0)
    escape(b, tick)


def escape_bump(b, tick: int) -> None:
    meet_bump(b, tick)
    escape(b, tick)


def blocked_behind(b, tick: int) -> None:
    b.whereabouts.meet(tick, BEHIND_RAD)


def turn_away_blocked_behind(b, tick: int) -> None:
    blocked_behind(b, tick)
    draw_turn_away(b, tick)


def leave(b, tick: int) -> None:
    b.turned_away = tick
    draw_distance(b, tick)


def turn_round(b, tick: int) -> None:
    meet_touch(b, tick)
    b.flips += 1
    b.goal = CLEAR_M
