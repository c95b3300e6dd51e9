"""Level-0 scenes: the same seed gives the same scene, files keep every bit, true poses stand clear, faults do as given."""

import math

import numpy as np
import pytest

from crunchbot.nav import localise
from crunchbot.scene import load
from crunchbot_lab import scenes
from crunchbot_lab.scenes import geometry
from crunchbot_lab.scenes.explorer import explore
from crunchbot_lab.scenes.readings import World, hold_back, odometry

FIELDS = ("t_s", "odometry", "texture", "radial_m", "truth", "normal")
FAMILIES = [*scenes.BASES, *(f"anchor+{modifier}" for modifier in scenes.MODIFIERS)]


def differing(one, other):
    return [f for f in FIELDS if not _same(getattr(one, f), getattr(other, f))]


def _same(one, other):
    return one is other if one is None or other is None else np.array_equal(one, other, equal_nan=True)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_written_scene_reads_back_bit_by_bit(family, tmp_path):
    made, again = (scenes.make(family, 5, rows=400) for _ in range(2))
    assert not differing(made.observations, again.observations)
    scenes.write_scene(tmp_path, made.scene, made.observations)
    scene = load(tmp_path)
    observations = localise.read_observations(localise.observations_path(tmp_path), scene)
    assert scene == made.scene
    assert observations.t_text == made.observations.t_text
    assert not differing(observations, made.observations)


WORLDS = ("anchor+pitch-0.3", "anchor+turned-tiles", "anchor+hexagons", "anchor+round", "anchor+moving-box")


@pytest.mark.parametrize("family", [*scenes.BASES, *WORLDS])
def test_true_poses_stand_clear_and_seeds_differ(family):
    made, other = scenes.make(family, 8, rows=300), scenes.make(family, 9, rows=300)
    arena, radius = made.scene.arena, made.scene.robot.body_radius_m
    assert all(arena.is_free(x, y, radius) for x, y in made.observations.truth[:, :2])
    assert differing(made.observations, other.observations)


def test_one_seed_draws_one_world_whatever_the_modifiers():
    one, other = scenes.make("anchor", 6), scenes.make("anchor+global", 6)
    assert one.scene.arena == other.scene.arena and other.scene.prior.kind == "uniform"
    assert not differing(one.observations, other.observations)
    faulty = scenes.make("anchor+outliers", 6)
    assert differing(one.observations, faulty.observations) == ["texture", "radial_m"]


def test_a_kidnap_carries_the_robot_far_and_odometry_does_not_know():
    made = scenes.make("anchor+kidnap", 7)
    row = made.kidnaps[0]
    truth = made.observations.truth[:, :2]
    assert np.hypot(*(truth[row] - truth[row - 1])) > 0.75
    assert np.hypot(*made.observations.odometry[row, :2]) < 0.05


def test_odometry_adds_up_to_the_true_path_but_for_its_noise():
    made = scenes.make("anchor", 10)
    poses = [made.observations.truth[0]]
    for step in made.observations.odometry[1:]:
        poses.append(geometry.compose(poses[-1], step))
    assert np.hypot(*(poses[-1] - made.observations.truth[-1])[:2]) < 0.3
    slipping = scenes.make("anchor+slip", 10).observations
    moved = np.hypot(*np.diff(slipping.truth[:, :2], axis=0).T)
    standing = (moved == 0.0) & (slipping.odometry[1:, 0] == 0.02)
    assert 20 <= standing.sum() <= 40


def test_heading_drifts_by_so_much_in_a_straight_metre_and_not_at_rest():
    metres, rows, drift_rad = 400, 50, 0.02
    path = np.zeros((metres * rows + 1, 3))
    path[:, 0] = np.arange(len(path)) / rows
    world = World(odometry=0.0, drift_rad=drift_rad)
    turns = odometry(path, world, np.random.default_rng(3))[:, 2].reshape(metres, rows).sum(axis=1)
    assert np.std(turns) == pytest.approx(drift_rad, rel=0.15)
    assert not odometry(np.zeros((rows, 3)), world, np.random.default_rng(3)).any()


def test_a_robot_that_explores_gets_about_and_reads_textures_only_in_steady_motion():
    made = scenes.make("robot", 18, rows=10)
    arena, robot, start = made.scene.arena, made.scene.robot, made.observations.truth[0]
    explored = explore(arena, robot, start, 1200, np.random.default_rng(18))
    assert np.ptp(explored.path[:, :2], axis=0).min() > 1.0
    assert np.isfinite(explored.radial_m).any(axis=0).all(), "every whisker measures something in two minutes"
    assert 0.05 < explored.held.mean() < 0.5 < explored.sweeping.mean() < 0.95
    assert not (explored.held & explored.sweeping).any()
    assert not (explored.sweeping[1:] & explored.held[:-1]).any(), "the windows of a whisk's end are the whisk's"


def test_held_back_odometry_comes_all_at_once():
    reported = np.array([[0.1, 0.0, math.pi / 2], [0.1, 0.0, 0.0], [0.1, 0.0, 0.0]])
    out = hold_back(reported, np.array([True, True, False]))
    assert np.allclose(out, [[0, 0, 0], [0, 0, 0], [0.1, 0.2, math.pi / 2]])
    assert np.array_equal(hold_back(reported, np.zeros(3, bool)), reported)


