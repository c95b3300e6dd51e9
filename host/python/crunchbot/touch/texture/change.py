"""Whisker, mount or speed are another than the model's: passes over the floor lie farther from the trained surfaces than those held out.

A pass is windows of one surface in a row, and counts once, since they err alike. Where the mean of passes is farther than places
and drives let expect, windows that bend as a changed whisker would are undone: turned back about the mean, or scaled. What brings
them near again is the likeliest cause. Nothing of the kind does where the speed is another.
"""

from collections.abc import Callable
from statistics import NormalDist

import numpy as np

from .classifier import blocks_of
from .novelty import ROW
from .spectral import Judgement, SpectralModel

LEVEL = 0.01  # of drives like those of training may be named
LOOKS = (6, 12, 24)  # passes after which it is asked, then anew
DRIVES = 0.08  # spread of that logarithm between drives: .05 over 112 of 56 simulated robots, the farthest .21 off
LEAST_FREEDOM = 8  # places beyond one of each surface, from which on their spread is known to a quarter
SUSPECT = 0.05  # a chance below which causes are sought
LEAST, MOST = ROW, 4 * ROW  # windows of a pass that count: a row; what crosses a tile of 0.5 m at 0.1 m/s
GAINS = tuple(2.0 ** (n / 4) for n in (-4, -3, -2, -1, 1, 2, 3, 4))  # a whisker that bends half or twice as much
TURNS = tuple(np.radians(15.0 * n) for n in range(-6, 7) if n)  # half a turn about its own axis shows nothing
EXPLAINED = 0.5  # of the distance, that undoing the right change leaves at most: .4 of gains and turns, .6 of speeds
FASTER = 1.25  # than any recording, or slower, is another speed
SAID = {
    "whisker": "another one than the model's, or a floor never trained; train with this whisker",
    "mount": "turned about its axis since training; turn it back, or train again",
    "speed": "another one than in training, or another whisker or floor; drive as in training, or train with such drives",
}


class Passes:
    """Whether new passes are farther than those held out let expect, in log(1 + distance): near the floor drives differ by factors."""

    def __init__(self, held: list[np.ndarray]):
        """`held`: by surface, the distances of passes held out, one of each place; a surface of one place tells no spread."""
        logs = [np.log1p(some) if len(some) > 1 else np.zeros(0) for some in held]
        self._mean, self._held = [some.mean() if len(some) else 0.0 for some in logs], np.array(list(map(len, logs)))
        self._freedom = int(np.maximum(self._held - 1, 0).sum())
        self._variance = sum(len(some) * some.var() for some in logs if len(some)) / self._freedom
        self._looks = 0
        self._begin()

    def _begin(self) -> None:
        self._new, self._beyond = np.zeros(len(self._held)), 0.0

    def take(self, surface: int, distance: float) -> tuple[bool, bool] | None:
        """At a look: whether a change is suspected, and whether it is sure. All looks together cost LEVEL."""
        if self._held[surface] == 0:
            return None
        self._new[surface] += 1
        self._beyond += np.log1p(distance) - self._mean[surface]
        passes = int(self._new.sum())
        if passes not in LOOKS:
            return None
        self._looks += 1
        share, there = self._new / passes, self._new > 0
        places = (share[there] ** 2 * (1.0 / self._new[there] + 1.0 / self._held[there])).sum()
        found = self._beyond / passes / np.sqrt(DRIVES**2 + self._variance * places)
        if passes == LOOKS[-1]:
            self._begin()
        sure = LEVEL / (self._looks * (self._looks + 1))
        return found > student(SUSPECT, self._freedom), found > student(sure, self._freedom)


def student(chance: float, freedom: int) -> float:
    """What Student's variable exceeds with this chance, by the expansion of Cornish and Fisher."""
    z = -NormalDist().inv_cdf(chance)
    return z + (z**3 + z) / (4.0 * freedom) + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * freedom**2)


class Way:
    """Windows with one change undone, and how far they are then."""

    def __init__(self, model: SpectralModel, cause: str, undo: Callable[[np.ndarray], np.ndarray]):
        self.cause, self._undo, self._distances = cause, undo, []
        self._stream = model.stream(model.novelty.length)

    def take(self, window: np.ndarray) -> None:
        (found,) = self._stream.push(self._undo(window))
        self._distances += [found.novelty] if found.confidence else []

    def end_pass(self) -> None:
        self._stream.reset()

    def mean(self) -> float:
        return float(np.mean(self._distances)) if self._distances else np.inf


