"""A robot in its own map: drives that begin where it has been, located in the map that it made and in the true one."""

from dataclasses import dataclass, replace

import numpy as np

from crunchbot.nav import localise
from crunchbot.nav.mapping import Mapped
from crunchbot.nav.scoring import lock_row, position_errors
from crunchbot.occupancy import to_map
from crunchbot.scene import Arena, Prior, Scene

from .families import recipe
from .making import Made, make_recipe
from .map_scoring import best_motion

ROWS = 600  # of a drive
VISITED_M = 0.15  # from the path that the map was made on, to where a drive begins
DRIVES_SEED = 1_000_000  # of the first drive's path and noise, beyond those of maps
TRIES = 200  # of starts
FILTER = "adaptive"


@dataclass(frozen=True)
class Located:
    """A drive located in an arena: rows until the lock and median error in m from there on; None: no lock."""

    rows_to_lock: int | None
    error_m: float | None


@dataclass(frozen=True)
class Drive:
    """The same drive in the robot's own map and in the true one; `map_error_m`: the median error of the poses that the map
    was made with, after the best rigid motion."""

    own: Located
    true: Located
    map_error_m: float


def drives(family: str, seed: int, visited: np.ndarray, count: int, rows: int = ROWS) -> list[Made]:
    """Drives in the arena of a family's scene, from places near the path `visited` (n, 2), m. Nothing is known of their
    starts."""
    r, out = replace(recipe(family), uniform=True, kidnap_rows=(), moves=False), []
    for path_seed in range(DRIVES_SEED + TRIES * seed, DRIVES_SEED + TRIES * (seed + 1)):
        if len(out) == count:
            break
        start = make_recipe(r, seed, 1, path_seed).observations.truth[0]
        if np.hypot(*(visited - start[:2]).T).min() <= VISITED_M:
            out.append(make_recipe(r, seed, rows, path_seed))
    return out


def located(arena: Arena, made: Made, places: np.ndarray, seed: int) -> Located:
    """The drive in this arena by the default filter; places (n, 2) where it truly is, in the arena's frame."""
    scene = Scene(arena, made.scene.robot, Prior("uniform"))
    distance = position_errors(localise.run(FILTER, scene, made.observations, {}, seed).poses, places)
    lock = lock_row(distance)
    return Located(lock, None if lock is None else float(np.median(distance[lock:])))


def score(mapped: Mapped, family: str, seed: int, count: int = 1) -> list[Drive]:
    """`count` drives in the map of a family's scene, whose rows have true poses."""
    truth, poses, own = mapped.rows.truth, mapped.poses(), mapped.scene()
    known = np.isfinite(poses).all(axis=1)
    origin = np.tile(np.array(own.origin), (1, 1))
    poses, truth = poses[known], truth[known]
    motion = best_motion(poses[:, :2], truth[:, :2])
    map_error = float(np.median(np.hypot(*(motion.points(poses[:, :2]) - truth[:, :2]).T)))
    true_arena = make_recipe(recipe(family), seed, 1).scene.arena
    (x, y, turn) = to_map(origin, (motion.x, motion.y, motion.turn))[0]  # of the arena's frame in the true one
    c, s = np.cos(turn), np.sin(turn)
    out = []
    for made in drives(family, seed, truth[:, :2], count):
        places = made.observations.truth[:, :2]
        in_own = (places - [x, y]) @ np.array([[c, -s], [s, c]])
        both = (located(own.arena, made, in_own, seed), located(true_arena, made, places, seed))
        out.append(Drive(*both, map_error))
    return out
