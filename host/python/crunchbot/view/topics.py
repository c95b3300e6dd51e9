"""What a page can subscribe to. A panel that shows something new adds a topic here; docs/view.md is the reference.

A feed is one page's subscription. `take` gives its next message, or None when there is nothing new; it is called at
most once a round, and not at all while the page is busy, so it must give the newest that fits and never store up.
"""

import json
import struct
import time
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from whisker_protocol import LANES

from .hub import Hub, RequestError
from .pyramid import BINS, WIDTHS, spans
from .robot_topics import BELIEF_ID, BeliefFeed, MapFeed, RobotFeed, SceneFeed

BLOCK = struct.Struct("<BBHHBBIIQ")  # topic, flags, width, bins, lanes, zero, lane mask, subscription, first bin
BLOCK_FRESH = 1  # flag: forget what came before this block
BLOCK_BINS = 512  # at most: a history comes in several blocks
STATUS_S = 0.25


class Feed(Protocol):
    """One page's subscription to one topic."""

    def take(self) -> str | bytes | None: ...

    def close(self) -> None: ...


def number(options: dict, name: str, low: int, high: int) -> int:
    """A whole number among the options of a subscription. RequestError if it is not one, or not in range."""
    value = options.get(name)
    if type(value) is not int or not low <= value <= high:
        raise RequestError(f"{name}: not a whole number from {low} to {high}")
    return value


class Traces:
    """Lowest and highest counts of lanes, bin by bin, as binary blocks."""

    def __init__(self, hub: Hub, options: dict):
        width = number(options, "ticks_per_bin", 1, WIDTHS[-1])
        if width not in WIDTHS:
            raise RequestError(f"ticks_per_bin: {width} is not one of {', '.join(map(str, WIDTHS))}")
        self._bins = number(options, "bins", 1, BINS)
        self._mask = number(options, "lanes", 1, (1 << LANES) - 1)
        self._subscription = number(options, "subscription", 0, 0xFFFFFFFF)
        self._lanes = [lane for lane in range(LANES) if self._mask >> lane & 1]
        self._hub, self._tap = hub, hub.watch(options.get("ring"))
        self._width, self._level = width, self._tap.pyramid.levels[width]
        self._next, self._flags = 0, BLOCK_FRESH

    def take(self) -> bytes | None:
        first = max(self._next, self._level.end - self._bins)
        end = min(self._level.end, first + BLOCK_BINS)
        if first >= end:
            return None
        head = (self._width, end - first, len(self._lanes), 0, self._mask, self._subscription, first)
        block = BLOCK.pack(TOPICS["traces"].id, self._flags, *head) + self._planes(spans(first, end))
        self._next, self._flags = end, 0
        return block

    def _planes(self, parts: list[slice]) -> bytes:
        level, lanes = self._level, self._lanes
        low, high = (np.concatenate([a[:, lanes, part] for part in parts], -1) for a in (level.low, level.high))
        bad = np.concatenate([level.bad[lanes, part] for part in parts], -1)
        return low.tobytes() + high.tobytes() + np.minimum(bad, 0xFF).astype(np.uint8).tobytes()

    def close(self) -> None:
        self._hub.unwatch(self._tap)


class Status:
    """State, counts and health of a ring, as JSON, four times a second."""

    def __init__(self, hub: Hub, options: dict):
        self._hub, self._tap = hub, hub.watch(options.get("ring"))
        self._due = 0.0

    def take(self) -> str | None:
        now = time.monotonic()
        if now < self._due:
            return None
        self._due = now + STATUS_S
        return json.dumps({"topic": "status"} | self._tap.status(), separators=(",", ":"))

    def close(self) -> None:
        self._hub.unwatch(self._tap)


class Changing:
    """A message as JSON, at first and when it changes."""

    def __init__(self, hub: Hub, options: dict):
        self._hub, self._reported = hub, None

    def take(self) -> str | None:
        message = self._message()
        if message == self._reported:
            return None
        self._reported = message
        return json.dumps(message)

    def close(self) -> None:
        return


class Rings(Changing):
    """Names of the rings that can be asked for and whose they are, as JSON, at first and when they change."""

    def _message(self) -> dict:
        return {"topic": "rings", "rings": self._hub.rings(), "owners": self._hub.owners()}


class Controls(Changing):
    """What is recorded, and whether a page has the robot stand, as JSON, at first and when it changes."""

    def _message(self) -> dict:
        return {"topic": "controls"} | self._hub.controls()


@dataclass(frozen=True)
class Topic:
    """`feed(hub, options)` subscribes, or raises RequestError. `id` is the first byte of its binary messages."""

    id: int
    feed: type
    about: str


TOPICS = {
    "traces": Topic(1, Traces, Traces.__doc__),
    "status": Topic(2, Status, Status.__doc__),
    "rings": Topic(3, Rings, Rings.__doc__),
    "scene": Topic(4, SceneFeed, SceneFeed.__doc__),
    "robot": Topic(5, RobotFeed, RobotFeed.__doc__),
    "belief": Topic(BELIEF_ID, BeliefFeed, BeliefFeed.__doc__),
    "map": Topic(7, MapFeed, MapFeed.__doc__),
    "controls": Topic(8, Controls, Controls.__doc__),
}
