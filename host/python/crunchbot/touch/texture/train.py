"""Trains the default texture method from recordings; everything that is chosen is chosen on recordings held out.

Of each fold of recordings there is a twin of the model that has not seen it: its rule, temperature, weight of later windows, doubt
and limits are all of the other recordings. What is reported of the model are the twins' decisions on what they have not seen, made
as any decision is. Only which features and which shrinkage are used, and the sensor's step, is settled once on all recordings.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from .change import mean_pass, one_of_each
from .classifier import blocks_of, plain_features
from .fit import Windows, fit, most_probable
from .model import longest_run
from .novelty import Rows, conformal, fit_novelty, least_level, limits
from .spectral import HAZARD, SENSOR_STOPS, Judgement, SpectralModel, forward

FOLDS = 10  # or as many as there are recordings
PIECES = 5  # that the one recording of a surface is cut into
PARTS = (4, 2, 1)  # of a window, that there are classifiers of: for answers as soon as sure, and shorter windows
LENGTH_LEAST, LENGTH_MOST = 4, 1024  # samples of a classifier
WINDOWS_MOST = 6000  # of one classifier, over all recordings
SPIKE_OVER = 3.0  # times what one sample in a thousand stands out from both neighbours
STILL_OVER, STILL_LEAST = 2.0, 16  # times the longest run of equal samples; shorter runs happen to any sensor
NO_STOP = 1e12  # of channels that are no raw counts
SPAN_OVER = 1.5  # times the farthest that a training window reaches
BEHIND, BEHIND_SPREAD = 0.25, 1.0  # weight of windows behind the first before anything is seen, and its log's spread
DOUBT = 0.9  # a class less probable is not named, ...
REFUSE_DOUBT, REFUSE_NOVEL = 0.03, 0.07  # ... as far as that costs no more; "unknown" may cost a tenth in all


def train(
    recordings: dict[str, list[np.ndarray]],
    rate_hz: float,
    window_ms: float = 100.0,
    progress: Callable[[int, int], object] = lambda done, of: None,
    hazard: float = HAZARD,
    places: dict[str, list[str]] | None = None,
) -> SpectralModel:
    """Learn from raw counts (n, channels) by class. `progress(done, of)` is called after each step; `hazard`: changes of
    surface in window_ms; `places`: where each recording is of, empty if not known: those of one place are held out together.

    ValueError when there is too little to learn from.
    """
    learnt = Learnt(recordings, rate_hz, window_ms, hazard, progress, places)
    model = learnt.model()
    found = learnt.held_out(learnt.window)
    model.figures = learnt.figures(found)
    if model.novelty:
        model.passes = learnt.passes(found if learnt.window == learnt.length else learnt.held_out(learnt.length))
    progress(1, 1)
    return model


class Learnt:
    """What is learnt from recordings, and the models that have not seen some of them."""

    def __init__(
        self,
        recordings: dict,
        rate_hz: float,
        window_ms: float,
        hazard: float,
        progress: Callable,
        places: dict[str, list[str]] | None = None,
    ):
        self.classes, self.rate_hz, self.window_ms, self.hazard = list(recordings), rate_hz, window_ms, hazard
        parts = [_clean(np.asarray(r, dtype=np.float64)) for group in recordings.values() for r in group]
        self.parts, self.labels = _cut(parts, [k for k, group in enumerate(recordings.values()) for _ in group])
        self.places = _places(recordings, places or {})
        self.units = _units(self.places, self.labels)
        self.folds = self.units % min(FOLDS, self.units.max() + 1)
        asked, shortest = max(LENGTH_LEAST, round(rate_hz * window_ms / 1000.0)), min(map(len, self.parts))
        if shortest < LENGTH_LEAST:
            raise ValueError(f"the shortest recording has {shortest} samples; record each surface for some seconds")
        longest = [
            max(len(p) for p, k in zip(self.parts, self.labels, strict=True) if k == c) for c in set(self.labels)
        ]
        self.window, self.length = min(asked, *longest), min(asked, LENGTH_MOST, shortest)
        lengths = sorted({max(LENGTH_LEAST, self.length // part) for part in PARTS})
        floor = _floor(self.parts)
        self._fitted = []
        for length in lengths:
            self._fitted.append(fit(self._windows(length), floor))
            progress(len(self._fitted), len(lengths) + 1)
        self._limits = [_limits(part) for part in self.parts]
        self._spans = {length: [_widest(part, length) for part in self.parts] for length in lengths}
        self._learn_distances(floor)
        twins = {f: self._plain(f) for f in set(self.folds)}
        self._rows = {}  # by length of a window: of each recording, by the twin that has not seen it
        for length in {*lengths, self.window}:
            of = zip(self.parts, self.folds, strict=True)
            self._rows[length] = [self._said(twins[f].judge(part, length)) for part, f in of]

    def _windows(self, length: int) -> Windows:
        """Half overlapping windows of all recordings, thinned evenly to at most WINDOWS_MOST."""
        starts = [np.arange(0, len(part) - length + 1, max(1, length // 2)) for part in self.parts]
        keep = min(1.0, WINDOWS_MOST / sum(map(len, starts)))
        chosen = [s[np.linspace(0, len(s) - 1, max(1, round(keep * len(s)))).astype(int)] for s in starts]
        windows = np.stack([part[i : i + length] for part, some in zip(self.parts, chosen, strict=True) for i in some])
        of = np.repeat(np.arange(len(chosen)), list(map(len, chosen)))
        return Windows(windows, self.labels[of], self.folds[of], of, len(self.classes))

    def _learn_distances(self, floor: np.ndarray) -> None:
        """The distances from trained surfaces of all recordings and without each fold, and what they say of recordings left out."""
        rows = [Rows(plain_features(blocks_of(p, self.length, len(floor)), floor)) for p in self.parts]
        self._novelty = {}
        for left_out in (None, *set(self.folds)):
            kept = self._kept(left_out)
            given = [rows[n] for n in kept], self.labels[kept]
            self._novelty[left_out] = fit_novelty(*given, len(self.classes), self.length)
        known = all(found is not None for found in self._novelty.values())
        twins = [self._novelty[f] for f in self.folds]
        self._distances = (
            [[twin.distances(row) for row in r.each] for twin, r in zip(twins, rows, strict=True)] if known else None
        )

    def _kept(self, left_out: int | None) -> np.ndarray:
        return np.flatnonzero(self.folds != left_out) if left_out is not None else np.arange(len(self.folds))

    def _plain(self, left_out: int | None) -> SpectralModel:
        """The model without a fold, which doubts nothing and takes each window by itself."""
        kept = self._kept(left_out)
        of = {
            n: (np.min if n == "low" else np.max)([self._limits[i][n] for i in kept], axis=0) for n in self._limits[0]
        }
        spans = [SPAN_OVER * np.max([self._spans[s][i] for i in kept], axis=0) for s in self._spans]
        classifiers = [f.classifier(span, left_out) for f, span in zip(self._fitted, spans, strict=True)]
        return SpectralModel(self.classes, self.rate_hz, classifiers, of, self.window_ms, hazard=self.hazard)

    def _said(self, found: list[Judgement]) -> np.ndarray:
        """Log-likelihoods (m, classes) of the windows with any evidence."""
        return np.array([d.loglik for d in found if d.confidence > 0.0]).reshape(-1, len(self.classes))

    def model(self, left_out: int | None = None) -> SpectralModel:
        """Of all recordings, or of all but those of a fold."""
        made, kept = self._plain(left_out), self._kept(left_out)
        for classifier in made.classifiers:
            rows, chance, _ = self._rows_of(classifier.length, kept)
            classifier.behind = self._behind(rows, chance)
        rows, chance, units = self._rows_of(self.window, kept)
        behind = made.classifiers[-1].behind
        sure = [-forward(loglik, behind, chance).max(axis=1) for loglik, _ in rows]
        made.doubt = min(DOUBT, -conformal(sure, REFUSE_DOUBT, units)) if sure else 0.0
        if self._distances is not None:
            limit = limits([self._distances[n] for n in kept], REFUSE_NOVEL, self.units[kept])
            made.novelty = replace(self._novelty[left_out], limit=limit)
        return made

    def _rows_of(self, length: int, kept: np.ndarray) -> tuple[list[tuple[np.ndarray, int]], float, np.ndarray]:
        """Log-likelihoods of windows in a row with their class, of the recordings kept, the chance of a change between two,
        and the recordings' units."""
        some = [n for n in kept if len(self._rows[length][n])]
        chance = -float(np.expm1(-1000.0 * self.hazard * length / (self.window_ms * self.rate_hz)))
        return [(self._rows[length][n], self.labels[n]) for n in some], chance, self.units[some]

    @staticmethod
    def _behind(rows: list[tuple[np.ndarray, int]], chance: float) -> float:
        return min(1.0, most_probable(lambda weight: _loss_behind(rows, weight, chance), BEHIND, BEHIND_SPREAD))

    def held_out(self, window: int, sequential: bool = False) -> list[list[Judgement]]:
        """Of each recording the decisions by the model that has not seen it."""
        twins = {f: self.model(f) for f in sorted(set(self.folds))}
        return [twins[f].judge(part, window, sequential) for part, f in zip(self.parts, self.folds, strict=True)]

    def passes(self, found: list[list[Judgement]]) -> dict[str, np.ndarray]:
        """By class, how far the pass over each place is; of a surface of one place it was not held out, but one tells no
        spread. `found`: of each recording, in windows that novelty is judged by."""
        far, out = np.array(list(map(mean_pass, found))), {}
        for k, name in enumerate(self.classes):
            mine = np.flatnonzero((self.labels == k) & ~np.isnan(far))
            chosen = one_of_each([self.places[n] for n in mine], [len(found[n]) for n in mine])
            out[name] = np.sort(far[mine[chosen]])
        return out

    def figures(self, judged: list[list[Judgement]]) -> dict:
        """What the model will do, for the reader; `judged`: decisions on recordings held out."""
        found, soon = self._with_class(judged), self._with_class(self.held_out(self.window, sequential=True))
        least = least_level(len(set(self.units)))
        level = max(REFUSE_DOUBT, least) + (max(REFUSE_NOVEL, least) if self._distances is not None else 0.0)
        answered = [d.best == k for k, d in found if d.label >= 0]
        return {
            "recordings": len(self.parts),
            "held_out_units": len(set(self.units)),
            "window_samples": self.window,
            "held_out_accuracy": _mean([d.best == k for k, d in found]),
            "refused": _mean([d.label < 0 for _, d in found]),
            "refused_level": round(level, 4),
            "accuracy_of_answers": _mean(answered),
            "calibration_error": _calibration(found),
            "sequential_accuracy": _mean([d.best == k for k, d in soon]),
            "sequential_calibration_error": _calibration(soon),
            "sequential_samples": round(float(np.mean([d.samples for _, d in soon])), 1) if soon else 0.0,
        }

    def _with_class(self, judged: list[list[Judgement]]) -> list[tuple[int, Judgement]]:
        return [(k, d) for k, some in zip(self.labels, judged, strict=True) for d in some]


