"""Fits one rung of a spectral texture model: discriminant, temperature and size, chosen on recordings held out.

Sums over windows are kept by fold, so that leaving one fold out is a subtraction, not a new pass over the data.
"""

from dataclasses import dataclass

import numpy as np

from ...native import lib
from .rung import Rung, plain_features

SHRINK = (1e-3, 1e-2, 1e-1)  # share of the diagonal in the covariance within classes
HIDDEN = (0, 128, 256)  # random projections: none, few, many; what many cost keeps a 100 ms window near 20 us
HIDDEN_MUST_GAIN = 0.02  # relative fall of the log loss that pays for the next size: it costs time in every window
LEAST_GAIN = 0.005  # nats: a smaller fall is chance, however large a share of a small loss
LEVELS_MUST_GAIN = 0.5  # the same for channel means: a rest drifts, and a mean may tell the session, not the surface
STRETCHES = 8  # of a window, end to end, judged beside the whole where they pay ...
STRETCHES_MUST_GAIN = 0.05  # ... in nats a window: they cost it a third more time, however little there is left to gain
AXES_MOST = 16  # of the distance that tells unknown surfaces
UNKNOWN_QUANTILE = 0.995  # of held-out windows of trained surfaces
PRIOR_WINDOWS = 20.0  # with the variances of all classes, that a class's own are mixed with
TEMPERS = np.geomspace(1e-3, 1.0, 91)  # scores are never sharpened: separable training data would ask for no end of it


@dataclass
class Windows:
    """Windows of one length with their class, fold and recording, by number."""

    windows: np.ndarray  # (m, length, channels)
    label: np.ndarray  # (m,)
    fold: np.ndarray  # (m,)
    classes: int
    folds: int


@dataclass
class Fitted:
    """A rung, its twins that have not seen a fold, and the held-out log-likelihoods (m, classes), tempered."""

    rung: Rung
    twins: list[Rung]
    loglik: np.ndarray
    loss: float


def fit(data: Windows, floor: np.ndarray) -> Fitted:
    """Choose levels, shorter stretches, size and shrinkage by held-out log loss, then fit all the rest."""
    chosen = _fit_features(data, floor, False, 0, HIDDEN[:1])
    if chosen.loss > LEAST_GAIN:
        levelled = _fit_features(data, floor, True, 0, HIDDEN[:1])
        if _pays(levelled.loss, chosen.loss, LEVELS_MUST_GAIN):
            chosen = levelled
    if chosen.loss > LEAST_GAIN and data.windows.shape[1] >= STRETCHES * lib.NAV_TEXTURE_LENGTH_MIN:
        beside = _fit_features(data, floor, chosen.rung.levels, STRETCHES, HIDDEN[:1])
        if beside.loss < chosen.loss - STRETCHES_MUST_GAIN:
            chosen = beside
    if chosen.loss > LEAST_GAIN:
        chosen = _fit_features(data, floor, chosen.rung.levels, chosen.rung.shorter, HIDDEN)
    return chosen


def _pays(loss: float, so_far: float, must_gain: float) -> bool:
    return loss < min((1.0 - must_gain) * so_far, so_far - LEAST_GAIN)


def _fit_features(data: Windows, floor: np.ndarray, levels: bool, shorter: int, sizes: tuple) -> Fitted:
    raw = plain_features(data.windows, levels, floor, shorter)
    centre, scale = raw.mean(axis=0), 1.0 / (raw.std(axis=0) + 1e-6)
    features, classes = raw.shape[1], data.classes
    nothing = np.zeros((0, features))
    blank = Rung(
        data.windows.shape[1], levels, shorter, max(sizes), floor, centre, scale,
        np.zeros((features + max(sizes), classes)), np.zeros(classes), np.zeros((classes, features)), nothing, np.zeros((classes, 0)),
        np.zeros(classes),
    )  # fmt: skip
    expanded = blank.expand(data.windows)
    sums = _Sums(expanded, data)
    best = None
    for hidden in sizes:
        tries = (_held_out(sums, expanded, data, features + hidden, s) for s in SHRINK)
        found = min(tries, key=lambda f: f[0])
        if best is None or _pays(found[0], best[0], HIDDEN_MUST_GAIN):
            best = (*found, hidden)
    loss, shrink, temper, loglik, hidden = best
    rungs = [_finish(blank, sums, left_out, hidden, shrink, temper) for left_out in (None, *range(data.folds))]
    _spread(rungs, expanded[:, :features], data)
    _limit(rungs, expanded[:, :features], data)
    return Fitted(rungs[0], rungs[1:], loglik, loss)


class _Sums:
    """Weighted counts, sums and products by fold; every class weighs the same, however much of it was recorded."""

    def __init__(self, x: np.ndarray, data: Windows):
        counts = np.bincount(data.label, minlength=data.classes)
        self.row_weight = 1.0 / counts[data.label]
        shape = (data.folds, data.classes)
        self.weight, self.first = np.zeros(shape), np.zeros((*shape, x.shape[1]))
        self.second = np.zeros((data.folds, x.shape[1], x.shape[1]))
        for f in range(data.folds):
            mine = data.fold == f
            weighted = x[mine] * self.row_weight[mine, None]
            self.second[f] = weighted.T @ x[mine]
            np.add.at(self.weight[f], data.label[mine], self.row_weight[mine])
            np.add.at(self.first[f], data.label[mine], weighted)

    def statistics(self, left_out: int | None, size: int) -> tuple[np.ndarray, np.ndarray]:
        """Class means (classes, size) and covariance within classes (size, size) of all folds but one."""
        use = [f for f in range(len(self.weight)) if f != left_out]
        weight, first = self.weight[use].sum(axis=0), self.first[use].sum(axis=0)[:, :size]
        means = first / np.maximum(weight, 1e-12)[:, None]
        second = self.second[use].sum(axis=0)[:size, :size]
        return means, (second - means.T @ (means * weight[:, None])) / weight.sum()


