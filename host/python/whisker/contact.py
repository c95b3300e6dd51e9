"""When an object whisker touches and lets go, from its samples alone.

Deflection is the length of (alpha, beta) about the whisker's rest, in counts. A contact begins with the first of
`ONSET_SAMPLES` good samples above `ONSET_COUNTS` and ends with the first of `RELEASE_SAMPLES` below `RELEASE_COUNTS`.
Bad samples (status not zero) are skipped: they neither begin, keep nor end a contact.
"""

import numpy as np

# 65536 counts are 180 degrees of field. Sensor noise is 0.03 degrees (11 counts) white and 0.05 degrees of slow drift
# (whisker_physics section 6); 0.3 degrees is ten sigma, and 0.4 degrees of body whisk at the tip.
ONSET_COUNTS = 110.0
RELEASE_COUNTS = 65.0
ONSET_SAMPLES = 3
RELEASE_SAMPLES = 12
REST_TICKS = 400  # the robot stands still and untouched for its first 0.2 s
DRIFT_SHARE = 1e-3  # of the rest's error, taken away per block while nothing touches: follows minutes, not contacts


class Contact:
    """One whisker: rest position, whether it touches, and the ticks of its last onset and release."""

    def __init__(self):
        self.rest: np.ndarray | None = None
        self.touching = False
        self.onset = -1
        self.release = -1
        self.deflection = np.zeros(2)  # mean of the last block's good samples about the rest, counts
        self._first: list[np.ndarray] = []
        self._run = 0
        self._run_start = 0

    def block(self, ticks: np.ndarray, samples: np.ndarray) -> None:
        """Take the good samples of one block: ticks (n,), samples (n, 2) in counts."""
        if len(ticks) == 0:
            return
        if self.rest is None:
            self._settle(ticks, samples)
            return
        about_rest = samples - self.rest
        self.deflection = about_rest.mean(axis=0)
        length = np.hypot(about_rest[:, 0], about_rest[:, 1])
        if not self.touching and self._run == 0 and length.max() <= ONSET_COUNTS:
            if np.hypot(*self.deflection) < RELEASE_COUNTS:
                self.rest = self.rest + DRIFT_SHARE * self.deflection
            return
        for tick, value in zip(ticks.tolist(), length.tolist(), strict=True):
            self._sample(tick, value)

    def _settle(self, ticks: np.ndarray, samples: np.ndarray) -> None:
        self._first.append(samples)
        if ticks[-1] + 1 >= REST_TICKS:
            self.rest = np.median(np.concatenate(self._first), axis=0)
            self._first.clear()

    def _sample(self, tick: int, length: float) -> None:
        changing = length < RELEASE_COUNTS if self.touching else length > ONSET_COUNTS
        if not changing:
            self._run = 0
            return
        if self._run == 0:
            self._run_start = tick
        self._run += 1
        if self.touching and self._run >= RELEASE_SAMPLES:
            self.touching, self.release, self._run = False, self._run_start, 0
        elif not self.touching and self._run >= ONSET_SAMPLES:
            self.touching, self.onset, self._run = True, self._run_start, 0
