"""The library's likelihood and motion noise for filters of other projects: rows in, weights of poses out (weigh.h)."""

import os
from dataclasses import dataclass

import numpy as np
from cffi import FFI

from crunchbot.native import doubles
from crunchbot.native import ffi as native
from crunchbot.nav.filters import problem_of
from crunchbot.nav.observations import Observations
from crunchbot.scene import Scene

LIBRARY = "NAV_WEIGH"  # environment: path of libweigh.so
ffi = FFI()
ffi.cdef("""
void *nav_weigher_new(const void *problem);
void nav_weigher_free(void *);
bool nav_weigher_take(void *, const void *row, double *motion);
void nav_weigher_weigh(const void *, const double *poses, long n, double *loglik);
""")


@dataclass
class Motion:
    """The motion of one row, in the robot's frame before it."""

    step: np.ndarray  # (3,): x, y in m, theta in rad
    sigma_m: float  # per axis
    sigma_rad: float


def _passed(pointer):
    """What the package's module made, for functions of the library beside it."""
    return ffi.cast("void *", int(native.cast("uintptr_t", pointer)))


class Weigher:
    """Takes rows one after the other, as a filter would, and weighs any poses by the last of them."""

    def __init__(self, scene: Scene):
        self._lib = ffi.dlopen(os.environ[LIBRARY])
        self._problem, self._keep = problem_of(scene, {})
        made = self._lib.nav_weigher_new(_passed(self._problem))
        if made == ffi.NULL:
            raise MemoryError("no memory for a weigher")
        self._weigher = ffi.gc(made, self._lib.nav_weigher_free)
        self._row, self._out = native.new("struct nav_row *"), np.zeros(5)

    def take(self, rows: Observations, k: int) -> tuple[Motion, bool]:
        """Row k: its motion, and whether something new was read."""
        texture, radial = (np.ascontiguousarray(column[k]) for column in (rows.texture, rows.radial_m))
        self._row.t_s, self._row.odometry = rows.t_s[k], rows.odometry[k].tolist()
        self._row.texture = doubles(texture, "texture", texture.shape)
        self._row.radial_m = doubles(radial, "radial_m", radial.shape)
        news = self._lib.nav_weigher_take(self._weigher, _passed(self._row), ffi.from_buffer("double[]", self._out))
        return Motion(self._out[:3].copy(), float(self._out[3]), float(self._out[4])), bool(news)

    def weigh(self, poses: np.ndarray) -> np.ndarray:
        """(n,) log-likelihoods of that row at poses (n, 3): x, y in m, theta in rad; -inf where no robot can stand."""
        poses, out = np.ascontiguousarray(poses, float), np.empty(len(poses))
        places, reported = (ffi.from_buffer("double[]", array) for array in (poses, out))
        self._lib.nav_weigher_weigh(self._weigher, places, len(poses), reported)
        return out
