"""How good any engine's estimates of a scene are: figures that are the same whatever made the estimates.

A row is near when its position is within a distance of the truth. A robot that is carried starts anew: what counts from
a start counts from there too.
"""

import math

import numpy as np

from ..scene import Scene
from .estimates import Estimates
from .observations import Observations
from .scoring import heading_errors, lock_row, position_errors

NEAR_M = 0.06
TRAVEL_M = 0.2  # of travel from a start, after which a row should be near
SURE = 0.9  # a confidence above it is a claim ...
WRONG_M, WRONG_RAD = 0.25, 0.5  # ... which is wrong beyond these
GRACE_ROWS = 30  # after a kidnap, in which nobody can know
FOUND_ROWS = 10  # successive near rows: found
CARRIED_ROWS, CARRIED_M = 10, 0.1  # carried: the truth moved so much more in so many rows than odometry reports


def judge(estimates: Estimates, observations: Observations, near_m: float = NEAR_M) -> dict:
    """Figures of estimates where the truth is known; None for what the engine does not report.

    ValueError when the truth of no estimated row is known.
    """
    if observations.truth is None:
        raise ValueError("the scene holds no true poses; give one with true_x_m, true_y_m and true_theta_rad")
    truth = observations.truth[estimates.rows]
    known = np.isfinite(truth).all(axis=1)
    if not known.any():
        raise ValueError("the true pose is known at none of the rows; give estimates of rows whose truth is known")
    carried = carried_rows(observations)
    starts = [0, *(end for _, end in carried)]
    distance, heading = position_errors(estimates.poses, truth), heading_errors(estimates.poses, truth)
    distance[~np.isfinite(distance) & known] = np.inf  # no number is no answer
    settled = known & (travel_of(observations, starts)[estimates.rows] >= TRAVEL_M)
    near = distance <= near_m
    return {
        "engine": estimates.name,
        "rows": len(estimates.rows),
        "rows_share": len(estimates.rows) / len(observations),
        "near_m": near_m,
        "near_share": float(near[known].mean()),
        "near_share_after_20cm": float(near[settled].mean()) if settled.any() else None,
        "error_median_m": float(np.median(distance[known])),
        "heading_error_median_rad": float(np.median(heading[known])),
        "coverage_90": None if estimates.inside_90 is None else float(estimates.inside_90.mean()),
        **_claims(estimates, known, distance, heading, carried),
        "rows_to_lock": _locked(distance, estimates.rows, starts[-1]),
        "rows_to_find": [_found(near, estimates.rows, a, b) for a, b in zip(starts, [*starts[1:], None], strict=True)],
        "step_us_mean": None if estimates.step_us is None else float(np.nanmean(estimates.step_us)),
    }


def _claims(estimates: Estimates, known, distance, heading, carried: list[tuple[int, int]]) -> dict:
    """What an engine's confidence is worth: Brier score, share of rows on which it is sure and wrong."""
    if estimates.confidence is None:
        return {"brier": None, "sure_wrong_share": None}
    confidence = np.nan_to_num(estimates.confidence, nan=0.0)
    right = (distance <= WRONG_M) & (heading <= WRONG_RAD)
    counted = known.copy()
    for first, end in carried:
        counted &= ~((estimates.rows >= first) & (estimates.rows < end + GRACE_ROWS))
    wrong = (confidence > SURE) & ~right
    return {
        "brier": float(np.mean((confidence - right)[known] ** 2)),
        "sure_wrong_share": float(wrong[counted].mean()) if counted.any() else None,
    }


def _locked(distance: np.ndarray, rows: np.ndarray, start: int) -> int | None:
    """Rows of the scene from the last start until lock (lock_row, in rows that are estimated); None: not locked."""
    part = rows >= start
    first = lock_row(distance[part])
    return None if first is None else int(rows[part][first] - start)


def _found(near: np.ndarray, rows: np.ndarray, start: int, end: int | None) -> int | None:
    """Rows from a start until FOUND_ROWS successive rows (of those estimated) are near; None: not before the next start."""
    part = (rows >= start) & (rows < (np.inf if end is None else end))
    run = np.convolve(near[part], np.ones(FOUND_ROWS, int), "valid") if part.sum() >= FOUND_ROWS else np.zeros(1)
    return int(rows[part][np.argmax(run == FOUND_ROWS)] - start) if (run == FOUND_ROWS).any() else None


def carried_rows(observations: Observations) -> list[tuple[int, int]]:
    """(first, end) for each time that the robot was carried, by truth and odometry; it goes on by itself from row end."""
    truth, moved = observations.truth[:, :2], np.nan_to_num(np.hypot(*observations.odometry[:, :2].T))
    sums, n = np.concatenate([[0.0], np.cumsum(moved)]), len(moved)
    ends = np.arange(1, n)
    begins = np.maximum(ends - CARRIED_ROWS, 0)
    excess = np.hypot(*(truth[ends] - truth[begins]).T) - (sums[ends + 1] - sums[begins + 1])
    carried = np.concatenate([[False], np.nan_to_num(excess) > CARRIED_M, [False]])
    firsts, lasts = (np.nonzero(edge)[0] for edge in (~carried[:-1] & carried[1:], carried[:-1] & ~carried[1:]))
    return [(int(a) + 1, int(max(b - CARRIED_ROWS + 1, a + 1))) for a, b in zip(firsts, lasts, strict=True)]


def starts_of(observations: Observations) -> list[int]:
    """Row 0, and each row at which a robot that was carried goes on by itself."""
    return [0, *(end for _, end in carried_rows(observations))]


def travel_of(observations: Observations, starts: list[int]) -> np.ndarray:
    """(n,) metres that the robot has driven since its last start, by odometry."""
    along = np.cumsum(np.nan_to_num(np.hypot(*observations.odometry[:, :2].T)))
    since = np.zeros(len(along))
    for start in starts[1:]:
        since[start:] = along[start - 1]
    return along - since


def bits_wanted(scene: Scene, near_m: float = NEAR_M) -> float:
    """Bits that separate a place of radius near_m from all others of the arena's area; the heading is not counted."""
    x, y = scene.arena.size_m
    return math.log2(x * y / (math.pi * near_m**2))


def bits_reported(scene: Scene, observations: Observations) -> np.ndarray | None:
    """(n,) bits that the floor can have given at most up to a row, since the last start: each tile that a texture whisker meets
    for the first time carries log2(textures). The moment at which a border is crossed is not counted. None for a robot with
    object whiskers, whose contacts no such bound holds for."""
    arena, tips = scene.arena, scene.robot.of_role("texture")
    if scene.robot.of_role("object") or not tips or observations.truth is None:
        return None
    x, y, heading = observations.truth.T
    cosine, sine = np.cos(heading), np.sin(heading)
    columns = math.ceil(arena.size_m[0] / arena.tile_m) + 1
    places = []
    for tip in tips:
        at_x = x + cosine * tip.tip_m[0] - sine * tip.tip_m[1]
        at_y = y + sine * tip.tip_m[0] + cosine * tip.tip_m[1]
        places.append(np.floor(at_y / arena.tile_m) * columns + np.floor(at_x / arena.tile_m))
    tiles, starts, out = np.column_stack(places), starts_of(observations), np.zeros(len(x))
    for start, end in zip(starts, [*starts[1:], len(x)], strict=True):
        _, first = np.unique(tiles[start:end].ravel(), return_index=True)
        out[start:end] = np.cumsum(np.bincount(first // len(tips), minlength=end - start))
    return out * math.log2(max(len(arena.textures), 1))