def _mean(values: list) -> float:
    return round(float(np.mean(values)), 4) if values else 0.0


def _calibration(found: list[tuple[int, Judgement]]) -> float:
    right, confidence = np.array([(d.best == k, d.confidence) for k, d in found], dtype=float).reshape(-1, 2).T
    return round(calibration_error(right, confidence), 4)


def calibration_error(right: np.ndarray, confidence: np.ndarray, bins: int = 10) -> float:
    """Expected calibration error of decisions (m,) over equal bins of confidence."""
    place = np.minimum((confidence * bins).astype(int), bins - 1)
    each = [(place == b).mean() * abs(right[place == b].mean() - confidence[place == b].mean()) for b in set(place)]
    return float(np.sum(each))


def _loss_behind(rows: list[tuple[np.ndarray, int]], weight: float, chance: float) -> float:
    """Of recordings of two windows or more, each counted once: what the filter's answers behind the first window cost, nats."""
    loss = 0.0
    for loglik, label in rows:
        if len(loglik) > 1:
            posterior = forward(loglik, min(1.0, weight), chance)[1:, label]
            loss -= float(np.log(posterior).mean())
    return loss


def _clean(recording: np.ndarray) -> np.ndarray:
    """Without records that are not finite."""
    recording = recording.reshape(len(recording), -1)
    return recording[np.isfinite(recording).all(axis=1)]


