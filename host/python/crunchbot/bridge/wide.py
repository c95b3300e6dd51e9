"""Frames of one bridge, or of two in one ring, as rows of lanes: docs/formats.md, the ring."""

import numpy as np

from whisker_protocol import CODES, LANES, STATUS_CODE_SHIFT

from ..native import lib
from .ring import FRAME, SAMPLE

SECOND: int = lib.WHISKER_FRAME_SECOND
LANES_MAX = 2 * LANES
WIDE = np.dtype(
    [(name, FRAME[name]) for name in FRAME.names if name not in ("lane_mask", "lane")]
    + [("lane_mask", "<u8"), ("lane", SAMPLE, LANES_MAX)]
)


def of_first(frames: np.ndarray) -> np.ndarray:
    """The frames (n,) of dtype FRAME that are the first bridge's; of one bridge all of them, not copied."""
    second = frames["flags"] & SECOND != 0
    return frames[~second] if second.any() else frames


def wide(frames: np.ndarray, two: bool = False) -> np.ndarray:
    """A row for each tick of frames (n,) of dtype FRAME, as a ring gives them.

    Of one bridge they are the frames themselves. Of two (one is among them, or `two` says so), dtype WIDE: 56 lanes, of which lanes 28 to 55 are the second
    bridge's; the other fields are those of the tick's first frame. Where a tick has one bridge's frame only, the other's
    lanes have status code absent.
    """
    second = frames["flags"] & SECOND != 0
    if not (two or second.any()):
        return frames
    begins = np.flatnonzero(~second | (np.diff(frames["tick"], prepend=frames["tick"][:1] + 1) != 0))
    row = np.searchsorted(begins, np.arange(len(frames)), side="right") - 1
    out = np.zeros(len(begins), WIDE)
    for name in FRAME.names[:3] + ("dropped", "flags"):
        out[name] = frames[name][begins]
    out["lane"]["status"] = CODES["absent"] << STATUS_CODE_SHIFT
    for bridge in (False, True):
        mine, lanes = second == bridge, slice(LANES * bridge, LANES * (1 + bridge))
        out["lane"][row[mine], lanes] = frames["lane"][mine]
        mask = int(np.bitwise_or.reduce(frames["lane_mask"][mine], initial=0)) << LANES * bridge
        out["lane_mask"] |= np.uint64(mask)
    return out
