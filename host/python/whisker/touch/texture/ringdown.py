"""A whisker that still rings from another surface: limits fitted here, arithmetic in C (host/nav/touch/texture_ringdown.h)."""

from dataclasses import dataclass

import numpy as np

from ...native import as_doubles, doubles, ffi, lib
from .classifier import blocks_of

FALLS_LEAST = 400  # fewer do not show how fast a floor gets quieter


def counts() -> range:
    """Blocks that a fall is measured over."""
    return range(lib.NAV_TEXTURE_RINGDOWN_LEAST, lib.NAV_TEXTURE_RINGDOWN_MOST + 1)


@dataclass
class Ringdown:
    """For blocks of `length` samples; the arrays as in nav_texture_ringdown_numbers."""

    length: int
    floor: np.ndarray  # (channels,)
    limit: np.ndarray  # (NAV_TEXTURE_RINGDOWN_LIMITS,)

    ARRAYS = {"floor": 1, "limit": 1}  # and their dimensions
    NUMBERS = ("length",)

    def native(self):
        """A judge of its own, that has heard nothing; ValueError when a size or number is impossible."""
        numbers = ffi.new("struct nav_texture_ringdown_numbers *")
        floor = as_doubles(self.floor, "ringdown: floor", (None,))
        limit = as_doubles(self.limit, "ringdown: limit", (lib.NAV_TEXTURE_RINGDOWN_LIMITS,))
        numbers.channels, numbers.length = len(floor), self.length
        numbers.floor, numbers.limit = doubles(floor, "floor", floor.shape), doubles(limit, "limit", limit.shape)
        made = lib.nav_texture_ringdown_new(numbers)
        if made == ffi.NULL:
            raise ValueError("ringdown: a size or number is out of range")
        return ffi.gc(made, lib.nav_texture_ringdown_free)

    def falls(self, samples: np.ndarray) -> np.ndarray:
        """Fall of the power after every block of samples (n, channels), over each of counts(): (m, limits), nats per block;
        without the first blocks, which are too few."""
        judge, found = self.native(), []
        for block in blocks_of(samples, self.length, len(self.floor)):
            lib.nav_texture_ringdown_take(judge, doubles(block, "block", (self.length, len(self.floor))))
            found.append([lib.nav_texture_ringdown_fall(judge, count) for count in counts()])
        return np.array(found).reshape(len(found), -1)[counts()[-1] - 1 :]


def fit_ringdown(parts: list[np.ndarray], length: int, floor: np.ndarray, quantile: float) -> Ringdown | None:
    """From cleaned recordings (n, channels) of one surface each: limits that keep `quantile` of their falls. None when
    they are too short to tell."""
    if max(map(len, parts)) < length:
        return None
    found = Ringdown(length, floor, np.ones(len(counts())))
    falls = np.concatenate([found.falls(part) for part in parts if len(part) >= length])
    if len(falls) < FALLS_LEAST:
        return None
    found.limit = np.quantile(falls, quantile, axis=0)
    return found if (found.limit > 0.0).all() else None