def _cut(parts: list, labels: list) -> tuple[list, np.ndarray]:
    """Recordings class by class; the one of a surface is cut into stretches of time."""
    out, classes = [], []
    for k in sorted(set(labels)):
        mine = [part for part, label in zip(parts, labels, strict=True) if label == k]
        mine = np.array_split(mine[0], PIECES) if len(mine) == 1 else mine
        out += mine
        classes += [k] * len(mine)
    return out, np.array(classes)


def _places(recordings: dict[str, list], places: dict[str, list[str]]) -> list[str]:
    """Where each recording is of, in the order of `_cut`; empty if not known."""
    known = [(places.get(name, [""] * len(group)), len(group)) for name, group in recordings.items()]
    return [p for where, count in known for p in (where * PIECES if count == 1 else where)]


def _units(places: list[str], labels: np.ndarray) -> np.ndarray:
    """What is held out together, by number: recordings of one place, or a recording where its surface has no other place."""
    of = {k: {p for p, label in zip(places, labels, strict=True) if label == k} for k in set(labels)}
    which = [(k, p if p and len(of[k]) > 1 else n) for n, (p, k) in enumerate(zip(places, labels, strict=True))]
    order = list(dict.fromkeys(which))
    return np.array([order.index(one) for one in which])


def _floor(parts: list) -> np.ndarray:
    """Power of quantisation by channel: a twelfth of the smallest step squared."""
    return np.array([_step(np.concatenate([p[:, c] for p in parts])) ** 2 / 12 for c in range(parts[0].shape[1])])


