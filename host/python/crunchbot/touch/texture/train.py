"""Trains the default texture method from recordings; everything that is chosen is chosen on recordings held out."""

from collections.abc import Callable
from itertools import zip_longest

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from .change import fit_change
from .fit import Fitted, Windows, fit
from .model import longest_run
from .novelty import fit_novelty
from .spectral import HAZARD, SENSOR_STOPS, SpectralModel, forward

FOLDS = 5
SHORTER, LONGER = 8, 8  # classifiers from an eighth of the window to eight windows, in octaves
LENGTH_LEAST, LENGTH_MOST = 4, 1024  # samples of a classifier
WINDOWS_MOST = 6000  # of one classifier, over all recordings
BLOCKS = 4  # of a window, in each of which a change of surface is looked for
SPIKE_OVER = 3.0  # times what one sample in a thousand stands out from both neighbours
STILL_OVER, STILL_LEAST = 2.0, 16  # times the longest run of equal samples; shorter runs happen to any sensor
NO_STOP = 1e12  # of channels that are no raw counts
SPAN_OVER = 1.5  # times the farthest that a training window reaches
TEMPERS = (1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.08)  # of windows in a row
DOUBT = 0.9  # a class less probable is not named, ...
REFUSE_MOST = 0.03  # ... as far as that costs no more than this share of held-out windows


def train(
    recordings: dict[str, list[np.ndarray]],
    rate_hz: float,
    window_ms: float = 100.0,
    progress: Callable[[int, int], object] = lambda done, of: None,
    hazard: float = HAZARD,
) -> SpectralModel:
    """Learn from raw counts (n, channels) by class. `progress(done, of)` is called after each step; `hazard`: changes of
    surface in window_ms.

    ValueError when there is too little to learn from.
    """
    parts = [_clean(np.asarray(r, dtype=np.float64)) for group in recordings.values() for r in group]
    labels = [k for k, group in enumerate(recordings.values()) for _ in group]
    parts, labels, folds = _fold(parts, labels)
    base = max(LENGTH_LEAST, round(rate_hz * window_ms / 1000.0))
    lengths = _ladder(base, min(map(len, parts)))
    base = min(base, *(max(len(p) for p, k in zip(parts, labels, strict=True) if k == c) for c in set(labels)))
    limits, floor = _limits(parts), _floor(parts)
    fitted = []
    for length in lengths:
        fitted.append(fit(_windows(parts, labels, folds, length, len(recordings)), floor))
        progress(len(fitted), len(lengths) + 1)
    _give_spans(fitted, parts)
    model = SpectralModel(list(recordings), rate_hz, [f.classifier for f in fitted], limits, window_ms, hazard=hazard)
    _calibrate(model, fitted, parts, labels, folds, base)
    block = max(LENGTH_LEAST, round(base / BLOCKS))
    model.change = fit_change(parts, labels, folds, block, floor)
    model.novelty = _novelty(model, parts, labels, folds, base)
    progress(len(lengths) + 1, len(lengths) + 1)
    return model


def _give_spans(fitted: list[Fitted], parts: list) -> None:
    for found in fitted:
        span = SPAN_OVER * _widest(parts, found.classifier.length)
        for classifier in (found.classifier, *found.twins):
            classifier.span = span


def _clean(recording: np.ndarray) -> np.ndarray:
    """Without records that are not finite."""
    recording = recording.reshape(len(recording), -1)
    return recording[np.isfinite(recording).all(axis=1)]


def _fold(parts: list, labels: list) -> tuple[list, np.ndarray, np.ndarray]:
    """Spread each class's recordings over the folds; a class with one recording is cut into stretches of time."""
    out, classes, folds = [], [], []
    for k in sorted(set(labels)):
        mine = [part for part, label in zip(parts, labels, strict=True) if label == k]
        if len(mine) == 1:
            mine = np.array_split(mine[0], FOLDS)
        for n, part in enumerate(sorted(mine, key=len, reverse=True)):
            out.append(part)
            classes.append(k)
            folds.append(n % FOLDS)
    return out, np.array(classes), np.array(folds)