@pytest.mark.parametrize("fold,turn", [(2, math.pi), (4, math.pi / 2)])
def test_symmetric_arenas_look_alike_after_the_turn(fold, turn):
    made = scenes.make(f"symmetric{fold}", 12)
    arena = made.scene.arena
    poses = made.observations.truth
    middle = np.array([arena.size_m[0] / 2, arena.size_m[1] / 2, 0.0])
    c, s = math.cos(turn), math.sin(turn)
    offset = poses - middle
    rotated = middle + np.column_stack(
        [c * offset[:, 0] - s * offset[:, 1], s * offset[:, 0] + c * offset[:, 1], offset[:, 2] + turn]
    )
    for whisker in made.scene.robot.of_role("texture"):
        same = geometry.textures(arena, poses, whisker)[0] == geometry.textures(arena, rotated, whisker)[0]
        assert same.mean() > 0.99
    for whisker in made.scene.robot.of_role("object"):
        here, there = (geometry.ranges(arena, p, whisker) for p in (poses, rotated))
        assert np.mean(np.isclose(here, there) | (np.isinf(here) & np.isinf(there))) > 0.99


def test_both_range_finders_agree_with_sampling():
    made = scenes.make("free", 13)
    arena, whisker = made.scene.arena, made.scene.robot.of_role("object")[1]
    poses = made.observations.truth[:80]
    fast, one = geometry.ranges(arena, poses, whisker), geometry.range_test(arena, whisker)
    along = np.arange(0.0, whisker.length_m, 0.0005)
    for pose, distance in zip(poses, fast, strict=True):
        assert one(*pose) == pytest.approx(distance)
        x, y, a = geometry.compose(pose, np.array([*whisker.base_m, whisker.yaw_rad]))
        px, py = x + along * math.cos(a), y + along * math.sin(a)
        hit = (px <= 0) | (px >= arena.size_m[0]) | (py <= 0) | (py >= arena.size_m[1])
        for x0, y0, x1, y1 in arena.obstacles:
            hit |= (px >= x0) & (px <= x1) & (py >= y0) & (py <= y1)
        assert (along[hit.argmax()] if hit.any() else math.inf) == pytest.approx(distance, abs=0.001)


def test_faults_of_rows_do_what_they_say():
    plain = scenes.make("anchor", 14).observations
    doubled, dropped = (scenes.make(f"anchor+{fault}", 14).observations for fault in ("doubled", "dropped"))
    assert 610 < len(doubled) < 660 and 500 < len(dropped) < 580
    assert doubled.in_order().sum() == len(plain)
    for fault in ("late", "reordered"):
        moved = scenes.make(f"anchor+{fault}", 14).observations
        assert sorted(moved.t_s) == list(plain.t_s) and not moved.in_order().all()
    missed = scenes.make("anchor+missed", 14).observations
    assert np.isfinite(missed.radial_m).sum() == pytest.approx(0.9 * np.isfinite(plain.radial_m).sum(), rel=0.06)


def test_a_wrong_map_is_the_filters_alone():
    plain, wrong, lacking = (scenes.make(f, 15) for f in ("anchor", "anchor+map-tile", "anchor+map-obstacle"))
    assert not differing(plain.observations, wrong.observations)
    letters = zip("".join(plain.scene.arena.floor), "".join(wrong.scene.arena.floor), strict=True)
    assert sum(a != b for a, b in letters) == 1
    assert len(lacking.scene.arena.obstacles) == len(plain.scene.arena.obstacles) - 1


@pytest.mark.parametrize("metres,degrees", [(0.2, 0), (0.5, 0), (1, 0), (0, 90), (0, 180)])
def test_a_wrong_prior_is_off_by_so_much(metres, degrees):
    made = scenes.make(f"anchor+wrong-{f'{metres}m' if metres else f'{degrees}deg'}", 16)
    start = scenes.make("anchor", 16).observations.truth[0]
    off = np.array(made.scene.prior.mean) - start
    assert np.hypot(*off[:2]) == pytest.approx(metres, abs=0.03)
    assert abs(math.remainder(off[2], 2 * math.pi)) == pytest.approx(math.radians(degrees), abs=0.3)


def test_an_unknown_family_is_named():
    with pytest.raises(scenes.FamilyError, match="anchor"):
        scenes.make("nowhere", 1)
    with pytest.raises(scenes.FamilyError, match="global"):
        scenes.make("anchor+nothing", 1)


def test_a_run_becomes_a_scene(tmp_path):
    made = scenes.make("robot", 17, rows=200)
    scenes.write_scene(tmp_path / "run" / "scene", made.scene, made.observations)
    scene, observations = scenes.read_recording(tmp_path / "run")
    assert scene == made.scene and not differing(observations, made.observations)
    with pytest.raises(scenes.RecordingKindError, match="folder of a run"):
        scenes.read_recording(tmp_path)
