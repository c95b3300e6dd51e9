"""Surfaces never trained: a hierarchical Gaussian model fitted here, arithmetic in C (host/nav/touch/texture/texture_novelty.h)."""

from dataclasses import dataclass

import numpy as np

from ...native import as_doubles, doubles, ffi, lib
from .classifier import made, pointers

SHRINK = 0.3  # share of the diagonal in the covariance of windows within a recording
RECORDINGS_PRIOR = 10.0  # recordings' worth of a spread alike in all directions, that the measured spread is mixed with
CLASSES_PRIOR = 3.0  # classes' worth, of the spread of class means
REFUSE_MOST = 0.08  # share of held-out windows of trained surfaces that the limits may refuse
TYPICAL = 20.0  # log odds against a surface never trained in the middle of held-out windows of trained ones
FOLDS = 5  # in which recordings are left out
RATIOS_EACH = 8  # of a recording, by which it counts towards a limit
STEPS = lib.NAV_TEXTURE_NOVELTY_STEPS


@dataclass
class Novelty:
    """For windows of `length` samples; the arrays as in nav_texture_novelty_numbers."""

    length: int
    scale: float
    turn: np.ndarray  # (F, F)
    mean: np.ndarray  # (classes + 1, F)
    recording: np.ndarray  # (classes + 1, F)
    noise: np.ndarray  # (F,)
    limit: np.ndarray  # (NAV_TEXTURE_NOVELTY_STEPS,)

    ARRAYS = {"turn": 2, "mean": 2, "recording": 2, "noise": 1, "limit": 1}  # and their dimensions
    NUMBERS = ("length", "scale")

    def native(self) -> ffi.CData:
        """A detector of its own, that has seen no window; ValueError when a size or number is impossible."""
        rows, features = as_doubles(self.mean, "novelty: mean", (None, None)).shape
        shapes = {"turn": (features, features), "mean": (rows, features), "recording": (rows, features)}
        shapes |= {"noise": (features,), "limit": (STEPS,)}
        sizes = {"classes": rows - 1, "features": features, "scale": self.scale}
        return made("novelty", sizes | pointers(self, "novelty", shapes), "novelty")

    def scores(self, features: np.ndarray) -> np.ndarray:
        """Log odds of a surface never trained after each of a recording's windows in a row: features (m, F) -> (m,)."""
        detector, shape = self.native(), (len(self.noise),)
        rows = as_doubles(features, "features", (None, *shape))
        return np.array([lib.nav_texture_novelty_weigh(detector, doubles(row, "row", shape)) for row in rows])


def fit_novelty(features: list[np.ndarray], labels: np.ndarray, folds: np.ndarray, length: int) -> Novelty | None:
    """Fits the score to the features (m, F) of the windows in a row of every recording, m >= 0.

    Limits separate recordings held out (fold by fold, and those that are alike together) from classes left out, and keep
    all but REFUSE_MOST of the former. None when fewer than two recordings of a class are left where a fold is held out.
    """
    use = [n for n, rows in enumerate(features) if len(rows)]
    features, labels, folds = [features[n] for n in use], np.asarray(labels)[use], np.asarray(folds)[use]
    classes = sorted(set(labels))
    spreads = [_Spread(f) for f in features]
    found = _fit(spreads, labels, length)
    if found is None:
        return None
    held_out = [(by == fold, classes) for by in (folds, _alike(features, labels)) for fold in sorted(set(by))]
    trained = _ratios(features, spreads, labels, held_out, length)
    if len(trained[0]) == 0:
        return None
    found.limit = _limits(trained, _ratios(features, spreads, labels, _left_out(labels, classes), length))
    typical = np.mean([found.limit[s] - np.median(t) for s, t in enumerate(trained) if len(t)])
    found.scale = max(1.0, float(typical) / TYPICAL)
    return found


def _alike(features: list[np.ndarray], labels: np.ndarray) -> np.ndarray:
    """A fold for each recording: of a surface, those that are most alike are left out together, as of one speed or load. What
    is left out is then as unlike the rest as a drive of another speed or load will be."""
    means, folds = np.array([f.mean(axis=0) for f in features]), np.zeros(len(labels), int)
    for k in set(labels):
        mine = np.flatnonzero(labels == k)
        apart = means[mine] - means[mine].mean(axis=0)
        along = np.linalg.svd(apart / (apart.std(axis=0) + 1e-9), full_matrices=False)[0][:, 0]
        folds[mine[np.argsort(along)]] = np.arange(len(mine)) * FOLDS // len(mine)
    return folds


