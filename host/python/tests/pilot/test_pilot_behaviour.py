"""The behaviour's states, driven by contacts and odometry made up here; the plain behaviour, without what test_pilot_rules.py tests."""

import math

import numpy as np
import pytest

from crunchbot.pilot.behaviour import (
    BLOCK_TICKS,
    EFFECT_TICKS,
    EXPLORE_M_S,
    ODOMETRY_TICKS,
    PUSH_TICKS,
    SEARCH_RAD,
    WHISK_RAD_S,
    Behaviour,
    State,
)
from crunchbot.pilot.states import PLAIN

LEFT, RIGHT = 2, 3


class MadeUpContact:
    def __init__(self):
        self.settled, self.touching, self.onset, self.release = True, False, -1, -1

    def touch(self, tick):
        self.touching, self.onset = True, tick

    def let_go(self, tick):
        self.touching, self.release = False, tick


class Bench:
    """A behaviour and the tick it is asked at."""

    def __init__(self, seed=1, habits=PLAIN, **options):
        self.contacts = {LEFT: MadeUpContact(), RIGHT: MadeUpContact()}
        self.behaviour = Behaviour(
            self.contacts,
            {LEFT: 1.0, RIGHT: -1.0},
            np.random.default_rng(seed),
            {LEFT: 1.0, RIGHT: -1.0},
            habits=habits,
            **options,
        )
        self.tick = -1

    def block(self):
        self.tick += BLOCK_TICKS
        return self.behaviour.decide(self.tick)

    def until(self, state, most=2000):
        for _ in range(most):
            drive = self.block()
            if self.behaviour.state == state:
                return drive
        pytest.fail(f"never reached {state}, still in {self.behaviour.state}")

    def touch(self, lane):
        self.contacts[lane].touch(self.tick)

    def let_go(self, lane):
        self.contacts[lane].let_go(self.tick)


@pytest.fixture
def bench():
    made = Bench()
    made.until(State.FORWARD)
    return made


def in_contact(bench):
    bench.touch(LEFT)
    bench.until(State.BACK_OFF)
    bench.let_go(LEFT)
    bench.until(State.WHISK_IN)


def test_stands_still_until_every_rest_is_known():
    bench = Bench()
    bench.contacts[RIGHT].settled = False
    assert [bench.block() for _ in range(20)] == [(0.0, 0.0)] * 20
    bench.contacts[RIGHT].settled = True
    assert bench.until(State.FORWARD) == (EXPLORE_M_S, 0.0)


def test_explores_forward_and_turns_at_random(bench):
    v, omega = bench.until(State.TURN)
    assert v == 0.0 and omega != 0.0
    assert bench.until(State.FORWARD) == (EXPLORE_M_S, 0.0)


def test_contact_backs_off_until_released_then_whisks_to_the_side_of_a_corner(bench):
    bench.touch(LEFT)
    assert bench.block()[0] < 0.0 and bench.behaviour.state == State.BACK_OFF
    assert bench.block()[0] < 0.0
    bench.let_go(LEFT)
    assert bench.block() == (0.0, WHISK_RAD_S)
    assert bench.behaviour.whisk.lane == LEFT


def test_push_lasts_as_long_from_the_onset_wherever_in_a_block_it_came(bench):
    ends = []
    for late in (0, 7, 31):
        bench.until(State.FORWARD)
        in_contact(bench)
        onset = bench.tick - late
        bench.contacts[LEFT].touch(onset)
        bench.until(State.PUSH)
        bench.until(State.WHISK_OUT)
        ends.append(bench.behaviour.whisk.push_end - onset)
        bench.let_go(LEFT)
        bench.until(State.CLEAR)
    assert all(PUSH_TICKS <= end <= PUSH_TICKS + BLOCK_TICKS + EFFECT_TICKS for end in ends)


def test_whisk_turns_back_until_released_and_holds_for_its_odometry(bench):
    in_contact(bench)
    bench.touch(LEFT)
    bench.until(State.PUSH)
    assert bench.until(State.WHISK_OUT) == (0.0, -WHISK_RAD_S)
    assert bench.block() == (0.0, -WHISK_RAD_S)
    bench.let_go(LEFT)
    assert bench.block() == (0.0, 0.0) and bench.behaviour.state == State.HOLD
    held = bench.tick
    assert bench.until(State.CLEAR)[0] < 0.0
    assert bench.tick - held >= ODOMETRY_TICKS
    assert bench.until(State.TURN)[1] != 0.0


def test_search_turns_to_one_side_then_the_other_then_gives_up(bench):
    in_contact(bench)
    seen = []
    while bench.behaviour.state == State.WHISK_IN:
        seen.append(bench.behaviour.drive[1])
        bench.block()
    turned = np.array(seen) * BLOCK_TICKS * 500e-6
    assert turned[turned > 0].sum() == pytest.approx(SEARCH_RAD[0], abs=0.006)
    assert -turned[turned < 0].sum() == pytest.approx(SEARCH_RAD[1], abs=0.006)
    assert bench.behaviour.state == State.CLEAR and bench.behaviour.whisk is None


def test_contact_in_a_turn_is_not_whisked_at(bench):
    bench.until(State.TURN)
    bench.block()
    bench.touch(LEFT)
    bench.block()
    assert bench.behaviour.state == State.CLEAR


@pytest.mark.parametrize(("moved", "stuck"), [(0.0, True), (0.1 * EXPLORE_M_S, False)])
def test_bump_is_seen_in_odometry_alone(bench, moved, stuck):
    for block in range(1, 26):
        bench.block()
        if block % 5 == 0:
            bench.behaviour.moved(bench.tick, moved, 0.0, 0.0)
    assert (bench.behaviour.state == State.CLEAR) == stuck


def test_same_seed_same_turns():
    def turns(seed):
        bench = Bench(seed)
        return [(bench.until(State.TURN), bench.tick) for _ in range(4)]

    assert turns(5) == turns(5)
    assert turns(5) != turns(6)


def test_drive_changes_are_dated_to_their_effect(bench):
    bench.touch(LEFT)
    bench.block()
    assert bench.behaviour.drive_since == bench.tick + EFFECT_TICKS


def test_search_angles_fit_the_papers_whisk():
    assert math.pi / 24 == WHISK_RAD_S and sum(SEARCH_RAD) < math.radians(30)