def _ladder(base: int, shortest: int) -> list[int]:
    """Window lengths: the base and octaves around it, no longer than the shortest recording."""
    tries = [base * 2.0**octave for octave in range(-int(np.log2(SHORTER)), int(np.log2(LONGER)) + 1)]
    top = min(LENGTH_MOST, shortest)
    while base <= LENGTH_LEAST * SHORTER and tries[-1] * 2 <= min(top, LENGTH_MOST // 2):
        tries.append(tries[-1] * 2)  # a slow sensor: its windows of use are many times 100 ms
    lengths = sorted({round(t) for t in tries if LENGTH_LEAST <= round(t) <= top})
    if not lengths:
        raise ValueError(f"the shortest recording has {shortest} samples; record each surface for some seconds")
    return lengths


def _windows(parts: list, labels: np.ndarray, folds: np.ndarray, length: int, classes: int) -> Windows:
    """Half overlapping windows of all recordings, thinned evenly to at most WINDOWS_MOST."""
    starts = [np.arange(0, len(part) - length + 1, max(1, length // 2)) for part in parts]
    keep = min(1.0, WINDOWS_MOST / sum(map(len, starts)))
    chosen = [s[np.linspace(0, len(s) - 1, max(1, round(keep * len(s)))).astype(int)] for s in starts]
    windows = np.stack([part[i : i + length] for part, some in zip(parts, chosen, strict=True) for i in some])
    counts = list(map(len, chosen))
    return Windows(windows, np.repeat(labels, counts), np.repeat(folds, counts), classes, int(folds.max()) + 1)


def _floor(parts: list) -> np.ndarray:
    """Power of quantisation by channel: a twelfth of the smallest step squared."""
    return np.array([_step(np.concatenate([p[:, c] for p in parts])) ** 2 / 12 for c in range(parts[0].shape[1])])


def _step(values: np.ndarray) -> float:
    steps = np.diff(np.unique(values))
    return float(np.median(steps)) if len(steps) else 0.0


def _limits(parts: list) -> dict[str, np.ndarray]:
    found = {"spike": [], "still": [], "low": [], "high": []}
    for c in range(parts[0].shape[1]):
        channel = [p[:, c] for p in parts]
        everything = np.concatenate(channel)
        outstanding = np.concatenate([_outstanding(x) for x in channel])
        found["spike"].append(SPIKE_OVER * np.quantile(outstanding, 0.999) + 4 * _step(everything))
        found["still"].append(max(STILL_LEAST, STILL_OVER * max(map(longest_run, channel))))
        counts = np.array_equal(everything, np.round(everything)) and everything.min() > SENSOR_STOPS[0]
        counts = counts and everything.max() < SENSOR_STOPS[1]
        low, high = SENSOR_STOPS if counts else (-NO_STOP, NO_STOP)
        found["low"].append(low)
        found["high"].append(high)
    return {name: np.array(values, dtype=float) for name, values in found.items()}


def _outstanding(x: np.ndarray) -> np.ndarray:
    """How far each sample stands out to one side of both its neighbours."""
    before, after = x[1:-1] - x[:-2], x[1:-1] - x[2:]
    return np.where(before * after > 0, np.minimum(abs(before), abs(after)), 0.0)


def _widest(parts: list, length: int) -> np.ndarray:
    """Farthest from lowest to highest sample of any window, by channel."""
    hop = max(1, length // 4)
    windows = (sliding_window_view(p, length, axis=0)[::hop] for p in parts if len(p) >= length)
    return np.maximum(np.max([np.ptp(each, axis=-1).max(axis=0) for each in windows], axis=0), 1.0)


def _calibrate(model: SpectralModel, fitted: list[Fitted], parts: list, labels, folds, base: int) -> None:
    """Temper and doubt, from decisions of twins on recordings that they have not seen."""
    twins = [
        SpectralModel(model.classes, model.rate_hz, [f.twins[n] for f in fitted], model.limits, model.window_ms)
        for n in range(len(fitted[0].twins))
    ]
    chance = -float(np.expm1(-1000.0 * model.hazard * base / (model.window_ms * model.rate_hz)))
    course = _course(_decisions(twins, parts, folds, base), labels, round(1.0 / chance))
    model.temper = min(TEMPERS, key=lambda temper: _filter_loss(*course, temper, chance))
    for twin in twins:
        twin.temper = model.temper
    right, confidence = _scores(_decisions(twins, parts, folds, base), labels)
    model.doubt = min(DOUBT, float(np.quantile(confidence, REFUSE_MOST)))
    sequential = _decisions(twins, parts, folds, base, sequential=True)
    right_sequential, sure = _scores(sequential, labels)
    answered = right[confidence >= model.doubt]
    model.figures = {
        "window_samples": base,
        "held_out_accuracy": round(float(right.mean()), 4),
        "refused": round(float((confidence < model.doubt).mean()), 4),
        "accuracy_of_answers": round(float(answered.mean()), 4),
        "calibration_error": round(calibration_error(right, confidence), 4),
        "sequential_accuracy": round(float(right_sequential.mean()), 4) if len(sure) else 0.0,
        "sequential_calibration_error": round(calibration_error(right_sequential, sure), 4),
        "sequential_samples": round(sum(d.samples for group in sequential for d in group) / max(1, len(sure)), 1),
    }


def _course(decisions: list[list], labels, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Log-likelihoods (m, classes) and true classes (m,) of windows in a row over many surfaces, of each at most so many at a time."""
    stretches = {k: [] for k in sorted(set(labels))}
    for group, k in zip(decisions, labels, strict=True):
        stretches[k] += [[(d.loglik, k) for d in group[at : at + most]] for at in range(0, len(group), most)]
    turns = zip_longest(*stretches.values(), fillvalue=[])
    loglik, label = zip(*(window for turn in turns for stretch in turn for window in stretch), strict=True)
    return np.array(loglik), np.array(label)


def _filter_loss(loglik: np.ndarray, label: np.ndarray, temper: float, chance: float) -> float:
    """Mean of -log posterior of the right class over a course of windows, nats."""
    return -float(np.log(forward(loglik, temper, chance)[np.arange(len(label)), label]).mean())


def calibration_error(right: np.ndarray, confidence: np.ndarray, bins: int = 10) -> float:
    """Expected calibration error of decisions (m,) over equal bins of confidence."""
    place = np.minimum((confidence * bins).astype(int), bins - 1)
    each = [(place == b).mean() * abs(right[place == b].mean() - confidence[place == b].mean()) for b in set(place)]
    return float(np.sum(each))


def _novelty(model: SpectralModel, parts, labels, folds, base: int):
    """The classifier's features of windows of the base length; None without such a classifier."""
    classifier = next((r for r in model.classifiers if r.length == base), None)
    if classifier is None:
        return None
    rows = [p[: len(p) // base * base].reshape(-1, base, p.shape[1]) for p in parts]
    bands = len(classifier.centre) - len(classifier.shape)
    return fit_novelty([classifier.expand(r)[:, :bands] for r in rows], labels, folds, base)


def _decisions(twins: list[SpectralModel], parts, folds, window: int, sequential: bool = False) -> list[list]:
    return [twins[f].judge(part, window, sequential) for part, f in zip(parts, folds, strict=True)]


def _scores(decisions: list[list], labels) -> tuple[np.ndarray, np.ndarray]:
    """Whether each decision's likeliest class is right, and its confidence."""
    pairs = [(d.best == k, d.confidence) for group, k in zip(decisions, labels, strict=True) for d in group]
    right, confidence = np.array(pairs, dtype=float).reshape(-1, 2).T
    return right, confidence
