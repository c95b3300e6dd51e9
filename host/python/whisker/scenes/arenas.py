"""Arenas drawn at random. An arena is taken when nearly all its free space hangs together for the robot."""

import numpy as np

from ..scene import Arena
from .geometry import connected_share, free_lattice

TEXTURES = ("VINYL", "SMOOTH", "ROUGH")
CONNECTED_LEAST = 0.98
TRIES = 200


def connected(draw, radius: float) -> Arena:
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


def tiled(rng: np.random.Generator, radius: float, tiles: int = 5, blocks: int = 3) -> Arena:
    """The paper's: square, tiles of 0.5 m, solid blocks of one tile each."""
    edge = 0.5

    def draw() -> Arena:
        floor = random_floor(tiles, tiles, TEXTURES, rng)
        places = [divmod(int(n), tiles) for n in rng.choice(tiles * tiles, blocks, replace=False)]
        boxes = tuple((edge * i, edge * j, edge * (i + 1), edge * (j + 1)) for i, j in places)
        return Arena((edge * tiles, edge * tiles), edge, TEXTURES, floor, boxes)

    return connected(draw, radius)