def _step(values: np.ndarray) -> float:
    steps = np.diff(np.unique(values))
    return float(np.median(steps)) if len(steps) else 0.0


def _limits(part: np.ndarray) -> dict[str, np.ndarray]:
    """What a recording shows of each channel, as limits that it keeps to."""
    found = {"spike": [], "still": [], "low": [], "high": []}
    for x in part.T:
        outstanding = np.quantile(_outstanding(x), 0.999) if len(x) > 2 else 0.0
        found["spike"].append(SPIKE_OVER * outstanding + 4 * _step(x))
        found["still"].append(max(STILL_LEAST, STILL_OVER * longest_run(x)))
        counts = np.array_equal(x, np.round(x)) and x.min() > SENSOR_STOPS[0] and x.max() < SENSOR_STOPS[1]
        low, high = SENSOR_STOPS if counts else (-NO_STOP, NO_STOP)
        found["low"].append(low)
        found["high"].append(high)
    return {name: np.array(values, dtype=float) for name, values in found.items()}


def _outstanding(x: np.ndarray) -> np.ndarray:
    """How far each sample stands out to one side of both its neighbours."""
    before, after = x[1:-1] - x[:-2], x[1:-1] - x[2:]
    return np.where(before * after > 0, np.minimum(abs(before), abs(after)), 0.0)


def _widest(part: np.ndarray, length: int) -> np.ndarray:
    """Farthest from lowest to highest sample of any window, by channel."""
    windows = sliding_window_view(part, length, axis=0)[:: max(1, length // 4)]
    return np.maximum(np.ptp(windows, axis=-1).max(axis=0), 1.0)