def _left_out(labels: np.ndarray, classes: list) -> list[tuple]:
    """Each class's recordings, and the classes that are left; none where only one would be left."""
    return [(labels == c, [k for k in classes if k != c]) for c in classes] if len(classes) > 2 else []


class _Spread:
    """The statistics of a recording's windows: count, mean and scatter. They serve all the models that leave something out."""

    def __init__(self, features: np.ndarray):
        self.windows, self.mean = len(features), features.mean(axis=0)
        self.scatter = (features - self.mean).T @ (features - self.mean)


def _ratios(features: list, spreads: list, labels: np.ndarray, left_out: list[tuple], length: int) -> list[np.ndarray]:
    """Ratios of recordings left out, by step: of each (recordings, classes that are left)."""
    steps = [[] for _ in range(STEPS)]
    for out, classes in left_out:
        kept = np.flatnonzero(~out)
        if set(labels[kept]) != set(classes):
            continue
        twin = _fit([spreads[n] for n in kept], np.searchsorted(classes, labels[kept]), length)
        for n in np.flatnonzero(out) if twin else ():
            _spread(twin.scores(features[n]), steps)
    return [np.array(step) for step in steps]


def _fit(spreads: list[_Spread], labels: np.ndarray, length: int) -> Novelty | None:
    classes = int(labels.max()) + 1
    counts, freedom = np.bincount(labels, minlength=classes), len(labels) - classes
    if freedom < 1 or classes < 2:
        return None
    means = np.array([s.mean for s in spreads])
    middle = np.array([means[labels == k].mean(axis=0) for k in range(classes)])
    apart, windows = means - middle[labels], sum(s.windows - 1 for s in spreads)
    # Where each recording has one window, that of recordings within classes stands for that of windows within them.
    within = sum(s.scatter for s in spreads) / windows if windows else apart.T @ apart / freedom
    values, vectors = np.linalg.eigh((1.0 - SHRINK) * within + np.diag(SHRINK * np.diag(within) + 1e-6))
    white = vectors / np.sqrt(values)
    recordings = _mixed((apart @ white).T @ (apart @ white), freedom, RECORDINGS_PRIOR)
    centre = middle.mean(axis=0)
    spread = ((middle - centre) @ white).T @ ((middle - centre) @ white)
    surfaces = _mixed(spread, classes - 1, CLASSES_PRIOR)
    variance, axes = np.linalg.eigh(recordings)
    turn, unknown = white @ axes, (axes * (surfaces @ axes)).sum(axis=0)
    recording = np.maximum(variance, 0.0) * (1.0 + 1.0 / np.append(counts, classes)[:, None])
    recording[-1] = np.maximum(variance, 0.0) + unknown * (1.0 + 1.0 / classes)
    noise = np.maximum((turn * (within @ turn)).sum(axis=0), 1e-6)
    return Novelty(length, 1.0, turn, np.vstack([middle, centre]) @ turn, recording, noise, np.zeros(STEPS))


def _mixed(scatter: np.ndarray, freedom: int, prior: float) -> np.ndarray:
    """A covariance from few vectors: their scatter, mixed with as much in all directions alike."""
    alike = max(float(np.trace(scatter)) / freedom / len(scatter), 1e-3)
    return (scatter + prior * alike * np.eye(len(scatter))) / (freedom + prior)


def _spread(scores: np.ndarray, steps: list[list]) -> None:
    """The ratios of one recording, to the step that judges them: a few each, for a long recording is no more than one."""
    for step in range(STEPS):
        last = 2 << step if step + 1 < STEPS else len(scores) + 1
        ratios = scores[(1 << step) - 1 : last - 1]
        if len(ratios):
            steps[step] += list(ratios[np.linspace(0, len(ratios) - 1, RATIOS_EACH).round().astype(int)])


def _limits(trained: list[np.ndarray], never: list[np.ndarray]) -> np.ndarray:
    """The ratio by step that errs least on both, and refuses at most REFUSE_MOST of the trained ones; without
    classes left out, 0 unless that refuses more. A step that no recording reached has the limit of the step before."""
    limits = np.zeros(STEPS)
    for step, (known, strangers) in enumerate(zip(trained, never, strict=True)):
        if len(known) == 0:
            limits[step] = limits[step - 1]
            continue
        least = float(np.quantile(known, 1.0 - REFUSE_MOST))
        if len(strangers) == 0:
            limits[step] = max(least, 0.0)
            continue
        tries = np.concatenate([[least], np.linspace(least, max(least, float(known.max())) + 10.0, 101)])
        errors = [(known > t).mean() + (strangers <= t).mean() for t in tries]
        best = tries[np.array(errors) <= min(errors) + 1e-9]
        limits[step] = 0.5 * (best.min() + best.max())
    return limits
