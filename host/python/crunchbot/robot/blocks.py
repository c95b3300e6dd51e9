"""Frames of a ring as blocks of 40 ticks, each with every tick: those that never came are marked bad."""

import time
from collections.abc import Callable, Iterator

import numpy as np

from whisker_protocol import CODES, STATUS_CODE_SHIFT

from ..bridge.ring import Reader, RingError
from ..pilot.behaviour import BLOCK_TICKS, ODOMETRY_TICKS, TICK_S

LOST = CODES["absent"] << STATUS_CODE_SHIFT  # status of a tick that never came
FRESH_TICKS = 200  # a live reader that joins, or was left behind, begins this far back
GAP_TICKS = 2000  # a hole as long as this is a new beginning; shorter ones are filled with bad samples

Block = tuple[int, np.ndarray]  # first tick, samples (40, lanes) of ring.SAMPLE


class Assembler:
    """Takes frames as they come, with ticks that only rise; gives whole blocks. The first begins at a multiple of 40."""

    def __init__(self, lanes: int):
        self._lanes = lanes
        self._first: int | None = None  # of the block being filled, or of the last one
        self._block: np.ndarray | None = None
        self._filled = 0

    def feed(self, ticks: np.ndarray, lanes: np.ndarray) -> Iterator[Block]:
        """Ticks (n,) and samples (n, any number of lanes); the blocks that they complete."""
        while len(ticks) > 0:
            if self._block is None:
                self._begin(int(ticks[0]), lanes.dtype)
            mine = ticks < self._first + BLOCK_TICKS
            self._block[ticks[mine] - self._first] = lanes[mine, : self._lanes]
            self._filled = int(ticks[mine].max(initial=self._first + self._filled - 1)) - self._first + 1
            ticks, lanes = ticks[~mine], lanes[~mine]
            if self._filled == BLOCK_TICKS or len(ticks) > 0:
                yield self._first, self._block
                self._block = None

    def rest(self) -> Iterator[Block]:
        """The block that is not whole, if there is one, shorter than 40 ticks."""
        if self._block is not None:
            yield self._first, self._block[: self._filled]

    def _begin(self, tick: int, sample: np.dtype) -> None:
        self._first = tick // BLOCK_TICKS * BLOCK_TICKS if self._first is None else self._first + BLOCK_TICKS
        self._block, self._filled = np.zeros((BLOCK_TICKS, self._lanes), sample), 0
        self._block["status"] = LOST


def blocks(reader: Reader, lanes: int) -> Iterator[Block]:
    """All blocks until the ring is closed. The last may be short."""
    assembler = Assembler(lanes)
    for frames in reader.frames():
        yield from assembler.feed(frames["tick"].astype(np.int64), frames["lane"])
    yield from assembler.rest()


class LiveRing:
    """Blocks as they come, whatever becomes of ring, daemon and bridge; its ticks never go back.

    They are the bridge's own until the bridge begins to count anew; from then on they go on after the time it took.
    """

    def __init__(self, name: str, lanes: int, clock: Callable[[], float] = time.monotonic, owner: int | None = None):
        self.name, self._owner = name, owner
        self.trouble = (
            f"ring {name}: not there yet; start whiskerd --ring {name}"  # why no samples come; empty: they come
        )
        self.restarts = self.overruns = self.ticks_missing = 0  # ticks: between those that came
        self._lanes, self._clock = lanes, clock
        self._reader: Reader | None = None
        self._attached = False
        self._assembler = Assembler(lanes)
        self._offset, self._last, self._last_s = 0, -1, clock()  # ticks added, the newest tick, when it came

    def close(self) -> None:
        if self._reader:
            self._reader.close()

    def take(self, wait_s: float) -> list[Block]:
        """Whole blocks, as soon as there are frames; none when nothing comes within `wait_s`, or `trouble` says why."""
        try:
            if not self._attached:
                self._attach(wait_s)
            frames = self._reader.take(wait_s)
        except RingError as error:
            self._note(error)
            return []
        if frames is None:
            self.trouble, self._attached = f"ring {self.name}: whiskerd closed it; start whiskerd", False
            return []
        return [] if len(frames) == 0 else self._assemble(frames)

    def _attach(self, wait_s: float) -> None:
        if self._reader:
            self._reader.reattach(wait_s)
            self.restarts += 1
        else:
            self._reader = Reader(self.name, wait_s, self._owner)
        self._reader.seek_latest(FRESH_TICKS)
        self._attached = True

    def _note(self, error: RingError) -> None:
        if error.name == "OVERRUN":
            self.overruns += 1
            self._reader.seek_latest(FRESH_TICKS)
        elif error.name != "TIMEOUT":
            self.trouble, self._attached = str(error), False

    def _assemble(self, frames: np.ndarray) -> list[Block]:
        self.trouble = ""
        ticks = frames["tick"].astype(np.int64)
        cuts = np.flatnonzero(np.diff(ticks) <= 0) + 1  # the bridge has begun anew
        made = []
        for part, lanes in zip(np.split(ticks, cuts), np.split(frames["lane"], cuts), strict=True):
            made += self._assembler_for(int(part[0])).feed(part + self._offset, lanes)
            self._last = int(part[-1]) + self._offset
        self._last_s = self._clock()
        return made

    def _assembler_for(self, tick: int) -> Assembler:
        """The present assembler, or, where time goes back or leaps, a new one with an offset that lets it go on."""
        if self._last < 0:
            return self._assembler
        step = tick + self._offset - self._last
        if step <= 0:
            away = max(1, round((self._clock() - self._last_s) / TICK_S))
            begin = -(-(self._last + 1 + away) // ODOMETRY_TICKS) * ODOMETRY_TICKS
            self._offset = begin - tick // ODOMETRY_TICKS * ODOMETRY_TICKS
        if not 0 < step <= GAP_TICKS:
            self._assembler = Assembler(self._lanes)
        self.ticks_missing += tick + self._offset - self._last - 1
        return self._assembler
