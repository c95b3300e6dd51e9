"""What whiskers would meet at every pose of a lattice, from a map that is asked for probabilities alone."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..scene import NOT_KNOWN_INDEX, Arena, Robot

CELL_M, TURNS = 0.05, 36  # of the lattice of poses
FINE_M = 0.025  # of the lattice of places
CELLS_MOST = 1_000_000  # poses; a larger map has wider cells
NOTHING = 255  # symbol of a reading that nobody can foretell
LIKELY = 0.5  # probability from which a place counts as occupied, or a class as a place's
FREE = 254  # symbol of an object whisker that reaches nothing


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
class Places:
    """By pose of a lattice (rows, columns, turns), row 0 the smallest y: `texture` (tips, ...) uint8, the class under each
    tip, or NOTHING; `reach` (object whiskers, ...) uint8, how far along each something stands, in steps of FINE_M, or FREE;
    `blocked` bool, the body does not fit there."""

    cell_m: float
    texture: np.ndarray
    reach: np.ndarray
    blocked: np.ndarray

    @classmethod
    def of(cls, known: Map, robot: Robot) -> "Places":
        """The readings that `known` and the geometry of `robot` foretell."""
        cell = max(CELL_M, math.sqrt(known.size_m[0] * known.size_m[1] * TURNS / CELLS_MOST))
        columns, rows = (max(1, math.ceil(side / cell)) for side in known.size_m)
        x, y = np.meshgrid((np.arange(columns) + 0.5) * cell, (np.arange(rows) + 0.5) * cell)
        fine, tips = _Fine(known), robot.of_role("texture")
        texture = np.full((len(tips), rows, columns, TURNS), NOTHING, np.uint8)
        shafts = [_shaft(whisker) for whisker in robot.of_role("object")]
        reach = np.full((len(shafts), rows, columns, TURNS), FREE, np.uint8)
        for turn in range(TURNS):
            heading = 2.0 * math.pi * turn / TURNS
            for n, tip in enumerate(tips):
                texture[n, ..., turn] = fine.symbol[fine.at(*_moved(x, y, heading, np.array([tip.tip_m])))][..., 0]
            for n, shaft in enumerate(shafts):
                met = fine.solid[fine.at(*_moved(x, y, heading, shaft))]
                reach[n, ..., turn] = np.where(met.any(axis=-1), met.argmax(axis=-1), FREE)
        body = _disc(robot.body_radius_m)
        blocked = fine.solid[fine.at(*_moved(x, y, 0.0, body))].any(axis=-1)
        return cls(cell, texture, reach, np.repeat(blocked[..., None], TURNS, axis=-1))

    def index(self, poses: np.ndarray) -> np.ndarray:
        """Flat index of the lattice's pose nearest to poses (..., 3)."""
        rows, columns, turns = self.blocked.shape
        column = np.clip((poses[..., 0] / self.cell_m).astype(np.int32), 0, columns - 1)
        row = np.clip((poses[..., 1] / self.cell_m).astype(np.int32), 0, rows - 1)
        turn = np.rint(poses[..., 2] * (turns / (2.0 * math.pi))).astype(np.int32) % turns
        return (row * columns + column) * turns + turn

    def spread(self, count: int) -> np.ndarray:
        """(count, 3) poses in which the body fits, spread evenly by a Kronecker sequence."""
        rows, columns, turns = self.blocked.shape
        golden = 1.22074408460575947536  # the real root of x^4 = x + 1
        draws = (np.arange(1, 40 * count + 1)[:, None] * golden ** -np.arange(1.0, 4.0)) % 1.0
        poses = draws * np.array([columns * self.cell_m, rows * self.cell_m, 2.0 * math.pi])
        return poses[~self.blocked.reshape(-1)[self.index(poses)]][:count]

    def tells_nothing(self) -> bool:
        """Whether every pose in which the body fits reads the same, so that no action can ever tell one from another."""
        free = ~self.blocked
        texture = self.texture[:, free]
        return bool((texture == texture[:, :1]).all() and (self.reach[:, free] == FREE).all())


class _Fine:
    """The map on a fine lattice of places, with a rim that is occupied."""

    def __init__(self, known: Map):
        columns, rows = (math.ceil(side / FINE_M) + 2 for side in known.size_m)
        x, y = np.meshgrid((np.arange(columns) - 0.5) * FINE_M, (np.arange(rows) - 0.5) * FINE_M)
        points = np.column_stack([x.ravel(), y.ravel()])
        classes = known.textures(points)
        symbol = np.where(classes.max(axis=1) > LIKELY, classes.argmax(axis=1), NOTHING)
        self.symbol = symbol.astype(np.uint8).reshape(rows, columns)
        self.solid = (known.occupied(points) > LIKELY).reshape(rows, columns)

    def at(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(row, column) of places."""
        rows, columns = self.solid.shape
        column = np.clip(np.floor(x / FINE_M).astype(np.int32) + 1, 0, columns - 1)
        return np.clip(np.floor(y / FINE_M).astype(np.int32) + 1, 0, rows - 1), column


def _moved(x: np.ndarray, y: np.ndarray, heading: float, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) of the robot's frame in the world, for each place of the robot: two (..., n)."""
    c, s = math.cos(heading), math.sin(heading)
    return x[..., None] + c * points[:, 0] - s * points[:, 1], y[..., None] + s * points[:, 0] + c * points[:, 1]


def _shaft(whisker) -> np.ndarray:
    """(n, 2) points along an object whisker, robot's frame."""
    along = np.linspace(0.0, whisker.length_m, max(2, math.ceil(whisker.length_m / FINE_M) + 1))[:, None]
    return np.array(whisker.base_m) + along * np.array([math.cos(whisker.yaw_rad), math.sin(whisker.yaw_rad)])


def _disc(radius_m: float) -> np.ndarray:
    """(n, 2) points on a round body's rim, and its middle."""
    angle = np.linspace(0.0, 2.0 * math.pi, max(8, math.ceil(2.0 * math.pi * radius_m / FINE_M)), endpoint=False)
    return np.vstack([[0.0, 0.0], radius_m * np.column_stack([np.cos(angle), np.sin(angle)])])
