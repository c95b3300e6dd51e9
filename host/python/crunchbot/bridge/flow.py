"""How frames flow into a ring: their rate and the share that is lost over the last seconds of the wall clock, and why."""

import time
from collections import deque
from collections.abc import Callable

import numpy as np

from whisker_protocol import LIMITS

from .ring import DaemonStats, Reader

WINDOW_S = 2.0  # a loss is to be known within it
EVEN = 0.9  # of real time: a batch of 64 frames more or less in a look of 0.5 s is 6 % of it
BUSY = "end what keeps this machine's processor busy; start a simulated robot again with --pace 0.3"
CABLE = "check the USB cable; whisker doctor finds out why"


class Flow:
    """`look` at a ring often; then `rate` and `loss` are of the last WINDOW_S."""

    def __init__(self, clock: Callable[[], float] = time.monotonic):
        self._clock = clock
        self._seen: deque[tuple[float, np.ndarray]] = deque()

    def look(self, reader: Reader, dropped: int = 0) -> None:
        """By what the ring's writer reports; where that is nothing, by what the reader has met, and `dropped` of these."""
        info, stats = reader.info, reader.stats
        lost = (stats.frames_missing, stats.frames_dropped) if stats else (info.frames_missing, dropped)
        self.add(info.published, *lost)

    def add(self, frames: int, missing: int, dropped: int) -> None:
        """What has been counted so far; those that the bridge dropped are missing, too."""
        now = self._clock()
        while len(self._seen) > 1 and now - self._seen[1][0] >= WINDOW_S:
            self._seen.popleft()
        self._seen.append((now, np.array([frames, missing, dropped], np.int64)))

    def rate(self) -> float:
        """Frames per second of the wall clock, to the last look; 0 before the second one."""
        elapsed_s = self._seen[-1][0] - self._seen[0][0] if self._seen else 0.0
        return float(self._grown()[0]) / elapsed_s if elapsed_s > 0 else 0.0

    def loss(self) -> tuple[float, str, str] | None:
        """(share of the frames, why, what helps); None: nothing was lost."""
        frames, missing, dropped = self._grown().tolist()
        if not missing:
            return None
        by_bridge = "the bridge dropped them, for this machine did not take them in time", BUSY
        return missing / (frames + missing), *(
            by_bridge if 2 * dropped > missing else ("they never came over the USB", CABLE)
        )

    def _grown(self) -> np.ndarray:
        """A writer that was started again counts anew."""
        return (self._seen[-1][1] - self._seen[0][1]).clip(0) if self._seen else np.zeros(3, np.int64)


def tick_s(stats: DaemonStats | None) -> float:
    """How long a tick is, as the daemon reports it."""
    return ((stats and stats.tick_period) or LIMITS["tick_period"]) / LIMITS["clock_hz"]
