"""How good poses are: errors against the truth, when a run is locked, and whether confidence foretells being lost."""

import math

import numpy as np

LOCK_M = 0.15
LOCK_ROWS = 100


def position_errors(poses: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """(n,) distances in m of poses (n, 3) from the truth (n, 3); nan where the truth is not known."""
    return np.hypot(poses[:, 0] - truth[:, 0], poses[:, 1] - truth[:, 1])


def heading_errors(poses: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """(n,) absolute angles in rad, at most pi."""
    return np.abs(np.remainder(poses[:, 2] - truth[:, 2] + math.pi, 2 * math.pi) - math.pi)


def pose_errors(poses: np.ndarray, truth: np.ndarray) -> dict[str, float]:
    """Position and heading errors of poses (n, 3) over the rows whose truth (n, 3) is finite."""
    known = np.isfinite(truth).all(axis=1)
    distance, heading = position_errors(poses, truth)[known], heading_errors(poses, truth)[known]
    return {
        "pose_error_median_m": float(np.median(distance)),
        "pose_error_p90_m": float(np.quantile(distance, 0.9)),
        "heading_error_median_rad": float(np.median(heading)),
    }


def lock_row(distance: np.ndarray) -> int | None:
    """Rows until lock: start of the first LOCK_ROWS successive rows within LOCK_M, if the last LOCK_ROWS are too."""
    near = distance <= LOCK_M
    if len(near) < LOCK_ROWS or not near[-LOCK_ROWS:].all():
        return None
    run = np.convolve(near, np.ones(LOCK_ROWS, int), "valid")
    return int(np.argmax(run == LOCK_ROWS))


def auc(score: np.ndarray, event: np.ndarray) -> float | None:
    """Area under the ROC curve: chance that a row with the event scores above one without; None if all are alike."""
    positive = int(event.sum())
    negative = len(event) - positive
    if positive == 0 or negative == 0:
        return None
    _, rank, count = np.unique(score, return_inverse=True, return_counts=True)
    middle = np.cumsum(count) - (count - 1) / 2  # mean rank of equal scores
    return float((middle[rank][event].sum() - positive * (positive + 1) / 2) / (positive * negative))
