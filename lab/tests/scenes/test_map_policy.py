"""The policy `map` in closed loop: tiles visited of an arena that is unknown, as a rate over seeds beside random."""

import math
from collections.abc import Callable

import numpy as np

from crunchbot.nav.mapper import Mapper, TouchMap
from crunchbot.nav.observations import Observations
from crunchbot.pilot.choices import Choices
from crunchbot.pilot.states import FULL
from crunchbot.pilot.wheels import EXACT
from crunchbot.planning.mapping import NO_WHISKERS, Mapping
from crunchbot.robot.policy import vehicle_of
from crunchbot.scene import Arena
from crunchbot_lab.scenes import walk
from crunchbot_lab.scenes.explorer import Explorer
from crunchbot_lab.scenes.families import recipe
from crunchbot_lab.scenes.files import rounded
from crunchbot_lab.scenes.geometry import LATTICE_M, free_lattice
from crunchbot_lab.scenes.making import ROW_S, explored_rows, streams

SEEDS, TWO_MINUTES = range(500, 518), 1200  # the mean of six seeds varies by 0.06
LOOK_ROWS = 500  # what reads along reads on each question, too


class MapLoop:
    """A robot that knows nothing of its arena, and what it does next may depend on what it has read so far. A mapper reads
    along, whose first pose is the origin. A seed's arena, start and noise are the same for every policy."""

    def __init__(self, family: str, seed: int, policy: Callable[["MapLoop", Choices], Choices], rows: int):
        self.recipe, self._seed, self._rows, self._fed = recipe(family), seed, rows, 0
        rng = streams(seed)
        self.robot = self.recipe.robot()
        self.arena = self.recipe.arena(rng["arena"], self.robot.body_radius_m)
        self.begin = walk.draw_pose(self.arena, self.robot.body_radius_m, rng["start"])
        normals = self.recipe.world.normal_sd_rad is not None
        self._mapper, self._pose = Mapper(self.robot, self.arena.textures, normals=normals), np.zeros(3)
        self._mover = Explorer(self.arena, self.robot, self.begin, rng["path"], FULL)
        self._mover.behaviour.choices = policy(self, self._mover.behaviour.choices)

    def run(self) -> np.ndarray:
        """(rows, 3) the true path."""
        for row in range(1, self._rows + 1):
            self._mover.row()
            if row % LOOK_ROWS == 0 or row == self._rows:
                self._read()
        return self._observations().truth

    def pose(self) -> np.ndarray:
        """(3,) where the robot believes to be, in its map's frame."""
        self._read()
        return self._pose

    def known(self) -> TouchMap:
        """Its map."""
        self._read()
        return self._mapper.map()

    def visited(self) -> float:
        """The share of the tiles that it could reach, and has visited."""
        return share_visited(self.arena, self.robot.body_radius_m, np.array(self._mover.path))

    def _read(self) -> None:
        """Lets the mapper take the rows that were driven since the last time."""
        done = len(self._mover.path) - 1
        if done > self._fed:
            table, _ = self._mapper.replay(self._observations(), self._fed, done - self._fed)
            self._pose, self._fed = table["pose"][-1].copy(), done

    def _observations(self) -> Observations:
        """All rows; those after the present one are of standing still. A row's readings depend on nothing later."""
        explored = self._mover.explored(self._rows)
        made = explored_rows(self.recipe, self.arena, self.robot, explored, streams(self._seed))
        made.t_s = (np.arange(self._rows) + 1) * ROW_S
        made.truth[:, 2] = np.remainder(made.truth[:, 2] + math.pi, 2 * math.pi) - math.pi
        return rounded(made)


def mapping(loop: MapLoop, random: Choices) -> Mapping:
    return Mapping(loop.robot, vehicle_of(EXACT), loop.pose, loop.known, random)


def as_it_is(loop: MapLoop, random: Choices) -> Choices:
    return random


def reachable(arena: Arena, radius: float, start: np.ndarray) -> np.ndarray:
    """(rows, columns) bool, row 0 the smallest y: tiles on which the middle of a body of this radius can stand that begins at
    `start` (x, y)."""
    free = free_lattice(arena, radius)
    row, column = np.nonzero(free)
    middles = LATTICE_M * (np.column_stack([column, row]) + 0.5)
    begun = np.hypot(*(middles - start[:2]).T).argmin()
    reached = np.zeros_like(free)
    reached[row[begun], column[begun]] = True
    count = 0
    while count != (count := int(reached.sum())):
        reached = grown(reached) & free
    return tiles(arena, middles[reached[row, column]])


def share_visited(arena: Arena, radius: float, path: np.ndarray) -> float:
    """Of the tiles that can be reached from a path's beginning, those on which the robot's middle was."""
    could = reachable(arena, radius, path[0])
    return float((tiles(arena, path[:, :2]) & could).sum() / could.sum())


def tiles(arena: Arena, points: np.ndarray) -> np.ndarray:
    out = np.zeros(arena.floor_indices().shape, bool)
    column, row = (points / arena.tile_m).astype(int).T
    out[np.clip(row, 0, out.shape[0] - 1), np.clip(column, 0, out.shape[1] - 1)] = True
    return out


def grown(cells: np.ndarray) -> np.ndarray:
    out = cells.copy()
    out[1:] |= cells[:-1]
    out[:-1] |= cells[1:]
    out[:, 1:] |= cells[:, :-1]
    out[:, :-1] |= cells[:, 1:]
    return out


def mean_visited(policy) -> float:
    loops = [MapLoop("robot", seed, policy, TWO_MINUTES) for seed in SEEDS]
    for loop in loops:
        loop.run()
    return float(np.mean([loop.visited() for loop in loops]))


def test_a_task_visits_more_than_chance():
    """In 2 minutes."""
    by_task, by_chance = mean_visited(mapping), mean_visited(as_it_is)
    assert by_task > 0.6 and by_task > by_chance + 0.05


def test_a_map_is_the_same_run_twice():
    first, second = (MapLoop("robot", 507, mapping, 300) for _ in range(2))
    assert np.array_equal(first.run(), second.run())


def test_the_mapper_does_not_know_the_truth():
    """Its frame is that of the first pose."""
    loop = MapLoop("robot", 508, mapping, 300)
    loop.run()
    assert 0.0 < np.hypot(*loop.pose()[:2]) < 5.0 and loop.known().frame == 0


def test_a_robot_without_whiskers_refuses_to_map():
    loop = MapLoop("no-whisker", 509, mapping, 100)
    path = loop.run()
    assert loop._mover.behaviour.choices.way.refused == NO_WHISKERS
    assert np.hypot(*(path[-1] - path[0])[:2]) == 0.0


def test_tiles_behind_a_box_cannot_be_reached():
    arena = Arena((2.0, 1.0), 0.5, ("SMOOTH",), ("SSSS", "SSSS"), ((0.9, 0.0, 1.1, 1.0),))
    could = reachable(arena, 0.1, np.array([0.3, 0.3]))
    assert could[:, :2].all() and not could[:, 2:].any()
    path = np.array([[0.3, 0.3, 0.0], [0.4, 0.7, 0.0], [0.3, 0.8, 0.0]])
    assert share_visited(arena, 0.1, path) == 0.5
