"""The pilot's samples: what a live reader makes of a ring that ends, begins anew, or is overtaken."""

import os

import numpy as np
import pytest

from crunchbot.bridge.ring import FRAME, Writer
from crunchbot.robot.blocks import FRESH_TICKS, LiveRing

LANES, WAIT_S = 6, 5.0


class Clock:
    """Seconds, as the test says."""

    def __init__(self):
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def name():
    return f"whisker-test-blocks-{os.getpid()}"


def frames(first: int, last: int) -> np.ndarray:
    """Ticks first .. last - 1; alpha is the tick."""
    made = np.zeros(last - first, FRAME)
    made["tick"] = np.arange(first, last)
    made["lane"]["alpha"] = (made["tick"] % 60000)[:, None]
    return made


def firsts(made) -> list[int]:
    return [first for first, _ in made]


def test_blocks_come_whole_and_with_the_bridges_ticks(name):
    with Writer(name, 4096) as writer:
        live = LiveRing(name, LANES)
        writer.publish(frames(400, 470))
        assert firsts(live.take(WAIT_S)) == [400]
        writer.publish(frames(470, 480))
        ((first, samples),) = live.take(WAIT_S)
        assert first == 440 and (samples["alpha"][:, LANES - 1] == np.arange(440, 480)).all()
        assert live.trouble == "" and live.ticks_missing == 0
        live.close()


def test_whoever_joins_late_begins_with_what_is_fresh(name):
    with Writer(name, 4096) as writer:
        writer.publish(frames(0, 3000))
        live = LiveRing(name, LANES)
        assert firsts(live.take(WAIT_S))[0] == 3000 - FRESH_TICKS
        live.close()


def test_without_a_ring_it_says_so_and_finds_it_later(name):
    live = LiveRing(name, LANES)
    assert live.take(0.0) == [] and name in live.trouble
    with Writer(name, 4096) as writer:
        writer.publish(frames(0, 40))
        assert firsts(live.take(WAIT_S)) == [0] and live.trouble == ""
        live.close()


def test_a_bridge_that_counts_anew_does_not_turn_time_back(name):
    clock = Clock()
    live = LiveRing(name, LANES, clock)
    with Writer(name, 4096) as writer:
        live.take(0.0)
        writer.publish(frames(800, 1000))
        assert firsts(live.take(WAIT_S))[-1] == 960
    assert live.take(WAIT_S) == [] and "closed" in live.trouble
    clock.now += 1.0
    with Writer(name, 4096) as writer:
        live.take(0.0)
        writer.publish(frames(0, 80))
        assert firsts(live.take(WAIT_S)) == [3000, 3040], "2000 ticks were away, and rows stay on multiples of 0.1 s"
        assert live.restarts == 1
        live.close()


def test_short_holes_are_bad_samples_and_long_ones_a_new_beginning(name):
    with Writer(name, 1 << 14) as writer:
        live = LiveRing(name, LANES)
        writer.publish(frames(0, 50))
        live.take(WAIT_S)
        writer.publish(frames(100, 120))
        made = dict(live.take(WAIT_S))
        assert sorted(made) == [40, 80] and live.ticks_missing == 50
        assert np.flatnonzero(made[40]["status"][:, 0]).tolist() == list(range(10, 40))
        writer.publish(frames(9000, 9040))
        assert firsts(live.take(WAIT_S)) == [9000]
        live.close()


def test_an_overrun_is_counted_and_the_hole_is_bad_samples(name):
    with Writer(name, 512) as writer:
        live = LiveRing(name, LANES)
        writer.publish(frames(0, 40))
        live.take(WAIT_S)
        writer.publish(frames(40, 1640))
        assert live.take(WAIT_S) == [] and live.overruns == 1
        made = live.take(WAIT_S)
        assert firsts(made) == list(range(40, 1640, 40))
        good = [first for first, samples in made if (samples["status"] == 0).all()]
        assert good == list(range(1440, 1640, 40))
        live.close()
