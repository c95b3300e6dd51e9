"""Wandering through free space: straight on with a little curve, and a turn on the spot where the way is blocked."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from crunchbot.scene import Arena

from .geometry import free_test


@dataclass(frozen=True)
class Pace:
    """Motion per row of 0.1 s."""

    step_m: float = 0.02
    turn_rad: float = 0.2  # on the spot
    curve_rad: float = 0.01  # fresh part of a row's curve; nine tenths of the last row's stay


def draw_pose(arena: Arena, radius: float, rng: np.random.Generator) -> np.ndarray:
    """A pose (3,) anywhere in free space."""
    free = free_test(arena, radius)
    for _ in range(100_000):
        x, y = rng.uniform(0.0, arena.size_m[0]), rng.uniform(0.0, arena.size_m[1])
        if free(x, y):
            return np.array([x, y, rng.uniform(-math.pi, math.pi)])
    raise ValueError("no free space for this body; make the arena larger or the body smaller")


def wander(
    arena: Arena, radius: float, start: Sequence[float], steps: int, rng: np.random.Generator, pace: Pace
) -> np.ndarray:
    """Path (steps + 1, 3) from `start`: row k of a scene goes from pose k to pose k + 1."""
    free = free_test(arena, radius)
    x, y, heading = map(float, start)
    fresh = (rng.standard_normal(steps) * pace.curve_rad).tolist()
    path, left, sign, curve = [(x, y, heading)], 0.0, 1.0, 0.0
    for k in range(steps):
        if left > 0.0:
            heading += sign * min(pace.turn_rad, left)
            left -= pace.turn_rad
        else:
            curve = 0.9 * curve + fresh[k]
            ahead = heading + curve / 2
            to_x, to_y = x + pace.step_m * math.cos(ahead), y + pace.step_m * math.sin(ahead)
            if free(to_x, to_y):
                x, y, heading = to_x, to_y, heading + curve
            else:
                left, sign, curve = rng.uniform(math.pi / 3, math.pi), rng.choice((-1.0, 1.0)), 0.0
        path.append((x, y, heading))
    return np.array(path)
