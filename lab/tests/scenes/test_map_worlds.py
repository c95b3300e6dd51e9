"""Worlds that are not as the mapper's priors have them: it stays bounded, and says no more than it knows."""

import math
from dataclasses import replace

import numpy as np
import pytest

from crunchbot.nav import mapping
from crunchbot_lab.scenes import map_scoring
from crunchbot_lab.scenes.arenas import scattered, tiled
from crunchbot_lab.scenes.families import recipe
from crunchbot_lab.scenes.geometry import compose, motions, ranges
from crunchbot_lab.scenes.making import make, make_recipe

ROWS = 1500
ACCURACY = 0.85


def run(scene, rows):
    return mapping.run(scene.robot, scene.arena.textures, rows)


def errors(mapped) -> tuple[float, float]:
    """Medians in m, of the mapper and of odometry alone."""
    truth = mapped.rows.truth
    mine = map_scoring.trajectory(mapped.table["pose"], truth)
    wheels = map_scoring.trajectory(map_scoring.odometry_path(mapped.rows.odometry), truth)
    return mine["error_median_m"], wheels["error_median_m"]


def with_floor(made, texture_at, seed: int):
    """The same rows on a floor whose texture at (x, y) (n,), (n,) is texture_at(x, y) (n,)."""
    rng, rows = np.random.default_rng(seed), made.observations
    classes, texture = len(made.scene.arena.textures), rows.texture.copy()
    for n, tip in enumerate(made.scene.robot.of_role("texture")):
        x, y = compose(rows.truth, np.array([*tip.tip_m, 0.0]))[:, :2].T
        true = texture_at(x, y) % classes
        said = np.where(rng.random(len(true)) < ACCURACY, true, (true + rng.integers(1, classes, len(true))) % classes)
        texture[:, n] = math.log((1.0 - ACCURACY) / (classes - 1))
        texture[np.arange(len(said)), n, said] = math.log(ACCURACY)
    return replace(rows, texture=texture)


def mixed(a, b):
    """A texture's number for a cell (a, b), without order."""
    return ((a * 7919 + b * 104729) ^ (a * 31 + b * 17)) // 3


@pytest.mark.parametrize("pitch", [0.3, 0.42])
def test_tiles_of_other_sizes_are_found(pitch):
    made = make("anchor", 21, ROWS)
    rows = with_floor(made, lambda x, y: mixed(np.floor(x / pitch).astype(int), np.floor(y / pitch).astype(int)), 1)
    mapped = run(made.scene, rows)
    assert mapped.touched.lattice is not None
    assert abs(mapped.touched.lattice.pitch - pitch) < 0.02
    mine, wheels = errors(mapped)
    assert mine < max(0.7 * wheels, 0.03)


def test_tiles_may_be_turned_against_the_walls():
    made, turn = make("anchor", 22, ROWS), math.radians(30)
    c, s = math.cos(turn), math.sin(turn)

    def texture_at(x, y):
        return mixed(np.floor((c * x + s * y) / 0.45).astype(int), np.floor((c * y - s * x) / 0.45).astype(int))

    mapped = run(made.scene, with_floor(made, texture_at, 2))
    mine, wheels = errors(mapped)
    assert mine < max(0.7 * wheels, 0.03)
    if mapped.touched.lattice is not None and mapped.touched.axes is not None:
        off = abs(math.remainder(mapped.touched.lattice.turn - mapped.touched.axes, math.pi / 2))
        assert off > math.radians(5)


def test_hexagons_do_no_harm():
    made = make("anchor", 23, ROWS)

    def texture_at(x, y):
        q, r = (x * math.sqrt(3) / 3 - y / 3) / 0.28, (2 * y / 3) / 0.28
        a, b, c = np.round(q), np.round(-q - r), np.round(r)
        da, db, dc = np.abs(a - q), np.abs(b + q + r), np.abs(c - r)
        a = np.where((da > db) & (da > dc), -b - c, a)
        c = np.where((dc >= da) & (dc > db), -a - b, c)
        return mixed(a.astype(int), c.astype(int))

    mine, wheels = errors(run(made.scene, with_floor(made, texture_at, 3)))
    assert mine < max(wheels, 0.05)


