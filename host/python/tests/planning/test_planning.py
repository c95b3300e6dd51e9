"""The planner: what is foretold, what it is worth, and when nothing is. Ranges are held against the scenes' own geometry."""

import math

import numpy as np
import pytest

from crunchbot.nav.filters import COMPONENT
from crunchbot.pilot.whereabouts import Whereabouts
from crunchbot.planning import information
from crunchbot.planning.actions import REACH_M, STEP_RAD, Fan, Vehicle
from crunchbot.planning.beside import HUG_M, IN_RAD, LANE_M, OUT_RAD, Along, Lanes
from crunchbot.planning.choices import Planned
from crunchbot.planning.places import CELL_M, FINE_M, FREE, NOTHING, TURNS, ArenaMap, Places
from crunchbot.planning.planner import DOUBT, KNOWN, NO_PAST, NOTHING_TOLD, SHUT_IN, Past, Planner
from crunchbot.scene import Arena, Robot, Whisker
from crunchbot_lab.scenes.geometry import free_test, ranges, textures
from crunchbot_lab.scenes.making import make

VEHICLE = Vehicle(0.15, 0.71, 0.5, 4.0, 0.25)
TIPS = (Whisker("left", "texture", tip_m=(0.0, 0.2)), Whisker("right", "texture", tip_m=(0.0, -0.2)))
FEELER = Whisker("feeler", "object", base_m=(0.1, 0.0), yaw_rad=0.0, length_m=0.14)
# Rough to the right of x = 2.5, smooth to its left.
HALVES = Arena((5.0, 2.0), 0.5, ("SMOOTH", "ROUGH"), ("SSSSSRRRRR",) * 4, ())


def robot(*whiskers):
    return Robot(0.15, 0.03, 0.005, whiskers)


def components(*poses):
    out = np.zeros(len(poses), COMPONENT)
    out["pose"], out["mass"] = poses, 1.0 / len(poses)
    return out


class Plane:
    """One texture and no walls."""

    size_m = (3.0, 3.0)

    def textures(self, points):
        return np.column_stack([np.ones(len(points)), np.zeros(len(points))])

    def occupied(self, points):
        return np.zeros(len(points))


@pytest.mark.parametrize("family", ["anchor", "free", "ring"])
def test_what_whiskers_meet_is_foretold(family):
    scene = make(family, 11, 1).scene
    places = Places.of(ArenaMap(scene.arena), scene.robot)
    rng = np.random.default_rng(1)
    cells = np.array(
        [
            (int(n / TURNS) % places.blocked.shape[1], int(n / TURNS / places.blocked.shape[1]), n % TURNS)
            for n in rng.integers(places.blocked.size, size=3000)
        ]
    )
    poses = np.column_stack([(cells[:, :2] + 0.5) * places.cell_m, cells[:, 2] * 2.0 * math.pi / TURNS])
    free = free_test(scene.arena, scene.robot.body_radius_m + 2.0 * FINE_M)
    poses = poses[[free(*pose[:2]) for pose in poses]]
    index = places.index(poses)
    for n, whisker in enumerate(scene.robot.of_role("texture")):
        assert np.mean(places.texture[n].reshape(-1)[index] == textures(scene.arena, poses, whisker)[0]) > 0.93
    for n, whisker in enumerate(scene.robot.of_role("object")):
        true, foretold = ranges(scene.arena, poses, whisker), places.reach[n].reshape(-1)[index]
        both = np.isfinite(true) & (foretold != FREE)
        assert np.mean(np.isfinite(true) == (foretold != FREE)) > 0.95 and both.any()
        assert np.abs(true[both] - foretold[both] * FINE_M).mean() < 1.5 * FINE_M


def test_a_body_fits_where_the_geometry_says():
    scene = make("free", 3, 1).scene
    places = Places.of(ArenaMap(scene.arena), scene.robot)
    rows, columns, _ = places.blocked.shape
    for radius, blocked in ((scene.robot.body_radius_m + CELL_M, False), (scene.robot.body_radius_m - CELL_M, True)):
        free = free_test(scene.arena, radius)
        at = [
            (r, c)
            for r in range(rows)
            for c in range(columns)
            if free((c + 0.5) * CELL_M, (r + 0.5) * CELL_M) != blocked
        ]
        assert at and all(places.blocked[r, c, 0] == blocked for r, c in at)


