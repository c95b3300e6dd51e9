"""Estimates of any engine as a CSV file: a pose for each row of a scene, or for some of them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..tables import TableError, numbers, read_columns
from .observations import Observations

POSE = ("x_m", "y_m", "theta_rad")
COVARIANCE = ("xx_m2", "xy_m2", "yy_m2")
SAME_S = 1e-3  # times that differ by less are the same row's


@dataclass(frozen=True)
class Estimates:
    """m answers of one engine; what it does not report is None."""

    name: str
    rows: np.ndarray  # (m,) rows of the observations, increasing
    poses: np.ndarray  # (m, 3) m, m, rad
    confidence: np.ndarray | None = None  # (m,) belief mass within 0.25 m and 0.5 rad of the pose
    inside_90: np.ndarray | None = None  # (j,) whether the truth lies in the 90 % region, at some rows
    step_us: np.ndarray | None = None  # (m,) CPU time


def read_estimates(path: str | Path, name: str, observations: Observations) -> Estimates:
    """A CSV file with x_m, y_m, theta_rad and any of t_s, confidence, xx_m2, xy_m2, yy_m2, step_us.

    With as many rows as the observations they are taken in order; else each is found by its t_s. TableError names file
    and remedy.
    """
    text = read_columns(path, [*POSE])
    poses = np.column_stack([numbers(text[key]) for key in POSE])
    rows = _rows_of(path, text, len(poses), observations)
    if not len(rows):
        raise TableError(path, None, "no rows; give an estimate for at least one row of the scene")
    confidence, step_us = (numbers(text[key]) if key in text else None for key in ("confidence", "step_us"))
    covariance = np.column_stack([numbers(text[key]) for key in COVARIANCE]) if set(COVARIANCE) <= text.keys() else None
    truth = observations.truth
    inside = None if covariance is None or truth is None else _inside(poses, covariance, truth[rows])
    return Estimates(name, rows, poses, confidence, inside, step_us)


def _rows_of(path, text: dict, count: int, observations: Observations) -> np.ndarray:
    if count == len(observations):
        return np.arange(count)
    if "t_s" not in text:
        asked = f"{count} rows, the scene has {len(observations)}"
        raise TableError(path, 1, f"{asked}; give one for each, or add the column 't_s'")
    times, known = numbers(text["t_s"]), observations.t_s
    order = np.argsort(known, kind="stable")
    at = order[np.clip(np.searchsorted(known[order], times - SAME_S), 0, len(known) - 1)]
    wrong = np.nonzero(~(np.abs(known[at] - times) <= SAME_S))[0]
    if len(wrong):
        raise TableError(
            path, int(wrong[0]) + 2, f"t_s {text['t_s'][wrong[0]]} is no row's of the scene; give those of it"
        )
    if (np.diff(at) <= 0).any():
        line = int(np.nonzero(np.diff(at) <= 0)[0][0]) + 3
        raise TableError(path, line, "t_s is not later than the line before; give rows in order, each once")
    return at


def _inside(poses: np.ndarray, covariance: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """(m,) whether the truth lies in the 90 % ellipse of a normal distribution in (x, y)."""
    x, y = (truth - poses)[:, :2].T
    xx, xy, yy = covariance.T
    scaled = yy * x * x - 2.0 * xy * x * y + xx * y * y  # Mahalanobis distance squared times the determinant
    return scaled <= -2.0 * np.log(0.1) * (xx * yy - xy * xy)
