"""Sensors of a user's own: a table of likelihoods in a scene folder, NumPy functions, and what those do wrong."""

import math
import re
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commandkit import run

from crunchbot.nav import localise
from crunchbot.nav.filters import Filter, SettingError
from crunchbot.nav.observations import Observations
from crunchbot.nav.own import OwnSensor
from crunchbot.observation import Row
from crunchbot.robot.network.inbox import Received
from crunchbot.robot.network.row_checks import RowChecks
from crunchbot.robot.network.rows import to_message, to_row
from crunchbot.robot.network.streams import Envelope
from crunchbot.scene import Arena, Prior, Robot, Scene, SceneError, Whisker, load
from crunchbot.sensor_tables import NOT_KNOWN, SensorTable
from crunchbot.tables import TableError
from crunchbot_lab import scenes

SIDE_M, CELL_M, LEVELS, ROWS = 2.0, 0.1, 8, 150
ARENA = Arena((SIDE_M, SIDE_M), 1.0, ("FLOOR",), ("FF", "FF"), ())
BLIND = Robot(0.1, 0.05, 0.005, ())


def brightness(x, y):
    """Smooth, and different everywhere."""
    return np.sin(2.1 * x + 0.3) + np.cos(1.7 * y - 0.4) + 0.8 * np.sin(1.3 * x * y)


def circle(row: int) -> tuple[np.ndarray, tuple[float, float, float]]:
    """Pose after a row, and its motion."""
    radius, turn = 0.5, 0.06
    angle = turn * (row + 1)
    pose = (1.0 + radius * math.sin(angle), 0.5 + radius * (1.0 - math.cos(angle)), math.remainder(angle, math.tau))
    return np.array(pose), (2 * radius * math.sin(turn / 2), 0.0, turn)


def lit_scene() -> tuple[Scene, Observations]:
    """A light sensor that reads brightness with noise, and its table of likelihoods."""
    middle = (np.arange(20) + 0.5) * CELL_M
    light = brightness(*np.meshgrid(middle, middle))
    cuts = np.quantile(light, np.arange(1, LEVELS) / LEVELS)
    edges = np.concatenate([[-4.0], cuts, [4.0]])
    confused = 0.7 * np.eye(LEVELS) + 0.3 / LEVELS
    codes = np.digitize(light, cuts).astype(np.uint8)
    codes[0, 0] = NOT_KNOWN
    sensor = SensorTable("light", (0.05, 0.0), 0.05, 0.2, codes, CELL_M, edges, confused)
    scene = Scene(ARENA, Robot(0.1, 0.05, 0.005, (), (sensor,)), Prior("uniform"))
    rng, own, truth, odometry = np.random.default_rng(2), [], [], []
    for row in range(ROWS):
        pose, step = circle(row)
        seen = brightness(pose[0] + 0.05 * math.cos(pose[2]), pose[1] + 0.05 * math.sin(pose[2]))
        own.append([seen + 0.05 * rng.standard_normal()])
        truth.append(pose)
        odometry.append(step)
    empty = np.empty((ROWS, 0))
    times = 0.1 * (np.arange(ROWS) + 1)
    rows = Observations(times, [], np.array(odometry), np.empty((ROWS, 0, 1)), empty, np.array(truth), np.array(own))
    return scene, scenes.files.rounded(rows)


def test_a_table_of_likelihoods_in_a_scene_folder_finds_the_robot(tmp_path, capsys):
    scene, rows = lit_scene()
    scenes.write_scene(tmp_path, scene, rows)
    again = load(tmp_path)
    (sensor,), (made,) = again.robot.sensors, scene.robot.sensors
    assert (sensor.codes == made.codes).all() and np.array_equal(sensor.edges, made.edges)
    assert np.array_equal(sensor.likelihood, made.likelihood) and (sensor.at_m, sensor.cell_m) == ((0.05, 0.0), 0.1)
    read = localise.read_observations(localise.observations_path(tmp_path), again)
    assert np.array_equal(read.own, rows.own)
    for name in ("grid", "adaptive"):
        off = np.hypot(*(localise.run(name, again, read).poses - rows.truth)[:, :2].T)
        assert np.median(off[60:]) < 0.05, name
    row = {"t_s": 0.1, "odo_x_m": 0.0, "odo_y_m": 0.0, "odo_theta_rad": 0.0, "light": 0.5}
    filter = Filter("grid", again)
    cells = [
        filter.step(row | {"t_s": 0.1 * n, "light": value}) and filter.bad_cells
        for n, value in enumerate((0.5, None, math.nan, 99.0, math.inf), start=1)
    ]
    assert cells == [0, 0, 0, 1, 2]
    assert run(capsys, "localise", tmp_path, "--filter", "grid", "--json")[0] == 0


def test_a_row_of_the_network_may_hold_a_sensors_reading():
    lit, _ = lit_scene()
    feeler = Whisker("feeler", "object", base_m=(0.1, 0.0), yaw_rad=0.0, length_m=0.1)
    scene = replace(lit, robot=replace(lit.robot, whiskers=(feeler,)))
    row = {"t_s": 0.1, "odo_x_m": 0.0, "odo_y_m": 0.0, "odo_theta_rad": 0.0, "feeler_mm": None}
    faults = []
    for cells in ({}, {"light": 0.5}, {"light": None}, {"dark": 0.5}):
        message = to_message(Row.of(row | cells), 0, np.zeros(3))
        faults.append(RowChecks(scene)(Received("observation", message, Envelope(1, 0, 0))))
        assert to_row(message) == row | cells
    assert faults[:3] == [""] * 3 and "no whisker has the cell dark" in faults[3]


