"""When an object whisker touches and when it lets go, in ticks, from its samples alone (host/nav/touch/contact/contact.h)."""

import numpy as np

from ..native import doubles, ffi, lib, octets

# 65536 counts are 180 degrees of field. The sensor's white noise is 11 counts, its drift 18 over minutes
# (whisker_physics section 6); 110 counts are ten sigma, and 0.4 degrees of body whisk with the contact at the tip.
ONSET_COUNTS = 110.0
RELEASE_COUNTS = 65.0
ONSET_SAMPLES = 3
RELEASE_SAMPLES = 12
REST_SAMPLES = 400  # the robot stands still and untouched for its first 0.2 s
DRIFT_SAMPLES = 40_000.0  # the rest follows minutes of drift, not seconds of contact


class Contact:
    """One whisker: its rest in counts, whether it touches, and the ticks of its last onset and release (-1: none)."""

    def __init__(self):
        config = {
            "onset_counts": ONSET_COUNTS,
            "release_counts": RELEASE_COUNTS,
            "onset_samples": ONSET_SAMPLES,
            "release_samples": RELEASE_SAMPLES,
            "settle_samples": REST_SAMPLES,
            "rest_samples": DRIFT_SAMPLES,
        }
        self._state = ffi.new("struct nav_contact *")
        lib.nav_contact_init(self._state, ffi.new("struct nav_contact_config *", config))
        self.onset = -1
        self.release = -1
        self._earlier = np.empty(0, np.int64)  # ticks of the last good samples of earlier blocks
        self._events = np.zeros(0, np.uint8)  # of a block, and what C needs for one of this length

    @property
    def touching(self) -> bool:
        return self._state.touching

    @property
    def settled(self) -> bool:
        """Whether the rest is known."""
        return self._state.settled >= REST_SAMPLES

    @property
    def rest(self) -> np.ndarray:
        """Mean of (alpha, beta) untouched, counts."""
        return np.array([self._state.rest[0], self._state.rest[1]])

    def block(self, ticks: np.ndarray, samples: np.ndarray, good: np.ndarray) -> None:
        """Take ticks (n,), samples (n, 2) in counts and good (n,): a bad sample begins, keeps and ends nothing."""
        if not len(ticks) == len(samples) == len(good):
            raise ValueError(f"{len(ticks)} ticks, {len(samples)} samples, {len(good)} good; give one of each")
        if not good.all():
            ticks, samples = ticks[good], samples[good]
        count, before = len(ticks), len(self._earlier)
        if count == 0:
            return
        if count > len(self._events):
            self._events, self._good, self._peaks = np.zeros(count, np.uint8), np.ones(count, np.uint8), np.zeros(count)
            self._events_out = octets(self._events, "events", (count,))
            self._good_out = octets(self._good, "good", (count,))
            self._peaks_out = doubles(self._peaks, "peaks", (count,))
        samples = doubles(np.ascontiguousarray(samples), "samples", (count, 2))
        lib.nav_contact_run(self._state, samples, self._good_out, count, self._events_out, self._peaks_out)
        events = self._events[:count]
        ticks = np.concatenate([self._earlier, ticks])
        self._earlier = ticks[-RELEASE_SAMPLES:]
        if not events.any():
            return
        for index in before + np.flatnonzero(events):
            # An event comes with the last sample of the run that proves it; the contact changed with the first.
            if events[index - before] == lib.NAV_CONTACT_ONSET:
                self.onset = int(ticks[max(0, index - ONSET_SAMPLES + 1)])
            else:
                self.release = int(ticks[max(0, index - RELEASE_SAMPLES + 1)])
