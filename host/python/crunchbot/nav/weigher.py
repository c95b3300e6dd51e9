"""The library's likelihood and motion noise for filters that are not the library's own: rows in, weights of poses out."""

from dataclasses import dataclass

import numpy as np

from ..native import as_doubles, doubles, ffi, lib
from ..scene import Scene
from .filters import problem_of
from .observations import Observations


@dataclass
class Motion:
    """The motion of one row, in the robot's frame before it."""

    step: np.ndarray  # (3,): x, y in m, theta in rad
    sigma_m: float  # per axis
    sigma_rad: float


class Weigher:
    """Takes rows one after the other, as a filter would, and weighs any poses by the last of them."""

    def __init__(self, scene: Scene, settings: dict[str, float] | None = None, blur_m: float = 0.0):
        self._problem, self._keep = problem_of(scene, settings or {})
        tips, rays = len(scene.robot.of_role("texture")), len(scene.robot.of_role("object"))
        self._texture, self._radial = (tips, len(scene.arena.textures)), (rays,)
        made = lib.nav_weigher_new(self._problem, blur_m)
        if made == ffi.NULL:
            raise MemoryError("no memory for a weigher")
        self._weigher = ffi.gc(made, lib.nav_weigher_free)
        self._out = np.zeros(5)
        self._row = ffi.new("struct nav_row *")

    def take(self, rows: Observations, k: int) -> tuple[Motion, bool]:
        """Row k: its motion, and whether something new was read. ValueError when the row is not of this scene's robot."""
        if not 0 <= k < len(rows):
            raise ValueError(f"row {k}: outside the {len(rows)} rows given; choose a row inside")
        self._row.t_s = rows.t_s[k]
        self._row.odometry = as_doubles(rows.odometry[k], "odometry", (3,)).tolist()
        self._row.texture = doubles(rows.texture[k], "texture", self._texture)
        self._row.radial_m = doubles(rows.radial_m[k], "radial_m", self._radial)
        news = lib.nav_weigher_take(self._weigher, self._row, doubles(self._out, "out", (5,)))
        return Motion(self._out[:3].copy(), float(self._out[3]), float(self._out[4])), bool(news)

    def weigh(self, poses: np.ndarray) -> np.ndarray:
        """(n,) log-likelihoods of that row at poses (n, 3): x, y in m, theta in rad; -inf where no robot can stand."""
        poses = as_doubles(poses, "poses", (None, 3))
        out = np.empty(len(poses))
        given, reported = doubles(poses, "poses", (None, 3)), doubles(out, "out", (len(poses),))
        lib.nav_weigher_weigh(self._weigher, given, len(poses), reported)
        return out
