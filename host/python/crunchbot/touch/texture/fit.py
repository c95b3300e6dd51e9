"""Fits the classifier for windows of one length: discriminant, temperature and size, chosen on recordings held out.

Sums over windows are kept by fold, so that leaving one fold out is a subtraction, not a new pass over the data.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...native import lib
from .classifier import NONE, Classifier, plain_features, shape_thresholds

SHRINK = (0.3, 1e-1, 1e-2, 1e-3)  # share of the diagonal in the covariance within classes, the first of equals
HIDDEN = (0, 128, 256)  # random projections: none, few, many; what many cost keeps a 100 ms window near 20 us
HIDDEN_MUST_GAIN = 0.02  # relative fall of the log loss that pays for the next size: it costs time in every window
ERRORS_MUST_GAIN = 2.0  # standard errors of the fall over windows
LEAST_GAIN = 0.005  # nats: a smaller fall is chance, however large a share of a small loss
LEVELS_MUST_GAIN = 0.5  # the same for channel means: a rest drifts, and a mean may separate sessions, not surfaces
STRETCHES = 8  # of a window, end to end, judged beside the whole where they pay
SHAPE_MOST = 1000  # windows: shapes of waveforms are for few of them, and bands know as much where there are more
BESIDE_MUST_GAIN = (
    0.05  # nats a window, of either: they cost it a third more time and more, however little is left to gain
)
LEAST_SPREAD = 0.01  # of a feature: one that hardly varies in training is not made much of
TEMPER_STEPS = 30  # of the search for a temperature; Newton needs about six, halving the rest


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
    """A classifier, its twins that have not seen a fold, and the held-out log-likelihoods (m, classes), tempered."""

    classifier: Classifier
    twins: list[Classifier]
    loglik: np.ndarray
    loss: float


def fit(data: Windows, floor: np.ndarray) -> Fitted:
    """Choose levels, shorter stretches, shapes, size and shrinkage by held-out log loss, then fit all the rest."""
    length, few = data.windows.shape[1], len(data.windows) <= SHAPE_MOST
    chosen = _Trial(data, {"floor": floor, "levels": False, "shorter": 0, "shape": NONE}, HIDDEN[:1])
    chosen = _better(chosen, {"levels": True}, LEVELS_MUST_GAIN * chosen.best.loss)
    if length >= STRETCHES * lib.NAV_TEXTURE_LENGTH_MIN:
        chosen = _better(chosen, {"shorter": STRETCHES}, BESIDE_MUST_GAIN)
    if few and lib.nav_texture_shape_count(length) and chosen.best.loss > LEAST_GAIN:
        chosen = _better(chosen, {"shape": shape_thresholds(data.windows, floor)}, BESIDE_MUST_GAIN)
    if chosen.best.loss > LEAST_GAIN:
        chosen = _Trial(data, chosen.kind, tuple(h for h in HIDDEN if h <= len(data.windows)))
    return chosen.finished()


def _better(so_far: "_Trial", change: dict, must_gain: float) -> "_Trial":
    """Adds features of another kind, where there is something to gain and they pay."""
    if so_far.best.loss <= LEAST_GAIN:
        return so_far
    found = _Trial(so_far.data, so_far.kind | change, HIDDEN[:1])
    return found if _pays(found.best, so_far.best, so_far.sums.row_weight, must_gain) else so_far


def _pays(found: "_Candidate", so_far: "_Candidate", weight: np.ndarray, must_gain: float) -> bool:
    """Whether the held-out loss falls by more, and by more than chance: what few windows say is not sure."""
    each = found.right - so_far.right
    gain = float(np.average(each, weights=weight))
    error = float(np.sqrt((weight**2 * (each - gain) ** 2).sum())) / weight.sum()
    return gain > max(must_gain, LEAST_GAIN, ERRORS_MUST_GAIN * error)


@dataclass
class _Candidate:
    """A size and shrinkage with its temperature, and the scores of windows whose fold was left out, tempered."""

    loss: float
    hidden: int
    shrink: float
    temper: float
    loglik: np.ndarray
    right: np.ndarray  # (m,) log posterior of the right class
    rules: list[tuple]  # weights and biases, of each fold left out


class _Trial:
    """Features of one kind, as in nav_texture_features_new, and the size and shrinkage that did best on them."""

    def __init__(self, data: Windows, kind: dict, sizes: tuple):
        self.data, self.kind = data, kind
        raw = plain_features(data.windows, **kind)
        centre, scale = raw.mean(axis=0), 1.0 / np.maximum(raw.std(axis=0), LEAST_SPREAD)
        self.features, most = raw.shape[1], max(sizes)
        rule = {"weight": np.zeros((self.features + most, data.classes)), "bias": np.zeros(data.classes)}
        self.blank = Classifier(data.windows.shape[1], hidden=most, centre=centre, scale=scale, **kind, **rule)
        expanded = self.blank.expand(data.windows) if most else (raw - centre) * scale
        self.sums, best = _Sums(expanded, data), None
        for hidden in sizes:
            of_size = _candidates(self.sums, expanded, data, hidden, self.features + hidden)
            found = min(of_size, key=lambda c: round(c.loss, 3))
            if best is None or _pays(found, best, self.sums.row_weight, HIDDEN_MUST_GAIN * best.loss):
                best = found
        self.best = best

    def finished(self) -> Fitted:
        best = self.best
        whole = _discriminant(*self.sums.statistics(None, self.features + best.hidden), best.shrink)
        made = [
            replace(self.blank, hidden=best.hidden, weight=weight, bias=bias, temper=best.temper, _made=None)
            for weight, bias in (whole, *best.rules)
        ]
        return Fitted(made[0], made[1:], best.loglik, best.loss)


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
        self.total = self.second.sum(axis=0)

    def statistics(self, left_out: int | None, size: int) -> tuple[np.ndarray, np.ndarray]:
        """Class means (classes, size) and covariance within classes (size, size) of all folds but one."""
        use = [f for f in range(len(self.weight)) if f != left_out]
        weight, first = self.weight[use].sum(axis=0), self.first[use].sum(axis=0)[:, :size]
        means = first / np.maximum(weight, 1e-12)[:, None]
        second = self.total[:size, :size] if left_out is None else (self.total - self.second[left_out])[:size, :size]
        return means, (second - means.T @ (means * weight[:, None])) / weight.sum()


def _discriminant(means: np.ndarray, within: np.ndarray, shrink: float) -> tuple[np.ndarray, np.ndarray]:
    shrunk = (1.0 - shrink) * within
    shrunk[np.diag_indices_from(shrunk)] += shrink * np.diag(within) + 1e-6
    weight = np.linalg.solve(shrunk, means.T)
    return weight, -0.5 * np.einsum("kf,fk->k", means, weight)


def _candidates(sums: _Sums, x: np.ndarray, data: Windows, hidden: int, size: int) -> list[_Candidate]:
    """Each shrinkage of discriminants on the first `size` columns of x."""
    statistics = [sums.statistics(f, size) for f in range(data.folds)]
    found = []
    for shrink in SHRINK:
        rules, scores = [_discriminant(*s, shrink) for s in statistics], np.empty((len(x), data.classes))
        for f, (weight, bias) in enumerate(rules):
            scores[data.fold == f] = x[data.fold == f, :size] @ weight + bias
        scores -= scores.max(axis=1, keepdims=True)
        temper = temperature(scores, data.label, sums.row_weight)
        right = log_posterior(scores * temper, data.label)
        loss = -float(np.average(right, weights=sums.row_weight))
        found.append(_Candidate(loss, hidden, shrink, temper, scores * temper, right, rules))
    return found


def temperature(scores: np.ndarray, label: np.ndarray, weight: np.ndarray | None = None, most: float = 1.0) -> float:
    """The factor in [0, most] under which scores (m, classes) cost least as log-likelihoods of `label` (m,).

    The log loss is convex in the factor: Newton steps, and halving where one leaves the bracket. Scores are not
    sharpened without bound, which separable training data would ask for.
    """
    low, high, factor = 0.0, most, min(0.5, most)
    rows, weight = np.arange(len(label)), np.full(len(label), 1.0) if weight is None else weight
    for _ in range(TEMPER_STEPS):
        chance = np.exp(factor * scores)
        chance /= chance.sum(axis=1, keepdims=True)
        mean = (chance * scores).sum(axis=1)
        slope = float(np.dot(weight, mean - scores[rows, label]))
        bend = float(np.dot(weight, (chance * (scores - mean[:, None]) ** 2).sum(axis=1)))
        low, high = (low, factor) if slope > 0.0 else (factor, high)
        step = factor - slope / bend if bend > 0.0 else high
        step = step if low < step < high else 0.5 * (low + high)
        if abs(step - factor) < 1e-4 * most:
            break
        factor = step
    return float(factor)


def log_posterior(loglik: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Log posterior of the right class under equal priors, nats; log-likelihoods (m, classes), best 0 -> (m,)."""
    return loglik[np.arange(len(label)), label] - np.log(np.exp(loglik).sum(axis=1))