def _discriminant(means: np.ndarray, within: np.ndarray, shrink: float) -> tuple[np.ndarray, np.ndarray]:
    shrunk = (1.0 - shrink) * within
    shrunk[np.diag_indices_from(shrunk)] += shrink * np.diag(within) + 1e-6
    weight = np.linalg.solve(shrunk, means.T)
    return weight, -0.5 * np.einsum("kf,fk->k", means, weight)


def _held_out(sums: _Sums, x: np.ndarray, data: Windows, size: int, shrink: float) -> tuple:
    """Log loss, shrinkage, temperature and tempered log-likelihoods of windows whose fold was left out."""
    scores = np.empty((len(x), data.classes))
    for f in range(data.folds):
        weight, bias = _discriminant(*sums.statistics(f, size), shrink)
        scores[data.fold == f] = x[data.fold == f, :size] @ weight + bias
    scores -= scores.max(axis=1, keepdims=True)
    losses = [log_loss(scores * t, data.label, sums.row_weight) for t in TEMPERS]
    best = int(np.argmin(losses))
    return losses[best], shrink, float(TEMPERS[best]), scores * TEMPERS[best]


def log_loss(loglik: np.ndarray, label: np.ndarray, weight: np.ndarray | None = None) -> float:
    """Mean of -log posterior of the right class under equal priors, nats; log-likelihoods (m, classes), best 0."""
    chance = loglik[np.arange(len(label)), label] - np.log(np.exp(loglik).sum(axis=1))
    return float(-np.average(chance, weights=weight))


def _finish(blank: Rung, sums: _Sums, left_out: int | None, hidden: int, shrink: float, temper: float) -> Rung:
    features = len(blank.centre)
    weight, bias = _discriminant(*sums.statistics(left_out, features + hidden), shrink)
    means, within = sums.statistics(left_out, features)
    _, vectors = np.linalg.eigh(within)
    axes = min(AXES_MOST, features)
    return Rung(
        blank.length, blank.levels, blank.shorter, hidden, blank.floor, blank.centre, blank.scale, weight, bias, means,
        vectors[:, ::-1][:, :axes].T, np.zeros((len(means), axes)), np.zeros(len(means)), temper,
    )  # fmt: skip


def _spread(rungs: list[Rung], z: np.ndarray, data: Windows) -> None:
    """Variances of each class along and beyond each rung's axes; few windows lean on what all classes have."""
    for f, rung in enumerate(rungs, start=-1):
        use = data.fold != f
        along, rest = np.zeros((data.classes, len(rung.axis))), np.zeros(data.classes)
        counts = np.bincount(data.label[use], minlength=data.classes)
        outside = max(1, z.shape[1] - len(rung.axis))
        for k in range(data.classes):
            apart = z[use & (data.label == k)] - rung.middle[k]
            squares = (apart @ rung.axis.T) ** 2
            along[k] = squares.sum(axis=0)
            rest[k] = max(0.0, (apart**2).sum() - squares.sum()) / outside
        lean = PRIOR_WINDOWS / counts.sum()
        along = (along + lean * along.sum(axis=0)) / (counts + PRIOR_WINDOWS)[:, None]
        rest = (rest + lean * rest.sum()) / (counts + PRIOR_WINDOWS)
        rung.axis_weight = 1.0 / np.maximum(along, 1e-6)
        rung.beyond = 1.0 / np.maximum(rest, 1e-6) if z.shape[1] > len(rung.axis) else np.ones(data.classes)


def _limit(rungs: list[Rung], z: np.ndarray, data: Windows) -> None:
    """Scales distances so that each class keeps all but a few of its own held-out windows, and limits the nearest one's."""
    held = np.empty((len(z), data.classes))
    for f, twin in enumerate(rungs[1:]):
        held[data.fold == f] = distances(twin, z[data.fold == f])
    own = [np.quantile(held[data.label == k, k], UNKNOWN_QUANTILE) for k in range(data.classes)]
    scale = 1.0 / np.maximum(own, 1e-12)
    limit = float(np.quantile((held * scale).min(axis=1), UNKNOWN_QUANTILE))
    for rung in rungs:
        rung.axis_weight, rung.beyond = rung.axis_weight * scale[:, None], rung.beyond * scale
        rung.unknown = limit


def distances(rung: Rung, z: np.ndarray) -> np.ndarray:
    """Squared distance of standardised features (m, F) from every class, per feature (m, K), as nav_texture_rung_judge."""
    apart = z[:, None, :] - rung.middle[None]
    along = apart @ rung.axis.T
    inside = (along**2 * rung.axis_weight).sum(axis=2)
    rest = np.maximum((apart**2).sum(axis=2) - (along**2).sum(axis=2), 0.0)
    return (inside + rest * rung.beyond) / z.shape[1]