class Watch:
    """Notices pass by pass. A window costs nothing beside its judgement, and one more for each cause while causes are sought."""

    def __init__(self, model: SpectralModel, speed_m_s: float | None = None):
        """`speed_m_s`: the tip's, where known."""
        self.line, self.sure = "", False  # sure that something changed; the line says what
        self._model, self._speed_known = model, speed_m_s is not None and model.speed_m_s is not None
        self._held = [model.passes.get(name, np.zeros(0)) for name in model.classes]
        self._passes, self._ways, self._sought = Passes(self._held), [], []
        self._pass, self._surface = [], 0

    def take(self, window: np.ndarray, found: Judgement) -> None:
        """The next whole window, as it was judged."""
        if self.line or found.confidence == 0.0:
            return
        if self._pass and found.best != self._surface:
            self.end_pass()
        self._surface = found.best
        if len(self._pass) < MOST:
            self._pass.append(found.novelty)
            for way in self._ways:
                way.take(window)

    def end_pass(self) -> None:
        """The next window is of another pass."""
        distances, self._pass = self._pass, []
        for way in self._ways:
            way.end_pass()
        if self.line or len(distances) < LEAST:
            return
        self._sought += distances if self._ways else []
        if self.sure and self._sought:
            self.line = self._said()
        elif not self.sure and (look := self._passes.take(self._surface, float(np.mean(distances)))):
            suspected, self.sure = look
            if not suspected:
                self._ways, self._sought = [], []
            elif not self._ways:
                self._ways = _ways(self._model)

    def _said(self) -> str:
        far, least = float(np.mean(self._sought)), min(self._ways, key=Way.mean)
        cause = least.cause if least.mean() <= EXPLAINED * far else "whisker" if self._speed_known else "speed"
        usual = np.mean(np.concatenate(self._held))
        return (
            f"{cause}: {SAID[cause]} ({far / usual:.1f} times as far from the trained surfaces as passes of training)"
        )


def knows(model: SpectralModel) -> bool:
    """Whether the model knows how far passes are that it has not seen."""
    return model.novelty is not None and sum(max(0, len(p) - 1) for p in model.passes.values()) >= LEAST_FREEDOM


def notice(
    model: SpectralModel, recordings: list[np.ndarray], places: list[str], speed_m_s: float | None = None
) -> str:
    """One line about a drive's recordings (n, channels), each a pass, of places where those are known; empty where they are as in
    training, or too few, or the model does not know. `speed_m_s`: the tip's, where known."""
    pace = _pace(model, speed_m_s)
    if pace:
        return f"speed: {pace}; train with drives at that speed"
    if not knows(model):
        return ""
    length, watch = model.novelty.length, Watch(model, speed_m_s)
    judged = [model.judge(samples, length) for samples in recordings]
    chosen = one_of_each(places, list(map(len, judged)))
    for n in chosen:
        _show(watch, recordings[n], judged[n], length)
    for n in chosen if watch.sure else []:  # again, for what changed
        _show(watch, recordings[n], judged[n], length)
    return watch.line


def _show(watch: Watch, samples: np.ndarray, judged: list[Judgement], length: int) -> None:
    for window, found in zip(blocks_of(samples, length, samples.shape[1]), judged, strict=True):
        if np.isfinite(window).all():
            watch.take(window, found)
    watch.end_pass()


def one_of_each(places: list[str], lengths: list[int]) -> list[int]:
    """Of each place the longest recording, by number; where no place is known, every one."""
    best = {}
    for n, place in enumerate(places):
        here = place or n
        best[here] = n if here not in best or lengths[n] > lengths[best[here]] else best[here]
    return list(best.values())


def mean_pass(judged: list[Judgement]) -> float:
    """How far a recording's pass is, as `Watch` takes it; nan where it is too short."""
    distances = [d.novelty for d in judged if d.confidence > 0.0][:MOST]
    return float(np.mean(distances)) if len(distances) >= LEAST else np.nan


def _ways(model: SpectralModel) -> list[Way]:
    """One for each cause and what undoes it."""
    ways = [Way(model, "whisker", lambda w, g=g: _scaled(w, 1.0 / g)) for g in GAINS]
    return ways + [Way(model, "mount", lambda w, a=a: _turned(w, a)) for a in TURNS if model.channels == 2]


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
