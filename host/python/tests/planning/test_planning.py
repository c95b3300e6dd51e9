"""The planner: what it knows of the ground, what an action is worth, and when nothing is. Held against the scenes' own
geometry; the arithmetic of a gain is host/nav/tests/test_planner.c's."""

import math
from dataclasses import replace

import numpy as np
import pytest

from crunchbot.nav.filters import COMPONENT
from crunchbot.pilot.whereabouts import Whereabouts
from crunchbot.planning.actions import REACH_M, STEP_RAD, Leg, Path, Vehicle, all_round
from crunchbot.planning.beside import HUG_M, IN_RAD, LANE_M, OUT_RAD, Along, Lanes
from crunchbot.planning.choices import Planned
from crunchbot.planning.ground import CELL_M, NOTHING, ArenaMap, Ground
from crunchbot.planning.planner import BUDGET, KNOWN, NO_PAST, NOTHING_TOLD, SHUT_IN, Past, Planner
from crunchbot.scene import Arena, Robot, Whisker
from crunchbot_lab.scenes.geometry import free_test, textures
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
def test_the_ground_is_as_the_scene_says(family):
    scene = make(family, 11, 1).scene
    ground = Ground.of(ArenaMap(scene.arena), scene.robot)
    rng = np.random.default_rng(1)
    at = rng.uniform((0.0, 0.0), scene.arena.size_m, (3000, 2))
    column, row = ((at - ground.corner_m) / ground.cell_m).astype(int).T
    bare = Whisker("middle", "texture", tip_m=(0.0, 0.0))
    assert (
        np.mean(ground.texture[row, column] == textures(scene.arena, np.column_stack([at, 0 * at[:, 0]]), bare)[0])
        > 0.97
    )
    radius = scene.robot.body_radius_m
    for off, fits in ((0.02, True), (-0.02, False)):
        free = free_test(scene.arena, radius + off)
        agree = [
            (ground.clear_m[r, c] >= radius) == fits
            for (x, y), r, c in zip(at, row, column, strict=True)
            if free(x, y) == fits
        ]
        assert len(agree) > 100 and np.mean(agree) > 0.98


def belief_of(scene, seed=2, count=300):
    rng = np.random.default_rng(seed)
    poses = rng.uniform((0.0, 0.0, -math.pi), (*scene.arena.size_m, math.pi), (20 * count, 3))
    free = free_test(scene.arena, scene.robot.body_radius_m)
    return components(*[pose for pose in poses if free(*pose[:2])][:count])


def planner_of(arena, *whiskers, **options):
    return Planner(Ground.of(ArenaMap(arena), robot(*whiskers)), VEHICLE, **options)


APART = components((1.9, 1.0, 0.0), (0.6, 1.0, 0.0))


def test_it_goes_where_two_places_differ():
    """Both face along +x on smooth floor; ahead of one, rough floor begins."""
    planner = planner_of(HALVES, *TIPS)
    plan = planner.plan(APART)
    (turn, drive), *more = plan.moves
    assert turn == 0.0 and drive > 0.55 and not more and 0.5 < plan.bits <= 1.0 and not plan.refused
    assert plan.passed == 1.0 and plan.seconds == pytest.approx(drive / VEHICLE.drive_m_s)
    behind = planner.plan(components((2.3, 1.0, math.pi), (1.4, 1.0, math.pi)))
    assert abs(behind.moves[0][0]) > math.pi / 2


def test_a_reading_of_where_it_has_been_is_not_counted_again():
    been = np.column_stack([np.arange(-0.1, 1.6, 0.05), np.zeros((34, 2))])
    plan = planner_of(HALVES, *TIPS).plan(APART, Past(NO_PAST.met, been))
    assert plan.moves[0][0] != 0.0


def test_what_was_met_is_not_driven_at():
    planner = planner_of(HALVES, *TIPS)
    assert planner.plan(APART, Past(np.array([[0.3, 0.0]]), NO_PAST.been)).moves[0][0] != 0.0
    ways = np.arange(0.0, 2.0 * math.pi, 0.2)
    all_round = Past(0.2 * np.column_stack([np.cos(ways), np.sin(ways)]), NO_PAST.been)
    assert planner.plan(APART, all_round).refused == SHUT_IN


