"""What a robot reports along a path: odometry, log-likelihoods of texture windows, contact distances."""

import math
from dataclasses import dataclass

import numpy as np

from ..scene import Arena, Robot
from .geometry import motions, ranges, textures


@dataclass(frozen=True)
class World:
    """What goes wrong, and how often."""

    odometry: float = 0.05  # relative standard deviation of a row's distance and turn
    odometry_memory_m: float = 0.0  # the relative error keeps its value so long; 0: fresh in every row
    drift_rad: float = 0.0  # heading error of a straight metre
    accuracy: float = 0.85  # of a texture window
    raw: bool = False  # log-likelihoods as a naive Bayes gives them: over-confident, wrong in runs, caught at borders
    wrong_rows: float = 3.0  # length of a run of wrong windows
    catch: float = 0.0  # share of border crossings that catch the whisker
    radial_sigma_m: float = 0.005
    miss: float = 0.05  # of contacts
    ghost: float = 0.01  # of readings without contact


def odometry(path: np.ndarray, world: World, rng: np.random.Generator) -> np.ndarray:
    """(n, 3) as reported of a path (n + 1, 3)."""
    true = motions(path)
    gain = 1.0 + world.odometry * _kept_normals(np.hypot(true[:, 0], true[:, 1]), world.odometry_memory_m, rng)
    turn = 1.0 + world.odometry * _kept_normals(np.hypot(true[:, 0], true[:, 1]), world.odometry_memory_m, rng)
    drift = world.drift_rad * np.sqrt(np.abs(true[:, 0])) * rng.standard_normal(len(true))
    return np.column_stack([true[:, :2] * gain[:, None], true[:, 2] * turn + drift])


def _kept_normals(distance: np.ndarray, memory_m: float, rng: np.random.Generator) -> np.ndarray:
    """Standard normals, one per row, each kept until `memory_m` have been travelled."""
    fresh = rng.standard_normal(len(distance))
    if memory_m <= 0.0:
        return fresh
    piece = np.floor(np.cumsum(distance) / memory_m).astype(int)
    return fresh[piece]


def texture_windows(
    arena: Arena, robot: Robot, poses: np.ndarray, world: World, rng: np.random.Generator
) -> np.ndarray:
    """(n, tips, classes) log-likelihoods, all of them read."""
    tips, classes = robot.of_role("texture"), len(arena.textures)
    out = np.zeros((len(poses), len(tips), classes))
    for n, whisker in enumerate(tips):
        true, tile = textures(arena, poses, whisker)
        out[:, n] = _raw(true, tile, classes, world, rng) if world.raw else _calibrated(true, classes, world, rng)
    return out


def _calibrated(true: np.ndarray, classes: int, world: World, rng: np.random.Generator) -> np.ndarray:
    """Each window alone: right with `accuracy`, and the log-likelihoods say so."""
    if classes == 1:
        return np.zeros((len(true), 1))
    wrong = rng.random(len(true)) >= world.accuracy
    said = np.where(wrong, (true + rng.integers(1, classes, len(true))) % classes, true)
    out = np.full((len(true), classes), math.log((1.0 - world.accuracy) / (classes - 1)))
    out[np.arange(len(true)), said] = math.log(world.accuracy)
    return out


def _raw(true: np.ndarray, tile: np.ndarray, classes: int, world: World, rng: np.random.Generator) -> np.ndarray:
    """Runs of wrong windows, catches of 3 to 9 rows at borders, and tens of nats between the classes."""
    count = len(true)
    chance = (1.0 - world.accuracy) / (world.wrong_rows * world.accuracy)
    start = rng.random(count) < chance
    length = 1 + rng.poisson(world.wrong_rows - 1.0, count)
    crossed = np.diff(tile, prepend=tile[:1]) != 0
    caught = crossed & (rng.random(count) < world.catch)
    start, length = start | caught, np.where(caught, rng.integers(3, 10, count), length)
    other = rng.integers(1, classes, count) if classes > 1 else np.zeros(count, int)
    said, until = true.copy(), 0
    for k in np.nonzero(start)[0].tolist():
        if k >= until:
            until = k + int(length[k])
            said[k:until] = (true[k] + other[k]) % classes
    out = -10.0 - rng.exponential(40.0, (count, classes))
    out[np.arange(count), said] = 0.0
    return out - 700.0


def contacts(arena: Arena, robot: Robot, poses: np.ndarray, world: World, rng: np.random.Generator) -> np.ndarray:
    """(n, rays) distances in m, all of them read; inf: no contact."""
    rays = robot.of_role("object")
    out = np.full((len(poses), len(rays)), np.inf)
    for n, whisker in enumerate(rays):
        true = ranges(arena, poses, whisker)
        felt = np.isfinite(true) & (rng.random(len(poses)) >= world.miss)
        ghost = ~felt & (rng.random(len(poses)) < world.ghost)
        measured = np.maximum(true + world.radial_sigma_m * rng.standard_normal(len(poses)), 0.0)
        invented = rng.uniform(0.0, whisker.length_m, len(poses))
        out[:, n] = np.where(felt, measured, np.where(ghost, invented, np.inf))
    return out
