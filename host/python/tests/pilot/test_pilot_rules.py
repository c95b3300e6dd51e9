"""The behaviour's table: every rule once; the tip, escapes and what the base feels, by scripted contacts; the picture."""

import math
import re
from pathlib import Path
from xml.sax.saxutils import unescape

import numpy as np
import pytest
from test_pilot_behaviour import LEFT, RIGHT, Bench

from crunchbot.base_table import BaseTable
from crunchbot.pilot import base
from crunchbot.pilot.behaviour import (
    BACK_OFF_M_S,
    BLOCK_TICKS,
    EFFECT_TICKS,
    ODOMETRY_TICKS,
    TICK_S,
    WHISK_RAD_S,
    State,
)
from crunchbot.pilot.rules import RULES, SPEEDS
from crunchbot.pilot.states import EXPLORE_M_S, FULL, LOST_TICKS, TIP_SLACK_RAD, WAIT_TICKS, TipMove
from crunchbot.pilot.tip import AIM_MM, contact_type, move_for_tip
from crunchbot.pilot.wheels import EXACT, NO_BUMPS, Bumps, Wheels
from crunchbot.pilot.whereabouts import Whereabouts
from crunchbot.touch.mount import Mount
from crunchbot_lab.simulation.scenes import make_robot

ROOT = Path(__file__).resolve().parents[4]
STEP_M_S, TRACK_M = 0.0285, 0.235  # of a base whose wheels move in steps
BLOCK_S = BLOCK_TICKS * TICK_S


class Robot(Bench):
    """The bench with odometry as commanded, bumps, and a list of the rules taken."""

    def __init__(self, **options):
        super().__init__(habits=FULL, **options)
        self.bumps, self.blocked, self.silent = NO_BUMPS, False, False
        self.taken = []
        take = self.behaviour._take
        self.behaviour._take = lambda rule, tick: (self.taken.append(rule), take(rule, tick))

    def block(self):
        drive = super().block()
        if (self.tick + 1) % ODOMETRY_TICKS == 0 and not self.silent:
            v, omega = (0.0, 0.0) if self.blocked else drive
            self.behaviour.moved(self.tick, 0.1 * v, 0.0, 0.1 * omega, self.bumps)
        return drive

    def blocks(self, count):
        return [self.block() for _ in range(count)]

    def touch(self, lane=LEFT):
        self.contacts[lane].touch(self.tick + 1)

    def crowd(self):
        """As if two things had been met here."""
        for _ in range(2):
            self.behaviour.whereabouts.meet(self.tick, 0.0)
        return self


def exploring():
    robot = Robot()
    robot.until(State.FORWARD)
    return robot


def turning():
    robot = exploring()
    robot.until(State.TURN)
    return robot


def whisked_until(state, move=None, lane=LEFT):
    """A whisk up to this state; `move`: asked to have been the shaft's."""
    robot = exploring()
    whisk(robot, move, lane)
    robot.until(state)
    return robot


def whisk(robot, move=None, lane=LEFT):
    robot.touch(lane)
    robot.until(State.BACK_OFF)
    robot.let_go(lane)
    robot.until(State.WHISK_IN)
    whisk_again(robot, move, lane)


def whisk_again(robot, move=None, lane=LEFT):
    robot.touch(lane)
    robot.until(State.WHISK_OUT)
    if move:
        robot.behaviour.aim(move)
    robot.let_go(lane)


MOVE = TipMove(0.02, 0.1)


def shaft(state):
    return whisked_until(state, MOVE)


def touched(robot, state):
    robot.touch()
    robot.until(state)
    return robot


def felt(bumps, state, robot=None):
    robot = robot or exploring()
    robot.bumps = bumps
    robot.until(state)
    return robot


def blocked(robot, *states):
    robot.blocked = True
    for state in states:
        robot.until(state)
    return robot


def caught():
    robot = exploring()
    robot.behaviour.catch(1.0)
    robot.until(State.CLEAR)
    return robot


def turned_away():
    robot = touched(exploring().crowd(), State.ESCAPE)
    robot.let_go(LEFT)
    robot.until(State.TURN_AWAY)
    return robot


def turned_round():
    robot = turned_away()
    robot.blocks(5)
    return touched(robot, State.ESCAPE)


