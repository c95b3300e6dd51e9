"""Which tiles of an arena a robot could visit, and which it has: its middle stood on them."""

from collections.abc import Sequence

import numpy as np

from crunchbot.scene import Arena

from .geometry import LATTICE_M, free_lattice


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
