"""How far from the ground's cells something solid stands, and how far a robot reaches."""

import math

import numpy as np

from ..scene import Robot


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
