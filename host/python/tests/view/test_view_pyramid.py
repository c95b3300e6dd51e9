"""Lowest and highest of every bin width against plain NumPy on the same samples."""

import numpy as np
import pytest
from viewkit import NODES, made_frames, spoil

from crunchbot.view.pyramid import BINS, CHUNK, WIDTHS, Pyramid
from crunchbot.view.tally import Tally
from whisker_protocol import CODES, LANES, SENSOR_ERRORS, STATUS_CODE_SHIFT


def expected(frames, slots, width, first, end):
    """(2, LANES, bins) low and high and (LANES, bins) bad, bin by bin."""
    low, high = np.full((2, LANES, end - first), 0xFFFF), np.zeros((2, LANES, end - first), int)
    bad = np.zeros((LANES, end - first), int)
    for frame, slot in zip(frames, slots, strict=True):
        b = slot // width - first
        if not 0 <= b < end - first:
            continue
        good = frame["lane"]["status"] == 0
        for axis, name in enumerate(("alpha", "beta")):
            counts = frame["lane"][name][good]
            low[axis, good, b] = np.minimum(low[axis, good, b], counts)
            high[axis, good, b] = np.maximum(high[axis, good, b], counts)
        bad[:, b] += ~good & (frame["lane"]["status"] >> STATUS_CODE_SHIFT != CODES["absent"])
    return low, high, bad


def check(pyramid, frames, slots, width):
    level = pyramid.levels[width]
    end = (int(slots[-1]) + 1) // width
    assert level.end == end
    first = max(0, end - BINS)
    at = np.arange(first, end) % BINS
    low, high, bad = expected(frames, slots, width, first, end)
    assert np.array_equal(level.low[..., at], low)
    assert np.array_equal(level.high[..., at], high)
    assert np.array_equal(level.bad[..., at], bad)


def batches(n, seed):
    """Cuts of n frames as a reader meets them: mostly a few dozen, now and then thousands."""
    rng = np.random.default_rng(seed)
    start = 0
    while start < n:
        size = int(rng.choice([1, 7, 66, 67, 400, CHUNK]))
        yield slice(start, min(n, start + size))
        start += size


@pytest.mark.parametrize("seed", range(3))
def test_every_width_holds_the_extremes_and_the_bad_records(seed):
    frames = made_frames(0, 10_000, seed)
    for lane in range(NODES):
        bad = np.random.default_rng((seed, lane)).random(len(frames)) < 0.05
        frames["lane"]["status"][bad, lane] = CODES["link_crc"] << STATUS_CODE_SHIFT
    spoil(frames, "late", 1, slice(3000, 4200))  # bins without any good sample
    pyramid, slots = Pyramid(), np.arange(len(frames))
    for part in batches(len(frames), seed):
        pyramid.add(slots[part], frames["lane"][part])
    for width in (1, 2, 16, 512):
        check(pyramid, frames, slots, width)


@pytest.mark.parametrize("gap", [1, 5, 63, CHUNK - 1, CHUNK, CHUNK + 1, 3 * BINS + 17, BINS * WIDTHS[-1]])
@pytest.mark.parametrize("at_once", [True, False])
def test_a_gap_of_any_length_is_empty_and_what_is_beside_it_is_kept(gap, at_once):
    frames = made_frames(0, 1500)
    slots = np.arange(len(frames)) + np.where(np.arange(len(frames)) >= 777, gap, 0)
    pyramid = Pyramid()
    for part in [slice(None)] if at_once else [slice(0, 777), slice(777, None)]:
        pyramid.add(slots[part], frames["lane"][part])
    for width in WIDTHS:
        check(pyramid, frames, slots, width)


def test_gaps_everywhere_take_bounded_work_and_leave_the_newest():
    frames = made_frames(0, 2000)
    slots = np.arange(len(frames)) * 5000
    pyramid = Pyramid()
    pyramid.add(slots, frames["lane"])
    assert pyramid.end == slots[-1] + 1
    assert pyramid.levels[1].low[0, 0, slots[-1] % BINS] == frames["lane"]["alpha"][-1, 0]


def test_tally_counts_each_kind_by_lane():
    frames = made_frames(0, 1000)
    spoil(frames, "link_crc", 0, slice(0, 30))
    spoil(frames, "resync", 2, slice(100, 104))
    bit = SENSOR_ERRORS["field_low"]["bit"]
    frames["lane"]["status"][500:505, 1] = 1 << bit
    frames["lane"]["status"][7, 0] |= 1 << bit  # a code and an error bit: one bad record, two kinds
    tally = Tally()
    for part in batches(len(frames), 1):
        tally.add(frames[part])
    bad = tally.bad()
    assert bad["link_crc"] == [30] + [0] * (LANES - 1)
    assert bad["resync"][2] == 4
    assert bad["field_low"][:2] == [1, 5]
    assert bad["absent"] == [0] * NODES + [1000] * (LANES - NODES)
    assert sorted(bad) == ["absent", "field_low", "link_crc", "resync"]
    assert tally.lost() == [30, 5, 4] + [0] * (LANES - NODES)
    assert tally.good() == [970, 995, 996] + [0] * (LANES - NODES)


def test_tally_adds_up_dropped_frames_over_a_restart_of_the_bridge():
    frames = made_frames(0, 6)
    frames["dropped"] = [5, 5, 9, 2, 2, 3]  # 5 before we came; 4 more; a new start with 2; 1 more
    tally = Tally()
    tally.add(frames[:2])
    tally.add(frames[2:])
    assert tally.dropped == 4 + 2 + 1
