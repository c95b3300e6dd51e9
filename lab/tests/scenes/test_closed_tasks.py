"""Tasks in closed loop, as rates over seeds: tiles visited of an arena that is unknown, beside random; a tile that is checked."""

import numpy as np
import pytest

from crunchbot.planning.tasks import NO_WHISKERS, NOT_REACHABLE
from crunchbot.scene import Arena
from crunchbot_lab.scenes.closed import Loop
from crunchbot_lab.scenes.tasks import CheckLoop, MapLoop, mapping, reachable, share_visited

SEEDS, TWO_MINUTES = range(500, 518), 1200  # the mean of six seeds varies by 0.06


def as_it_is(loop, random):
    return random


def shares(family, policy):
    loops = [MapLoop(family, seed, policy, TWO_MINUTES) for seed in SEEDS]
    for loop in loops:
        loop.run(until_locked=False)
    return [loop.visited() for loop in loops]


def test_a_task_visits_more_than_chance():
    """In 2 minutes."""
    by_task, by_chance = (np.mean(shares("robot", policy)) for policy in (mapping, as_it_is))
    assert by_task > 0.6 and by_task > by_chance + 0.05


def test_a_map_is_the_same_run_twice():
    first, second = (MapLoop("robot", 507, mapping, 300) for _ in range(2))
    assert np.array_equal(first.run(False).truth, second.run(False).truth)


def test_the_mapper_does_not_know_the_truth():
    """Its frame is that of the first pose, and its error is that of a mapper on the same rows."""
    loop = MapLoop("robot", 508, mapping, 300)
    out = loop.run(until_locked=False)
    assert np.hypot(*loop.pose()[:2]) < 5.0 and 0.0 < np.median(out.error_m) < 0.3
    assert loop.known().frame == 0


def test_a_robot_without_whiskers_refuses_to_map():
    made = []

    def policy(loop, random):
        made.append(mapping(loop, random))
        return made[0]

    loop = MapLoop("no-whisker", 509, policy, 100)
    out = loop.run(until_locked=False)
    assert made[0].way.refused == NO_WHISKERS
    assert np.hypot(*(out.truth[-1] - out.truth[0])[:2]) == 0.0


@pytest.mark.parametrize("family", ["robot", "anchor"])
def test_a_tile_is_found_as_it_is(family):
    right = []
    for seed in SEEDS:
        loop = Loop(family, seed, as_it_is, 1)
        floor, tiles = (
            loop.arena.floor_indices(),
            np.argwhere(reachable(loop.arena, loop.robot.body_radius_m, loop.begin)),
        )
        row, column = np.random.default_rng(seed).permutation(tiles)[0]
        for said in (None, int((floor[row, column] + 1) % 3)):
            found, rows = CheckLoop(family, seed, (int(column), int(row)), said, 1200).check()
            true = loop.arena.textures[floor[row, column]]
            right.append(found == ("as mapped" if said is None else f"otherwise: {true}"))
            assert not found or rows < 1200
    assert sum(right) >= 10  # of 12: measured 10 for the robot


def test_a_tile_under_a_box_is_not_reachable():
    loop = Loop("anchor", 510, as_it_is, 1)
    x, y = loop.arena.obstacles[0][:2]
    tile = (round(x / loop.arena.tile_m), round(y / loop.arena.tile_m))
    assert CheckLoop("anchor", 510, tile, None, 1200).check()[0] == NOT_REACHABLE


def test_tiles_behind_a_box_cannot_be_reached():
    arena = Arena((2.0, 1.0), 0.5, ("SMOOTH",), ("SSSS", "SSSS"), ((0.9, 0.0, 1.1, 1.0),))
    could = reachable(arena, 0.1, (0.3, 0.3))
    assert could[:, :2].all() and not could[:, 2:].any()
    path = np.array([[0.3, 0.3, 0.0], [0.4, 0.7, 0.0], [0.3, 0.8, 0.0]])
    assert share_visited(arena, 0.1, path) == 0.5
