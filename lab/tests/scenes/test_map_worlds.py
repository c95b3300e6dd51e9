"""Worlds that are not as the mapper's priors have them: it stays bounded, and says no more than it knows."""

import math
from dataclasses import replace

import numpy as np
import pytest

from crunchbot.nav import mapping
from crunchbot_lab.scenes import map_scoring
from crunchbot_lab.scenes.arenas import scattered
from crunchbot_lab.scenes.families import recipe
from crunchbot_lab.scenes.faults import MINUTE_ROWS
from crunchbot_lab.scenes.making import make, make_recipe

ROWS = 1500


def run(made):
    return mapping.run(made.scene.robot, made.scene.arena.textures, made.observations)


def errors(mapped) -> tuple[float, float]:
    """Medians in m, of the mapper and of odometry alone."""
    truth = mapped.rows.truth
    mine = map_scoring.trajectory(mapped.table["pose"], truth)
    wheels = map_scoring.trajectory(map_scoring.odometry_path(mapped.rows.odometry), truth)
    return mine["error_median_m"], wheels["error_median_m"]


@pytest.mark.parametrize("pitch", [0.3, 0.42])
def test_tiles_of_other_sizes_are_found(pitch):
    mapped = run(make(f"anchor+pitch-{pitch:g}", 21, ROWS))
    assert mapped.touched.lattice is not None
    assert abs(mapped.touched.lattice.pitch - pitch) < 0.02
    mine, wheels = errors(mapped)
    assert mine < max(0.7 * wheels, 0.03)


def test_tiles_may_be_turned_against_the_walls():
    mapped = run(make("anchor+turned-tiles", 22, ROWS))
    mine, wheels = errors(mapped)
    assert mine < max(0.7 * wheels, 0.03)
    if mapped.touched.lattice is not None and mapped.touched.axes is not None:
        off = abs(math.remainder(mapped.touched.lattice.turn - mapped.touched.axes, math.pi / 2))
        assert off > math.radians(5)


def test_hexagons_do_no_harm():
    mine, wheels = errors(run(make("anchor+hexagons", 23, ROWS)))
    assert mine < max(wheels, 0.05)


def test_textures_renamed_half_way_do_no_harm():
    mine, wheels = errors(run(make("anchor+renamed", 24, ROWS)))
    assert mine < max(wheels, 0.06)


def test_a_minute_without_contact_or_texture_is_bounded_and_less_sure():
    mapped = run(make("anchor+silent-minute", 25, ROWS))
    spread, first = np.trace(mapped.table["covariance"][:, :2, :2], axis1=1, axis2=2), 2 * ROWS // 5
    assert spread[first + MINUTE_ROWS - 1] > 2.0 * spread[first]
    mine, wheels = errors(mapped)
    assert mine < max(wheels, 0.06)


def test_a_box_that_moves_leaves_the_map():
    mine, wheels = errors(run(make("anchor+moving-box", 26, 2 * ROWS)))
    assert mine < max(wheels, 0.05)


def test_a_round_wall_is_bounded():
    mapped = run(make("one-texture+round", 27, ROWS))
    mine, wheels = errors(mapped)
    assert mine < 2.0 * wheels  # chords of it pass for straight faces
    assert not all(mapped.touched.faces["right"])
    assert mapped.scene().arena.obstacles


def test_small_rooms_with_boxes_anywhere():
    made = make_recipe(replace(recipe("anchor"), arena=scattered((1.6, 1.6), (2.4, 2.0))), 28, ROWS)
    mine, wheels = errors(run(made))
    assert mine < max(0.8 * wheels, 0.03)
