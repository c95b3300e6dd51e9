"""The scorer of maps: right maps score full marks, and each thing that is wrong costs its own figure."""

import math

import numpy as np
import pytest

from crunchbot import cli
from crunchbot.nav import mapping
from crunchbot.nav.mapper import FACE, TouchMap
from crunchbot.tables import TableError
from crunchbot_lab.scenes import map_reading, map_scoring, write_scene
from crunchbot_lab.scenes.making import make

TURN, SHIFT = 0.7, np.array([0.3, -1.1])


def away(points: np.ndarray) -> np.ndarray:
    """World points in a map's frame of its own."""
    return map_scoring.Motion(TURN, *SHIFT).points(np.asarray(points, float))


def drawn(arena, off_m: float = 0.0, turn: float = 0.0) -> TouchMap:
    """The true faces as a map, each moved along its normal and turned."""
    faces = np.zeros(len(map_scoring.true_faces(arena)), FACE)
    for n, (x0, y0, x1, y1, normal) in enumerate(map_scoring.true_faces(arena)):
        shift = off_m * np.array([math.cos(normal), math.sin(normal)])
        (a, b), (c, d) = away(np.array([[x0, y0], [x1, y1]]) + shift)
        faces[n] = (a, b, c, d, normal + TURN + turn, 0.01, 0.01, 10, n, 1)
    return TouchMap(faces, TURN, None, {})


@pytest.fixture(scope="module")
def scene():
    return make("anchor", 3, 800)


@pytest.fixture(scope="module")
def back(scene):
    truth = scene.observations.truth
    return map_scoring.best_motion(away(truth[:, :2]), truth[:, :2])


def test_true_faces_in_another_frame_are_right(scene, back):
    arena = scene.scene.arena
    found = map_scoring.faces_score(drawn(arena), back, arena)
    assert found["faces_right"] == 1.0 and found["faces_median_m"] < 1e-9
    corners = map_scoring.corners_score(drawn(arena), back, arena, scene.observations.truth)
    assert corners == {"corners_found": 1.0, "corners_false": 0.0}


def test_faces_off_or_turned_are_not(scene, back):
    arena = scene.scene.arena
    assert map_scoring.faces_score(drawn(arena, off_m=0.02), back, arena)["faces_right"] < 0.2
    assert map_scoring.faces_score(drawn(arena, turn=0.03), back, arena)["faces_right"] == 0.0
    assert map_scoring.faces_score(drawn(arena, off_m=0.01), back, arena)["faces_right"] > 0.8


def test_poses_are_judged_with_and_without_alignment(scene):
    truth = scene.observations.truth
    poses = np.column_stack([away(truth[:, :2]), truth[:, 2] + TURN])
    found = map_scoring.trajectory(poses, truth)
    assert found["error_median_m"] < 1e-9 and found["anchored_median_m"] < 1e-9
    poses[0, 2] += 0.1  # the first heading alone is wrong
    found = map_scoring.trajectory(poses, truth)
    assert found["error_median_m"] < 1e-9 and found["anchored_median_m"] > 0.05


def test_regions_that_are_too_small_hold_less(scene):
    truth = scene.observations.truth
    noise = np.random.default_rng(1).standard_normal((len(truth), 2))
    poses = truth.copy()
    poses[1:, :2] += 0.02 * noise[1:]
    covariance = np.tile(np.diag([4e-4, 4e-4, 1e-4]), (len(truth), 1, 1))
    assert 0.82 < map_scoring.coverage(poses, covariance, truth) < 0.97
    assert map_scoring.coverage(poses, covariance / 16, truth) < 0.4


@pytest.fixture(scope="module")
def mapped_folder(scene, tmp_path_factory):
    """A scene folder, and what `whisker map` writes of it."""
    where = tmp_path_factory.mktemp("maps")
    write_scene(where / "scene", scene.scene, scene.observations)
    assert cli.main(["map", str(where / "scene"), "--out", str(where / "map"), "--json"]) == 0
    return where


def test_what_the_command_writes_is_judged_as_the_mapper_itself(scene, mapped_folder):
    arena, rows = scene.scene.arena, scene.observations
    read, cells = map_reading.read_map_folder(mapped_folder / "map", scene.scene, rows)
    whole = map_scoring.judged(read, arena)
    mapper = map_scoring.judged(mapping.run(scene.scene.robot, arena.textures, rows, quiet=True), arena)
    for key in ("error_median_m", "anchored_median_m", "coverage_90", "odometry_error_median_m", "tiles_right"):
        assert whole[key] == pytest.approx(mapper[key], abs=2e-5), key
    assert whole["error_median_m"] < 0.05 and whole["tiles_right"] > 0.9
    assert whole["faces_right"] == pytest.approx(mapper["faces_right"], abs=0.02)
    motion = map_scoring.best_motion(read.table["pose"][:, :2], rows.truth[:, :2])
    free = map_scoring.cells_score(cells, motion, arena)
    assert free["free_right"] > 0.95 and free["solid_right"] > 0.8


def test_an_occupancy_that_is_off_is_wrong(scene, back):
    arena = scene.scene.arena
    sides = (np.arange(-0.0125, side + 0.025, 0.025) for side in arena.size_m)
    middles = np.stack(np.meshgrid(*sides), -1).reshape(-1, 2)
    solid = np.array([not arena.is_free(x, y, 0.0) for x, y in middles], float)
    cells = np.column_stack([away(middles), solid])
    assert map_scoring.cells_score(cells, back, arena) == {"solid_right": 1.0, "free_right": 1.0}
    wrong = map_scoring.cells_score(cells, map_scoring.Motion(back.turn, back.x + 0.3, back.y), arena)
    assert wrong["solid_right"] < 0.9 and wrong["free_right"] < 0.95
    swapped = np.column_stack([cells[:, :2], 1.0 - solid])
    assert map_scoring.cells_score(swapped, back, arena)["free_right"] == 0.0


def test_rows_without_a_pose_are_carried_on_by_odometry(scene, mapped_folder, tmp_path):
    lines = (mapped_folder / "map/est.csv").read_text().splitlines()
    (tmp_path / "est.csv").write_text("\n".join(lines[:2] + lines[11::10]) + "\n")
    mapped, cells = map_reading.read_map_folder(tmp_path, scene.scene, scene.observations)
    whole, _ = map_reading.read_map_folder(mapped_folder / "map", scene.scene, scene.observations)
    assert cells is None and not len(mapped.touched.faces)
    assert np.abs(mapped.table["pose"][:, :2] - whole.table["pose"][:, :2]).max() < 0.1
    assert np.array_equal(mapped.table["pose"][10::10], whole.table["pose"][10::10])
    (tmp_path / "est.csv").write_text("\n".join(lines[:1] + lines[11::10]) + "\n")
    with pytest.raises(TableError, match="no pose of the first row"):
        map_reading.read_map_folder(tmp_path, scene.scene, scene.observations)
