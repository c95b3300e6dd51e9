"""Fits the classifier for windows of one length: discriminant, temperature and size, chosen on recordings held out.

Sums over windows are kept by fold, so that leaving one fold out is a subtraction, not a new pass over the data.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...native import lib
from .classifier import Classifier, plain_features

SHRINK = (1e-3, 1e-2, 1e-1)  # share of the diagonal in the covariance within classes
HIDDEN = (0, 128, 256)  # random projections: none, few, many; what many cost keeps a 100 ms window near 20 us
HIDDEN_MUST_GAIN = 0.02  # relative fall of the log loss that pays for the next size: it costs time in every window
LEAST_GAIN = 0.005  # nats: a smaller fall is chance, however large a share of a small loss
LEVELS_MUST_GAIN = 0.5  # the same for channel means: a rest drifts, and a mean may tell the session, not the surface
STRETCHES = 8  # of a window, end to end, judged beside the whole where they pay ...
STRETCHES_MUST_GAIN = 0.05  # ... in nats a window: they cost it a third more time, however little there is left to gain
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
    """Choose levels, shorter stretches, size and shrinkage by held-out log loss, then fit all the rest."""
    chosen = _trial(data, floor, False, 0, HIDDEN[:1])
    if chosen.loss > LEAST_GAIN:
        levelled = _trial(data, floor, True, 0, HIDDEN[:1])
        if _pays(levelled.loss, chosen.loss, LEVELS_MUST_GAIN):
            chosen = levelled
    if chosen.loss > LEAST_GAIN and data.windows.shape[1] >= STRETCHES * lib.NAV_TEXTURE_LENGTH_MIN:
        beside = _trial(data, floor, chosen.blank.levels, STRETCHES, HIDDEN[:1])
        if beside.loss < chosen.loss - STRETCHES_MUST_GAIN:
            chosen = beside
    if chosen.loss > LEAST_GAIN:
        chosen = _trial(data, floor, chosen.blank.levels, chosen.blank.shorter, HIDDEN)
    return _finished(chosen, data)


def _pays(loss: float, so_far: float, must_gain: float) -> bool:
    return loss < min((1.0 - must_gain) * so_far, so_far - LEAST_GAIN)


@dataclass
class _Candidate:
    """A size and shrinkage with its temperature, and the scores of windows whose fold was left out, tempered."""

    loss: float
    hidden: int
    shrink: float
    temper: float
    loglik: np.ndarray
    rules: list[tuple]  # weights and biases, of each fold left out


@dataclass
class _Trial:
    """Features of one kind, and what did best on them."""

    blank: Classifier  # without weights
    expanded: np.ndarray  # (m, F + hidden most)
    sums: "_Sums"
    best: _Candidate

    @property
    def loss(self) -> float:
        return self.best.loss


def _trial(data: Windows, floor: np.ndarray, levels: bool, shorter: int, sizes: tuple) -> _Trial:
    raw = plain_features(data.windows, levels, floor, shorter)
    centre, scale = raw.mean(axis=0), 1.0 / (raw.std(axis=0) + 1e-6)
    features, classes = raw.shape[1], data.classes
    weight = np.zeros((features + max(sizes), classes))
    length = data.windows.shape[1]
    blank = Classifier(length, levels, shorter, max(sizes), floor, centre, scale, weight, np.zeros(classes))
    expanded = blank.expand(data.windows) if max(sizes) else (raw - centre) * scale
    sums = _Sums(expanded, data)
    best = None
    for hidden in sizes:
        found = min(_candidates(sums, expanded, data, hidden, features + hidden), key=lambda c: c.loss)
        if best is None or _pays(found.loss, best.loss, HIDDEN_MUST_GAIN):
            best = found
    return _Trial(blank, expanded, sums, best)


def _finished(trial: _Trial, data: Windows) -> Fitted:
    classifiers = [_finish(trial.blank, trial.sums, left_out, trial.best) for left_out in (None, *range(data.folds))]
    return Fitted(classifiers[0], classifiers[1:], trial.best.loglik, trial.loss)


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
        loss = log_loss(scores * temper, data.label, sums.row_weight)
        found.append(_Candidate(loss, hidden, shrink, temper, scores * temper, rules))
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


def log_loss(loglik: np.ndarray, label: np.ndarray, weight: np.ndarray | None = None) -> float:
    """Mean of -log posterior of the right class under equal priors, nats; log-likelihoods (m, classes), best 0."""
    chance = loglik[np.arange(len(label)), label] - np.log(np.exp(loglik).sum(axis=1))
    return float(-np.average(chance, weights=weight))


def _finish(blank: Classifier, sums: _Sums, left_out: int | None, chosen: _Candidate) -> Classifier:
    features = len(blank.centre)
    whole = sums.statistics(None, features + chosen.hidden) if left_out is None else None
    weight, bias = _discriminant(*whole, chosen.shrink) if whole else chosen.rules[left_out]
    return replace(blank, hidden=chosen.hidden, weight=weight, bias=bias, temper=chosen.temper, _made=None)
