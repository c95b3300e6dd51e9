"""Other representations of a map by touch: grid maps and the factor graph, by their options, errors and figures."""

import json
import sys
from itertools import cycle

import numpy as np
import pytest
from mapkit import SEEDS

from crunchbot import cli
from crunchbot.nav import mapping
from crunchbot.nav.filters import ESTIMATE
from crunchbot.nav.grid_mapper import GridMapper
from crunchbot.nav.map_choice import evidence_of
from crunchbot.nav.map_graph import Borders, GraphMapper
from crunchbot.nav.mapper import Mapper, MappingError, Part
from crunchbot.occupancy import from_map
from crunchbot_lab.scenes import map_scoring, write_scene
from crunchbot_lab.scenes.making import make

ROWS = 2000


@pytest.fixture(scope="module")
def made():
    return make("anchor", 13, ROWS)


@pytest.mark.parametrize("representation", ["grid", "graph"])
def test_a_representation_maps_better_than_odometry(made, representation):
    if representation == "graph":
        pytest.importorskip("gtsam")
    textures = made.scene.arena.textures
    run = mapping.run(made.scene.robot, textures, made.observations, representation=representation)
    score = map_scoring.score(run, made.scene.arena)
    assert len(run.table) == len(run.step_us) == ROWS
    assert np.isfinite(run.table["pose"]).all() and np.isfinite(run.table["covariance"]).all()
    assert len(run.touched.faces) > 3
    assert score["error_median_m"] < score["odometry_error_median_m"]
    assert run.scene().arena.obstacles


def test_the_grid_of_cells_is_free_inside_and_solid_at_walls(made):
    mapper = GridMapper(made.scene.robot, made.scene.arena.textures)
    mapper.replay(made.observations, 0, ROWS)
    grid = mapper.map().grid
    assert grid.cell == 0.025
    assert 0.0 <= grid.occupied.min() < 0.05 and 0.6 < grid.occupied.max() <= 1.0
    assert (grid.occupied > 0.5).sum() < 0.1 * (grid.occupied < 0.5).sum()
    assert mapper.evidence != 0.0


def test_options_out_of_range_are_one_line(made):
    robot, textures = made.scene.robot, made.scene.arena.textures
    with pytest.raises(MappingError, match="^--particles 5001: outside 1 to 5000; choose a number inside$"):
        GridMapper(robot, textures, particles=5001)


def test_a_graph_without_its_package_is_one_line(made, monkeypatch, tmp_path, capsys):
    monkeypatch.setitem(sys.modules, "gtsam", None)
    with pytest.raises(MappingError, match="crunchbot.graph"):
        GraphMapper(made.scene.robot, made.scene.arena.textures)
    write_scene(tmp_path / "scene", made.scene, made.observations)
    words = ["map", str(tmp_path / "scene"), "--out", str(tmp_path / "map"), "--representation", "graph"]
    assert cli.main(words) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "gtsam" in error and "pip install" in error


def test_a_change_of_texture_is_a_border_where_it_was_crossed(made):
    borders = Borders(made.scene.robot, 2)
    sure, other = np.array([[0.0, -3.0]] * 2), np.array([[-3.0, 0.0]] * 2)
    found = []
    for k in range(60):
        found += [(k, *point) for point in borders.take(np.array([0.02, 0.0, 0.0]), sure if k < 30 else other)]
    tip = made.scene.robot.of_role("texture")[0].tip_m
    assert len(found) == 2
    row, x, _ = found[0]
    assert 30 <= row <= 33
    assert abs(x - (tip[0] - 0.02 * (row - 29.5))) < 0.03


def along(poses: np.ndarray) -> np.ndarray:
    """Estimates of these poses (n, 3)."""
    table = np.zeros(len(poses), ESTIMATE)
    table["pose"] = poses
    return table


def test_the_true_path_has_more_evidence_than_the_wheels(made):
    robot, textures, rows = made.scene.robot, made.scene.arena.textures, made.observations
    truth = along(from_map(rows.truth, tuple(rows.truth[0])))
    wheels = along(map_scoring.odometry_path(rows.odometry))
    true, reckoned = (evidence_of(robot, textures, rows, table) for table in (truth, wheels))
    assert true.shape == (ROWS,) and np.isfinite(true).all() and np.isfinite(reckoned).all()
    assert true.sum() > reckoned.sum() + 100.0


def test_faces_are_taken_where_they_explain_the_rows_better():
    scenes = [make("anchor", seed, ROWS) for seed in SEEDS]
    runs = [mapping.run(m.scene.robot, m.scene.arena.textures, m.observations, representation="auto") for m in scenes]
    assert all(run.representation == "faces" for run in runs)
    assert np.median([run.evidence for run in runs]) > 100.0


def test_the_command_says_what_was_taken(made, tmp_path, capsys):
    write_scene(tmp_path / "scene", made.scene, made.observations)
    words = ["map", str(tmp_path / "scene"), "--out", str(tmp_path / "map"), "--representation", "auto", "--json"]
    assert cli.main(words) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["representation"] == "faces" and reported["evidence_nats"] > 0.0


@pytest.mark.parametrize(("faces", "grid", "taken"), [(-7.0, -5.0, "grid"), (-5.0, -7.0, "faces")])
def test_what_is_taken_follows_the_evidence(made, monkeypatch, faces, grid, taken):
    reported = cycle((faces, grid))
    monkeypatch.setattr(mapping, "evidence_of", lambda *_: np.array([next(reported)]))
    options = (made.scene.robot, made.scene.arena.textures, made.observations)
    run, alone = (mapping.run(*options, representation=name) for name in (mapping.AUTO, taken))
    assert (run.representation, run.evidence) == (taken, 2.0)
    assert np.array_equal(run.table, alone.table)
    assert (run.step_us > 0.0).all()


def test_a_second_map_of_the_same_place_has_less_evidence(made):
    robot, textures, rows = made.scene.robot, made.scene.arena.textures, made.observations
    truth = along(from_map(rows.truth, tuple(rows.truth[0])))
    one, two = (evidence_of(robot, textures, rows, truth, frame) for frame in (None, np.arange(ROWS) // (ROWS // 2)))
    assert np.array_equal(one[: ROWS // 2], two[: ROWS // 2])
    assert one.sum() > two.sum() + 100.0


def test_a_robot_that_was_carried_off_is_the_faces():
    made = make("anchor+carried", 5, 3000)
    run = mapping.run(made.scene.robot, made.scene.arena.textures, made.observations, representation=mapping.AUTO)
    assert len(run.parts) == 2 and run.representation == "faces" and run.evidence > 0.0


def test_a_kidnap_that_was_none_is_the_grid(made, monkeypatch):
    """One that faces alone say costs them its prior."""
    monkeypatch.setattr(mapping, "evidence_of", lambda *_: np.zeros(ROWS))
    monkeypatch.setattr(Mapper, "parts", lambda _: [Part(0, 0, 0, None, None, None), Part(1, 50, 60, None, None, None)])
    options = (made.scene.robot, made.scene.arena.textures, made.observations)
    assert mapping.run(*options, representation=mapping.AUTO).representation == "grid"
