"""Families of scenes at level 0, by name and seed.

A name is a base and any number of modifiers: `anchor`, `anchor+global`, `anchor+kidnap`. One seed draws one arena, one
path and one noise of each kind, whatever the modifiers: scenes of a seed can be compared pair by pair.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import UserError
from ..observations import Observations
from ..scene import Arena, Prior, Robot, Scene
from . import arenas, robots, walk
from .files import rounded
from .readings import World, contacts, odometry, texture_windows

ROW_S = 0.1
KNOWN_SIGMA = (0.02, 0.02, 0.03)  # m, m, rad
KIDNAP_LEAST_M = 0.8
STREAMS = ("arena", "start", "path", "odometry", "texture", "radial", "prior", "kidnap", "fault")


class FamilyError(UserError):
    """A name that is no family; one line."""


@dataclass(frozen=True)
class Recipe:
    """How scenes of a family come about."""

    text: str
    arena: Callable[[np.random.Generator, float], Arena] = arenas.tiled
    robot: Callable[[], Robot] = robots.anchor
    world: World = field(default_factory=World)
    pace: walk.Pace = field(default_factory=walk.Pace)
    rows: int = 600
    uniform: bool = False  # the prior
    kidnap_row: int | None = None


@dataclass(frozen=True)
class Made:
    """A scene as the filters get it, its observations with the truth, and the rows at whose end the robot was moved."""

    scene: Scene
    observations: Observations
    kidnaps: tuple[int, ...] = ()


BASES: dict[str, Recipe] = {
    "anchor": Recipe("2.5 m, 0.5 m tiles, 3 blocks; every whisker reads in every row, 2 cm a row"),
}

MODIFIERS: dict[str, tuple[str, Callable[[Recipe], Recipe]]] = {
    "global": ("nothing is known of the start", lambda r: replace(r, uniform=True)),
    "kidnap": (
        f"carried at least {KIDNAP_LEAST_M:g} m after 300 rows of 1200",
        lambda r: replace(r, kidnap_row=300, rows=1200),
    ),
}


def recipe(name: str) -> Recipe:
    """The recipe of a base with its modifiers."""
    base, *modifiers = name.split("+")
    if base not in BASES:
        raise FamilyError(f"family '{base}' is unknown; the names are {', '.join(BASES)}")
    made = BASES[base]
    for modifier in modifiers:
        if modifier not in MODIFIERS:
            raise FamilyError(f"family '{name}': no modifier '{modifier}'; the names are {', '.join(MODIFIERS)}")
        made = MODIFIERS[modifier][1](made)
    return made


def make(name: str, seed: int, rows: int | None = None) -> Made:
    """The scene of a family and seed; `rows` where the family's own number is not wanted."""
    return make_recipe(recipe(name), seed, rows)


def make_recipe(r: Recipe, seed: int, rows: int | None = None) -> Made:
    rng = {stream: np.random.default_rng([seed, n]) for n, stream in enumerate(STREAMS)}
    rows = r.rows if rows is None else rows
    robot = r.robot()
    arena = r.arena(rng["arena"], robot.body_radius_m)
    start = walk.draw_pose(arena, robot.body_radius_m, rng["start"])
    pieces, kidnaps = [walk.wander(arena, robot.body_radius_m, start, _first(r, rows), rng["path"], r.pace)], []
    if r.kidnap_row is not None and rows > r.kidnap_row:
        kidnaps.append(r.kidnap_row)
        there = _elsewhere(arena, robot.body_radius_m, pieces[0][-1], rng["kidnap"])
        pieces.append(walk.wander(arena, robot.body_radius_m, there, rows - r.kidnap_row, rng["path"], r.pace))
    reported = np.concatenate([odometry(piece, r.world, rng["odometry"]) for piece in pieces])
    truth = np.concatenate([piece[1:] for piece in pieces])
    t_s = (np.arange(rows) + 1) * ROW_S
    taken = Observations(
        t_s,
        [],
        reported,
        texture_windows(arena, robot, truth, r.world, rng["texture"]),
        contacts(arena, robot, truth, r.world, rng["radial"]),
        _wrapped(truth),
    )
    return Made(Scene(arena, robot, _prior(r, start, rng["prior"])), rounded(taken), tuple(kidnaps))


def _first(r: Recipe, rows: int) -> int:
    return rows if r.kidnap_row is None else min(rows, r.kidnap_row)


def _elsewhere(arena: Arena, radius: float, pose: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    while True:
        there = walk.draw_pose(arena, radius, rng)
        if math.hypot(*(there - pose)[:2]) >= KIDNAP_LEAST_M:
            return there


def _prior(r: Recipe, start: np.ndarray, rng: np.random.Generator) -> Prior:
    if r.uniform:
        return Prior("uniform")
    mean = start + rng.standard_normal(3) * KNOWN_SIGMA
    return Prior("gaussian", tuple(float(v) for v in np.round(mean, 6)), KNOWN_SIGMA)


def _wrapped(poses: np.ndarray) -> np.ndarray:
    out = poses.copy()
    out[:, 2] = np.remainder(out[:, 2] + math.pi, 2 * math.pi) - math.pi
    return out
