"""Starts the robot's processes from one table, starts again what ends, and tells of each on its health topic.

A program that ends is started again after a pause that doubles each time, up to PAUSE_MOST_S, and is short again once
it has run for STEADY_S. The end of the one named `until` (a simulation) is the end of all.
"""

import threading
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from .children import Child, Program
from .health import ENDED, RUNNING
from .link import Link
from .messages import HEALTH, Header, KeyValue, ProcessHealth

PAUSE_S, PAUSE_MOST_S = 0.2, 5.0
LEAVE_S, LEAVE_LOOK_S = (
    2.0,
    0.05,
)  # for what a program has left behind to end by itself: a driver stops the wheels first
STEADY_S = 10.0
TELL_S = 1.0


class Keeper:
    """One line of the table: its child, and when it is started again."""

    def __init__(self, program: Program, logs: Path, on_end: Callable[[], None], clock=time.monotonic):
        self.program, self.restarts, self.last_error = program, 0, ""
        self._log, self._on_end, self._clock = logs / f"{program.name}.log", on_end, clock
        self._child: Child | None = None
        self._pause_s, self._due_s = PAUSE_S, clock()

    @property
    def pid(self) -> int:
        """0: it is not running."""
        return self._child.process.pid if self._child and self._child.running else 0

    @property
    def over(self) -> bool:
        """It ran, and has ended."""
        return self._child is not None and not self._child.running

    def step(self) -> None:
        """Start it if that is due; note it if it has ended."""
        now = self._clock()
        if self._child and (self._child.running or self._leaves):
            return
        if self._child:
            self._note_end(now)
        if now >= self._due_s:
            self._child = Child(self.program, self._log, on_end=self._on_end)

    def wait_s(self) -> float:
        """Until `step` has something to do, as far as that is known."""
        if self.pid:
            return TELL_S
        return LEAVE_LOOK_S if self._leaves else max(0.0, self._due_s - self._clock())

    @property
    def _leaves(self) -> bool:
        """It has ended, and what it started has a little time left to do so too."""
        child = self._child
        return child is not None and child.leaves and self._clock() - child.ended_s < LEAVE_S

    def _note_end(self, now: float) -> None:
        child, self._child = self._child, None
        with closing(child):
            self.last_error = child.failure() if child.failed else f"{child.name} ended ({child.how()})"
        if child.ended_s - child.started_s >= STEADY_S:
            self._pause_s = PAUSE_S
        self._due_s, self._pause_s = now + self._pause_s, min(PAUSE_MOST_S, 2.0 * self._pause_s)
        self.restarts += 1

    def close(self) -> None:
        """End it for good."""
        if self._child:
            self._child.close()

    def ask_to_end(self) -> None:
        """It will end soon."""
        if self._child:
            self._child.ask_to_end()


class Supervisor:
    """`run` until stopped, or until the program `until` has ended. The table's first are started first and ended last."""

    def __init__(self, table: list[Program], logs: Path, link: Link | None = None, until: str | None = None):
        logs.mkdir(parents=True, exist_ok=True)
        self._woken, self._until, self._link = threading.Event(), until, link
        self._keepers = [Keeper(program, logs, self._woken.set) for program in table]
        self._streams = {k.program.name: link.publish(f"{HEALTH}/{k.program.name}") for k in self._told()}
        self._began_s, self._tell_s = time.monotonic(), 0.0

    def run(self, stop: threading.Event) -> str:
        """Returns why it ended: a line for a person."""
        watcher = threading.Thread(target=lambda: (stop.wait(), self._woken.set()), daemon=True)
        watcher.start()
        try:
            while not stop.is_set():
                if ended := self._ended():
                    return ended
                for keeper in self._keepers:
                    keeper.step()
                self._tell()
                self._woken.wait(min(keeper.wait_s() for keeper in self._keepers))
                self._woken.clear()
            return "stopped"
        finally:
            self._close()

    def pid(self, name: str) -> int:
        """Of a program of the table; 0: it is not running."""
        return next(keeper.pid for keeper in self._keepers if keeper.program.name == name)

    def _told(self) -> list[Keeper]:
        """Those that this process tells of: the others do so themselves."""
        return [k for k in self._keepers if not k.program.tells] if self._link else []

    def _ended(self) -> str:
        """Why the program that all depend on is gone; empty: it is not."""
        keeper = next((k for k in self._keepers if k.program.name == self._until), None)
        if keeper is None or not keeper.over:
            return ""
        keeper.step()
        return keeper.last_error

    def _tell(self) -> None:
        now = time.monotonic()
        if now < self._tell_s and not self._woken.is_set():
            return
        self._tell_s = now + TELL_S
        for keeper in self._told():
            self._tell_of(keeper, RUNNING if keeper.pid else "waiting to be started again")

    def _tell_of(self, keeper: Keeper, state: str) -> None:
        header = Header.at(round((time.monotonic() - self._began_s) * 1e9))
        name, counters = keeper.program.name, [KeyValue("restarts", str(keeper.restarts))]
        self._streams[name].send(ProcessHealth(header, name, keeper.pid, state, counters, keeper.last_error))

    def _close(self) -> None:
        """The last in the table first, one after the other: the pilot stops the wheels while there is a base."""
        for keeper in reversed(self._keepers):
            keeper.close()
        for keeper in self._told():
            self._tell_of(keeper, ENDED)
