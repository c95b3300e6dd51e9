"""Starts the robot's processes from one table, restarts what ends, and reports each on its health topic.

A program that ends is started again after a pause that doubles each time, up to PAUSE_MOST_S; one that ran steadily
(`Program.steady_s`) is started again at once. One that cannot be started is tried again likewise. The end of the one
named `until` (a simulation) is the end of all, and so is exit code 2, wrong arguments, of one that never ran steadily.

The main loop turns every LOOK_S, and beats for the processes that can move wheels: without its beat they stop them.
"""

import threading
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from ...errors import UserError
from ...tables import ignore
from ..network.health import ENDED, RUNNING
from ..network.link import Link
from ..network.messages import HEALTH, Header, KeyValue, ProcessHealth
from .children import GRACE_S, STOPPED, Child, Program
from .lifeline import BEAT_S

PAUSE_S, PAUSE_MOST_S = 0.2, 5.0
LEAVE_S = 0.2  # for what a program has left behind to end by itself: a driver stops the wheels first
KILLED_S = 1.0  # for the kernel to end what was killed
LOOK_S, LEAVE_LOOK_S = 0.05, 0.01
TELL_S = 1.0
TRIES = 3  # of what has never run, before a person is warned: the first may be for a part that comes up meanwhile


class RunError(UserError):
    """The program that all depend on has failed; one line."""

    exit_code = 1


class Keeper:
    """One line of the table: its child, and when it is started again."""

    def __init__(
        self,
        program: Program,
        logs: Path,
        on_end: Callable[[], None],
        clock: Callable[[], float] = time.monotonic,
        tell: Callable[[str], None] = ignore,
    ):
        self.program, self.restarts, self.last_error = program, 0, ""
        self.refused = self.failed = False  # it ended with exit code 2 and never ran steadily; its last run failed
        self._log, self._on_end, self._clock = logs / f"{program.name}.log", on_end, clock
        self._child: Child | None = None
        self._pause_s, self._due_s, self._steady = PAUSE_S, clock(), False
        self._tell, self._tries, self.unwritten = tell, 0, 0  # log lines

    @property
    def pid(self) -> int:
        """0: it is not running."""
        return self._child.process.pid if self._child and self._child.running else 0

    @property
    def over(self) -> bool:
        """It ran, and has ended."""
        return self._child is not None and not self._child.running

    def step(self) -> None:
        """Start it if that is due; note it if it has ended; end it if it hangs."""
        if self.pid:
            self._watch(self._child)
        elif self.settled() and self._clock() >= self._due_s:
            self._start(self._clock())

    def settled(self) -> bool:
        """Whether it has ended and left nothing behind; then its end has been noted."""
        child, now = self._child, self._clock()
        if child and (child.running or self._leaves(child, now)):
            return False
        if child:
            self._note_end(child, now)
        return True

    def wait_s(self) -> float:
        """Seconds until `step` has something to do, at most."""
        if self.pid:
            return LOOK_S
        return LEAVE_LOOK_S if self._child else max(0.0, self._due_s - self._clock())

    def beat(self) -> None:
        """Tell it that it is watched over."""
        if self._child:
            self._child.beat()

    def _watch(self, child: Child) -> None:
        if child.hangs(self._clock()):
            child.kill()

    def _leaves(self, child: Child, now: float) -> bool:
        """It has ended, and what it started has a little time to do so too. What is stopped or late is killed."""
        rest, since_s = child.rest(), now - child.ended_s
        if rest and (since_s >= LEAVE_S or set(rest.values()) <= set(STOPPED)):
            child.kill()
        return bool(rest) and since_s < LEAVE_S + KILLED_S

    def _start(self, now: float) -> None:
        try:
            self._child = Child(self.program, self._log, on_end=self._on_end)
        except (OSError, RuntimeError) as error:
            self.last_error = f"{self.program.name} cannot be started ({getattr(error, 'strerror', None) or error})"
            self._put_off(now, steady=False)

    def _note_end(self, child: Child, now: float) -> None:
        self._child = None
        with closing(child):
            self.failed = child.failed
            self.last_error = child.failure() if child.failed else f"{child.name} ended ({child.how()})"
        self.unwritten += child.unwritten
        steady = child.ended_s - child.started_s >= self.program.steady_s
        self._steady |= steady
        self.refused = child.process.returncode == UserError.exit_code and not self._steady
        self._put_off(now, steady)

    def _put_off(self, now: float, steady: bool) -> None:
        """When it is started again."""
        if steady:
            self._due_s, self._pause_s = now, PAUSE_S
        else:
            self._due_s, self._pause_s = now + self._pause_s, min(PAUSE_MOST_S, 2.0 * self._pause_s)
        self.restarts += 1
        self._tries += 1
        if self._tries == TRIES and not self._steady:
            self._tell(f"{self.last_error}; it has never run, and is tried again")

    def ask_to_end(self) -> None:
        """It will end soon."""
        if self._child:
            self._child.ask_to_end()

    def close(self) -> None:
        """End it for good."""
        child, self._child = self._child, None
        if child:
            child.close()


