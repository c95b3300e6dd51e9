"""The pilot's choices by name, and the map of its own."""

import numpy as np
import pytest

from crunchbot.observation import EXPLORING, Quantity, Row
from crunchbot.pilot.wheels import EXACT
from crunchbot.planning.coverage import Way
from crunchbot.robot.policy import MAP, RANDOM, choices_of, expected
from crunchbot_lab.simulation.scenes import make_scene


def rows_of(scene, count):
    """Rows of a robot that drives straight on over ROUGH and meets nothing."""
    textures, names = scene.layout.of(Quantity.TEXTURE), scene.layout.names
    cells = [(1.0 if name.endswith("ROUGH") else -1.0) if name in textures else None for name in names]
    return [
        Row.made(EXPLORING, round(0.1 * (n + 1), 4), np.array([0.015, 0.0, 0.0]), names, cells) for n in range(count)
    ]


def test_random_choices_are_the_behaviours_own():
    random = object()
    assert choices_of(RANDOM, make_scene(1)[0].robot, EXACT, random) == (random, None) and expected(random) == {}


def test_a_map_of_the_pilots_own_follows_its_rows():
    scene, _ = make_scene(1)
    _, own = choices_of(MAP, scene.robot, EXACT, object())
    assert own.pose() is None
    for row in rows_of(scene, 40):
        own.row(row)
    assert own.pose() == pytest.approx((0.6, 0.0, 0.0), abs=0.02)
    assert own.map().grid.occupied.size and own.map().frame == 0


def test_health_says_what_a_way_is_expected_to_sweep():
    mapping, _ = choices_of(MAP, make_scene(1)[0].robot, EXACT, object())
    assert expected(mapping) == {"expects": "no pose yet"}
    mapping.way = Way(np.array([[0.4, 0.0]]), swept_m2=0.125, seconds=2.7)
    assert expected(mapping) == {"expects": "0.12 m2 of floor in 2.7 s"}
    mapping.way = Way(np.zeros((0, 2)), refused="no way")
    assert expected(mapping) == {"expects": "nothing: no way"}
