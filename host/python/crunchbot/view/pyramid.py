"""Lowest and highest value of every lane over 1, 2, 4, ... ticks, the last BINS bins of each width.

A page asks for the width that makes one bin one column of pixels, so no peak is lost however far it zooms out. A bin
that saw no good sample has its lowest above its highest.
"""

from itertools import pairwise

import numpy as np

from whisker_protocol import LANES, STATUS_CODE_SHIFT

from .tally import CODE_KINDS, EMPTY

AXES = ("alpha", "beta")
BINS = 4096  # kept of each width: more columns than a screen has
WIDTHS = tuple(1 << k for k in range(10))  # ticks per bin; the widest keep 17 minutes at 2 kHz
CHUNK = BINS // 2  # slots completed at a time: what a level makes of them must still lie in the level below
PARTS = 8  # of one batch that are shown when it has gaps wider than a chunk; the newest
LOST = ~np.isin(np.arange(CODE_KINDS), EMPTY)  # by code
NOTHING_LOW, NOTHING_HIGH = 0xFFFF, 0


class Level:
    """Circular arrays of bins of one width; bin b lies at index b modulo BINS. `end` is the first bin not yet complete."""

    def __init__(self):
        self.low = np.full((len(AXES), LANES, BINS), NOTHING_LOW, np.uint16)
        self.high = np.full((len(AXES), LANES, BINS), NOTHING_HIGH, np.uint16)
        self.bad = np.zeros((LANES, BINS), np.uint16)  # records lost: not those of lanes that are empty or off
        self.end = 0

    def clear_to(self, end: int) -> None:
        """Nothing was seen in the bins from `self.end` to `end`."""
        for part in spans(max(self.end, end - BINS), end):
            self.low[..., part], self.high[..., part], self.bad[..., part] = NOTHING_LOW, NOTHING_HIGH, 0
        self.end = end

    def take_halves(self, finer: "Level") -> None:
        """Complete the bins whose two halves the finer level has completed: at most CHUNK / 2 of them."""
        first, end = self.end, finer.end // 2
        if first == end:
            return
        for part in spans(first, end, CHUNK):  # there the halves lie in one piece too
            even = slice(2 * part.start % BINS, (2 * part.stop - 1) % BINS, 2)
            odd = slice(even.start + 1, even.stop + 1, 2)
            np.minimum(finer.low[..., even], finer.low[..., odd], out=self.low[..., part])
            np.maximum(finer.high[..., even], finer.high[..., odd], out=self.high[..., part])
            np.add(finer.bad[..., even], finer.bad[..., odd], out=self.bad[..., part])
        self.end = end


class Pyramid:
    """All widths of one ring. Time is counted in slots: ticks of the view, which never go back."""

    def __init__(self):
        self.levels = {width: Level() for width in WIDTHS}

    @property
    def end(self) -> int:
        """The slot after the newest."""
        return self.levels[1].end

    def add(self, slots: np.ndarray, lanes: np.ndarray) -> None:
        """Take frames: (n,) rising slots, none before `end`; (n, LANES) of ring.SAMPLE. Slots left out were not seen."""
        cuts = np.flatnonzero(np.diff(slots // CHUNK)) + 1
        for part in np.split(np.arange(len(slots)), cuts)[-PARTS:]:
            self._skip_to(int(slots[part[0]]))
            self._write(slots[part], lanes[part])
            self._complete()

    def _write(self, slots: np.ndarray, lanes: np.ndarray) -> None:
        finest, end = self.levels[1], int(slots[-1]) + 1
        if end - finest.end > len(slots):
            finest.clear_to(end)
        at, status = slots % BINS, lanes["status"].T
        bad = status != 0
        for axis, name in enumerate(AXES):
            counts = lanes[name].T
            finest.low[axis][:, at] = np.where(bad, NOTHING_LOW, counts)
            finest.high[axis][:, at] = np.where(bad, NOTHING_HIGH, counts)
        finest.bad[:, at] = bad & LOST[status >> STATUS_CODE_SHIFT]
        finest.end = end

    def _skip_to(self, slot: int) -> None:
        """The first chunk of a gap completes every bin that was begun before it; then all levels can jump."""
        finest = self.levels[1]
        if finest.end < slot:
            finest.clear_to(min(slot, finest.end + CHUNK))
            self._complete()
        if finest.end < slot:
            for width, level in self.levels.items():
                level.clear_to(slot // width)

    def _complete(self) -> None:
        for finer, coarser in zip(WIDTHS, WIDTHS[1:], strict=False):
            self.levels[coarser].take_halves(self.levels[finer])


def spans(first: int, end: int, piece: int = BINS) -> list[slice]:
    """The places of bins `first` to `end` (at most BINS of them), cut where a multiple of `piece` is crossed."""
    edges = [first, *range(first - first % piece + piece, end, piece), end]
    return [slice(a % BINS, a % BINS + b - a) for a, b in pairwise(edges) if a < b]