class Supervisor:
    """`run` until stopped, or until the program `until` has ended, which is ended last."""

    def __init__(
        self,
        table: list[Program],
        logs: Path,
        link: Link | None = None,
        until: str | None = None,
        tell: Callable[[str], None] = ignore,
    ):
        """tell: for what a person at the terminal has to know."""
        self._woken, self._until, self._link = threading.Event(), until, link
        self._keepers = [Keeper(program, logs, self._woken.set, tell=tell) for program in table]
        self._streams = {k.program.name: link.publish(f"{HEALTH}/{k.program.name}") for k in self._reported()}
        self._began_s, self._report_s, self._beat_s = time.monotonic(), 0.0, 0.0

    def run(self, stop: threading.Event) -> str:
        """Returns why it ended: a line for a person. UserError: a program was given wrong arguments, or `until` failed."""
        watcher = threading.Thread(target=lambda: (stop.wait(), self._woken.set()), daemon=True)
        watcher.start()
        try:
            while not stop.is_set():
                if ended := self._ended():
                    return ended
                for keeper in self._keepers:
                    keeper.step()
                    self._beat()
                self._report()
                self._look(min(LOOK_S, *(keeper.wait_s() for keeper in self._keepers)))
            return "stopped"
        finally:
            self._close()

    def pid(self, name: str) -> int:
        """The process number of a program of the table; 0: it is not running."""
        return next(keeper.pid for keeper in self._keepers if keeper.program.name == name)

    def _reported(self) -> list[Keeper]:
        """Those that this process reports: the others report themselves."""
        return [k for k in self._keepers if not k.program.reports] if self._link else []

    def _ended(self) -> str:
        """Why the program that all depend on is gone; empty: it is not. UserError: that is a failure."""
        if refused := next((k for k in self._keepers if k.refused), None):
            raise UserError(refused.last_error)
        keeper = next((k for k in self._keepers if k.program.name == self._until), None)
        if keeper is None or not keeper.over:
            return ""
        while not keeper.settled():
            self._look(LEAVE_LOOK_S)
        if keeper.refused:
            raise UserError(keeper.last_error)
        if keeper.failed:
            raise RunError(keeper.last_error)
        return keeper.last_error

    def _look(self, wait_s: float) -> None:
        """Sleep until something ends, beating meanwhile."""
        self._beat()
        self._woken.wait(wait_s)
        self._woken.clear()

    def _beat(self) -> None:
        now = time.monotonic()
        if now - self._beat_s >= BEAT_S:
            self._beat_s = now
            for keeper in self._keepers:
                keeper.beat()

    def _report(self) -> None:
        now = time.monotonic()
        if now < self._report_s:
            return
        self._report_s = now + TELL_S
        for keeper in self._reported():
            self._report_of(keeper, RUNNING if keeper.pid else "waiting to be started again")

    def _report_of(self, keeper: Keeper, state: str) -> None:
        header = Header.at(round((time.monotonic() - self._began_s) * 1e9))
        counted = {"restarts": keeper.restarts, "log_unwritten": keeper.unwritten}
        name, counters = keeper.program.name, [KeyValue(name, str(count)) for name, count in counted.items()]
        self._streams[name].send(ProcessHealth(header, name, keeper.pid, state, counters, keeper.last_error))

    def _close(self) -> None:
        """What can move wheels from the last on, one after the other: the pilot stops them while there is a base. Then all
        others at once, and what all depend on."""
        moving = [k for k in reversed(self._keepers) if k.program.moves]
        last = [k for k in self._keepers if k.program.name == self._until]
        others = [k for k in self._keepers if k not in moving and k not in last]
        for keepers in (*([keeper] for keeper in moving), others, last):
            self._end(keepers)
        for keeper in self._reported():
            self._report_of(keeper, ENDED)

    def _end(self, keepers: list[Keeper]) -> None:
        for keeper in keepers:
            keeper.ask_to_end()
        give_up_s = time.monotonic() + GRACE_S
        while any(keeper.pid for keeper in keepers) and time.monotonic() < give_up_s:
            self._look(LOOK_S)
        for keeper in keepers:
            keeper.close()
