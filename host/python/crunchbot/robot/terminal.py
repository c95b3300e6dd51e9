"""What `whisker robot` says in the terminal while it runs: where its page is, what share of its samples is lost, its pace."""

import contextlib
import re
import threading
import time
from collections.abc import Callable
from pathlib import Path

from ..bridge.flow import BUSY, EVEN, WINDOW_S, Flow, tick_s
from ..bridge.ring import Reader, RingError

LOOK_S = 0.5
REPEAT_S = 60.0  # between two words of the same kind


class Terminal(threading.Thread):
    """`tell` is given each line, until `stop` is set. `page`: the log in which the view says its address; None: no page."""

    def __init__(self, ring: str, page: Path | None, pace: float, stop: threading.Event, tell: Callable[[str], None]):
        super().__init__(daemon=True)
        self._ring, self._page, self._pace, self._stop_event, self._tell = ring, page, pace, stop, tell
        self._reader: Reader | None = None
        self._flow, self._attached_s = Flow(), 0.0
        self._told: dict[str, float] = {}

    def run(self) -> None:
        while not self._stop_event.wait(LOOK_S):
            self.look()

    def look(self) -> None:
        with contextlib.suppress(OSError):  # not there yet, or no disk
            if self._page and (found := re.search(r"http://\S+", self._page.read_text(errors="replace"))):
                self._tell(f"the robot's page: {found[0]}")
                self._page = None
        try:
            self._look_at_ring()
        except RingError as error:
            if error.name != "TIMEOUT":
                self._reader = None  # its writer has ended, or has not begun

    def _look_at_ring(self) -> None:
        if self._reader is None:
            self._reader, self._flow, self._attached_s = Reader(self._ring), Flow(), time.monotonic()
        self._flow.look(self._reader)
        pace = self._flow.rate() * tick_s(self._reader.stats)
        if loss := self._flow.loss():
            share, why, remedy = loss
            self._say("loss", f"{100 * share:.2g} % of the samples are lost: {why}; {remedy}")
        elif 0 < pace < EVEN * self._pace and time.monotonic() - self._attached_s > WINDOW_S:
            self._say("pace", f"the robot runs at {pace:.2f} of real time, not {self._pace:g}; {BUSY}")
        self._reader.seek_latest(0)
        self._reader.wait(0.0)

    def _say(self, kind: str, line: str) -> None:
        now = time.monotonic()
        if now - self._told.get(kind, -REPEAT_S) >= REPEAT_S:
            self._told[kind] = now
            self._tell(f"warning: {line}")
