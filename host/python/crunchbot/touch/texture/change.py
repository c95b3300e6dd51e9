"""A drive that is unlike all of training: whisker, mount or speed are another than the model's.

Windows that bend as a changed whisker would are undone: turned back about the mean, or scaled. What brings them near the
trained surfaces again is the likeliest cause. Nothing of the kind does where the speed is another.
"""

from collections.abc import Callable

import numpy as np

from ...native import doubles, lib
from .classifier import Reducer, blocks_of
from .novelty import ROW
from .spectral import SpectralModel

GAINS = tuple(2.0 ** (n / 4) for n in (-4, -3, -2, -1, 1, 2, 3, 4))  # a whisker that bends half or twice as much
TURNS = tuple(np.radians(15.0 * n) for n in range(-6, 7) if n)  # half a turn about its own axis shows nothing
EXPLAINED = 0.5  # of the distance, that undoing the right change leaves at most: .4 of gains and turns, .6 of speeds
LEAST_WINDOWS, MOST_WINDOWS = 2 * ROW, 16 * ROW  # that are enough to say so; more are thinned evenly, in whole rows
FASTER = 1.25  # than any recording, or slower, is another speed


class Apart:
    """How far windows are from the trained surfaces, each undone first: the mean over rows of the distance over its limit."""

    def __init__(self, model: SpectralModel, undo: Callable = lambda window: window):
        floor = next(c.floor for c in model.classifiers if c.length == model.novelty.length)
        self._reducer, self._detector = Reducer(floor, model.novelty.length), model.novelty.native()
        self._undo, self._taken, self._sum = undo, 0, 0.0

    def take(self, window: np.ndarray) -> None:
        features = self._reducer.features(self._undo(window))
        distance = lib.nav_texture_novelty_weigh(self._detector, doubles(features, "features", features.shape))
        self._taken += 1
        if self._taken % ROW == 0:
            self._sum += distance
            lib.nav_texture_novelty_reset(self._detector)

    def mean(self) -> float:
        """Of the whole rows taken, one or more."""
        return self._sum / (self._taken // ROW)


class Watch:
    """Notices window by window. A window costs one look, and one more for each cause while causes are sought: they are sought
    in the windows behind those that were too far."""

    def __init__(self, model: SpectralModel, windows: int, speed_m_s: float | None = None):
        """`windows`: whole rows, that are enough to say so. `speed_m_s`: the tip's, where known."""
        self.line = ""  # as of `notice`
        self._model, self._windows, self._speed_m_s = model, windows, speed_m_s
        self._begin([])

    def _begin(self, ways: list[tuple[str, Callable]]) -> None:
        self._apart, self._left, self._taken = Apart(self._model), [(c, Apart(self._model, w)) for c, w in ways], 0

    def take(self, window: np.ndarray) -> None:
        """A whole window with evidence."""
        if self.line:
            return
        for apart in (self._apart, *(apart for _, apart in self._left)):
            apart.take(window)
        self._taken += 1
        if self._taken == self._windows:
            self._conclude(self._apart.mean())

    def _conclude(self, found: float) -> None:
        ways = _ways(self._model) if found > self._model.novelty.drive else []
        if ways and self._left:
            self.line = self._said(found)
        self._begin(ways)

    def _said(self, found: float) -> str:
        cause, least = min(((cause, apart.mean()) for cause, apart in self._left), key=lambda one: one[1])
        if least > EXPLAINED * found:
            cause = "speed" if self._speed_m_s is None or not self._model.speed_m_s else "whisker"
        far = found / self._model.novelty.drive
        return f"{cause}: {SAID[cause]} ({far:.1f} times as far from the trained surfaces as a drive may be)"


def knows(model: SpectralModel) -> bool:
    """Whether the model knows how far a drive may be from it."""
    return model.novelty is not None and model.novelty.drive > 0.0


def notice(model: SpectralModel, windows: np.ndarray, speed_m_s: float | None = None) -> str:
    """One line about a drive's windows, of `windows_of`; empty where they are as in training, or too few, or the model does not
    know. `speed_m_s`: the tip's, where known."""
    pace = _pace(model, speed_m_s)
    if pace:
        return f"speed: {pace}; train with drives at that speed"
    if not knows(model) or len(windows) < LEAST_WINDOWS:
        return ""
    rows = np.arange(len(windows)) // ROW
    kept = np.unique(np.linspace(0, len(windows) // ROW - 1, MOST_WINDOWS // ROW).astype(int))
    seen = windows[np.isin(rows, kept)]
    watch = Watch(model, len(seen), speed_m_s)
    for window in (*seen, *seen):
        watch.take(window)
    return watch.line


def _ways(model: SpectralModel) -> list[tuple[str, Callable]]:
    """Causes, and what undoes them in a window."""
    ways = [("whisker", lambda w, g=g: _scaled(w, 1.0 / g)) for g in GAINS]
    return ways + [("mount", lambda w, a=a: _turned(w, a)) for a in TURNS if model.channels == 2]


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


def _scaled(window: np.ndarray, gain: float) -> np.ndarray:
    middle = window.mean(axis=0)
    return middle + gain * (window - middle)


def _turned(window: np.ndarray, angle: float) -> np.ndarray:
    middle, (c, s) = window.mean(axis=0), (np.cos(angle), np.sin(angle))
    return middle + (window - middle) @ np.array([[c, -s], [s, c]])


def _pace(model: SpectralModel, speed_m_s: float | None) -> str:
    if speed_m_s is None or not model.speed_m_s:
        return ""
    low, high = model.speed_m_s
    if low / FASTER <= speed_m_s <= high * FASTER:
        return ""
    return f"{speed_m_s:.2f} m/s, but the recordings of training are of {low:.2f} to {high:.2f} m/s"