def test_it_refuses_where_no_place_reads_otherwise():
    plan = Planner(Ground.of(Plane(), robot(*TIPS, FEELER)), VEHICLE).plan(APART)
    assert plan.refused == NOTHING_TOLD and plan.bits_per_s == 0.0 and plan.moves == ()


def test_a_wall_in_a_plain_arena_is_something_to_feel():
    plain = Arena((3.0, 3.0), 0.5, ("SMOOTH", "ROUGH"), ("SSSSSS",) * 6, ())
    assert Ground.of(ArenaMap(plain), robot(*TIPS)).says_nothing()
    assert not Ground.of(ArenaMap(plain), robot(*TIPS, FEELER)).says_nothing()


def test_a_pose_that_is_known_has_nothing_to_yield():
    assert planner_of(HALVES, *TIPS).plan(components((1.9, 1.0, 0.0))).refused == KNOWN


def test_the_same_belief_is_the_same_plan_within_the_budget():
    scene = make("anchor", 5, 1).scene
    belief, ground = belief_of(scene), Ground.of(ArenaMap(scene.arena), scene.robot)
    plans = [Planner(ground, VEHICLE, after=3).plan(belief) for _ in range(2)]
    assert plans[0].moves == plans[1].moves and plans[0].bits == plans[1].bits
    assert 0 < plans[0].spent < BUDGET + 100_000
    free, small = Planner(ground, VEHICLE, budget=0).plan(belief), Planner(ground, VEHICLE, budget=300_000).plan(belief)
    assert small.spent < 400_000 < free.spent and small.bits > 0.0 and small.bits_per_s <= free.bits_per_s


def test_who_knows_the_pose_expects_its_readings():
    """Of three places, one reads otherwise: who is there learns all, who is at another one only that it is not there."""
    planner = planner_of(HALVES, *TIPS)
    belief = components((1.9, 1.0, 0.0), (0.6, 1.0, 0.0), (0.9, 1.0, 0.0))
    there, other = (planner.plan(belief, truth=np.array(belief["pose"][k])).bits for k in (0, 1))
    assert there > 1.0 > other > 0.3


def test_a_whisk_separates_places_that_are_touched_in_one_only():
    planner = planner_of(HALVES, FEELER)
    assert planner.whisk(components((4.8, 1.0, 0.0), (3.0, 1.0, 0.0))).bits > 0.3
    assert planner.whisk(components((2.0, 1.0, 0.0), (3.0, 1.0, 0.0))).bits == pytest.approx(0.0, abs=1e-6)


def test_paths_turn_to_all_sides_and_drive_on():
    paths = all_round(VEHICLE)
    assert paths[0].legs[0].turn_rad == 0.0 and len(paths) == round(2.0 * math.pi / STEP_RAD)
    ends = np.array([path.steps[-1].pose for path in paths])
    assert np.hypot(ends[:, 0], ends[:, 1]) == pytest.approx(np.full(len(ends), REACH_M))
    assert np.cos(np.arctan2(ends[:, 1], ends[:, 0]) - ends[:, 2]) == pytest.approx(np.ones(len(ends)))


def test_a_path_takes_the_time_of_its_turns_drives_and_changes_of_speed():
    path = Path.of([Leg(math.pi / 2, 0.3), Leg(-math.pi / 2, 0.2, (0.1,))], VEHICLE)
    turns, drives = math.pi / VEHICLE.turn_rad_s, 0.5 / VEHICLE.drive_m_s
    assert sum(step.seconds for step in path.steps) == pytest.approx(turns + drives + 4 * VEHICLE.settle_s)
    assert path.steps[-1].pose == pytest.approx((0.2, 0.3, 0.0), abs=1e-9)
    still = Path.of([Leg(0.0, 0.1)], replace(VEHICLE, drive_m_s=0.3)).steps[0]
    assert still.texture_nats == pytest.approx(0.5 * Path.of([Leg(0.0, 0.1)], VEHICLE).steps[0].texture_nats)


