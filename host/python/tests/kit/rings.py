"""Frames and rings for tests."""

import itertools
import os

import numpy as np

from crunchbot.bridge.ring import FRAME
from whisker_protocol import LANES, LIMITS

_numbers = itertools.count()


def ring_name() -> str:
    """A name no other test uses."""
    return f"whisker-test-{os.getpid()}-{next(_numbers)}"


def make_frames(count: int, seed: int = 1, first: int = 0) -> np.ndarray:
    """Consecutive frames full of anything: sensor noise about the rest, some samples bad."""
    rng = np.random.default_rng(seed)
    frames = np.zeros(count, FRAME)
    frames["tick"] = np.arange(first, first + count)
    frames["time_cycles"] = frames["tick"] * LIMITS["tick_period"]
    frames["sequence"] = frames["tick"] + 7
    frames["lane_mask"] = (1 << LANES) - 1
    frames["lane"]["alpha"] = rng.normal(0x8000, 11, (count, LANES)).round()
    frames["lane"]["beta"] = rng.normal(0x8000, 11, (count, LANES)).round()
    frames["lane"]["status"] = (rng.random((count, LANES)) < 0.01) * (33 << 10)
    return frames