def test_two_places_that_read_otherwise_are_one_bit():
    units, weights, apart = np.array([[0, 200], [200, 0]], np.uint8), np.array([0.5, 0.5]), np.eye(2, dtype=bool)
    assert information.bits(units, weights, apart) == pytest.approx(1.0, abs=1e-6)
    assert information.bits(np.zeros_like(units), weights, apart) == pytest.approx(0.0, abs=1e-6)
    assert 0.0 < information.bits(units // 200, weights, apart) < 0.5


def test_what_tells_only_within_a_place_tells_nothing():
    units, weights = np.array([[0, 200], [200, 0]], np.uint8), np.array([0.5, 0.5])
    assert information.bits(units, weights, np.ones((2, 2), bool)) == pytest.approx(0.0, abs=1e-6)


def test_the_estimate_is_no_more_than_the_information_itself():
    """Windows of three classes, right in 85 %, of two places: the lower bound against the sum over all readings."""
    right, wrong = 0.85, 0.075
    p = np.array([[right, wrong, wrong], [wrong, right, wrong]])
    mixed = p.mean(axis=0)
    true = -(mixed * np.log2(mixed)).sum() + (p[0] * np.log2(p[0])).sum()
    gain = information.bits(np.array([[0, 1], [1, 0]], np.uint8), np.array([0.5, 0.5]), np.eye(2, dtype=bool))
    assert 0.5 * true < gain <= true


def test_a_window_tells_no_more_than_its_classes():
    assert information.capacity_bits(1.0, 4) == 2.0
    assert information.capacity_bits(0.25, 4) == pytest.approx(0.0, abs=1e-12)
    assert information.capacity_bits(0.85, 1) == 0.0


def test_poses_nearby_are_one_place_across_the_full_turn():
    same = information.one_place(np.array([[1.0, 1.0, 3.1], [1.1, 1.0, -3.1], [1.0, 1.0, 1.0], [1.5, 1.0, 3.1]]))
    assert same[0].tolist() == [True, True, False, False]


def test_it_goes_where_two_places_differ():
    """Both face along +x on smooth floor; ahead of one, rough floor begins."""
    planner = Planner(Places.of(ArenaMap(HALVES), robot(*TIPS)), VEHICLE, steps=1)
    plan = planner.plan(components((1.9, 1.0, 0.0), (0.6, 1.0, 0.0)), doubt=0.0)
    assert plan.turn_rad == 0.0 and plan.distance_m > 0.55 and plan.bits > 0.5 and not plan.refused
    behind = planner.plan(components((1.9, 1.0, math.pi), (0.6, 1.0, math.pi)), doubt=0.0)
    assert abs(behind.turn_rad) > math.pi / 2


def test_a_reading_of_where_it_has_been_is_not_counted_again():
    planner = Planner(Places.of(ArenaMap(HALVES), robot(*TIPS)), VEHICLE, steps=1)
    belief = components((1.9, 1.0, 0.0), (0.6, 1.0, 0.0))
    been = np.column_stack([np.arange(-0.1, 1.6, 0.05), np.zeros((34, 2))])
    assert planner.plan(belief, Past(np.zeros((0, 2)), been), doubt=0.0).turn_rad != 0.0


def test_what_was_met_is_not_driven_at():
    planner = Planner(Places.of(ArenaMap(HALVES), robot(*TIPS)), VEHICLE, steps=1)
    belief = components((1.9, 1.0, 0.0), (0.6, 1.0, 0.0))
    assert planner.plan(belief, Past(np.array([[0.3, 0.0]]), NO_PAST.been)).turn_rad != 0.0
    ways = np.arange(0.0, 2.0 * math.pi, 0.2)
    all_round = Past(0.2 * np.column_stack([np.cos(ways), np.sin(ways)]), NO_PAST.been)
    assert planner.plan(belief, all_round).refused == SHUT_IN


def test_it_refuses_where_no_place_reads_otherwise():
    planner = Planner(Places.of(Plane(), robot(*TIPS, FEELER)), VEHICLE)
    plan = planner.plan(components((1.0, 1.0, 0.0), (2.0, 2.0, 1.0)))
    assert plan.refused == NOTHING_TOLD and plan.bits_per_s == 0.0


def test_a_wall_in_a_plain_arena_is_something_to_tell():
    plain = Arena((3.0, 3.0), 0.5, ("SMOOTH", "ROUGH"), ("SSSSSS",) * 6, ())
    assert Places.of(ArenaMap(plain), robot(*TIPS)).tells_nothing()
    assert not Places.of(ArenaMap(plain), robot(*TIPS, FEELER)).tells_nothing()


def test_a_pose_that_is_known_has_nothing_to_tell():
    planner = Planner(Places.of(ArenaMap(HALVES), robot(*TIPS)), VEHICLE)
    assert planner.plan(components((1.9, 1.0, 0.0)), doubt=0.0).refused == KNOWN


def test_the_same_belief_is_the_same_plan():
    scene = make("anchor", 5, 1).scene
    belief = components(*np.random.default_rng(2).uniform((0.3, 0.3, -3.0), (2.2, 2.2, 3.0), (300, 3)))
    plans = {Planner(Places.of(ArenaMap(scene.arena), scene.robot), VEHICLE).plan(belief) for _ in range(2)}
    assert len(plans) == 1


def test_a_whisk_tells_places_apart_that_are_touched_in_one_only():
    planner = Planner(Places.of(ArenaMap(HALVES), robot(FEELER)), VEHICLE)
    assert planner.whisk(components((4.8, 1.0, 0.0), (3.0, 1.0, 0.0)), doubt=0.0).bits > 0.3
    assert planner.whisk(components((2.0, 1.0, 0.0), (3.0, 1.0, 0.0)), doubt=0.0).bits == pytest.approx(0.0, abs=1e-6)


def test_a_fan_turns_to_all_sides_and_drives_on():
    fan = Fan.all_round()
    assert len(fan.turn_rad) == round(2.0 * math.pi / STEP_RAD) and fan.driven_m.max() == pytest.approx(REACH_M)
    ends = fan.poses[:, -1]
    assert np.hypot(ends[:, 0], ends[:, 1]) == pytest.approx(np.full(len(ends), REACH_M))
    assert np.arctan2(ends[:, 1], ends[:, 0]) == pytest.approx(ends[:, 2])


def test_hypotheses_of_any_place_are_free():
    scene = make("free", 4, 1).scene
    poses = Places.of(ArenaMap(scene.arena), scene.robot).spread(200)
    free = free_test(scene.arena, scene.robot.body_radius_m - 2.0 * CELL_M)
    assert len(poses) == 200 and all(free(*pose[:2]) for pose in poses)


class Body:
    """What `Planned` asks of a behaviour."""

    def __init__(self):
        self.whereabouts, self.turned_away = Whereabouts(), -1


class Otherwise:
    def turn(self, b, tick, least_deg, most_deg):
        return 1.25

    def distance(self, b, tick):
        return 0.75

    def whisk(self, b, tick):
        return True


def test_a_belief_that_expected_to_pass_is_in_doubt():
    planner = Planner(Places.of(ArenaMap(HALVES), robot(*TIPS, FEELER)), VEHICLE, steps=1)
    body = Body()
    planned = Planned(planner, lambda: components((1.9, 1.0, 0.0), (0.6, 1.0, 0.0)), Otherwise())
    planned.turn(body, 0, 25.0, 90.0)
    drive, expected = planned.distance(body, 1), planned.plan.passed
    assert drive > 0.5 and planned.doubt == DOUBT and expected[0] > expected[1]
    planned.turn(body, 2, 25.0, 90.0)
    assert planned.doubt > DOUBT


def test_without_a_belief_the_other_choices_hold():
    planned = Planned(Planner(Places.of(Plane(), robot(*TIPS)), VEHICLE), lambda: None, Otherwise())
    assert planned.turn(Body(), 0, 25.0, 90.0) == 1.25 and planned.whisk(Body(), 0)


def test_where_nothing_can_be_told_it_stands():
    planned = Planned(
        Planner(Places.of(Plane(), robot(*TIPS)), VEHICLE), lambda: components((1.0, 1.0, 0.0)), Otherwise()
    )
    assert planned.turn(Body(), 0, 25.0, 90.0) == 0.0


def test_ground_not_known_is_no_symbol():
    arena = Arena((1.0, 1.0), 0.5, ("SMOOTH", "ROUGH"), ("S?", "RS"), ())
    places = Places.of(ArenaMap(arena), Robot(0.05, 0.03, 0.005, (Whisker("tip", "texture", tip_m=(0.0, 0.0)),)))
    at = places.texture[0].reshape(-1)[
        places.index(np.array([[0.26, 0.76, 0.0], [0.76, 0.76, 0.0], [0.26, 0.26, 0.0]]))
    ]
    assert at.tolist() == [0, NOTHING, 1]


def test_lanes_turn_twice_to_a_side_and_then_to_the_other():
    lanes = Lanes()
    ways = [(lanes.turn(None, 0, 60.0, 150.0), lanes.distance(None, 0)) for _ in range(4)]
    quarter = math.pi / 2
    assert ways == [(quarter, LANE_M), (quarter, math.inf), (-quarter, LANE_M), (-quarter, math.inf)]


def test_along_a_wall_it_turns_out_and_in():
    along = Along()
    assert along.distance(None, 0) == math.inf
    assert (along.turn(None, 0, 60.0, 150.0), along.distance(None, 0)) == (OUT_RAD, HUG_M)
    assert (along.turn(None, 0, 25.0, 90.0), along.distance(None, 0)) == (-IN_RAD, math.inf)