def test_poses_anywhere_are_free():
    scene = make("free", 4, 1).scene
    poses = Ground.of(ArenaMap(scene.arena), scene.robot).spread(200)
    free = free_test(scene.arena, scene.robot.body_radius_m - 3.0 * CELL_M)
    assert len(poses) == 200 and all(free(*pose[:2]) for pose in poses)


def test_what_is_out_of_range_is_refused():
    with pytest.raises(ValueError, match="hypotheses: out of range"):
        planner_of(HALVES, *TIPS, most=500)


class Body:
    """What `Planned` asks of a behaviour."""

    def __init__(self):
        self.whereabouts, self.turned_away = Whereabouts(), -1


class Otherwise:
    def on(self, b, tick):
        return 0.0

    def turn(self, b, tick, least_deg, most_deg):
        return 1.25

    def distance(self, b, tick):
        return 0.75

    def whisk(self, b, tick):
        return True


def test_a_plan_is_a_turn_and_its_drive_and_then_another_one():
    planned, body = Planned(planner_of(HALVES, *TIPS), lambda: APART, Otherwise()), Body()
    turn = planned.turn(body, 0, 25.0, 90.0)
    assert 0.0 < turn < 0.01 and planned.distance(body, 1) == planned.plan.moves[0][1] > 0.5
    assert planned.distance(body, 2) == 0.0
    body.turned_away = 3
    assert planned.distance(body, 3) == 0.75


def test_it_goes_on_as_now_where_that_is_best_and_plans_once_a_tick():
    ahead, aside = (APART, components((1.9, 1.0, math.pi / 2), (0.6, 1.0, math.pi / 2)))
    for belief, goes_on in ((ahead, True), (aside, False)):
        planned, body = Planned(planner_of(HALVES, *TIPS), lambda belief=belief: belief, Otherwise()), Body()
        assert (planned.on(body, 5) > 0.0) == goes_on and planned.on(body, 5) == planned.on(body, 5)
        planned.turn(body, 5, 25.0, 90.0)
        assert planned.plans == 1 and planned.distance(body, 6) > 0.0


def test_where_the_pose_is_known_the_other_choices_hold():
    planned = Planned(planner_of(HALVES, *TIPS), lambda: components((1.9, 1.0, 0.0)), Otherwise())
    assert planned.turn(Body(), 0, 25.0, 90.0) == 1.25 and planned.distance(Body(), 1) == 0.75


def test_it_whisks_where_that_yields_more_per_second():
    near = components((4.82, 1.0, 0.0), (3.0, 1.0, math.pi))
    ground = Ground.of(ArenaMap(HALVES), robot(FEELER))
    slow, quick = (
        Planned(Planner(ground, replace(VEHICLE, whisk_s=s)), lambda: near, Otherwise()) for s in (40.0, 0.1)
    )
    assert quick.whisk(Body(), 0) and not slow.whisk(Body(), 0)


def test_without_a_belief_the_other_choices_hold():
    planned = Planned(planner_of(HALVES, *TIPS), lambda: None, Otherwise())
    assert planned.turn(Body(), 0, 25.0, 90.0) == 1.25 and planned.whisk(Body(), 0)


def test_where_nothing_can_be_told_it_stands():
    plane = Planner(Ground.of(Plane(), robot(*TIPS)), VEHICLE)
    assert Planned(plane, lambda: components((1.0, 1.0, 0.0)), Otherwise()).turn(Body(), 0, 25.0, 90.0) == 0.0


def test_ground_not_known_has_no_class():
    arena = Arena((1.0, 1.0), 0.5, ("SMOOTH", "ROUGH"), ("S?", "RS"), ())
    ground = Ground.of(ArenaMap(arena), Robot(0.05, 0.03, 0.005, ()))
    at = ((np.array([[0.26, 0.76], [0.76, 0.76], [0.26, 0.26]]) - ground.corner_m) / ground.cell_m).astype(int)
    assert ground.texture[at[:, 1], at[:, 0]].tolist() == [0, NOTHING, 1]


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
