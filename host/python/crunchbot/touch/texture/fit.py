"""Fits the classifier for windows of one length: a linear discriminant, chosen and tempered on recordings held out.

Sums over windows are kept by fold, so that leaving one fold out is a subtraction, not a new pass over the data.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...native import lib
from .classifier import NONE, Classifier, plain_features, shape_thresholds

SHRINK = (0.7, 0.3, 0.1, 0.03, 0.01)  # share of the diagonal in the covariance within classes, the first of equals
SHAPE_MOST = 600  # windows: shapes of waveforms are for few of them, and bands know as much where there are more
CLEARLY = (
    2.0  # standard errors over recordings: of 30 draws of 10 public sets the losses say otherwise in 8, wrongly in 7
)
LEAST_SPREAD = 0.01  # of a feature: one that hardly varies in training is not made much of
TEMPERATURE, TEMPERATURE_SPREAD = 0.35, 0.7  # before anything is seen: median of 15 public sets, and the log's spread
FACTOR_STEPS, FACTOR_RANGE = 20, 6.0  # of the search for a factor, to 1 %; about the typical one, in natural logs


@dataclass
class Windows:
    """Windows of one length with their class, fold and recording, by number."""

    windows: np.ndarray  # (m, length, channels)
    label: np.ndarray  # (m,)
    fold: np.ndarray  # (m,)
    recording: np.ndarray  # (m,)
    classes: int

    def each(self, values: np.ndarray, use: np.ndarray) -> np.ndarray:
        """The mean of values (m,) in each recording of the windows in use (m,)."""
        counts = np.bincount(self.recording[use])
        return (np.bincount(self.recording[use], values[use]) / np.maximum(counts, 1))[counts > 0]


class Fitted:
    """Features of one kind, the shrinkage that did best on them, and discriminants of all windows and without each fold."""

    def __init__(self, data: Windows, floor: np.ndarray, shape: np.ndarray):
        self.data, self.floor, self.shape = data, floor, shape
        raw = plain_features(data.windows, floor, shape)
        self._centre, self._scale = raw.mean(axis=0), 1.0 / np.maximum(raw.std(axis=0), LEAST_SPREAD)
        x, folds = (raw - self._centre) * self._scale, sorted(set(data.fold))
        sums = _Sums(x, data)
        means, within = zip(*(sums.statistics(f) for f in (None, *folds)), strict=True)
        self.loss = np.inf
        for shrink in SHRINK:
            rules = dict(
                zip((None, *folds), (_discriminant(*s, shrink) for s in zip(means, within, strict=True)), strict=True)
            )
            scores = np.empty((len(x), data.classes))
            for f in folds:
                scores[data.fold == f] = x[data.fold == f] @ rules[f][0] + rules[f][1]
            right = self._right(scores)
            if right.mean() > 1e-3 - self.loss:
                self.loss, self.right, self.rules, self.scores, self.shrink = (
                    -right.mean(),
                    right,
                    rules,
                    scores,
                    shrink,
                )

    def _right(self, scores: np.ndarray) -> np.ndarray:
        """Log posterior of the right class, tempered: the mean of each recording."""
        every = np.ones(len(scores), bool)
        factor = temperature(self.data, scores, every)
        return self.data.each(log_posterior(factor * scores, self.data.label), every)

    def classifier(self, span: np.ndarray, left_out: int | None = None) -> Classifier:
        """Of all recordings but those of a fold, tempered by them alone."""
        factor = temperature(self.data, self.scores, self.data.fold != left_out)
        weight, bias = self.rules[left_out]
        weight = factor * self._scale[:, None] * weight
        bias = factor * bias - self._centre @ weight
        return Classifier(self.data.windows.shape[1], self.floor, self.shape, weight, bias, span=span)


def fit(data: Windows, floor: np.ndarray) -> Fitted:
    """Bands; where windows are few, shapes beside them, unless recordings held out clearly lose by them."""
    bands = Fitted(data, floor, NONE)
    if len(data.windows) > SHAPE_MOST or not lib.nav_texture_shape_count(data.windows.shape[1]):
        return bands
    both = Fitted(data, floor, shape_thresholds(data.windows, floor))
    loss = bands.right - both.right
    return bands if loss.mean() > CLEARLY * loss.std() / np.sqrt(len(loss)) else both


class _Sums:
    """Weighted counts, sums and products by fold; every class weighs the same, however much of it was recorded."""

    def __init__(self, x: np.ndarray, data: Windows):
        row_weight = 1.0 / np.bincount(data.label, minlength=data.classes)[data.label]
        folds, size = int(data.fold.max()) + 1, x.shape[1]
        self.weight, self.first = np.zeros((folds, data.classes)), np.zeros((folds, data.classes, size))
        self.second = np.zeros((folds, size, size))
        for f in range(folds):
            mine = data.fold == f
            weighted = x[mine] * row_weight[mine, None]
            self.second[f] = weighted.T @ x[mine]
            np.add.at(self.weight[f], data.label[mine], row_weight[mine])
            np.add.at(self.first[f], data.label[mine], weighted)
        self.total = self.second.sum(axis=0)

    def statistics(self, left_out: int | None) -> tuple[np.ndarray, np.ndarray]:
        """Class means (classes, F) and covariance within classes (F, F) of all folds but one."""
        use = [f for f in range(len(self.weight)) if f != left_out]
        weight, first = self.weight[use].sum(axis=0), self.first[use].sum(axis=0)
        means = first / np.maximum(weight, 1e-12)[:, None]
        second = self.total if left_out is None else self.total - self.second[left_out]
        return means, (second - means.T @ (means * weight[:, None])) / weight.sum()


def _discriminant(means: np.ndarray, within: np.ndarray, shrink: float) -> tuple[np.ndarray, np.ndarray]:
    shrunk = (1.0 - shrink) * within
    shrunk[np.diag_indices_from(shrunk)] += shrink * np.diag(within) + 1e-6
    weight = np.linalg.solve(shrunk, means.T)
    return weight, -0.5 * np.einsum("kf,fk->k", means, weight)


def temperature(data: Windows, scores: np.ndarray, use: np.ndarray) -> float:
    """The factor under which scores (m, classes) of the windows in use are log-likelihoods; each recording counts once."""
    return most_probable(
        lambda factor: -data.each(log_posterior(factor * scores, data.label), use).sum(),
        TEMPERATURE,
        TEMPERATURE_SPREAD,
    )


def most_probable(loss: Callable[[float], float], typical: float, spread: float) -> float:
    """The factor of least loss(factor), nats, when its log is normal about that of `typical` before anything is seen."""
    low, high = -FACTOR_RANGE, FACTOR_RANGE
    cost = lambda log: loss(typical * np.exp(log)) + 0.5 * (log / spread) ** 2  # noqa: E731
    for _ in range(FACTOR_STEPS):
        third = (high - low) / 3.0
        low, high = (low, high - third) if cost(low + third) < cost(high - third) else (low + third, high)
    return float(typical * np.exp(0.5 * (low + high)))


def log_posterior(loglik: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Log posterior of the right class under equal priors, nats: log-likelihoods (m, classes) -> (m,)."""
    loglik = loglik - loglik.max(axis=1, keepdims=True)
    return loglik[np.arange(len(label)), label] - np.log(np.exp(loglik).sum(axis=1))
