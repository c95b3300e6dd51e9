"""Surfaces never trained: the distance from the trained ones and its limit, arithmetic in C (host/nav/touch/texture/texture_novelty.h)."""

from dataclasses import dataclass

import numpy as np

from ...native import as_doubles, doubles, ffi, lib
from .classifier import made, pointers

SHRINK = 0.3  # share of the diagonal in the covariance of windows within a recording
RECORDINGS_PRIOR = 10.0  # recordings' worth of a spread alike in all directions, that the measured spread is mixed with


@dataclass
class Novelty:
    """For windows of `length` samples; the arrays as in nav_texture_novelty_numbers."""

    length: int
    limit: float
    turn: np.ndarray  # (F, F)
    mean: np.ndarray  # (classes, F)
    recording: np.ndarray  # (F,)

    ARRAYS = {"turn": 2, "mean": 2, "recording": 1}  # and their dimensions
    NUMBERS = ("length", "limit")

    def native(self) -> ffi.CData:
        """A detector of its own, that has seen no window; ValueError when a size or number is impossible."""
        classes, features = as_doubles(self.mean, "novelty: mean", (None, None)).shape
        shapes = {"turn": (features, features), "mean": (classes, features), "recording": (features,)}
        sizes = {"classes": classes, "features": features, "limit": self.limit}
        return made("novelty", sizes | pointers(self, "novelty", shapes), "novelty")

    def distances(self, features: np.ndarray) -> np.ndarray:
        """Over the limit, after each of a recording's windows in a row: features (m, F) -> (m,)."""
        detector, shape = self.native(), (len(self.recording),)
        rows = as_doubles(features, "features", (None, *shape))
        return np.array([lib.nav_texture_novelty_weigh(detector, doubles(row, "row", shape)) for row in rows])


class Spread:
    """The statistics of a recording's windows: count, mean and scatter. They serve all the models that leave something out."""

    def __init__(self, features: np.ndarray):
        self.windows, self.mean = len(features), features.mean(axis=0)
        self.scatter = (features - self.mean).T @ (features - self.mean)


def fit_novelty(spreads: list[Spread], labels: np.ndarray, classes: int, length: int) -> Novelty | None:
    """The distance, in units of its own: the limit is 1. None without two recordings of a surface and one of each."""
    counts, freedom = np.bincount(labels, minlength=classes), len(labels) - classes
    if freedom < 1 or counts.min() < 1:
        return None
    means = np.array([s.mean for s in spreads])
    middle = np.array([means[labels == k].mean(axis=0) for k in range(classes)])
    apart, windows = means - middle[labels], sum(s.windows - 1 for s in spreads)
    # Where each recording has one window, that of recordings within classes stands for that of windows within them.
    within = sum(s.scatter for s in spreads) / windows if windows else apart.T @ apart / freedom
    values, vectors = np.linalg.eigh((1.0 - SHRINK) * within + np.diag(SHRINK * np.diag(within) + 1e-6))
    white = vectors / np.sqrt(values)
    scatter = (apart @ white).T @ (apart @ white)
    alike = float(np.trace(scatter)) / freedom / len(scatter)
    variance, axes = np.linalg.eigh(
        (scatter + RECORDINGS_PRIOR * alike * np.eye(len(scatter))) / (freedom + RECORDINGS_PRIOR)
    )
    turn = white @ axes
    return Novelty(length, 1.0, turn, middle @ turn, np.maximum(variance, 0.0))


def conformal(values: list[np.ndarray], level: float) -> float:
    """What a value of the next recording exceeds with a chance of at most `level`, or as small a one as so many recordings
    can show. Each recording counts once, however many values it has, and one more lies beyond all."""
    order = np.argsort(np.concatenate(values))
    weight = np.concatenate([np.full(len(v), 1.0 / len(v)) for v in values])[order]
    enough = np.cumsum(weight) >= (1.0 - level) * (len(values) + 1) - 1e-9
    return float(np.concatenate(values)[order[int(enough.argmax()) if enough.any() else -1]])


def least_level(recordings: int) -> float:
    """The smallest level that so many recordings can show."""
    return 1.0 / (recordings + 1)
