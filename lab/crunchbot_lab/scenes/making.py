"""Scenes of a family and seed, with what the robot reports and where it truly was.

One seed draws one arena, one path and one noise of each kind, whatever the modifiers of the family: scenes of a seed can
be compared pair by pair.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from crunchbot.nav.observations import Observations
from crunchbot.scene import Arena, Prior, Robot, Scene

from . import arenas, walk
from .explorer import TIP_M, Explored, explore
from .families import KIDNAP_LEAST_M, SLIP_ROWS, Recipe, recipe
from .files import rounded
from .readings import contacts, hold_back, measured, normals, odometry, texture_windows

ROW_S = 0.1
KNOWN_SIGMA = (0.02, 0.02, 0.03)  # m, m, rad
WRONG_SIGMA = (0.1, 0.1, 0.2)
STREAMS = (
    "arena",
    "start",
    "path",
    "odometry",
    "texture",
    "radial",
    "prior",
    "kidnap",
    "fault",
    "map",
    "slip",
    "normal",
    "move",
)


@dataclass(frozen=True)
class Made:
    """A scene as the filters get it, its observations with the truth, and the rows before which the robot was moved."""

    scene: Scene
    observations: Observations
    kidnaps: tuple[int, ...] = ()


def make(name: str, seed: int, rows: int | None = None) -> Made:
    """The scene of a family and seed; `rows` where the family's own number is not wanted."""
    return make_recipe(recipe(name), seed, rows)


def make_recipe(r: Recipe, seed: int, rows: int | None = None, path_seed: int | None = None) -> Made:
    """The scene of a recipe and seed; `path_seed` draws everything but the arena, where many drives of one are wanted."""
    rng = streams(seed if path_seed is None else path_seed)
    rng["arena"] = np.random.default_rng([seed, STREAMS.index("arena")])
    rows = r.rows if rows is None else rows
    robot = r.robot()
    arena = r.arena(rng["arena"], robot.body_radius_m)
    start = walk.draw_pose(arena, robot.body_radius_m, rng["start"])
    middle, at, parts = rows // 2 if r.moves else None, start, []
    kidnaps = tuple(row for row in r.kidnap_rows if row < rows)
    cuts = {0, rows, *kidnaps} | ({middle} if middle else set())
    for first, until in pairwise(sorted(cuts)):
        if first in kidnaps:
            at = carried_to(arena, robot.body_radius_m, at, rng["kidnap"])
        if first and first == middle:
            arena = arenas.with_moved_box(arena, robot.body_radius_m, at[:2], rng["move"])
        parts.append(_drive(r, arena, robot, at, until - first, rng))
        at = parts[-1].truth[-1]
    taken = Observations(
        (np.arange(rows) + 1) * ROW_S,
        [],
        *(np.concatenate([getattr(p, name) for p in parts]) for name in ("odometry", "texture", "radial_m", "truth")),
        normal=None if r.world.normal_sd_rad is None else np.concatenate([p.normal for p in parts]),
    )
    mapped = r.map_fault(arena, rng["map"]) if r.map_fault else arena
    scene = Scene(mapped, robot, _prior(r, arena, robot, start, rng["prior"]))
    taken.truth[:, 2] = np.remainder(taken.truth[:, 2] + math.pi, 2 * math.pi) - math.pi
    for fault in r.faults:
        taken = fault(taken, scene, rng["fault"])
    return Made(scene, rounded(taken), kidnaps)


def streams(seed: int) -> dict[str, np.random.Generator]:
    """A stream of random numbers for each kind of chance."""
    return {stream: np.random.default_rng([seed, n]) for n, stream in enumerate(STREAMS)}


def _drive(r: Recipe, arena: Arena, robot: Robot, start: np.ndarray, rows: int, rng: dict) -> Observations:
    """One uninterrupted drive; its times are not set."""
    if r.body_whisks:
        return explored_rows(r, arena, robot, explore(arena, robot, start, rows, rng["path"]), rng)
    path = walk.wander(arena, robot.body_radius_m, start, rows, rng["path"], r.pace)
    reported = odometry(path, r.world, rng["odometry"])
    if r.slips:
        path, reported = _slipped(path, reported, r, rng["slip"])
    return walked_rows(r, arena, robot, path, reported, rng)


def explored_rows(r: Recipe, arena: Arena, robot: Robot, e: Explored, rng: dict) -> Observations:
    """What the robot reports of an exploration; times are not set."""
    reported = hold_back(odometry(e.path, r.world, rng["odometry"]), e.held)
    radial = measured(e.radial_m, robot, r.world, rng["radial"])
    texture = texture_windows(arena, robot, e.path[1:], r.world, rng["texture"])
    texture[~e.sweeping] = np.nan
    by_tip = e.radial_m > np.array([w.length_m - TIP_M for w in robot.of_role("object")])
    normal = normals(arena, robot, e.path[1:], by_tip & np.isfinite(radial), r.world, rng["normal"])
    return Observations(np.zeros(len(e.held)), [], reported, texture, radial, e.path[1:], normal=normal)


def walked_rows(
    r: Recipe, arena: Arena, robot: Robot, path: np.ndarray, reported: np.ndarray, rng: dict
) -> Observations:
    """What the robot reports along a path (n + 1, 3) with this odometry (n, 3); times are not set."""
    texture = texture_windows(arena, robot, path[1:], r.world, rng["texture"])
    radial = contacts(arena, robot, path[1:], r.world, rng["radial"])
    normal = normals(arena, robot, path[1:], np.isfinite(radial), r.world, rng["normal"])
    return Observations(np.zeros(len(reported)), [], reported, texture, radial, path[1:], normal=normal)


def _slipped(path: np.ndarray, reported: np.ndarray, r: Recipe, rng: np.random.Generator):
    """Now and then the robot stands while its odometry says that it drives on; the path is cut to its length."""
    rows = len(reported)
    stands = np.zeros(rows, bool)
    for first in rng.integers(0, max(rows - SLIP_ROWS, 1), r.slips):
        stands[first : first + SLIP_ROWS] = True
    source = np.cumsum(~stands) - 1  # row of the old path that a moving row plays
    moved = np.where(stands[:, None], np.array([r.pace.step_m, 0.0, 0.0]), reported[np.maximum(source, 0)])
    return path[np.append(0, source + 1)], moved


def carried_to(arena: Arena, radius: float, pose: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A pose (3,) in free space, at least KIDNAP_LEAST_M from `pose`."""
    while True:
        there = walk.draw_pose(arena, radius, rng)
        if math.hypot(*(there - pose)[:2]) >= KIDNAP_LEAST_M:
            return there


def _prior(r: Recipe, arena: Arena, robot: Robot, start: np.ndarray, rng: np.random.Generator) -> Prior:
    if r.uniform:
        return Prior("uniform")
    side, turn, noise = rng.uniform(-math.pi, math.pi, 64), rng.choice((-1.0, 1.0)), rng.standard_normal(3)
    if not (r.wrong_m or r.wrong_rad):
        return Prior("gaussian", _numbers(start + noise * KNOWN_SIGMA), KNOWN_SIGMA)
    off = r.wrong_m * np.column_stack([np.cos(side), np.sin(side)])
    places = [p for p in start[:2] + off if arena.is_free(*p, robot.body_radius_m)] or [start[:2] + off[0]]
    return Prior("gaussian", _numbers([*places[0], start[2] + turn * r.wrong_rad]), WRONG_SIGMA)


def _numbers(values) -> tuple[float, ...]:
    return tuple(float(v) for v in np.round(values, 6))
