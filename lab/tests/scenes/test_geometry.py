"""What a scene's robot meets in an arena: distances worked out by hand, and fast functions against plain ones."""

import math

import numpy as np
import pytest

from crunchbot.scene import Arena, Whisker
from crunchbot_lab.scenes import geometry

LONG = Arena((3.0, 1.0), 0.5, ("VINYL",), ("VVVVVV", "VVVVVV"), ((1.01, 0.41, 1.52, 0.62),))
LEFTWARD = Whisker("left", "object", base_m=(0.0, 0.0), yaw_rad=math.pi / 2, length_m=0.2)


@pytest.mark.parametrize(
    ("pose", "distance_m"),
    [
        ((2.9, 0.5, -math.pi / 2), 0.1),  # walls: right, left, upper, lower
        ((0.1, 0.5, math.pi / 2), 0.1),
        ((0.5, 0.9, 0.0), 0.1),
        ((0.5, 0.1, math.pi), 0.1),
        ((2.9, 0.9, -math.pi / 4), 0.1 * math.sqrt(2)),
        ((1.2, 0.31, 0.0), 0.1),  # the block, from below and from its right
        ((1.57, 0.5, math.pi / 2), 0.05),
        ((0.5, 0.5, 0.3), math.inf),
        ((2.9, 0.5, math.pi / 2), math.inf),
    ],
)
def test_a_whisker_meets_walls_and_blocks_of_an_arena_longer_than_wide(pose, distance_m):
    assert geometry.ranges(LONG, np.array([pose]), LEFTWARD) == pytest.approx([distance_m])
    assert geometry.range_test(LONG, LEFTWARD)(*pose) == pytest.approx(distance_m)


@pytest.mark.parametrize(
    ("pose", "direction"),
    [
        ((2.9, 0.5, -math.pi / 2), math.pi),  # walls: right, left, upper, lower
        ((0.1, 0.5, math.pi / 2), 0.0),
        ((0.5, 0.9, 0.2), -math.pi / 2),
        ((0.5, 0.1, math.pi), math.pi / 2),
        ((1.2, 0.31, 0.0), -math.pi / 2),  # the block, from below and from its right
        ((1.57, 0.5, math.pi / 2), 0.0),
        ((1.015, 0.31, 0.0), math.nan),  # its corner, the room's, nothing
        ((2.997, 0.9, 0.0), math.nan),
        ((0.5, 0.5, 0.3), math.nan),
    ],
)
def test_a_face_is_met_as_it_lies(pose, direction):
    (reported,) = geometry.directions(LONG, np.array([pose]), LEFTWARD, 0.01)
    assert np.cos([reported]) == pytest.approx([math.cos(direction)], abs=1e-9, nan_ok=True)
    assert np.sin([reported]) == pytest.approx([math.sin(direction)], abs=1e-9, nan_ok=True)


@pytest.mark.parametrize("radius", [0.0, 0.1, 0.165])
def test_what_is_free_for_a_scene_is_free_for_the_arena_with_some_to_spare(radius):
    free = geometry.free_test(LONG, radius)
    x, y = np.random.default_rng(1).uniform((0.0, 0.0), LONG.size_m, (2000, 2)).T
    reported = [free(*place) for place in zip(x, y, strict=True)]
    assert reported == [LONG.is_free(*place, radius + geometry.CLEAR_M) for place in zip(x, y, strict=True)]
    assert 0.2 < np.mean(reported) < 0.99


@pytest.mark.parametrize("radius", [0.0, geometry.LATTICE_M / 2 - geometry.CLEAR_M, 0.1, 0.165])
def test_the_lattice_is_free_where_its_squares_middles_are(radius):
    """Also where a middle is exactly so far from the wall as the body reaches: there it is not free."""
    free = geometry.free_test(LONG, radius)
    columns, rows = (np.arange(geometry.LATTICE_M / 2, side, geometry.LATTICE_M).tolist() for side in LONG.size_m)
    lattice = geometry.free_lattice(LONG, radius)
    assert lattice.tolist() == [[free(x, y) for x in columns] for y in rows]
    assert 0.2 < lattice.mean() < 0.99


@pytest.mark.parametrize("turned", [False, True])
def test_what_hangs_together_is_counted_from_the_arenas_middle(turned):
    free = np.ones((30, 12), bool)
    free[[12, 17]] = False  # the middle's piece: four rows of 28
    share = geometry.connected_share(free.T if turned else free)
    assert share == pytest.approx(4 / 28)


def test_motions_lead_from_each_pose_of_a_path_to_the_next():
    rng = np.random.default_rng(2)
    path = np.column_stack([rng.uniform(0.0, 3.0, (50, 2)), rng.uniform(-math.pi, math.pi, 50)])
    path[10:13, :2] = path[10, :2]  # it turns on the spot
    motions = geometry.motions(path)
    reached = geometry.compose(path[:-1], motions)
    assert np.allclose(reached[:, :2], path[1:, :2])
    assert np.allclose(np.exp(1j * reached[:, 2]), np.exp(1j * path[1:, 2]))
    assert np.all(np.abs(motions[:, 2]) <= math.pi)
