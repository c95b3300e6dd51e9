"""Times of a recording: the bridge's clock converted to host time, which never goes backwards."""

import time
from collections.abc import Callable

from whisker_protocol import LIMITS

from ..bridge.ring import Clock

STEP_NS = 10_000_000  # the wall clock against the monotonic one: more than this, and somebody has set it
STALE_NS = 10 * 10**9  # a mapping that puts a frame further than this from now is that of an earlier start
IDLE_NS = 10**9  # without frames for so long, time goes on by the host's clock
JUMP_CYCLES = 3600 * LIMITS["clock_hz"]  # between two blocks: more is another clock


class Timeline:
    """Host time in ns since 1970, as the wall clock stood when recording began.

    With the daemon's clock mapping a frame's time is when its tick began; without, frames follow the bridge's clock
    from the moment the first was seen, so that a simulation or a replay at another speed keeps its own seconds.
    Setting the wall clock changes nothing, except that `wall_step_ns` shows it.
    """

    def __init__(
        self, monotonic_ns: Callable[[], int] = time.monotonic_ns, realtime_ns: Callable[[], int] = time.time_ns
    ):
        self._monotonic, self._realtime = monotonic_ns, realtime_ns
        self._seen = monotonic_ns()
        self._last = realtime_ns()
        self._offset = self._wall_offset = self._last - self._seen
        self._anchor: tuple[int, int] | None = None  # time_cycles and time of one frame
        self._cycles = 0

    def of(self, time_cycles: int, clock: Clock | None) -> int:
        """The time of a frame; never before an earlier answer."""
        self._seen = self._monotonic()
        if not self._cycles <= time_cycles < self._cycles + JUMP_CYCLES:
            self._anchor = None
        self._cycles = time_cycles
        self._last = max(self._last, self._time(time_cycles, clock))
        return self._last

    def now(self) -> int:
        """The time of what happens now: that of the last frame, unless none has come for a while."""
        idle = self._monotonic() - self._seen
        return self._last + (idle if idle > IDLE_NS else 0)

    def wall_step_ns(self) -> int:
        """How far the wall clock has been set since last asked; 0: not."""
        offset = self._realtime() - self._monotonic()
        step = offset - self._wall_offset
        if abs(step) < STEP_NS:
            return 0
        self._wall_offset = offset
        return step

    def _time(self, time_cycles: int, clock: Clock | None) -> int:
        here = self._seen + self._offset
        if clock:
            mapped = int(clock.monotonic(time_cycles)) + self._offset
            if abs(mapped - here) < STALE_NS:
                return mapped
        if self._anchor is None:
            self._anchor = (time_cycles, max(here, self._last))
        cycles, anchored = self._anchor
        return anchored + (time_cycles - cycles) * 10**9 // LIMITS["clock_hz"]
