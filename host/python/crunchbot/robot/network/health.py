"""What every process of the robot says of itself: once a second to the others, at each turn of its loop to its service manager."""

import os
import time
from collections.abc import Callable

from .link import Link
from .messages import HEALTH, Header, KeyValue, ProcessHealth
from .notify import Notify

PERIOD_S = 1.0
RUNNING, ENDED = "running", "ended"


class Health:
    """`report` as often as convenient, at least once a second: it sends when a second has passed or the state is new.

    `counters()` gives what is counted, by name; asked for only when something is sent.
    """

    def __init__(self, link: Link, counters: Callable[[], dict[str, object]]):
        self._stream = link.publish(f"{HEALTH}/{link.process}")
        self._process, self._counters = link.process, counters
        self._due_s, self._state = 0.0, ""
        self._manager = Notify()

    def report(self, stamp_ns: int, state: str = RUNNING, last_error: str = "") -> None:
        """`stamp_ns`: the bridge's clock as far as this process knows it."""
        self._manager.stopping() if state == ENDED else self._manager.alive()
        now = time.monotonic()
        if now < self._due_s and state == self._state:
            return
        self._due_s, self._state = now + PERIOD_S, state
        counters = [KeyValue(key, str(value)) for key, value in self._counters().items()]
        self._stream.send(ProcessHealth(Header.at(stamp_ns), self._process, os.getpid(), state, counters, last_error))
