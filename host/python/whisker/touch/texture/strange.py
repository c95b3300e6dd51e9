"""Surfaces never trained, by the mean of several windows: numbers fitted here, arithmetic in C (host/nav/touch/texture_strange.h)."""

from dataclasses import dataclass

import numpy as np

from ...native import as_doubles, doubles, ffi, lib

STEPS = 4  # means of 2, 4, 8 and 16 windows
SHRINK = 0.1  # share of the diagonal in the covariance of the means
RECORDINGS_LEAST = (
    8  # of each class: fewer do not show how far drives lie apart, which no number of windows makes up for
)


@dataclass
class Strange:
    """Steps as in nav_texture_strange_numbers; for windows of `length` samples."""

    length: int
    turn: np.ndarray  # (steps, F, F)
    middle: np.ndarray  # (steps, classes, F)
    limit: np.ndarray  # (steps,)

    ARRAYS = {"turn": 3, "middle": 3, "limit": 1}  # and their dimensions
    NUMBERS = ("length",)

    def native(self):
        """A judge of its own, that has seen no window; ValueError when a size or number is impossible."""
        steps, classes, features = as_doubles(self.middle, "strange: middle", (None, None, None)).shape
        shapes = {"turn": (steps, features, features), "middle": (steps, classes, features), "limit": (steps,)}
        numbers, kept = ffi.new("struct nav_texture_strange_numbers *"), []
        numbers.classes, numbers.features, numbers.steps = classes, features, steps
        for name in self.ARRAYS:
            kept.append(as_doubles(getattr(self, name), f"strange: {name}", shapes[name]))
            setattr(numbers, name, doubles(kept[-1], name, shapes[name]))
        made = lib.nav_texture_strange_new(numbers)
        if made == ffi.NULL:
            raise ValueError("strange: a size or number is out of range")
        return ffi.gc(made, lib.nav_texture_strange_free)


def fit_strange(features: list[np.ndarray], labels, folds, length: int, quantile: float) -> Strange | None:
    """From the features of windows in a row (m, F) of every recording; limits keep `quantile` of the recordings left out
    in turn. None when recordings long enough for the first step are too few."""
    steps = []
    for step in range(STEPS):
        means = [_means(f, 2 << step) for f in features]
        found = _step(means, np.asarray(labels), np.asarray(folds), quantile)
        if found is None:
            break
        steps.append(found)
    if not steps:
        return None
    return Strange(length, *(np.array([s[i] for s in steps]) for i in range(3)))


def _means(rows: np.ndarray, count: int) -> np.ndarray:
    sums = np.concatenate([np.zeros((1, rows.shape[1])), np.cumsum(rows, axis=0)])
    return (sums[count:] - sums[:-count]) / count


def _step(means: list[np.ndarray], labels: np.ndarray, folds: np.ndarray, quantile: float) -> tuple | None:
    held = []
    if any(
        sum(len(m) > 1 for m, k in zip(means, labels, strict=True) if k == c) < RECORDINGS_LEAST for c in set(labels)
    ):
        return None
    for fold in sorted(set(folds)):
        fitted = _fit(means, labels, folds != fold)
        held += [_nearest(means[n], *fitted) for n in np.flatnonzero(folds == fold)]
    limit = float(np.quantile(np.concatenate(held), quantile)) if held else 0.0
    return (*_fit(means, labels, folds >= 0), limit) if limit > 0.0 else None


def _fit(means: list[np.ndarray], labels: np.ndarray, use: np.ndarray) -> tuple:
    """What makes the spread of means within classes, of all alike, round; and each class's middle, turned likewise."""
    groups = [
        np.concatenate([m for m, k, u in zip(means, labels, use, strict=True) if u and k == c])
        for c in range(labels.max() + 1)
    ]
    cov = np.mean([np.cov(group.T) for group in groups], axis=0)
    cov = (1.0 - SHRINK) * cov + np.diag(SHRINK * np.diag(cov) + 1e-6)
    turn = np.linalg.inv(np.linalg.cholesky(cov)).T
    return turn, np.array([group.mean(axis=0) for group in groups]) @ turn


def _nearest(means: np.ndarray, turn: np.ndarray, middle: np.ndarray) -> np.ndarray:
    apart = (means @ turn)[:, None] - middle
    return (apart**2).sum(axis=2).min(axis=1) / means.shape[1]
