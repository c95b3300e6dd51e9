"""Conditions of the behaviour's rules: short functions of (behaviour, tick). Their names are what the diagram says."""

from .states import (
    CROWD,
    CROWD_M,
    CROWD_TICKS,
    FLIPS,
    HALT_TICKS,
    LINGER_TICKS,
    LOST_TICKS,
    ODOMETRY_TICKS,
    OUT_LIMIT_RAD,
    STUCK_REPORTS,
    TIP_PATIENCE_TICKS,
    WAIT_TICKS,
    State,
)


def touching(b) -> list[int]:
    """Lanes in contact, the earliest onset first; without contacts that were there when the robot had turned away."""
    lanes = (n for n, c in b.contacts.items() if c.touching and c.onset > b.turned_away)
    return sorted(lanes, key=lambda n: b.contacts[n].onset)


def rests_known(b, tick: int) -> bool:
    return all(contact.settled for contact in b.contacts.values())


def touched(b, tick: int) -> bool:
    return bool(touching(b))


def touched_and_worth_a_whisk(b, tick: int) -> bool:
    return touched(b, tick) and b.choices.whisk(b, tick)


def no_turn_is_worth_it(b, tick: int) -> bool:
    return b.sign == 0.0


def waited(b, tick: int) -> bool:
    return tick - b.since >= WAIT_TICKS


def touched_since(b, tick: int) -> bool:
    return any(contact.touching and contact.onset > b.since for contact in b.contacts.values())


def touched_again_here(b, tick: int) -> bool:
    return touched(b, tick) and crowded(b, tick)


def touched_since_again_here(b, tick: int) -> bool:
    return touched_since(b, tick) and crowded(b, tick)


def touched_and_may_turn_round(b, tick: int) -> bool:
    """In the first escape from a place; in later ones the whiskers bend and the robot turns on."""
    return touched_since(b, tick) and b.flips < FLIPS and b.escapes == 1


def crowded(b, tick: int) -> bool:
    """Whether the robot has met something here before, too often or for too long."""
    if not b.habits.escapes or b.choices.remembers:
        return False
    here = len(b.whereabouts.encounters(tick - CROWD_TICKS, CROWD_M))
    return here >= CROWD or (here > 0 and lingering(b, tick))


def lingering(b, tick: int) -> bool:
    return b.whereabouts.lingered(tick, CROWD_M) >= LINGER_TICKS


def stuck(b, tick: int) -> bool:
    return b.stuck >= STUCK_REPORTS


def stuck_again_here(b, tick: int) -> bool:
    return stuck(b, tick) and crowded(b, tick)


def floor_whisker_caught(b, tick: int) -> bool:
    return b.caught != 0.0


def wheels_dropped_or_base_lost(b, tick: int) -> bool:
    return b.state != State.STOPPED and adrift(b, tick)


def wheels_down_and_base_heard(b, tick: int) -> bool:
    return not adrift(b, tick)


def adrift(b, tick: int) -> bool:
    return b.bumps.adrift or (b.heard >= 0 and tick - b.heard > LOST_TICKS)


def cliff(b, tick: int) -> bool:
    return b.bumps.cliff and b.state not in (State.HALT, State.ESCAPE, State.STOPPED)


def bumped(b, tick: int) -> bool:
    return b.bumps.bumped and b.state not in (State.CLEAR, State.HALT, State.ESCAPE, State.STOPPED)


def bumped_again_here(b, tick: int) -> bool:
    return bumped(b, tick) and crowded(b, tick)


def halted(b, tick: int) -> bool:
    return tick - b.since >= HALT_TICKS


def far_enough(b, tick: int) -> bool:
    return b.done >= b.goal


def far_enough_and_on_it_goes(b, tick: int) -> bool:
    return far_enough(b, tick) and b.choices.on(b, tick) > 0.0


def far_enough_or_stuck(b, tick: int) -> bool:
    return far_enough(b, tick) or stuck(b, tick)


def whisker_free(b, tick: int) -> bool:
    return not b.contacts[b.whisk.lane].touching


def whisker_touches(b, tick: int) -> bool:
    return b.contacts[b.whisk.lane].touching


def nothing_found(b, tick: int) -> bool:
    return b.whisk.other_rad is None and b.done >= b.whisk.search_rad


def nothing_on_this_side(b, tick: int) -> bool:
    return b.whisk.other_rad is not None and b.done >= b.whisk.search_rad


def pushed_or_let_go(b, tick: int) -> bool:
    contact = b.contacts[b.whisk.lane]
    return tick >= contact.onset + b.wheels.push_ticks or not contact.touching


def let_go_or_too_far(b, tick: int) -> bool:
    return not b.contacts[b.whisk.lane].touching or b.done >= OUT_LIMIT_RAD


def odometry_reported(b, tick: int) -> bool:
    """The odometry row that holds the release closes within 0.1 s; until then the robot keeps the release's pose."""
    return tick - b.since >= ODOMETRY_TICKS


def odometry_reported_of_a_shaft_contact(b, tick: int) -> bool:
    return odometry_reported(b, tick) and b.whisk.tip_move is not None and patient(b, tick)


def patient(b, tick: int) -> bool:
    return b.whereabouts.lingered(tick, CROWD_M) < TIP_PATIENCE_TICKS
