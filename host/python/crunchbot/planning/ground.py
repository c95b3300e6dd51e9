"""What is known of the ground by cell: the floor's class, and how far from it something solid stands."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..scene import NOT_KNOWN_INDEX, Arena, Robot

CELL_M = 0.01
CELLS_MOST = 1_000_000  # a larger map has wider cells
NOTHING = 255  # class of a floor that nobody knows
LIKELY = 0.5  # probability from which a place counts as occupied, or a class as a place's


class Map(Protocol):
    """Where a planner's knowledge of a place comes from: a known arena, or a map as it grows."""

    @property
    def size_m(self) -> tuple[float, float]:
        """Extent from the origin, m."""
        ...

    def textures(self, points: np.ndarray) -> np.ndarray:
        """(n, classes) probabilities of the floor's classes at points (n, 2), m; a row sums to at most 1: the rest is none
        of them."""
        ...

    def occupied(self, points: np.ndarray) -> np.ndarray:
        """(n,) probabilities that something stands at points (n, 2), m."""
        ...


class ArenaMap:
    """An arena that is known. Ground never mapped is as likely occupied as not."""

    def __init__(self, arena: Arena):
        self._arena, self._floor, self.size_m = arena, arena.floor_indices(), arena.size_m

    def textures(self, points: np.ndarray) -> np.ndarray:
        """As in `Map`: 0 or 1."""
        column, row = (np.clip((points / self._arena.tile_m).astype(int), 0, np.array(self._floor.shape[::-1]) - 1)).T
        index = self._floor[row, column]
        out = np.zeros((len(points), len(self._arena.textures)))
        known = index != NOT_KNOWN_INDEX
        out[np.nonzero(known)[0], index[known]] = 1.0
        return out

    def occupied(self, points: np.ndarray) -> np.ndarray:
        """As in `Map`: 0, 0.5 or 1."""
        out = (~_in_box(points, (0.0, 0.0, *self.size_m))).astype(float)
        for box in self._arena.unknown:
            out[_in_box(points, box)] = LIKELY
        for box in self._arena.obstacles:
            out[_in_box(points, box)] = 1.0
        return out


def _in_box(points: np.ndarray, box: tuple[float, float, float, float]) -> np.ndarray:
    return (points > box[:2]).all(axis=1) & (points < box[2:]).all(axis=1)


@dataclass(frozen=True)
class Ground:
    """Cells of `cell_m`, (rows, columns), row 0 the smallest y, the corner of the first at `corner_m` of x and of y: `texture`
    uint8, a class or NOTHING, and `clear_m` float32, from a cell's middle to what is solid, as far as `robot` reaches."""

    robot: Robot
    cell_m: float
    corner_m: float
    texture: np.ndarray
    clear_m: np.ndarray

    @classmethod
    def of(cls, known: Map, robot: Robot) -> "Ground":
        """What `known` holds for `robot`, with a rim of one cell that is solid."""
        cell = max(CELL_M, math.sqrt(known.size_m[0] * known.size_m[1] / CELLS_MOST))
        columns, rows = (math.ceil(side / cell - 1e-9) + 2 for side in known.size_m)
        x, y = np.meshgrid((np.arange(columns) - 0.5) * cell, (np.arange(rows) - 0.5) * cell)
        points = np.column_stack([x.ravel(), y.ravel()])
        classes = known.textures(points)
        symbol = np.where(classes.max(axis=1) > LIKELY, classes.argmax(axis=1), NOTHING).astype(np.uint8)
        solid = (known.occupied(points) > LIKELY).reshape(rows, columns)
        clear = clearance(solid, cell, reach(robot) + 2.0 * cell)
        return cls(robot, cell, -cell, symbol.reshape(rows, columns), clear)

    def spread(self, count: int) -> np.ndarray:
        """(count, 3) poses in which the body fits, spread evenly by a Kronecker sequence."""
        rows, columns = self.clear_m.shape
        golden = 1.22074408460575947536  # the real root of x^4 = x + 1
        draws = (np.arange(1, 40 * count + 1)[:, None] * golden ** -np.arange(1.0, 4.0)) % 1.0
        column, row = (draws[:, :2] * (columns, rows)).astype(int).T
        fits = self.clear_m[row, column] >= self.robot.body_radius_m
        at = draws * (columns * self.cell_m, rows * self.cell_m, 2.0 * math.pi) + (self.corner_m, self.corner_m, 0.0)
        return at[fits][:count]

    def says_nothing(self) -> bool:
        """Whether every pose in which the body fits reads the same, so that no action can ever tell one from another."""
        feels = any(_far(whisker) > self.robot.body_radius_m for whisker in self.robot.of_role("object"))
        if feels and (self.clear_m == 0.0).any():
            return False
        floor = self.texture[self.clear_m > 0.0]
        return not self.robot.of_role("texture") or not len(floor) or bool((floor == floor[0]).all())


def reach(robot: Robot) -> float:
    """m from the robot's middle to the farthest that its body or an object whisker reaches."""
    return max([robot.body_radius_m, *map(_far, robot.of_role("object"))])


def _far(whisker) -> float:
    (x, y), yaw, length = whisker.base_m, whisker.yaw_rad, whisker.length_m
    return max(math.hypot(x, y), math.hypot(x + length * math.cos(yaw), y + length * math.sin(yaw)))


def clearance(solid: np.ndarray, cell_m: float, most_m: float) -> np.ndarray:
    """(rows, columns) float32: m from each cell's middle to the edge of the nearest of the solid ones (rows, columns) bool, at
    least 0; beyond `most_m` only that it is further."""
    rows, columns = solid.shape
    most = math.ceil(most_m / cell_m) + 1
    k = np.broadcast_to(np.arange(columns), solid.shape)
    left = np.maximum.accumulate(np.where(solid, k, -most - columns), axis=1)
    right = np.minimum.accumulate(np.where(solid, k, 2 * columns + most)[:, ::-1], axis=1)[:, ::-1]
    along = np.full((rows + 2 * most, columns), float(most**2), np.float32)
    along[most : most + rows] = np.minimum(np.minimum(k - left, right - k), most) ** 2
    nearest = along[most : most + rows].copy()
    for off in range(-most, most + 1):
        np.minimum(nearest, along[most + off : most + off + rows] + np.float32(off**2), out=nearest)
    return np.maximum(np.sqrt(nearest) - np.float32(0.5), np.float32(0.0)) * np.float32(cell_m)
