"""What a robot reports along a path: odometry, log-likelihoods of texture windows, contact distances."""

import math
from dataclasses import dataclass, replace

import numpy as np

from crunchbot.scene import Arena, Robot

from .geometry import compose, directions, motions, ranges, textures

CORNER_M = 0.005  # from the end of a face, and less: the corner is touched
LOOSE_M = 0.005  # a whisker that lets go is still so near
CATCH_ROWS = (1, 11)  # a caught whisker says one thing for 0.1 to 1 s


@dataclass(frozen=True)
class World:
    """What goes wrong, and how often."""

    odometry: float = 0.05  # relative standard deviation of a row's distance and turn
    odometry_memory_m: float = 0.0  # the relative error keeps its value so long; 0: fresh in every row
    run_gain: float = 0.0  # standard deviation of a gain that a whole run keeps
    drift_rad: float = 0.0  # heading error of a straight metre
    scale: float = 1.0  # of reported distances
    turn_scale: float = 1.0  # of reported turns
    gyro_sd_rad: float | None = None  # of a row's turn, measured by a gyroscope; None: the wheels tell it
    accuracy: float = 0.85  # of a texture window
    raw_nats: float | None = None  # None: calibrated windows, each alone. Else a naive Bayes's: so far apart, in runs
    wrong_rows: float = 3.0  # length of a run of wrong raw windows
    catch: float = 0.0  # share of border crossings that catch a texture whisker
    radial_sigma_m: float = 0.005
    miss: float = 0.05  # of contacts
    ghost: float = 0.01  # of readings without contact
    normal_sd_rad: float | None = None  # of the direction of a face that is touched; None: it is not reported
    normal_wrong: float = 0.05  # share of them that are any direction


def odometry(path: np.ndarray, world: World, rng: np.random.Generator) -> np.ndarray:
    """(n, 3) as reported of a path (n + 1, 3)."""
    true = motions(path)
    distance = np.hypot(true[:, 0], true[:, 1])
    run = world.run_gain * rng.standard_normal(2)
    gain, turn = (
        scale * (1.0 + own + world.odometry * _kept_normals(distance, world.odometry_memory_m, rng))
        for scale, own in zip((world.scale, world.turn_scale), run, strict=True)
    )
    drift = world.drift_rad * np.sqrt(distance) * rng.standard_normal(len(true))
    if world.gyro_sd_rad is not None:
        measured_turn = true[:, 2] + world.gyro_sd_rad * rng.standard_normal(len(true))
        return np.column_stack([true[:, :2] * gain[:, None], measured_turn])
    return np.column_stack([true[:, :2] * gain[:, None], true[:, 2] * turn + drift])


def _kept_normals(distance: np.ndarray, memory_m: float, rng: np.random.Generator) -> np.ndarray:
    """Standard normals, one per row, each kept until `memory_m` have been travelled."""
    fresh = rng.standard_normal(len(distance))
    if memory_m <= 0.0:
        return fresh
    return fresh[np.floor(np.cumsum(distance) / memory_m).astype(int)]