@pytest.mark.parametrize(
    "name, old, new, reported",
    [
        ("robot.toml", 'map = "light.png"', 'map = "none.png"', "'map' .*none.png: cannot be read"),
        ("robot.toml", "    0.05,\n    0.0,\n", "    0.05,\n", "'at_m' must be a list of 2"),
        ("light.csv", "from,to", "from,too", "column 'to' is missing"),
        ("light.csv", "-4.0", "9.0", "line 2: 'from' and 'to' are no bin"),
        ("light.csv", "0.0375,0.0375", "-1,0.0375", "line 2: a likelihood is negative"),
    ],
)
def test_what_is_wrong_with_a_sensors_files_is_reported_in_a_line(tmp_path, name, old, new, reported):
    scenes.write_scene(tmp_path, *lit_scene())
    text = (tmp_path / name).read_text()
    assert old in text
    (tmp_path / name).write_text(text.replace(old, new, 1))
    with pytest.raises((SceneError, TableError), match=reported) as caught:
        load(tmp_path)
    assert "\n" not in str(caught.value)


ANCHOR = (0.0, 0.0)
RANGES = np.arange(0.05, 3.0, 0.05)


def to_anchor(x, y):
    return np.hypot(x - ANCHOR[0], y - ANCHOR[1])


def near(reading: float, levels: np.ndarray) -> np.ndarray:
    return -0.5 * ((reading - levels) / 0.1) ** 2


def test_numpy_functions_are_a_sensor():
    """Ranges to one corner, from a start whose place is known to 30 cm."""
    own = OwnSensor((SIDE_M, SIDE_M), 0.05, to_anchor, near, RANGES)
    scene = Scene(ARENA, BLIND, Prior("gaussian", (1.3, 0.5, 0.06), (0.3, 0.3, 0.1)))
    filter, rng = Filter("grid", scene, sensors=[own.sensor]), np.random.default_rng(1)
    for row in range(100):
        pose, step = circle(row)
        reading = own.read(to_anchor(*pose[:2]) + 0.1 * rng.standard_normal())
        found = filter.step_values(0.1 * (row + 1), step, np.zeros((0, 1)), [], reading)
    assert math.dist(found.pose[:2], pose[:2]) < 0.1 and found.confidence > 0.9
    assert filter.bad_cells == 0 and (own.raised, own.bad, own.skipped) == (0, 0, 0)


def raising(reading, levels):
    raise ZeroDivisionError("no\nsignal")


@pytest.mark.parametrize(
    "loglik, counted, reported",
    [
        (raising, "raised", "ZeroDivisionError: no signal"),
        (lambda reading, levels: levels * np.nan, "bad", r"shape \(59,\) with 59 nan"),
        (lambda reading, levels: [1.0], "bad", r"shape \(1,\) .*\(59,\) numbers are wanted"),
        (lambda reading, levels: np.full(len(levels), -np.inf), "bad", "numbers are wanted"),
        (lambda reading, levels: "many", "raised", "ValueError: could not convert"),
    ],
)
def test_what_a_function_does_wrong_costs_its_readings_and_is_counted(loglik, counted, reported):
    own = OwnSensor((SIDE_M, SIDE_M), 0.05, to_anchor, loglik, RANGES)
    filter = Filter(
        "grid", Scene(ARENA, BLIND, Prior("gaussian", (1.0, 0.5, 0.0), (0.1, 0.1, 0.1))), sensors=[own.sensor]
    )
    found = [filter.step_values(0.1 * n, (0.0, 0.0, 0.0), np.zeros((0, 1)), [], own.read(1.0)) for n in (1, 2, 3)]
    assert getattr(own, counted) == 3 and filter.bad_cells == 0
    assert math.dist(found[-1].pose[:2], (1.0, 0.5)) < 0.02, "a reading that is left out moves nothing"
    assert re.search(reported, own.last_error) and "\n" not in own.last_error


def test_a_slow_function_is_asked_as_often_as_its_budget_allows():
    now = [0.0]

    def slow(reading, levels):
        now[0] += 1 / 16
        return near(reading, levels)

    own = OwnSensor((SIDE_M, SIDE_M), 0.05, to_anchor, slow, RANGES, budget_s=1 / 64, clock=lambda: now[0])
    asked = [np.isfinite(own.read(1.0)).all() for _ in range(500)]
    assert sum(asked) == own.slow == 125 and own.skipped == 375 and now[0] == 500 / 64
    assert "took 62 ms, 16 are granted" in own.last_error


@pytest.mark.parametrize(
    "options, reported",
    [
        ({"cell_m": 0.0}, "cell_m: 0 x 0 cells"),
        ({"cell_m": 1e-4}, "cell_m: 20000 x 20000 cells"),
        ({"levels": np.arange(256.0)}, "levels: not 1 to 255"),
        ({"levels": [1.0, 1.0]}, "levels: not 1 to 255"),
        ({"expected": lambda x, y: raising(x, y)}, "expected: ZeroDivisionError: no signal"),
        ({"expected": lambda x, y: 1.0}, r"expected: gave shape \(\)"),
    ],
)
def test_a_map_that_cannot_be_is_refused_in_a_line(options, reported):
    given = {"cell_m": 0.05, "expected": to_anchor, "loglik": near, "levels": RANGES} | options
    with pytest.raises(SettingError, match=reported):
        OwnSensor((SIDE_M, SIDE_M), **given)


def test_the_example_of_a_light_sensor_finds_its_robot():
    example = Path(__file__).resolve().parents[2] / "examples/light_sensor.py"
    assert runpy.run_path(str(example))["main"]() < 0.1
