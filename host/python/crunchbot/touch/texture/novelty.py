"""Surfaces never trained: the distance from the trained ones and its limit, arithmetic in C (host/nav/touch/texture/texture_novelty.h)."""

from dataclasses import dataclass

import numpy as np

from ...native import as_doubles, doubles, ffi, lib
from .classifier import made, pointers

ROW = lib.NAV_TEXTURE_ROW  # windows
SHRINK = 0.3  # share of the diagonal in the covariance of windows within a row
RECORDINGS_PRIOR = 10.0  # recordings' worth of a spread alike in all directions, that the measured spread is mixed with


@dataclass
class Novelty:
    """For windows of `length` samples; the arrays as in nav_texture_novelty_numbers."""

    length: int
    limit: np.ndarray  # (ROW,)
    turn: np.ndarray  # (F, F)
    mean: np.ndarray  # (classes, F)
    row: np.ndarray  # (F,)

    ARRAYS = {"limit": 1, "turn": 2, "mean": 2, "row": 1}  # and their dimensions
    NUMBERS = ("length",)

    def native(self) -> ffi.CData:
        """A detector of its own, that has seen no window; ValueError when a size or number is impossible."""
        classes, features = as_doubles(self.mean, "novelty: mean", (None, None)).shape
        shapes = {"limit": (ROW,), "turn": (features, features), "mean": (classes, features), "row": (features,)}
        sizes = {"classes": classes, "features": features}
        return made("novelty", sizes | pointers(self, "novelty", shapes), "novelty")

    def distances(self, features: np.ndarray) -> np.ndarray:
        """Over the limit, after each of some windows in a row: features (m, F) -> (m,)."""
        detector, shape = self.native(), (len(self.row),)
        windows = as_doubles(features, "features", (None, *shape))
        return np.array([lib.nav_texture_novelty_weigh(detector, doubles(w, "window", shape)) for w in windows])


class Rows:
    """A recording's windows as what is judged at once, rows of at most ROW: what a drive is like may change from one to the next.

    Their count, means and scatter serve all the models that leave something out.
    """

    def __init__(self, features: np.ndarray):
        self.each = np.array_split(features, -(-len(features) // ROW))
        self.means = np.array([row.mean(axis=0) for row in self.each])
        off = features - np.repeat(self.means, list(map(len, self.each)), axis=0)
        self.scatter, self.freedom = off.T @ off, len(features) - len(self.each)


def fit_novelty(recordings: list[Rows], labels: np.ndarray, classes: int, length: int) -> Novelty | None:
    """The distance, in units of its own: the limits are 1. None without two recordings of a surface and one of each."""
    counts, freedom = np.bincount(labels, minlength=classes), len(labels) - classes
    if freedom < 1 or counts.min() < 1:
        return None
    whole = np.array([r.means.mean(axis=0) for r in recordings])
    middle = np.array([whole[labels == k].mean(axis=0) for k in range(classes)])
    # Each recording counts once, however many rows it has.
    apart = np.concatenate(
        [(r.means - middle[k]) / len(r.means) ** 0.5 for r, k in zip(recordings, labels, strict=True)]
    )
    windows = sum(r.freedom for r in recordings)
    # Where each recording has one window, that of recordings within classes stands for that of windows within them.
    within = sum(r.scatter for r in recordings) / windows if windows else apart.T @ apart / freedom
    values, vectors = np.linalg.eigh((1.0 - SHRINK) * within + np.diag(SHRINK * np.diag(within) + 1e-6))
    white = vectors / np.sqrt(values)
    scatter = (apart @ white).T @ (apart @ white)
    alike = float(np.trace(scatter)) / freedom / len(scatter)
    variance, axes = np.linalg.eigh(
        (scatter + RECORDINGS_PRIOR * alike * np.eye(len(scatter))) / (freedom + RECORDINGS_PRIOR)
    )
    turn = white @ axes
    return Novelty(length, np.ones(ROW), turn, middle @ turn, np.maximum(variance, 0.0))


def limits(recordings: list[list[np.ndarray]], level: float, units: np.ndarray | None = None) -> np.ndarray:
    """Of the distances after 1, 2, .. windows of a row, (ROW,), by `conformal`: for each recording those of its rows.

    Not below that of the recordings' first rows, all lengths alike: of long rows a few recordings show the farthest badly.
    """
    units = np.arange(len(recordings)) if units is None else np.asarray(units)
    all_alike = conformal([rows[0] for rows in recordings], level, units)
    found = np.full(ROW, all_alike)
    for n in range(ROW):
        values = [np.array([row[n] for row in rows if len(row) > n]) for rows in recordings]
        known = [i for i, v in enumerate(values) if len(v)]
        found[n] = max(all_alike, conformal([values[i] for i in known], level, units[known]) if known else 0.0)
    return found


def conformal(values: list[np.ndarray], level: float, units: np.ndarray | None = None) -> float:
    """What a value of the next unit exceeds with a chance of at most `level`, or as small a one as so many units can show.

    `values`: of each recording. `units`: which place each is of; without, each recording is one. A unit counts once, however
    many values it has, and one more lies beyond all."""
    of = np.repeat(np.arange(len(values)) if units is None else units, list(map(len, values)))
    every, of = np.concatenate(values), np.unique(of, return_inverse=True)[1]
    order = np.argsort(every)
    weight = (1.0 / np.bincount(of))[of][order]
    enough = np.cumsum(weight) >= (1.0 - level) * (of.max() + 2) - 1e-9
    return float(every[order[int(enough.argmax()) if enough.any() else -1]])


def least_level(units: int) -> float:
    """The smallest level that so many units can show."""
    return 1.0 / (units + 1)
