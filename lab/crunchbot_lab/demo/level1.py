"""Level 1: the world's signals straight to the pilot, no bits. Same timing of decisions as the RTL-level chain."""

from collections import deque
from collections.abc import Callable

import numpy as np

from crunchbot.observation import Row
from crunchbot.pilot.behaviour import BLOCK_TICKS, EFFECT_TICKS, ODOMETRY_TICKS
from crunchbot.pilot.pilot import Pilot
from crunchbot.scene import Scene

from ..signals import World

# Blocks between the end of the block a decision answers and its effect.
DELAY_BLOCKS = (EFFECT_TICKS - 1) // BLOCK_TICKS


def explore(
    scene: Scene,
    start: tuple[float, float, float],
    pilot: Pilot,
    seed: int,
    ticks: int,
    status: Callable[[int], np.ndarray] | None = None,
    on_block: Callable[[int, np.ndarray], None] = lambda first, counts: None,
    world: World | None = None,
) -> tuple[list[Row], list[dict]]:
    """Let the pilot explore for `ticks` (a multiple of 200): observation rows, and truth rows as the chain writes them.

    `status(first_tick)` gives the (40, lanes) status of a block, all good by default; `on_block` sees (first tick, counts).
    `world`: another than the scene's own of this seed, as one that is watched.
    """
    world = world or World(scene.flat(start), seed)
    lanes = len(scene.robot.whiskers)
    good = np.zeros((BLOCK_TICKS, lanes), np.uint16)
    waiting = deque([(0.0, 0.0)] * (1 + DELAY_BLOCKS))
    rows, truth = [], []
    observer = Truth(scene)
    for first in range(0, ticks, BLOCK_TICKS):
        world.drive(*waiting.popleft())
        counts = world.run(BLOCK_TICKS)
        block_status = status(first) if status else good
        waiting.append(pilot.block(first, counts[:, :, 0], counts[:, :, 1], block_status))
        on_block(first, counts)
        last = first + BLOCK_TICKS - 1
        if (last + 1) % ODOMETRY_TICKS == 0:
            rows.append(pilot.odometry(last, *world.odometry()))
            truth.append(observer.row(last, world))
    return rows, truth


class Truth:
    """Rows of truth.csv: pose at the end of each 0.1 s, and where the floor whiskers' tips are and how far they went."""

    def __init__(self, scene: Scene):
        self._floor = [(lane, w.name) for lane, w in enumerate(scene.robot.whiskers) if w.role == "texture"]
        self._travelled = {lane: 0.0 for lane, _ in self._floor}

    def row(self, tick: int, world: World) -> dict:
        row = {"tick": tick} | dict(zip(("x_m", "y_m", "theta_rad"), world.pose, strict=True))
        for lane, name in self._floor:
            tip = world.tip(lane)
            row[f"{name}_tile"] = tip.texture
            row[f"{name}_inside_mm"] = 1e3 * tip.inside_m
            row[f"{name}_moved_mm"] = 1e3 * (tip.travelled_m - self._travelled[lane])
            self._travelled[lane] = tip.travelled_m
        return row
