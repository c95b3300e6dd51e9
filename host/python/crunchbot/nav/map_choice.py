"""Evidence between mappers of any kind, by the paths that they give (host/nav/mapping/grid/grid_path.h)."""

import numpy as np

from ..native import doubles, ffi, lib, pointer
from ..scene import Robot, Scene
from .filters import ESTIMATE, ESTIMATES, pack, problem_of
from .mapper import MappingError, nowhere
from .observations import Observations


def evidence_of(robot: Robot, textures: tuple[str, ...], rows: Observations, table: np.ndarray) -> np.ndarray:
    """Log-likelihood, nats, of each row (n,) given those before it along a path; `table`: (n,) of ESTIMATE, a mapper's, the
    first pose the origin. Readings and densities are the same for every path, so sums over rows compare mappers.
    MappingError when there is no memory, ValueError when there are not as many estimates as rows."""
    count, out = len(rows), np.zeros(len(rows))
    problem, keep = problem_of(Scene(nowhere(textures), robot), {})
    path = ffi.gc(lib.nav_grid_path_new(problem), lib.nav_grid_path_free)
    if path == ffi.NULL:
        raise MappingError("the map of a path does not fit in memory; choose one --representation")
    widths = (len(robot.of_role("texture")), len(textures)), len(robot.of_role("object"))
    packed, kept = pack(rows, *widths, 0)
    found = pointer(ESTIMATES, ESTIMATE, table, "table", (count,))
    lib.nav_grid_path_replay(path, packed, 0, count, found, doubles(out, "out", (count,)))
    del keep, kept  # until here
    return out
