"""Trials: one filter on scenes of one family, judged. What a trial gives is JSON, and the same for equal arguments but
for `timing`, which is the machine's."""

import math

import numpy as np

from crunchbot.nav import localise
from crunchbot.nav.observations import Observations
from crunchbot.nav.scoring import LOCK_M, LOCK_ROWS, lock_row, position_errors

from .making import Made, make

LOST_M = 0.25
FOLDS = {"symmetric2": 2, "symmetric4": 4}


def trials(
    family: str, seeds: list[int], filter: str, settings: dict, rows: int | None = None, regions: int = 10
) -> dict[str, list[dict]]:
    """Trials of several seeds: {"trials": [figures of each]}."""
    return {"trials": [trial(family, seed, filter, settings, rows, regions) for seed in seeds]}


def trial(family: str, seed: int, filter: str, settings: dict, rows: int | None, regions: int) -> dict:
    """Figures of one run; the filter's own random seed is the scene's."""
    made = make(family, seed, rows)
    run = localise.run(filter, made.scene, made.observations, settings, seed, regions)
    begun = made.kidnaps[-1] if made.kidnaps else 0
    distance = errors_up_to_symmetry(made, run.poses, FOLDS.get(family.split("+")[0], 1))
    counted = made.observations.in_order() & np.isfinite(distance)
    lock = lock_row(distance[begun:])
    return {
        "seed": seed,
        "rows": len(run.table),
        "error_median_m": float(np.median(distance[counted])),
        "error_rms_m": float(np.sqrt(np.mean(distance[counted] ** 2))),
        "near_at_end": bool((distance[-LOCK_ROWS:] <= LOCK_M).all()),
        "lock_rows": lock,
        "faulty": _faulty(run),
        "judged": _judged(run, made.observations, distance, regions, begun if lock is None else begun + lock),
        "timing": _timing(run),
    }


def errors_up_to_symmetry(made: Made, poses: np.ndarray, folds: int) -> np.ndarray:
    """Distances from the truth, or from the nearest of its images in an arena that looks alike after a turn."""
    truth = made.observations.truth
    middle = np.array(made.scene.arena.size_m) / 2
    images = []
    for k in range(folds):
        c, s = math.cos(2 * math.pi * k / folds), math.sin(2 * math.pi * k / folds)
        x, y = (truth[:, :2] - middle).T
        images.append(position_errors(poses, np.column_stack([middle[0] + c * x - s * y, middle[1] + s * x + c * y])))
    return np.min(images, axis=0)


def _faulty(run: localise.Run) -> int:
    """Rows whose answer is no number, or whose confidence is no share."""
    table = run.table
    finite = np.isfinite(table["pose"]).all(axis=1) & np.isfinite(table["covariance"]).all(axis=(1, 2))
    return int((~(finite & (table["confidence"] >= 0.0) & (table["confidence"] <= 1.0))).sum())


def _judged(run: localise.Run, rows: Observations, distance: np.ndarray, regions: int, locked: int) -> dict:
    """Judges evenly spread rows: level and area of the region, confidence, error; `locked`: the first row after lock."""
    at = localise.judged_rows(rows, regions)
    return {
        "after_lock": [row >= locked for row in at],
        "level": [round(float(v), 4) for v in run.levels],
        "area_m2": [float(f"{v:.4g}") for v in run.areas_m2],
        "confidence": [round(float(v), 4) for v in run.table["confidence"][at]],
        "error_m": [round(float(v), 5) for v in distance[at]],
    }


def _timing(run: localise.Run) -> dict:
    us = run.step_us
    return {"step_us_median": float(np.median(us)), "step_us_p99": float(np.quantile(us, 0.99))}
