"""A robot in its own map: drives that begin where it has been, located in the map that it made and in the true one."""

from dataclasses import dataclass, replace

import numpy as np

from crunchbot.nav import localise
from crunchbot.nav.mapping import Mapped
from crunchbot.nav.scoring import lock_row, position_errors
from crunchbot.occupancy import from_map, to_map
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


@dataclass(frozen=True)
class OwnMap:
    """A map that was made, as an arena; the pose of its frame in the true one, and the median error of its poses."""

    arena: Arena
    origin: tuple[float, float, float]
    error_m: float

    @classmethod
    def of(cls, mapped: Mapped) -> "OwnMap":
        """By the rigid motion that fits the poses best to the truth of the rows."""
        truth, poses, own = mapped.rows.truth, mapped.poses(), mapped.scene()
        known = np.isfinite(poses).all(axis=1)
        motion = best_motion(poses[known, :2], truth[known, :2])
        off = np.hypot(*(motion.points(poses[known, :2]) - truth[known, :2]).T)
        origin = to_map(np.array([own.origin]), (motion.x, motion.y, motion.turn))[0]
        return cls(own.arena, tuple(map(float, origin)), float(np.median(off)))

    def places(self, truth: np.ndarray) -> np.ndarray:
        """(n, 2) of true poses (n, 3), in the map's frame."""
        return from_map(truth, self.origin)[:, :2]


def score(mapped: Mapped, family: str, seed: int, count: int = 1) -> list[Drive]:
    """`count` drives in the map of a family's scene, whose rows have true poses."""
    own, true_arena = OwnMap.of(mapped), make_recipe(recipe(family), seed, 1).scene.arena
    known = np.isfinite(mapped.poses()).all(axis=1)
    out = []
    for made in drives(family, seed, mapped.rows.truth[known, :2], count):
        truth = made.observations.truth
        both = (located(own.arena, made, own.places(truth), seed), located(true_arena, made, truth[:, :2], seed))
        out.append(Drive(*both, own.error_m))
    return out
