"""What a floor whisker says of a window: by the paper's classifier, about a rest that is followed, or by the spectral one."""

from typing import Any

import numpy as np

from .texture.change import Watch, knows
from .texture.spectral import SpectralModel

STEP_COUNTS = 16.0  # MLX90333: 12 bits of angle in a 16-bit word (data sheet, front page)
LONGEST_SAMPLES = 10_000.0  # the rest is the mean of about the last 5 s of sweeping: the drift takes minutes
WINDOW_SAMPLES = 200  # 100 ms
WINDOW_LEAST_GOOD = 150  # fewer good samples than this are no window
FIRST_SAMPLES = 2_000.0  # and at first the model's own, as if it had been seen for 1 s


def dithered(samples: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Counts spread evenly over the sensor's step: a rest between two steps would else move all of them across a bin."""
    return samples + rng.uniform(-STEP_COUNTS / 2, STEP_COUNTS / 2, np.shape(samples))


def centred(recording: np.ndarray, middle: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A recording (n, 2) for training: dithered, its own mean moved to `middle` (2,)."""
    return dithered(recording - recording.mean(axis=0) + middle, rng)


def floor_whisker(model: Any, rng: np.random.Generator) -> "FloorWhisker | SpectralFloorWhisker":
    """What reads a floor whisker with a texture model of either method."""
    return SpectralFloorWhisker(model) if isinstance(model, SpectralModel) else FloorWhisker(model, rng)


class FloorWhisker:
    """One floor whisker, the paper's way: its histograms and its rest, counts by axis, followed while the tip sweeps.

    The sensor's rest drifts by more than the smoothest floor moves the whisker.
    """

    def __init__(self, model: Any, rng: np.random.Generator):
        self.model = model
        self.rest = model.rest.copy()
        self._rng = rng
        self._seen = FIRST_SAMPLES

    def follow(self, samples: np.ndarray) -> None:
        """Take good samples (n, 2) of a sweeping tip."""
        if len(samples) == 0:
            return
        self._seen = min(self._seen + len(samples), LONGEST_SAMPLES)
        self.rest += len(samples) / self._seen * (samples.mean(axis=0) - self.rest)

    def loglik(self, window: np.ndarray) -> np.ndarray:
        """Equation 1 for a window (n, 2) of good samples, by class."""
        return self.model.loglik(dithered(window, self._rng), rest=self.rest)

    changed = ""  # a line where whisker, mount or speed are not the model's: this way never knows
    silent = False  # whether the last window had no evidence though its samples are good: this way never says so

    def look(self, window: np.ndarray) -> np.ndarray | None:
        """Log-likelihood by class of a window (n, 2), nan where a sample is bad; None: too few good ones."""
        good = window[np.isfinite(window).all(axis=1)]
        return self.loglik(good) if len(good) >= WINDOW_LEAST_GOOD else None

    def pause(self) -> None:
        """The next window does not follow the last."""


class SpectralFloorWhisker:
    """One floor whisker, the spectral way: it needs no rest, knows its windows in a row and says what it doubts."""

    def __init__(self, model: SpectralModel):
        self.model = model
        self.silent = False  # whether the last window had no evidence, as during a catch
        self._stream = model.stream(WINDOW_SAMPLES)
        known = knows(model) and model.novelty.length == WINDOW_SAMPLES
        self._watch = Watch(model) if known else None

    def follow(self, samples: np.ndarray) -> None:
        """Spectra are of differences: a drifting rest is not in them."""

    def look(self, window: np.ndarray) -> np.ndarray | None:
        """Log-likelihood by class of a window (200, 2), nan where a sample is bad; None: no evidence, as during a catch or of
        a surface never trained."""
        (found,) = self._stream.push(window)
        self.silent = found.confidence == 0.0
        if self._watch and np.isfinite(window).all():
            self._watch.take(window, found)
        return found.loglik if not self.silent and found.novelty <= 1.0 else None

    @property
    def changed(self) -> str:
        """A line where whisker, mount or speed are not the model's."""
        return self._watch.line if self._watch else ""

    def pause(self) -> None:
        """The next window does not follow the last."""
        self._stream.reset()
        if self._watch:
            self._watch.end_pass()
