"""Worlds that are not as the mapper's priors have them: it stays bounded, and says no more than it knows."""

import math
from dataclasses import replace

import numpy as np
import pytest
from mapkit import MANY, SEEDS, errors, errors_of, map_made, mapped

from crunchbot_lab.scenes.arenas import scattered
from crunchbot_lab.scenes.families import recipe
from crunchbot_lab.scenes.faults import MINUTE_ROWS
from crunchbot_lab.scenes.making import make_recipe

ROWS = 1500
BETTER = len(SEEDS) - 1  # scenes in which it does no harm, at least
UNHARMED = 10  # the same, of MANY


@pytest.mark.parametrize("pitch", [0.3, 0.42])
def test_tiles_of_other_sizes_are_found(pitch):
    family = f"anchor+pitch-{pitch:g}"
    lattices = [mapped(family, seed, ROWS)[1].touched.lattice for seed in SEEDS]
    assert sum(lattice is not None and abs(lattice.pitch - pitch) < 0.02 for lattice in lattices) >= BETTER
    mine, wheels = errors(family, ROWS)
    assert (mine < np.maximum(0.7 * wheels, 0.03)).sum() >= BETTER


def test_tiles_may_be_turned_against_the_walls():
    mine, wheels = errors("anchor+turned-tiles", ROWS)
    assert (mine < np.maximum(0.7 * wheels, 0.03)).sum() >= BETTER
    for seed in SEEDS:
        touched = mapped("anchor+turned-tiles", seed, ROWS)[1].touched
        if touched.lattice is not None and touched.axes is not None:
            off = abs(math.remainder(touched.lattice.turn - touched.axes, math.pi / 2))
            assert off > math.radians(5)


@pytest.mark.parametrize(
    ("family", "rows", "most_m"),
    [
        ("anchor+hexagons", ROWS, 0.05),
        ("anchor+silent-minute", ROWS, 0.06),
        ("anchor+moving-box", 2 * ROWS, 0.05),
    ],
)
def test_a_world_of_another_kind_does_no_harm(family, rows, most_m):
    mine, wheels = errors(family, rows)
    assert (mine < np.maximum(wheels, most_m)).sum() >= BETTER


def test_textures_renamed_half_way_do_no_harm():
    mine, wheels = errors("anchor+renamed", ROWS, MANY)
    assert (mine < np.maximum(wheels, 0.06)).sum() >= UNHARMED


def test_a_minute_without_contact_or_texture_is_less_sure():
    for seed in SEEDS:
        table, first = mapped("anchor+silent-minute", seed, ROWS)[1].table, 2 * ROWS // 5
        spread = np.trace(table["covariance"][:, :2, :2], axis1=1, axis2=2)
        assert spread[first + MINUTE_ROWS - 1] > 2.0 * spread[first]


def test_a_round_wall_is_bounded():
    _, run = mapped("one-texture+round", 27, ROWS)
    mine, wheels = errors_of(run)
    assert mine < 2.0 * wheels  # chords of it pass for straight faces
    assert not all(run.touched.faces["right"])
    assert run.scene().arena.obstacles


def test_small_rooms_with_boxes_anywhere():
    small = replace(recipe("anchor"), arena=scattered((1.6, 1.6), (2.4, 2.0)))
    found = [errors_of(map_made(make_recipe(small, seed, ROWS))) for seed in SEEDS]
    assert sum(mine < max(0.8 * wheels, 0.03) for mine, wheels in found) >= BETTER