def test_textures_renamed_half_way_do_no_harm():
    made = make("anchor", 24, ROWS)
    texture = made.observations.texture.copy()
    texture[ROWS // 2 :] = np.roll(texture[ROWS // 2 :], 1, axis=2)
    mine, wheels = errors(run(made.scene, replace(made.observations, texture=texture)))
    assert mine < max(wheels, 0.06)


def test_a_minute_without_contact_or_texture_is_bounded_and_less_sure():
    made = make("anchor", 25, ROWS)
    rows = replace(
        made.observations, texture=made.observations.texture.copy(), radial_m=made.observations.radial_m.copy()
    )
    rows.texture[600:1200], rows.radial_m[600:1200] = np.nan, np.nan
    mapped = run(made.scene, rows)
    spread = np.trace(mapped.table["covariance"][:, :2, :2], axis1=1, axis2=2)
    assert spread[1199] > 2.0 * spread[600]
    mine, wheels = errors(mapped)
    assert mine < max(wheels, 0.06)


def test_a_box_that_moves_leaves_the_map():
    made = make_recipe(replace(recipe("anchor"), arena=tiled(blocks=3)), 26, 2 * ROWS)
    arena, rows = made.scene.arena, made.observations
    later = replace(arena, obstacles=arena.obstacles[1:])
    radial = rows.radial_m.copy()
    for n, ray in enumerate(made.scene.robot.of_role("object")):
        gone = np.isinf(ranges(later, rows.truth, ray)) & np.isfinite(ranges(arena, rows.truth, ray))
        radial[ROWS:, n] = np.where(gone[ROWS:], np.inf, radial[ROWS:, n])
    mine, wheels = errors(run(made.scene, replace(rows, radial_m=radial)))
    assert mine < max(wheels, 0.05)


def round_rows(made, radius: float, seed: int):
    """A drive inside a round wall about the origin, with the rows of the scene's robot."""
    rng, x, y, heading, left = np.random.default_rng(seed), 0.0, 0.0, 0.0, 0.0
    path = [(x, y, heading)]
    for _ in range(ROWS):
        ahead = (x + 0.02 * math.cos(heading), y + 0.02 * math.sin(heading))
        if left > 0.0:
            heading, left = heading + 0.2, left - 0.2
        elif math.hypot(*ahead) < radius - 0.17:
            (x, y), heading = ahead, heading + 0.01 * rng.standard_normal()
        else:
            left = rng.uniform(math.pi / 3, math.pi)
        path.append((x, y, heading))
    path = np.array(path)
    radial = np.full((ROWS, len(made.scene.robot.of_role("object"))), np.inf)
    for n, ray in enumerate(made.scene.robot.of_role("object")):
        base = compose(path[1:], np.array([*ray.base_m, ray.yaw_rad]))
        along = base[:, 0] * np.cos(base[:, 2]) + base[:, 1] * np.sin(base[:, 2])
        reach = -along + np.sqrt(np.maximum(along**2 + radius**2 - (base[:, :2] ** 2).sum(axis=1), 0.0))
        noisy = np.maximum(reach + 0.005 * rng.standard_normal(ROWS), 0.0)
        radial[:, n] = np.where(reach <= ray.length_m, noisy, np.inf)
    odometry = motions(path) * (1.0 + 0.05 * rng.standard_normal((ROWS, 3)))
    truth = path[1:].copy()
    return replace(
        made.observations,
        odometry=odometry,
        radial_m=radial,
        truth=truth,
        texture=np.full_like(made.observations.texture, np.nan),
    )


def test_a_round_wall_is_bounded():
    made = make("anchor", 27, ROWS)
    mapped = run(made.scene, round_rows(made, 1.2, 4))
    mine, wheels = errors(mapped)
    assert mine < 2.0 * wheels  # chords of it pass for straight faces
    assert not all(mapped.touched.faces["right"])
    assert mapped.scene().arena.obstacles


def test_small_rooms_with_boxes_anywhere():
    made = make_recipe(replace(recipe("anchor"), arena=scattered((1.6, 1.6), (2.4, 2.0))), 28, ROWS)
    mine, wheels = errors(run(made.scene, made.observations))
    assert mine < max(0.8 * wheels, 0.03)
