"""A sensor of the user's own finds a robot that has nothing else; a belief can be set while running."""

import math

import numpy as np
import pytest

from crunchbot.nav.filters import Filter, Sensor, SettingError
from crunchbot.scene import Arena, Prior, Robot, Scene

LEVELS, CELL_M, ROWS = 8, 0.1, 150


def dark_room(seed: int):
    """A robot with no whisker under a ceiling whose brightness, in LEVELS codes, is smooth and different everywhere."""
    x, y = np.meshgrid(*(np.arange(20) * CELL_M,) * 2)
    light = np.sin(2.1 * x + 0.3) + np.cos(1.7 * y - 0.4) + 0.8 * np.sin(1.3 * x * y)
    codes = np.digitize(light, np.quantile(light, np.arange(1, LEVELS) / LEVELS)).astype(np.uint8)
    arena = Arena((2.0, 2.0), 1.0, ("FLOOR",), ("FF", "FF"), ())
    scene = Scene(arena, Robot(0.1, 0.05, 0.005, ()), Prior("uniform"))
    return scene, Sensor(codes, CELL_M, spacing_m=0.05), np.random.default_rng(seed)


@pytest.mark.parametrize("name", ["grid", "adaptive", "particle"])
def test_a_light_sensor_alone_finds_the_robot(name):
    scene, sensor, rng = dark_room(1)
    filter = Filter(name, scene, seed=1, sensors=[sensor])
    pose, confidence = np.array([1.0, 0.6, 0.2]), 0.0
    for k in range(ROWS):
        step = 0.03, 0.06  # a circle within the room
        pose = pose + [step[0] * math.cos(pose[2]), step[0] * math.sin(pose[2]), step[1]]
        code = sensor.codes[int(pose[1] / CELL_M), int(pose[0] / CELL_M)]
        said = code if rng.random() < 0.8 else rng.integers(LEVELS)
        loglik = np.where(np.arange(LEVELS) == said, math.log(0.8), math.log(0.2 / LEVELS))
        found = filter.step_values(0.1 * (k + 1), (step[0], 0.0, step[1]), np.zeros((0, 1)), [], loglik)
        confidence = found.confidence
    assert math.dist(found.pose[:2], pose[:2]) < 0.1
    assert confidence > 0.7
    filter.step_values(0.1 * (ROWS + 1), (0.0, 0.0, 0.0), np.zeros((0, 1)), [], [0.0, math.nan] + [0.0] * (LEVELS - 2))
    assert filter.bad_cells == 1


def test_a_belief_is_set_while_running():
    scene, sensor, _ = dark_room(1)
    filter = Filter("adaptive", scene, seed=1, sensors=[sensor])
    filter.set_prior(Prior("gaussian", (0.5, 1.5, 1.0), (0.02, 0.02, 0.03)))
    nothing = np.zeros((0, 1)), [], np.full(LEVELS, math.nan)
    found = filter.step_values(0.1, (0.0, 0.0, 0.0), *nothing)
    assert math.dist(found.pose[:2], (0.5, 1.5)) < 0.02
    filter.set_prior(Prior("uniform"))
    assert filter.step_values(0.2, (0.0, 0.0, 0.0), *nothing).confidence < 0.1


def test_a_map_of_no_codes_is_refused():
    scene, *_ = dark_room(1)
    with pytest.raises(SettingError, match="sensor 0: no map of codes"):
        Filter("grid", scene, sensors=[Sensor(np.zeros((0, 3), np.uint8), 0.1)])
