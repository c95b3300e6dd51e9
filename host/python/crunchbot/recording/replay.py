"""Writes a recording to a ring: the same frames, bit for bit, at their own pace or any other."""

import threading
import time
from collections.abc import Iterator

import numpy as np

from ..bridge.ring import Clock, Writer
from .reading import Recording

PACE_S = 0.002  # frames that fall due within it are published at once, as those of one USB transfer are


class Replay:
    """Publishes a recording's frames. `speed` 1: as fast as the bridge did; None: as fast as the machine can."""

    def __init__(self, recording: Recording, writer: Writer, speed: float | None = 1.0):
        self._recording, self._writer = recording, writer
        self._ns_per_cycle = None if speed is None else 1e9 / recording.clock_hz / speed
        self._start: tuple[int, int] | None = None  # time_cycles and monotonic ns of a frame on time
        self._last_cycles = 0
        self.frames = 0  # published so far

    def run(self, stop: threading.Event) -> None:
        """Publish everything, or up to when `stop` is set."""
        for frames in self._recording.blocks():
            for run in self._runs(frames):
                if self._ns_per_cycle is not None:
                    self._await(int(run["time_cycles"][-1]), stop)
                if stop.is_set():
                    return
                self._writer.publish(run)
                self.frames += len(run)

    def _runs(self, frames: np.ndarray) -> Iterator[np.ndarray]:
        """Frames cut where the bridge's clock goes back and into pieces of PACE_S."""
        if self._ns_per_cycle is None:
            yield frames
            return
        times = frames["time_cycles"].astype(np.int64)
        slots = (times * (self._ns_per_cycle / 1e9) // PACE_S).astype(np.int64)
        yield from np.split(frames, np.flatnonzero(np.diff(slots)) + 1)

    def _await(self, cycles: int, stop: threading.Event) -> None:
        if self._start is None or cycles < self._last_cycles:
            self._begin(cycles)
        self._last_cycles = cycles
        begun, begun_ns = self._start
        due_ns = begun_ns + (cycles - begun) * self._ns_per_cycle
        stop.wait(max(0.0, (due_ns - time.monotonic_ns()) / 1e9))

    def _begin(self, cycles: int) -> None:
        """This frame is on time; those that follow keep their distance from it."""
        self._start = (cycles, time.monotonic_ns())
        # What a reader makes of it is the time of the replay: the bridge of then is not there now.
        self._writer.set_clock(Clock(cycles, self._start[1], time.time_ns(), self._ns_per_cycle, PACE_S * 1e9))
