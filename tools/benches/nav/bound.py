"""The least mean time until lock that the bits allow, of a family's arena and robot.

A lock needs the bits that tell its circle from the rest of free space; what is known of the heading is not counted.

Texture whiskers: a row repeats the one before it unless a tip has crossed a border of tiles. A path that is laid without
looking, of a step s in a row, crosses a border of tiles of edge a with probability p = 4 s / (pi a) (Buffon). A tip's rows
then hold at most log2 C bits in the first row and H(p) + p log2(C - 1) in each further one, C the classes that lie in the
arena; a border that a path is steered along yields no more. Windows are taken to be right.

Object whiskers tell nothing of the place before the nearest solid thing can be within reach, the robot driving straight at
it, and a body whisk must end first where only that measures. From then on they are taken to tell all.
"""

import math

import numpy as np

from crunchbot.nav.scoring import LOCK_M
from crunchbot.planning.ground import ArenaMap, Ground, reach
from crunchbot_lab.scenes.closed import Loop
from crunchbot_lab.scenes.geometry import LATTICE_M, free_lattice
from crunchbot_lab.scenes.making import ROW_S

POSES = 2000  # over which the mean is taken


def bound(loop: Loop) -> dict:
    """`wanted_bits`; `first_bits` and `row_bits` of all texture whiskers; `bound_s`, the mean over poses anywhere."""
    robot, arena, vehicle = loop.robot, loop.arena, loop.vehicle
    area = free_lattice(arena, robot.body_radius_m).sum() * LATTICE_M**2
    wanted = math.log2(area / (math.pi * LOCK_M**2))
    classes = len(np.unique(arena.floor_indices()))
    first = row = 0.0
    for whisker in robot.of_role("texture"):
        step = ROW_S * max(vehicle.drive_m_s, vehicle.turn_rad_s * math.hypot(*whisker.tip_m))
        first += math.log2(classes)
        row += _run_bits(4.0 * step / (math.pi * arena.tile_m), classes)
    by_floor = math.inf if row == 0.0 else ROW_S * max(0.0, (wanted - first) / row)
    ground = Ground.of(ArenaMap(arena), robot)
    way = np.maximum(_clear(arena, ground.spread(POSES)) - reach(robot), 0.0)
    by_touch = way / vehicle.drive_m_s + (0.0 if vehicle.reads_always else vehicle.whisk_s)
    by_touch = by_touch if robot.of_role("object") else np.full(POSES, math.inf)
    seconds = np.minimum(by_floor, by_touch) + ROW_S
    return {"wanted_bits": wanted, "first_bits": first, "row_bits": row, "bound_s": float(seconds.mean())}


def _run_bits(p: float, classes: int) -> float:
    """H(p) + p log2(C - 1); none where all is of one class."""
    if classes < 2:
        return 0.0
    p = min(p, (classes - 1.0) / classes)
    return -p * math.log2(p) - (1.0 - p) * math.log2(1.0 - p) + p * math.log2(classes - 1)


def _clear(arena, poses: np.ndarray) -> np.ndarray:
    """(n,) m from poses (n, 3) to the nearest wall or box."""
    x, y = poses[:, 0], poses[:, 1]
    near = np.minimum(np.minimum(x, arena.size_m[0] - x), np.minimum(y, arena.size_m[1] - y))
    for x0, y0, x1, y1 in arena.obstacles:
        away = np.hypot(np.maximum(np.maximum(x0 - x, x - x1), 0.0), np.maximum(np.maximum(y0 - y, y - y1), 0.0))
        near = np.minimum(near, away)
    return near
