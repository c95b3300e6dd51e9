"""What whiskers meet in an arena, many poses at once. Written for the scenes alone: filters are not judged by their own
code (host/nav/problem/arena.c). Poses are (n, 3): x, y in m, theta in rad."""

import math
from collections.abc import Callable

import numpy as np

from crunchbot.scene import Arena, Whisker

LATTICE_M = 0.05
CLEAR_M = 1e-3  # true poses stay this far inside free space


def compose(poses: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Poses reached from `poses` by `steps`, motions in the frame of each; shapes (n, 3) or (3,)."""
    c, s = np.cos(poses[..., 2]), np.sin(poses[..., 2])
    x = poses[..., 0] + c * steps[..., 0] - s * steps[..., 1]
    y = poses[..., 1] + s * steps[..., 0] + c * steps[..., 1]
    return np.stack([x, y, poses[..., 2] + steps[..., 2]], axis=-1)


def motions(path: np.ndarray) -> np.ndarray:
    """(n, 3) motions between successive poses of a path (n + 1, 3), each in the frame of the earlier."""
    delta = np.diff(path, axis=0)
    c, s = np.cos(path[:-1, 2]), np.sin(path[:-1, 2])
    turn = np.remainder(delta[:, 2] + math.pi, 2 * math.pi) - math.pi
    return np.stack([c * delta[:, 0] + s * delta[:, 1], c * delta[:, 1] - s * delta[:, 0], turn], axis=-1)


def textures(arena: Arena, poses: np.ndarray, whisker: Whisker) -> tuple[np.ndarray, np.ndarray]:
    """Texture index under a texture whisker's tip, and the tile's number: (n,) each."""
    tips = compose(poses, np.array([*whisker.tip_m, 0.0]))
    floor = arena.floor_indices()
    column, row = (np.clip(np.floor(tips[:, i] / arena.tile_m), 0, floor.shape[1 - i] - 1).astype(int) for i in (0, 1))
    return floor[row, column], row * floor.shape[1] + column


def ranges(arena: Arena, poses: np.ndarray, whisker: Whisker) -> np.ndarray:
    """(n,) distance of first contact along an object whisker, m; inf beyond its length."""
    base = compose(poses, np.array([*whisker.base_m, whisker.yaw_rad]))
    x, y, c, s = base[:, 0], base[:, 1], np.cos(base[:, 2]), np.sin(base[:, 2])
    with np.errstate(divide="ignore", invalid="ignore"):
        wall = np.minimum(
            np.where(c > 0, (arena.size_m[0] - x) / c, np.where(c < 0, -x / c, np.inf)),
            np.where(s > 0, (arena.size_m[1] - y) / s, np.where(s < 0, -y / s, np.inf)),
        )
        nearest = np.maximum(wall, 0.0)
        for x0, y0, x1, y1 in arena.obstacles:
            a, b = _slab(x, c, x0, x1), _slab(y, s, y0, y1)
            enter, leave = np.maximum(a[0], b[0]), np.minimum(a[1], b[1])
            hit = (enter <= leave) & (leave > 0.0)
            nearest = np.where(hit, np.minimum(nearest, np.maximum(enter, 0.0)), nearest)
    return np.where(nearest <= whisker.length_m, nearest, np.inf)


def directions(arena: Arena, poses: np.ndarray, whisker: Whisker, corner_m: float) -> np.ndarray:
    """(n,) direction of the outward normal of the face at which an object whisker's line ends, world, rad; nan: it meets
    none, or another face is as near as `corner_m`."""
    base = compose(poses, np.array([*whisker.base_m, whisker.yaw_rad]))
    reach = ranges(arena, poses, whisker)[:, None]
    met = np.isfinite(reach[:, 0])
    end = base[:, :2] + np.where(met[:, None], reach, 0.0) * np.column_stack([np.cos(base[:, 2]), np.sin(base[:, 2])])
    faces = [(side, math.pi + turn) for side, turn in _sides((0.0, 0.0, *arena.size_m))]
    faces += [face for box in arena.obstacles for face in _sides(box)]
    off = np.array([np.hypot(*(end - np.clip(end, side[0], side[1])).T) for side, _ in faces])
    near = np.sort(off, axis=0)
    reported = met & (near[1] > corner_m)
    return np.where(reported, np.array([turn for _, turn in faces])[off.argmin(axis=0)], np.nan)


def _sides(box) -> list[tuple[tuple[tuple, tuple], float]]:
    """Each side of a box as its least and greatest corner, and the direction of its outward normal."""
    x0, y0, x1, y1 = box
    left, right, low, high = ((x0, y0), (x0, y1)), ((x1, y0), (x1, y1)), ((x0, y0), (x1, y0)), ((x0, y1), (x1, y1))
    return [(right, 0.0), (high, math.pi / 2), (left, math.pi), (low, -math.pi / 2)]


def _slab(start, direction, low, high):
    """Where a ray enters and leaves the strip low .. high."""
    inside = (start >= low) & (start <= high)
    first, second = (low - start) / direction, (high - start) / direction
    enter = np.where(direction == 0.0, np.where(inside, -np.inf, np.inf), np.fmin(first, second))
    leave = np.where(direction == 0.0, np.where(inside, np.inf, -np.inf), np.fmax(first, second))
    return enter, leave


def free_test(arena: Arena, radius: float) -> Callable[[float, float], bool]:
    """A fast function (x, y) -> bool: whether a round body stands clear by CLEAR_M of walls and obstacles."""
    reach = radius + CLEAR_M
    high_x, high_y, square = arena.size_m[0] - reach, arena.size_m[1] - reach, reach * reach
    boxes = arena.obstacles

    def free(x: float, y: float) -> bool:
        if not (reach < x < high_x and reach < y < high_y):
            return False
        for x0, y0, x1, y1 in boxes:
            dx = x0 - x if x < x0 else (x - x1 if x > x1 else 0.0)
            dy = y0 - y if y < y0 else (y - y1 if y > y1 else 0.0)
            if dx * dx + dy * dy <= square:
                return False
        return True

    return free


def range_test(arena: Arena, whisker: Whisker) -> Callable[[float, float, float], float]:
    """A fast function (x, y, theta) -> m: `ranges` for one pose."""
    base_x, base_y = whisker.base_m
    yaw, length = whisker.yaw_rad, whisker.length_m
    far = math.hypot(base_x, base_y) + length
    walls = (0.0, 0.0, *arena.size_m)
    boxes = arena.obstacles

    def reach(x: float, y: float, heading: float) -> float:
        by_wall = not (far < x < walls[2] - far and far < y < walls[3] - far)
        near = [b for b in boxes if b[0] - far < x < b[2] + far and b[1] - far < y < b[3] + far]
        if not near and not by_wall:
            return math.inf
        c, s = math.cos(heading), math.sin(heading)
        from_x, from_y = x + c * base_x - s * base_y, y + s * base_x + c * base_y
        c, s = math.cos(heading + yaw), math.sin(heading + yaw)
        nearest = max(_crossing(walls, from_x, from_y, c, s)[1], 0.0)
        for box in near:
            enter, leave = _crossing(box, from_x, from_y, c, s)
            if enter <= leave and leave > 0.0:
                nearest = min(nearest, max(enter, 0.0))
        return nearest if nearest <= length else math.inf

    return reach


def _crossing(box, x: float, y: float, c: float, s: float) -> tuple[float, float]:
    """Where a ray enters and leaves a box, m."""
    c, s = c or 1e-300, s or 1e-300  # along an edge: the strip is then entered and left at +-infinity, or never
    a, b = sorted(((box[0] - x) / c, (box[2] - x) / c))
    d, e = sorted(((box[1] - y) / s, (box[3] - y) / s))
    return max(a, d), min(b, e)


def free_lattice(arena: Arena, radius: float) -> np.ndarray:
    """(ny, nx) bool at the middles of LATTICE_M squares: whether the body stands clear there."""
    x = np.arange(LATTICE_M / 2, arena.size_m[0], LATTICE_M)
    y = np.arange(LATTICE_M / 2, arena.size_m[1], LATTICE_M)[:, None]
    reach = radius + CLEAR_M
    free = (x > reach) & (x < arena.size_m[0] - reach) & (y > reach) & (y < arena.size_m[1] - reach)
    for x0, y0, x1, y1 in arena.obstacles:
        gap = np.hypot(np.maximum(np.maximum(x0 - x, x - x1), 0.0), np.maximum(np.maximum(y0 - y, y - y1), 0.0))
        free &= gap > reach
    return free


def connected_share(free: np.ndarray) -> float:
    """Share of the free squares that can be reached from the free square nearest to the arena's middle."""
    rows, columns = np.nonzero(free)
    if not len(rows):
        return 0.0
    middle = np.argmin((rows - free.shape[0] / 2) ** 2 + (columns - free.shape[1] / 2) ** 2)
    reached = np.zeros_like(free)
    reached[rows[middle], columns[middle]] = True
    count = 0
    while count != (count := int(reached.sum())):
        for _ in range(8):
            grown = reached.copy()
            grown[1:] |= reached[:-1]
            grown[:-1] |= reached[1:]
            grown[:, 1:] |= reached[:, :-1]
            grown[:, :-1] |= reached[:, 1:]
            reached = grown & free
    return count / len(rows)
