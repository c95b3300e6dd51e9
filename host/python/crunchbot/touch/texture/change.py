"""A drive that is unlike all of training: whisker, mount or speed are another than the model's.

Windows that bend as a changed whisker would are undone: turned back about the mean, or scaled. What brings them near the
trained surfaces again is the likeliest cause. Nothing of the kind does where the speed is another.
"""

from collections.abc import Callable

import numpy as np

from .classifier import blocks_of, plain_features
from .novelty import ROW, Novelty
from .spectral import SpectralModel

GAINS = tuple(2.0 ** (n / 4) for n in (-4, -3, -2, -1, 1, 2, 3, 4))  # a whisker that bends half or twice as much
TURNS = tuple(np.radians(15.0 * n) for n in range(-6, 7) if n)  # half a turn about its own axis shows nothing
EXPLAINED = 0.5  # of the distance, that undoing the right change leaves at most: .4 of gains and turns, .6 of speeds
LEAST_WINDOWS, MOST_WINDOWS = 2 * ROW, 16 * ROW  # that are enough to say so; more are thinned evenly, in whole rows
FASTER = 1.25  # than any recording, or slower, is another speed


def notice(model: SpectralModel, windows: np.ndarray, speed_m_s: float | None = None) -> str:
    """One line about a drive's windows, of `windows_of`; empty where they are as in training, or too few, or the model does not
    know. `speed_m_s`: the tip's, where known."""
    pace = _pace(model, speed_m_s)
    if pace:
        return f"speed: {pace}; train with drives at that speed"
    novelty = model.novelty
    if novelty is None or not novelty.drive or len(windows) < LEAST_WINDOWS:
        return ""
    floor = next(c.floor for c in model.classifiers if c.length == novelty.length)
    rows = np.arange(len(windows)) // ROW
    kept = np.unique(np.linspace(0, rows[-1], MOST_WINDOWS // ROW).astype(int))
    seen = windows[np.isin(rows, kept)]
    found = apart(novelty, plain_features(seen, floor))
    if found <= novelty.drive:
        return ""
    undone = {"whisker": [lambda w, g=g: _scaled(w, 1.0 / g) for g in GAINS]}
    if model.channels == 2:
        undone["mount"] = [lambda w, a=a: _turned(w, a) for a in TURNS]
    left = {cause: _least(novelty, seen, floor, ways) for cause, ways in undone.items()}
    cause = min(left, key=lambda name: left[name])
    if left[cause] > EXPLAINED * found:
        cause = "speed" if speed_m_s is None or not model.speed_m_s else "whisker"
    return (
        f"{cause}: {SAID[cause]} ({found / novelty.drive:.1f} times as far from the trained surfaces as a drive may be)"
    )


SAID = {
    "whisker": "another one than the model's, or a floor never trained; train with this whisker",
    "mount": "turned about its axis since training; turn it back, or train again",
    "speed": "another one than in training, or another whisker or floor; drive as in training, or train with such drives",
}


def windows_of(model: SpectralModel, samples: np.ndarray) -> np.ndarray:
    """The windows of a recording (n, channels) that are whole and have evidence, as `notice` takes them."""
    length = model.novelty.length if model.novelty else model.classifiers[-1].length
    windows, judged = blocks_of(samples, length, model.channels), model.judge(samples, length)
    good = np.array([d.confidence > 0.0 for d in judged], bool) & np.isfinite(windows).all(axis=(1, 2))
    return windows[good]


def apart(novelty: Novelty, features: np.ndarray) -> float:
    """How far a drive's windows (m, F) are from the trained surfaces: of rows, the mean of the distance over its limit."""
    rows = np.array_split(features, -(-len(features) // ROW))
    return float(np.mean([novelty.distances(row)[-1] for row in rows]))


def _least(novelty: Novelty, windows: np.ndarray, floor: np.ndarray, ways: list[Callable]) -> float:
    return min(apart(novelty, plain_features(way(windows), floor)) for way in ways)


def _scaled(windows: np.ndarray, gain: float) -> np.ndarray:
    middle = windows.mean(axis=1, keepdims=True)
    return middle + gain * (windows - middle)


def _turned(windows: np.ndarray, angle: float) -> np.ndarray:
    middle, (c, s) = windows.mean(axis=1, keepdims=True), (np.cos(angle), np.sin(angle))
    return middle + (windows - middle) @ np.array([[c, -s], [s, c]])


def _pace(model: SpectralModel, speed_m_s: float | None) -> str:
    if speed_m_s is None or not model.speed_m_s:
        return ""
    low, high = model.speed_m_s
    if low / FASTER <= speed_m_s <= high * FASTER:
        return ""
    return f"{speed_m_s:.2f} m/s, but the recordings of training are of {low:.2f} to {high:.2f} m/s"
