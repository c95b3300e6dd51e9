"""Maps by touch alone: the mapper on drawn scenes, and `whisker map` from rows to a folder that `localise` takes."""

import json
import math

import numpy as np
import pytest
from mapkit import SEEDS, errors, mapped

from crunchbot import cli
from crunchbot.nav import localise, mapping
from crunchbot.nav.map_scene import map_scene
from crunchbot.occupancy import read_map
from crunchbot.scene import load
from crunchbot_lab.scenes import write_scene
from crunchbot_lab.scenes.making import make
from crunchbot_lab.scenes.map_scoring import best_motion, trajectory, true_faces

ROWS = 2000
BETTER = len(SEEDS) - 1  # scenes in which it is better than odometry, at least


@pytest.mark.parametrize(
    ("family", "most_m"), [("anchor", 0.04), ("free", 0.04), ("robot", 0.07), ("raw", 0.2), ("ring", 0.06)]
)
def test_poses_are_better_than_odometry(family, most_m):
    mine, wheels = errors(family, ROWS)
    assert np.median(mine) < min(most_m, 0.7 * np.median(wheels))
    assert (mine < wheels).sum() >= BETTER


def test_the_tiles_of_the_floor_are_found():
    made, run = mapped("anchor", 12, ROWS)
    assert run.touched.lattice is not None
    assert abs(run.touched.lattice.pitch - made.scene.arena.tile_m) < 0.02
    axes = run.touched.axes - run.touched.lattice.turn
    assert abs(math.remainder(axes, math.pi / 2)) < math.radians(1)


def test_cells_are_solid_and_free_as_often_as_they_are_said_to_be():
    made, run = mapped("anchor", 12, ROWS)
    grid, motion = run.touched.grid, best_motion(run.table["pose"][:, :2], made.observations.truth[:, :2])
    rows, columns = np.nonzero(np.abs(grid.occupied - 0.5) > 0.01)
    middles = np.column_stack([grid.x + (columns + 0.5) * grid.cell, grid.y + (rows + 0.5) * grid.cell])
    arena, said = made.scene.arena, grid.occupied[rows, columns]
    free = np.array([arena.is_free(x, y, 0.0) for x, y in motion.points(middles)])
    assert len(said) > 1000
    assert free[said < 0.05].mean() > 0.98
    assert free[said > 0.9].mean() < 0.25
    assert abs((1.0 - free.mean()) - said.mean()) < 0.1


def test_corners_are_as_far_off_as_they_are_said_to_be():
    made, run = mapped("anchor", 12, ROWS)
    motion = best_motion(run.table["pose"][:, :2], made.observations.truth[:, :2])
    truth = np.unique(true_faces(made.scene.arena)[:, :4].reshape(-1, 2), axis=0)
    found = run.touched.corners
    off = np.hypot(*np.moveaxis(motion.points(np.column_stack([found["x"], found["y"]]))[:, None] - truth, -1, 0))
    spread = np.sqrt(found["xx"] + found["yy"])
    assert len(found) >= 3
    assert (off.min(axis=1) < 3.0 * spread).mean() > 0.8
    assert ((found["xx"] > 0.0) & (found["xx"] * found["yy"] >= found["xy"] ** 2)).all()


def test_no_tiles_are_made_up():
    _, run = mapped("one-texture", 13, ROWS)
    assert run.touched.lattice is None and not run.touched.tiles


def test_the_same_rows_give_the_same_map():
    made = make("anchor", 14, 300)
    runs = [mapping.run(made.scene.robot, made.scene.arena.textures, made.observations) for _ in range(2)]
    assert np.array_equal(runs[0].table, runs[1].table)
    assert np.array_equal(runs[0].touched.faces, runs[1].touched.faces)


def test_a_robot_that_feels_nothing_is_less_and_less_sure():
    made = make("no-whisker", 3, 600)
    run = mapping.run(made.scene.robot, made.scene.arena.textures, made.observations)
    heading, place = run.table["covariance"][:, 2, 2], run.table["covariance"][:, 0, 0]
    assert heading[-1] > 2.0 * heading[50] and place[-1] > 2.0 * place[50]
    assert run.table["confidence"][-1] < run.table["confidence"][50]
    assert not len(run.touched.faces)
    assert run.scene().arena.obstacles == ()


@pytest.mark.parametrize(
    "family", ["anchor+outliers", "anchor+dead", "anchor+nan-second", "anchor+dropped", "anchor+reordered"]
)
def test_faults_leave_it_finite_and_better_than_odometry(family):
    for seed in SEEDS:
        table = mapped(family, seed, 1200)[1].table
        assert np.isfinite(table["pose"]).all() and np.isfinite(table["covariance"]).all()
    mine, wheels = errors(family, 1200)
    assert (mine < np.maximum(wheels, 0.06)).sum() >= BETTER


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """A scene folder without an arena, and its map."""
    made, where = make("anchor", 16, ROWS), tmp_path_factory.mktemp("map")
    write_scene(where / "scene", made.scene, made.observations)
    (where / "scene/arena.toml").unlink()
    assert cli.main(["map", str(where / "scene"), "--out", str(where / "map"), "--json"]) == 0
    return made, where / "scene", where / "map"


def test_the_map_is_a_scene_in_which_the_same_rows_are_located(folders):
    made, _, folder = folders
    result = localise.run("adaptive", load(folder), made.observations)
    assert trajectory(result.poses, made.observations.truth)["error_median_m"] < 0.08


def test_the_map_is_one_that_map_servers_read(folders):
    _, _, folder = folders
    occupancy, scene = read_map(folder / "map.yaml"), load(folder)
    assert occupancy.solid and occupancy.unknown
    assert np.allclose(occupancy.size_m, scene.arena.size_m, atol=0.05)
    assert load(folder, folder / "map.yaml").arena.obstacles


def test_what_is_wrong_is_one_line(tmp_path, capsys):
    assert cli.main(["map", str(tmp_path / "none"), "--out", str(tmp_path / "map")]) != 0
    assert "no such folder" in capsys.readouterr().err
    made = make("anchor", 1, 5)
    write_scene(tmp_path / "scene", made.scene, made.observations)
    (tmp_path / "scene/observations.csv").write_text("t_s,odo_x_m,odo_y_m,odo_theta_rad\n")
    assert cli.main(["map", str(tmp_path / "scene"), "--out", str(tmp_path / "map")]) != 0
    error = capsys.readouterr().err
    assert "observations.csv, line 1" in error and error.count("\n") == 1


def test_rows_of_no_length_make_a_map_of_nothing(tmp_path, capsys):
    made = make("anchor", 1, 3)
    write_scene(tmp_path / "scene", made.scene, made.observations)
    lines = (tmp_path / "scene/observations.csv").read_text().splitlines()
    (tmp_path / "scene/observations.csv").write_text(lines[0] + "\n")
    assert cli.main(["map", str(tmp_path / "scene"), "--out", str(tmp_path / "map"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["faces"] == 0
    load(tmp_path / "map")


def test_a_map_without_contacts_has_no_solid_cell():
    made, run = mapped("no-obstacle", 17, 5)
    where = map_scene(run.touched, run.table["pose"], made.observations, run.robot, run.textures)
    assert not where.arena.obstacles and (where.cells == 0).any()
