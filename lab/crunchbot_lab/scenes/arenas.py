"""Arenas drawn at random. An arena is taken when nearly all its free space hangs together for the robot.

Every maker takes (rng, body radius) and returns an Arena.
"""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from crunchbot.scene import Arena

from .geometry import connected_share, free_lattice

TEXTURES = ("VINYL", "SMOOTH", "ROUGH")
MORE_TEXTURES = (*TEXTURES, "CORK", "FELT", "GRIT")
CONNECTED_LEAST = 0.98
TRIES = 500

FINE_M = 0.025  # tiles that stand for a floor of other shapes
STEP_M = 0.01  # of the boxes that stand for a round wall

Cell = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]  # x, y (m) -> numbers of the cell there
Maker = Callable[[np.random.Generator, float], Arena]


def connected(draw: Callable[[], Arena], radius: float) -> Arena:
    """The first arena of `draw()` whose free space is one piece for a body of this radius."""
    for _ in range(TRIES):
        arena = draw()
        if connected_share(free_lattice(arena, radius)) >= CONNECTED_LEAST:
            return arena
    raise ValueError(f"no connected arena in {TRIES} tries; draw fewer or smaller obstacles")


def random_floor(columns: int, rows: int, textures: tuple[str, ...], rng: np.random.Generator) -> tuple[str, ...]:
    """Letters at random, every texture at least once if there are tiles enough."""
    letters = [name[0] for name in textures]
    tiles = columns * rows
    drawn = (letters + [letters[k] for k in rng.integers(len(letters), size=tiles)])[:tiles]
    rng.shuffle(drawn)
    return tuple("".join(drawn[columns * k : columns * (k + 1)]) for k in range(rows))


def tiled(tiles: int = 5, blocks: int = 3, textures: tuple[str, ...] = TEXTURES) -> Maker:
    """The paper's: square, tiles of 0.5 m, solid blocks of one tile each."""
    edge = 0.5

    def make(rng: np.random.Generator, radius: float) -> Arena:
        def draw() -> Arena:
            floor = random_floor(tiles, tiles, textures, rng)
            places = [divmod(int(n), tiles) for n in rng.choice(tiles * tiles, blocks, replace=False)]
            boxes = tuple((edge * i, edge * j, edge * (i + 1), edge * (j + 1)) for i, j in places)
            return Arena((edge * tiles, edge * tiles), edge, textures, floor, boxes)

        return connected(draw, radius)

    return make


def scattered(
    low: tuple[float, float], high: tuple[float, float], per_m2: float = 0.5, textures: tuple[str, ...] = TEXTURES
) -> Maker:
    """Any size from `low` to `high` in m, tiles of 0.3 to 0.6 m that need not divide it, boxes anywhere."""

    def make(rng: np.random.Generator, radius: float) -> Arena:
        size = tuple(float(round(rng.uniform(a, b), 3)) for a, b in zip(low, high, strict=True))
        tile = float(round(rng.uniform(0.3, 0.6), 3))
        columns, rows = (int(np.ceil(side / tile - 1e-6)) for side in size)
        count = max(1, round(per_m2 * size[0] * size[1]))

        def draw() -> Arena:
            boxes = tuple(_box(size, rng) for _ in range(count))
            return Arena(size, tile, textures, random_floor(columns, rows, textures, rng), boxes)

        return connected(draw, radius)

    return make


def _box(size: tuple[float, float], rng: np.random.Generator) -> tuple[float, float, float, float]:
    """A box of 0.1 to 0.45 m a side, somewhere."""
    width, depth = rng.uniform(0.1, 0.45, 2)
    x, y = rng.uniform(0.0, size[0] - width), rng.uniform(0.0, size[1] - depth)
    return tuple(float(round(v, 3)) for v in (x, y, x + width, y + depth))


def symmetric(folds: int) -> Maker:
    """The paper's square, alike after a turn by 180 (two folds) or 90 degrees (four) about its centre."""
    edge, tiles, turns = 0.5, 5, {2: (0, 2), 4: (0, 1, 2, 3)}[folds]

    def make(rng: np.random.Generator, radius: float) -> Arena:
        def draw() -> Arena:
            floor = rng.integers(len(TEXTURES), size=(tiles, tiles))
            blocked = np.zeros((tiles, tiles), bool)
            blocked.flat[rng.integers(tiles * tiles)] = True
            for turn in turns[1:]:
                mask = _first_wedge(tiles, folds, turn)
                floor = np.where(mask, np.rot90(floor, turn), floor)
            blocked = np.any([np.rot90(blocked, turn) for turn in turns], axis=0)
            letters = tuple("".join(TEXTURES[k][0] for k in row) for row in floor)
            boxes = tuple(
                (edge * i, edge * (tiles - 1 - j), edge * (i + 1), edge * (tiles - j)) for j, i in np.argwhere(blocked)
            )
            return Arena((edge * tiles,) * 2, edge, TEXTURES, letters, tuple(tuple(map(float, b)) for b in boxes))

        return connected(draw, radius)

    return make