def hold_back(reported: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Odometry as the pilot reports it: nothing in held rows, and what they moved in the next row that is not."""
    out, pending = reported.copy(), None
    for k in np.nonzero(held | np.append(False, held[:-1]))[0]:
        total = reported[k] if pending is None else compose(pending, reported[k])
        pending, out[k] = (total, 0.0) if held[k] else (None, total)
    return out


def texture_windows(
    arena: Arena, robot: Robot, poses: np.ndarray, world: World, rng: np.random.Generator
) -> np.ndarray:
    """(n, tips, classes) log-likelihoods, all of them read."""
    tips, classes = robot.of_role("texture"), len(arena.textures)
    out = np.zeros((len(poses), len(tips), classes))
    for n, whisker in enumerate(tips):
        true, tile = textures(arena, poses, whisker)
        said = _said(true, classes, world, rng) if classes > 1 else true
        said = _caught(said, tile, classes, world.catch, rng)
        out[:, n] = _calibrated(said, classes, world) if world.raw_nats is None else _raw(said, classes, world, rng)
    return out


def _said(true: np.ndarray, classes: int, world: World, rng: np.random.Generator) -> np.ndarray:
    """Class with the largest log-likelihood: wrong at random, raw windows in runs of one and the same class."""
    count = len(true)
    length = np.ones(count, int) if world.raw_nats is None else 1 + rng.poisson(world.wrong_rows - 1.0, count)
    mean = 1.0 if world.raw_nats is None else world.wrong_rows
    start = rng.random(count) < (1.0 - world.accuracy) / (mean * world.accuracy + 1.0 - world.accuracy)
    return _overlaid(true, start, length, (true + rng.integers(1, classes, count)) % classes)


def _caught(said: np.ndarray, tile: np.ndarray, classes: int, share: float, rng: np.random.Generator) -> np.ndarray:
    start = (np.diff(tile, prepend=tile[:1]) != 0) & (rng.random(len(said)) < share)
    return _overlaid(said, start, rng.integers(*CATCH_ROWS, len(said)), rng.integers(0, classes, len(said)))


def _overlaid(values: np.ndarray, start: np.ndarray, length: np.ndarray, other: np.ndarray) -> np.ndarray:
    """`values` with runs that begin where `start` says and no other run lasts, each of one value of `other`."""
    out, until = values.copy(), 0
    for k in np.nonzero(start)[0].tolist():
        if k >= until:
            until = k + int(length[k])
            out[k:until] = other[k]
    return out


def _calibrated(said: np.ndarray, classes: int, world: World) -> np.ndarray:
    out = np.full((len(said), classes), math.log((1.0 - world.accuracy) / (classes - 1)) if classes > 1 else 0.0)
    out[np.arange(len(said)), said] = math.log(world.accuracy)
    return out


def _raw(said: np.ndarray, classes: int, world: World, rng: np.random.Generator) -> np.ndarray:
    """Second best so far behind, the others further: lognormal, median raw_nats, as signal-level windows are."""
    behind = world.raw_nats * np.exp(0.55 * rng.standard_normal((len(said), classes)))
    order = np.argsort(rng.random((len(said), classes)), axis=1)  # which class comes second is chance
    out = -behind - world.raw_nats * order
    out[np.arange(len(said)), said] = 0.0
    return out - 10.0 * world.raw_nats


def contacts(arena: Arena, robot: Robot, poses: np.ndarray, world: World, rng: np.random.Generator) -> np.ndarray:
    """(n, rays) distances in m, all of them read; inf: no contact."""
    true = [ranges(arena, poses, whisker) for whisker in robot.of_role("object")]
    return measured(np.array(true).reshape(-1, len(poses)).T, robot, world, rng)


def measured(true_m: np.ndarray, robot: Robot, world: World, rng: np.random.Generator) -> np.ndarray:
    """True distances (n, rays) with noise, misses and ghosts; nan, not read, stays."""
    out = np.full(true_m.shape, np.inf)
    for n, whisker in enumerate(robot.of_role("object")):
        rows = len(true_m)
        felt = np.isfinite(true_m[:, n]) & (rng.random(rows) >= world.miss)
        ghost = (rng.random(rows) < world.ghost) & ~felt
        noisy = np.maximum(true_m[:, n] + world.radial_sigma_m * rng.standard_normal(rows), 0.0)
        invented = rng.uniform(0.0, whisker.length_m, rows)
        out[:, n] = np.where(felt, noisy, np.where(ghost, invented, np.inf))
    return np.where(np.isnan(true_m), np.nan, out)


def normals(
    arena: Arena, robot: Robot, poses: np.ndarray, touched: np.ndarray, world: World, rng: np.random.Generator
) -> np.ndarray | None:
    """(n, rays, 2) directions of faces, robot's frame, with their standard deviation, rad; nan: not reported, as where not
    `touched` (n, rays) or at a corner. None: this robot reports none."""
    if world.normal_sd_rad is None:
        return None
    out = np.full((*touched.shape, 2), np.nan)
    for n, whisker in enumerate(robot.of_role("object")):
        longer = replace(whisker, length_m=whisker.length_m + LOOSE_M)
        true = directions(arena, poses, longer, CORNER_M) - poses[:, 2]
        wrong = rng.random(len(poses)) < world.normal_wrong
        reported = np.where(wrong, rng.uniform(-math.pi, math.pi, len(poses)), true)
        reported = np.where(np.isnan(true), np.nan, reported + world.normal_sd_rad * rng.standard_normal(len(poses)))
        out[:, n, 0] = np.where(touched[:, n], np.remainder(reported + math.pi, 2 * math.pi) - math.pi, np.nan)
    out[..., 1] = np.where(np.isnan(out[..., 0]), np.nan, world.normal_sd_rad)
    return out
