"""Evidence between mappers of any kind, by the paths that they give (host/nav/mapping/grid/grid_path.h)."""

from itertools import pairwise

import numpy as np

from ..native import doubles, ffi, lib, pointer
from ..scene import Robot, Scene
from .filters import ESTIMATE, ESTIMATES, pack, problem_of
from .mapper import MappingError, nowhere
from .observations import Observations


def evidence_of(
    robot: Robot, textures: tuple[str, ...], rows: Observations, table: np.ndarray, frame: np.ndarray | None = None
) -> np.ndarray:
    """Log-likelihood, nats, of each row (n,) given those before it along a path; `table`: (n,) of ESTIMATE, a mapper's, the
    first pose the origin; `frame` (n,): of each pose, where there is more than one: each frame has a map of its own.
    Readings and densities are the same for every path, so sums over rows compare mappers. MappingError when there is no
    memory, ValueError when there are not as many estimates as rows."""
    count, out = len(rows), np.zeros(len(rows))
    frame = np.zeros(count, int) if frame is None else frame
    problem, keep = problem_of(Scene(nowhere(textures), robot), {})
    widths = (len(robot.of_role("texture")), len(textures)), len(robot.of_role("object"))
    packed, kept = pack(rows, *widths, 0)
    found, sums = pointer(ESTIMATES, ESTIMATE, table, "table", (count,)), doubles(out, "out", (count,))
    starts = np.append(np.flatnonzero(np.diff(frame, prepend=-1)), count)
    paths: dict[int, object] = {}
    for first, after in pairwise(starts.tolist()):
        if frame[first] not in paths:
            paths[frame[first]] = ffi.gc(lib.nav_grid_path_new(problem), lib.nav_grid_path_free)
        path = paths[frame[first]]
        if path == ffi.NULL:
            raise MappingError("the map of a path does not fit in memory; choose one --representation")
        lib.nav_grid_path_replay(path, packed, first, after - first, found + first, sums + first)
    del keep, kept  # until here
    return out