def _first_wedge(tiles: int, folds: int, turn: int) -> np.ndarray:
    """Tiles that get their texture from the first wedge by this turn (a multiple of 90 degrees)."""
    numbers = np.arange(tiles * tiles).reshape(tiles, tiles)
    images = [np.rot90(numbers, t) for t in ({2: (0, 2), 4: (0, 1, 2, 3)}[folds])]
    first = np.min(images, axis=0)
    return (np.rot90(numbers, turn) == first) & (numbers != first)


def one_texture(rng: np.random.Generator, radius: float) -> Arena:
    """The paper's with the same floor everywhere; the other textures exist but lie nowhere."""
    arena = tiled()(rng, radius)
    return Arena(arena.size_m, arena.tile_m, arena.textures, ("V" * 5,) * 5, arena.obstacles)


def empty(rng: np.random.Generator, radius: float) -> Arena:
    """The paper's without blocks."""
    return tiled(blocks=0)(rng, radius)


def with_tiles(make: Maker, edge: float) -> Maker:
    """The same arenas with square tiles of another size."""

    def made(rng: np.random.Generator, radius: float) -> Arena:
        arena = make(rng, radius)
        columns, rows = (math.ceil(side / edge - 1e-6) for side in arena.size_m)
        return replace(arena, tile_m=edge, floor=random_floor(columns, rows, arena.textures, rng))

    return made


def with_cells(make: Maker, cell: Cell) -> Maker:
    """The same arenas with a floor of cells that are no tiles, each of one texture. The arena has fine tiles in their place."""

    def made(rng: np.random.Generator, radius: float) -> Arena:
        arena = make(rng, radius)
        columns, rows = (math.ceil(side / FINE_M - 1e-6) for side in arena.size_m)
        x, y = np.meshgrid((np.arange(columns) + 0.5) * FINE_M, (np.arange(rows)[::-1] + 0.5) * FINE_M)
        numbers = np.stack([part.astype(int) for part in cell(x, y)], axis=-1)
        _, which = np.unique(numbers.reshape(-1, 2), axis=0, return_inverse=True)
        letters = np.array([name[0] for name in arena.textures])[
            rng.integers(len(arena.textures), size=which.max() + 1)
        ]
        floor = tuple("".join(row) for row in letters[which].reshape(rows, columns))
        return replace(arena, tile_m=FINE_M, floor=floor)

    return made


def turned(edge: float, turn: float) -> Cell:
    """Square cells of this edge, turned by `turn` rad."""
    c, s = math.cos(turn), math.sin(turn)
    return lambda x, y: (np.floor((c * x + s * y) / edge), np.floor((c * y - s * x) / edge))


def hexagons(side: float) -> Cell:
    """Regular hexagons with sides of this length: axial coordinates, rounded to the nearest middle."""

    def cell(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        q, r = (math.sqrt(3) * x - y) / (3 * side), 2 * y / (3 * side)
        exact = np.stack([q, r, -q - r])
        near = np.round(exact)
        off = np.abs(near - exact)
        for n, worst in enumerate(off.argmax(axis=0) == k for k in range(2)):
            near[n] = np.where(worst, -near[1 - n] - near[2], near[n])
        return near[0], near[1]

    return cell


def with_round_wall(make: Maker) -> Maker:
    """The same floors within a round wall and without blocks: boxes as thin as STEP_M fill the corners."""

    def made(rng: np.random.Generator, radius: float) -> Arena:
        arena = make(rng, radius)
        (width, height), reach = arena.size_m, min(arena.size_m) / 2 - STEP_M
        boxes = []
        for row in range(round(height / STEP_M)):
            y0, y1 = row * STEP_M, (row + 1) * STEP_M
            half = math.sqrt(max(reach**2 - ((y0 + y1) / 2 - height / 2) ** 2, 0.0))
            boxes += [(0.0, y0, width / 2 - half, y1), (width / 2 + half, y0, width, y1)]
        rounded = (tuple(float(round(v, 4)) for v in box) for box in boxes)
        return replace(arena, obstacles=tuple(box for box in rounded if box[0] < box[2]))

    return made


def with_moved_box(arena: Arena, radius: float, at: np.ndarray, rng: np.random.Generator) -> Arena:
    """One box stands in another place, clear of a robot at `at` (x, y); as it is where there is none, or no room."""
    if not arena.obstacles:
        return arena
    which = int(rng.integers(len(arena.obstacles)))
    x0, y0, x1, y1 = arena.obstacles[which]
    for _ in range(TRIES):
        x, y = (
            float(round(rng.uniform(0.0, side - long), 3))
            for side, long in zip(arena.size_m, (x1 - x0, y1 - y0), strict=True)
        )
        box = (x, y, float(round(x + x1 - x0, 6)), float(round(y + y1 - y0, 6)))
        boxes = tuple(box if n == which else old for n, old in enumerate(arena.obstacles))
        moved = replace(arena, obstacles=boxes)
        if moved.is_free(*at, radius + STEP_M) and connected_share(free_lattice(moved, radius)) >= CONNECTED_LEAST:
            return moved
    return arena