def searched_in_vain():
    robot = touched(exploring(), State.BACK_OFF)
    robot.let_go(LEFT)
    robot.until(State.CLEAR)
    return robot


def left_after(robot, state):
    robot.until(state)
    return robot


def set_down():
    robot = felt(Bumps(wheel_drop=True), State.STOPPED)
    return felt(NO_BUMPS, State.FORWARD, robot)


class Chosen:
    """Choices that are given: how far the first drive goes on, a turn, and whether to whisk; a second turn is left."""

    remembers = False

    def __init__(self, turn=0.5, whisk=False, on=0.0):
        self.turns, self.worth, self.further = [turn], whisk, on
        self.asked = None  # tick at which it was first asked whether to go on

    def on(self, b, tick):
        self.asked = tick if self.asked is None else self.asked
        return self.further if tick == self.asked else 0.0

    def turn(self, b, tick, least_deg, most_deg):
        return self.turns.pop() if self.turns else 0.5

    def distance(self, b, tick):
        return 0.3

    def whisk(self, b, tick):
        return self.worth


def choosing(*states, **chosen):
    robot = Robot(choices=Chosen(**chosen))
    robot.until(State.FORWARD)
    for state in states:
        robot.until(state)
    return robot


def going_on():
    robot = choosing(on=0.4)
    while robot.behaviour.goal == 0.3:
        robot.block()
    return robot


SCRIPTS = (
    going_on,
    lambda: choosing(State.WAIT, State.TURN, turn=0.0),
    lambda: touched(choosing(), State.CLEAR),
    exploring,
    lambda: left_after(turning(), State.FORWARD),
    lambda: whisked_until(State.TURN),
    lambda: shaft(State.WHISK_IN),
    lambda: touched(exploring(), State.CLEAR),
    searched_in_vain,
    lambda: blocked(exploring(), State.CLEAR),
    lambda: blocked(exploring().crowd(), State.ESCAPE, State.TURN_AWAY),
    caught,
    lambda: touched(turning(), State.CLEAR),
    lambda: touched(turning().crowd(), State.ESCAPE),
    lambda: left_after(turned_away(), State.FORWARD),
    turned_round,
    lambda: felt(Bumps(left=True), State.CLEAR),
    lambda: felt(Bumps(left=True), State.ESCAPE, exploring().crowd()),
    lambda: left_after(felt(Bumps(cliff_right=True), State.HALT), State.ESCAPE),
    set_down,
)


def test_scripts_take_every_rule():
    taken = {rule for script in SCRIPTS for rule in script().taken}
    assert [(rule.source, rule.reason) for rule in RULES if rule not in taken] == []


def test_every_state_has_speeds_a_way_in_and_a_way_out():
    assert set(SPEEDS) == set(State) == {rule.target for rule in RULES}
    assert {rule.source for rule in RULES} - {None} == set(State)


def test_a_change_of_state_says_why():
    assert touched(exploring(), State.BACK_OFF).behaviour.reason == "touched and worth a whisk"


