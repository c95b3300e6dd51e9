"""A floor whisker's rest, which drifts by more than the smoothest floor moves it, and samples made fit for histograms."""

import numpy as np

STEP_COUNTS = 16.0  # MLX90333: 12 bits of angle in a 16-bit word (data sheet, front page)
LONGEST_SAMPLES = 10_000.0  # the rest is the mean of about the last 5 s of sweeping: the drift takes minutes
FIRST_SAMPLES = 2_000.0  # and at first the model's own, as if it had been seen for 1 s


def dithered(samples: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Counts spread evenly over the sensor's step: a rest between two steps would else move all of them across a bin."""
    return samples + rng.uniform(-STEP_COUNTS / 2, STEP_COUNTS / 2, np.shape(samples))


def centred(recording: np.ndarray, middle: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A recording (n, 2) for training: dithered, its own mean moved to `middle` (2,)."""
    return dithered(recording - recording.mean(axis=0) + middle, rng)


class FloorWhisker:
    """One floor whisker: its texture model and its rest, counts by axis, followed while the tip sweeps."""

    def __init__(self, model, rng: np.random.Generator):
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
