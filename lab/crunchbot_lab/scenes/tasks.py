"""Closed loops whose end is not a pose: a map of an unknown arena, and a tile that is suspected to be otherwise than mapped."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from crunchbot.nav.filters import FAVOURITE
from crunchbot.nav.mapper import Mapper, TouchMap
from crunchbot.nav.observations import Observations
from crunchbot.occupancy import to_map
from crunchbot.pilot.choices import Choices
from crunchbot.planning.choices import Planned
from crunchbot.planning.ground import ArenaMap, Ground
from crunchbot.planning.planner import Planner
from crunchbot.planning.tasks import Checking, Mapping
from crunchbot.planning.tiles import Tile, Tiles
from crunchbot.scene import Arena

from .closed import Loop
from .families import Recipe
from .geometry import LATTICE_M, free_lattice

MINUTES_5 = 3000  # rows
LOOK_ROWS = 500  # what reads along reads on each question, too


class MapLoop(Loop):
    """A robot that knows nothing of its arena. A mapper reads along, whose first pose is the origin."""

    look_rows = LOOK_ROWS

    def __init__(self, family: str | Recipe, seed: int, policy: Callable, rows: int = MINUTES_5):
        super().__init__(family, seed, policy, rows)
        self._pose = np.zeros(3)

    def _reads_along(self, filter: str) -> Mapper:
        return Mapper(self.robot, self.arena.textures, self.seed, normals=self.recipe.world.normal_sd_rad is not None)

    def _take(self, rows: Observations, first: int, table: np.ndarray) -> None:
        self._pose = table["pose"][-1].copy()
        placed = table.copy()
        placed["pose"] = to_map(table["pose"], tuple(map(float, self.begin)))
        super()._take(rows, first, placed)

    def pose(self) -> np.ndarray:
        """(3,) where the robot believes to be, in its map's frame."""
        self._read()
        return self._pose

    def known(self) -> TouchMap:
        """Its map."""
        self._read()
        return self._filter.map()

    def visited(self, rows: int | None = None) -> float:
        """The share of the tiles that it could reach, and has visited in its first `rows`; None: so far."""
        return share_visited(self.arena, self.robot.body_radius_m, np.array([self.begin, *self._truth_so_far()[:rows]]))


def mapping(loop: MapLoop, random: Choices) -> Mapping:
    """The policy of task map."""
    return Mapping(loop.robot, loop.vehicle, loop.pose, loop.known, random)


class CheckLoop(Loop):
    """A robot whose map has one tile, `tile` (column, row), with a texture of its own choice: `said`, None: the true one."""

    def __init__(
        self, family: str | Recipe, seed: int, tile: Tile, said: int | None, rows: int, filter: str = FAVOURITE
    ):
        self.suspect, self._said = tile, said
        super().__init__(family, seed, checking, rows, filter)
        self.tiles = Tiles(self.scene.arena, self.robot)
        self._last: tuple[np.ndarray, np.ndarray, float] | None = None

    def _mapped(self) -> Arena:
        floor = [list(row) for row in self.arena.floor]
        column, row = self.suspect
        if self._said is not None:
            floor[len(floor) - 1 - row][column] = self.arena.textures[self._said][0]
        return replace(self.arena, floor=tuple("".join(row) for row in floor))

    def _take(self, rows: Observations, first: int, table: np.ndarray) -> None:
        super()._take(rows, first, table)
        for k, row in enumerate(table):
            self._last = row["pose"], row["covariance"].reshape(3, 3), float(row["confidence"])
            self.tiles.take(*self._last, rows.texture[first + k])
        self.checking.look()

    def estimate(self) -> tuple[np.ndarray, np.ndarray, float] | None:
        """Pose, covariance and confidence after all rows so far."""
        self._read()
        return self._last

    def _is_over(self, row: int, until_locked: bool) -> bool:
        return bool(self.checking.result)

    def check(self) -> tuple[str, int]:
        """What was found, empty: nothing in all rows; and rows driven."""
        self.run()
        return self.checking.result, len(self._truth_so_far())


def checking(loop: CheckLoop, random: Choices) -> Checking:
    """The policy of task check."""
    ground = Ground.of(ArenaMap(loop.scene.arena), loop.robot)
    localise = Planned(Planner(ground, loop.vehicle), loop.belief, random)
    loop.checking = Checking(ground, loop.vehicle, loop.tiles, loop.estimate, localise, loop.suspect)
    return loop.checking


def reachable(arena: Arena, radius: float, start: Sequence[float]) -> np.ndarray:
    """(rows, columns) bool, row 0 the smallest y: tiles on which the middle of a body of this radius can stand that begins at
    `start` (x, y)."""
    free = free_lattice(arena, radius)
    row, column = np.nonzero(free)
    middles = LATTICE_M * (np.column_stack([column, row]) + 0.5)
    begun = np.hypot(*(middles - np.asarray(start[:2])).T).argmin()
    reached = np.zeros_like(free)
    reached[row[begun], column[begun]] = True
    count = 0
    while count != (count := int(reached.sum())):
        reached = _grown(reached) & free
    return _tiles(arena, middles[reached[row, column]])


def visited(arena: Arena, path: np.ndarray) -> np.ndarray:
    """(rows, columns) bool: tiles on which the middle of a robot was that went along a path (n, 2 or more)."""
    return _tiles(arena, path[:, :2])


def share_visited(arena: Arena, radius: float, path: np.ndarray) -> float:
    """Of the tiles that can be reached from a path's beginning."""
    could = reachable(arena, radius, path[0])
    return float((visited(arena, path) & could).sum() / could.sum())


def _tiles(arena: Arena, points: np.ndarray) -> np.ndarray:
    out = np.zeros(arena.floor_indices().shape, bool)
    column, row = (points / arena.tile_m).astype(int).T
    out[np.clip(row, 0, out.shape[0] - 1), np.clip(column, 0, out.shape[1] - 1)] = True
    return out


def _grown(cells: np.ndarray) -> np.ndarray:
    out = cells.copy()
    out[1:] |= cells[:-1]
    out[:-1] |= cells[1:]
    out[:, 1:] |= cells[:, :-1]
    out[:, :-1] |= cells[:, 1:]
    return out