def test_it_stands_still_while_no_turn_is_worth_it():
    robot = choosing(State.WAIT, turn=0.0)
    drives = {robot.block() for _ in range(WAIT_TICKS // BLOCK_TICKS - 1)}
    assert drives == {(0.0, 0.0)} and robot.behaviour.state == State.WAIT


def test_a_turn_is_the_chosen_one():
    robot = choosing(State.TURN, turn=-0.8)
    assert (robot.behaviour.goal, robot.behaviour.sign) == (0.8, -1.0)
    robot.until(State.FORWARD)
    assert robot.behaviour.goal == 0.3


def test_it_goes_on_without_a_stop():
    robot = going_on()
    behaviour = robot.behaviour
    assert (behaviour.state, behaviour.goal, behaviour.drive) == (State.FORWARD, 0.4, (EXPLORE_M_S, 0.0))
    assert behaviour.drive_since < behaviour.since - 0.3 / EXPLORE_M_S / TICK_S + 2 * BLOCK_TICKS


def test_what_is_known_on_one_side_does_not_turn_a_robot_that_stands():
    robot = felt(NO_BUMPS, State.WAIT, felt(Bumps(left=True), State.CLEAR, choosing(turn=0.0)))
    assert robot.block() == (0.0, 0.0)


def test_where_it_has_been_is_in_its_own_frame():
    here = Whereabouts()
    here.moved(200, 1.0, 0.0, 0.0)
    here.meet(200, 0.0)
    here.moved(400, 0.0, 0.0, math.pi / 2)
    assert here.things() == pytest.approx(np.array([[0.0, -0.2]]), abs=1e-12)
    here.moved(600, 0.5, 0.0, 0.0)
    assert here.been() == pytest.approx(np.array([[-0.5, 0.0], [-0.5, 0.0], [0.0, 0.0]]), abs=1e-12)


# The tip.


@pytest.mark.parametrize("whisker", make_robot().of_role("object"), ids=lambda whisker: whisker.name)
@pytest.mark.parametrize("radius_mm", [70.0, 90.0, 110.0, 125.0])
def test_the_move_brings_the_corner_under_the_tip(whisker, radius_mm):
    mount = Mount.of(whisker)
    move = move_for_tip(mount, radius_mm)
    along = complex(math.cos(mount.yaw_rad), math.sin(mount.yaw_rad))
    corner = complex(*mount.base_m) + 1e-3 * radius_mm * along
    corner = (corner + move.retreat_m) * complex(math.cos(move.turn_rad), -math.sin(move.turn_rad))
    beside = (corner - complex(*mount.base_m)) / along
    assert beside == pytest.approx(1e-3 * (mount.length_mm - AIM_MM), abs=1e-9)
    assert move.turn_rad * mount.corner_turn > 0.0


def test_a_contact_at_the_tip_needs_no_move_and_is_reported_so():
    mount = Mount.of(make_robot().of_role("object")[1])
    assert move_for_tip(mount, mount.length_mm) is None
    kinds = [contact_type(mount, reported) for reported in (None, 90.0, 129.0, 131.0, 140.0)]
    assert kinds == [None, "shaft", "shaft", "tip", "tip"]


def test_after_the_shaft_the_robot_retreats_and_whisks_for_the_tip():
    robot = shaft(State.RETREAT)
    drives = []
    while robot.behaviour.state == State.RETREAT:
        drives.append(robot.behaviour.drive)
        robot.block()
    assert set(drives) == {(-BACK_OFF_M_S, 0.0)}
    assert len(drives) * BACK_OFF_M_S * BLOCK_S == pytest.approx(MOVE.retreat_m, abs=0.001)
    assert robot.behaviour.drive == (0.0, WHISK_RAD_S) and robot.behaviour.whisk.tries == 1
    turned = 0.0
    while robot.behaviour.state == State.WHISK_IN:
        turned += robot.behaviour.drive[1] * BLOCK_S
        robot.block()
    assert turned == pytest.approx(MOVE.turn_rad + TIP_SLACK_RAD, abs=0.004)  # nothing met: on it goes, no other side
    assert robot.behaviour.state == State.CLEAR


def test_tries_for_the_tip_come_to_an_end():
    robot = shaft(State.WHISK_IN)
    for tried in range(FULL.tip_tries - 1):
        whisk_again(robot, MOVE)
        robot.until(State.WHISK_IN)
        assert robot.behaviour.whisk.tries == 2 + tried
    whisk_again(robot, MOVE)
    robot.until(State.CLEAR)
    assert robot.taken[-1].source == State.HOLD


def test_whisk_for_the_tip_is_a_whisk_to_the_pilot():
    assert shaft(State.RETREAT).behaviour.whisking


# The base.


def test_a_base_with_stepped_wheels_whisks_as_far_at_its_own_rate():
    wheels = Wheels.of(BaseTable(TRACK_M, wheel_step_m_s=STEP_M_S), effect_ticks=121)
    assert wheels.whisk_rad_s * TRACK_M / 2.0 == pytest.approx(STEP_M_S) and wheels.back_off_m_s == STEP_M_S
    assert wheels.push_ticks * wheels.whisk_rad_s == pytest.approx(EXACT.push_ticks * EXACT.whisk_rad_s, rel=0.01)
    robot = Robot(wheels=wheels)
    robot.until(State.FORWARD)
    robot.touch()
    robot.until(State.BACK_OFF)
    assert robot.behaviour.drive == (-STEP_M_S, 0.0)
    assert robot.behaviour.drive_since == robot.tick + wheels.effect_ticks != robot.tick + EFFECT_TICKS
    robot.let_go(LEFT)
    robot.until(State.WHISK_IN)
    assert robot.behaviour.drive == (0.0, wheels.whisk_rad_s)
    robot.touch()
    onset = robot.tick + 1
    robot.until(State.WHISK_OUT)
    assert 0 <= robot.tick - onset - wheels.push_ticks <= BLOCK_TICKS
    assert robot.behaviour.whisk.push_end == robot.tick + wheels.effect_ticks


@pytest.mark.parametrize(
    ("base", "share"),
    [
        (BaseTable(0.16, 0.22, 0.01, 1.0), 1.0),  # as quick as a Create is ordered to be
        (BaseTable(0.16, 0.1, 0.01), 0.1 / 0.15),  # its wheels are slow
        (BaseTable(0.6, 0.15, 0.01), 0.15 / (0.71 * 0.3)),  # its wheels are too far apart to turn so fast
        (BaseTable(0.16, 0.22, 0.01, 0.1), math.sqrt(2 * 0.1 * 0.06) / 0.15),  # it brakes slowly
    ],
)
def test_a_base_that_can_do_less_drives_and_turns_slower(base, share):
    wheels = Wheels.of(base)
    robot = Robot(wheels=wheels)
    robot.until(State.FORWARD)
    assert robot.behaviour.drive == pytest.approx((share * EXPLORE_M_S, 0.0))
    assert wheels.sweeps(*robot.behaviour.drive)
    robot.until(State.TURN)
    v, omega = robot.behaviour.drive
    assert v == 0.0 and abs(omega) == pytest.approx(share * 0.71)
    for speeds in ((wheels.explore_m_s, 0.0), (0.0, wheels.turn_rad_s), (0.0, wheels.whisk_rad_s)):
        assert base.reached(*speeds) == pytest.approx(speeds)


def test_a_base_that_turns_evenly_only_when_fast_is_as_slow_as_it_can_be():
    wheels = Wheels.of(BaseTable(0.5, 0.6, 0.3))
    assert wheels.explore_m_s == wheels.back_off_m_s == 0.3
    assert wheels.turn_rad_s == pytest.approx(0.3 / 0.25) == pytest.approx(wheels.whisk_rad_s)


def test_wheels_that_gather_speed_are_not_taken_for_blocked():
    base = BaseTable(0.16, 0.22, 0.01, 0.1)  # 0.11 m/s takes it 1.1 s
    robot = Robot(wheels=Wheels.of(base))
    robot.until(State.FORWARD)
    reached = robot.behaviour.drive_since - robot.tick
    assert reached == EFFECT_TICKS + math.ceil(robot.behaviour.drive[0] / 0.1 / TICK_S)


@pytest.mark.parametrize(("bumps", "turn"), [(Bumps(left=True), -1.0), (Bumps(right=True), 1.0)])
def test_after_a_bump_it_backs_off_and_turns_away(bumps, turn):
    for seed in range(4):
        robot = Robot(seed=seed)
        robot.until(State.FORWARD)
        felt(bumps, State.CLEAR, robot)
        assert robot.behaviour.drive[0] < 0.0
        robot.bumps = NO_BUMPS
        assert math.copysign(1.0, robot.until(State.TURN)[1]) == turn


def test_a_bump_breaks_off_a_whisk():
    robot = touched(exploring(), State.BACK_OFF)
    felt(Bumps(left=True), State.CLEAR, robot)
    assert robot.behaviour.whisk is None


def test_at_a_cliff_it_stops_then_backs_off():
    robot = felt(Bumps(cliff_left=True), State.HALT)
    assert robot.behaviour.drive == (0.0, 0.0)
    assert robot.until(State.ESCAPE)[0] < 0.0
    robot.bumps = NO_BUMPS
    assert robot.until(State.TURN_AWAY)[0] == 0.0


def test_lifted_it_stands_still_until_set_down():
    robot = felt(Bumps(wheel_drop=True), State.STOPPED)
    assert set(robot.blocks(100)) == {(0.0, 0.0)}
    felt(NO_BUMPS, State.FORWARD, robot)


def test_without_word_from_the_base_it_stands_still():
    robot = exploring()
    robot.blocks(5)
    robot.silent = True
    silent_since = robot.tick
    assert robot.until(State.STOPPED) == (0.0, 0.0)
    assert robot.tick - silent_since <= LOST_TICKS + ODOMETRY_TICKS + BLOCK_TICKS
    robot.silent = False
    robot.until(State.FORWARD)


def test_lost_is_lost_even_while_reports_come():
    robot = felt(Bumps(lost=True), State.STOPPED)
    assert set(robot.blocks(20)) == {(0.0, 0.0)}


def test_bumps_are_read_from_the_bases_bits():
    assert Bumps.of_bits(0) == NO_BUMPS
    assert Bumps.of_bits(base.BUMP_LEFT | base.CLIFF_FRONT_RIGHT) == Bumps(left=True, cliff_right=True)
    assert Bumps.of_bits(base.BUMP_RIGHT | base.CLIFF_LEFT) == Bumps(right=True, cliff_left=True)
    for bit in (base.DROP_LEFT, base.DROP_RIGHT, base.DROP_CASTER, base.IDLE):
        assert Bumps.of_bits(bit).adrift


# Escapes.


def test_contacts_here_again_and_again_are_left_behind():
    robot = exploring()
    for _ in range(3):
        robot.touch()
        robot.blocks(1)
        if robot.behaviour.state == State.ESCAPE:
            break
        robot.let_go(LEFT)
        robot.until(State.CLEAR)
        robot.until(State.FORWARD)
    assert robot.behaviour.state == State.ESCAPE
    robot.let_go(LEFT)
    before = robot.behaviour.whereabouts._x
    robot.until(State.TURN_AWAY)
    assert abs(robot.behaviour.whereabouts._x - before) > 0.05
    robot.until(State.FORWARD)


def test_the_next_escape_goes_further():
    robot = turned_away()
    first = next(rule for rule in robot.taken if rule.target == State.ESCAPE)
    assert first.reason == "touched again here"
    robot.until(State.FORWARD)
    robot.behaviour.whereabouts.meet(robot.tick, 0.0)
    robot.crowd()
    robot.blocks(5)
    touched(robot, State.ESCAPE)
    assert robot.behaviour.escapes == 2 and robot.behaviour.goal == pytest.approx(0.5)


def test_a_whisker_that_is_still_bent_after_an_escape_does_not_hold_the_robot():
    robot = turned_away()
    robot.touch(RIGHT)
    robot.until(State.FORWARD)
    robot.blocks(5)
    assert robot.behaviour.state == State.FORWARD


def test_turns_away_from_a_held_floor_whisker():
    for seed in range(4):
        robot = Robot(seed=seed)
        robot.until(State.FORWARD)
        robot.behaviour.catch(1.0)
        robot.until(State.CLEAR)
        assert robot.until(State.TURN)[1] < 0.0


def test_the_gap_is_where_nothing_was_met():
    here = Whereabouts()
    assert here.gap(0.5) == (math.pi, 2.0 * math.pi)
    for degrees in (-40.0, 40.0, 90.0):
        here.meet(0, math.radians(degrees))
    turn, width = here.gap(0.5)
    assert math.degrees(width) == pytest.approx(230.0) and math.degrees(turn) == pytest.approx(-155.0)
    here.moved(200, 1.0, 0.0, 0.0)
    assert here.gap(0.5)[1] == 2.0 * math.pi


def test_lingering_is_counted_from_the_last_tick_elsewhere():
    here = Whereabouts()
    for number in range(1, 31):
        here.moved(200 * number, 0.1 if number <= 10 else 0.0, 0.0, 0.0)
    assert here.lingered(6000, 0.25) == 6000 - 200 * 7
    assert [m.tick for m in here.encounters(0, 1.0)] == []


def test_the_picture_lists_the_rules_of_the_table():
    """docs/pictures/behaviour.svg is drawn by hand; a change of the table changes it, too."""
    listed = re.findall(
        r">(\d+  [^<]* \N{RIGHTWARDS ARROW} [^<]*)<", (ROOT / "docs/pictures/behaviour.svg").read_text()
    )
    of_any = [rule.source.value if rule.source else "any state" for rule in RULES]
    assert [unescape(line) for line in listed] == [
        f"{number}  {source} \N{RIGHTWARDS ARROW} {rule.target.value}: {rule.reason}"
        for number, (source, rule) in enumerate(zip(of_any, RULES, strict=True), start=1)
    ]
