"""Processes that another one starts and answers for: each in a group of its own, its output in a log, none left behind.

Output goes straight into the log's file, and each process begins its lines with the time itself (crunchbot.stamping). A pipe
through the starting process would give it every line, but when that process hangs the pipe fills and blocks the child,
and when it dies the next line ends the child by SIGPIPE: a child that is about to stop its wheels may do neither.
"""

import contextlib
import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...stamping import VARIABLE as TIMES
from .lifeline import VARIABLE, Lifeline, Pulse
from .logs import Log, last_line
from .watchdog import VARIABLES, Watchdog

GRACE_S = 10.0  # for a child to end after SIGTERM, before SIGKILL
FOREIGN = (*VARIABLES, VARIABLE)  # set for this process alone by the process that started it
DEAD, STOPPED = "ZXx", "Tt"  # states of proc(5)


@dataclass(frozen=True)
class Program:
    """A line of a process table.

    serves: it goes on until it is asked to end, and is missed when it ends before; reports: it reports itself on a health
    topic; moves: it can move wheels, and has a heartbeat; fed: it feeds a watchdog, and one that hangs is ended;
    steady_s: who ran for so long is started again at once; orphaned: the signal it has when who started it has ended.
    """

    name: str
    command: tuple[str, ...]
    serves: bool = False
    reports: bool = False
    moves: bool = False
    fed: bool = False
    steady_s: float = 10.0
    orphaned: int = signal.SIGTERM

    @classmethod
    def of(cls, name: str, command: list, **options: Any) -> "Program":
        """The words of `command` may be anything that prints: paths, numbers."""
        return cls(name, tuple(map(str, command)), **options)


class Child:
    """A running program. Its standard error goes to `on_line` line by line if that is given, and always to the log."""

    def __init__(
        self,
        program: Program,
        log: Path,
        on_line: Callable[[str], None] | None = None,
        on_end: Callable[[], None] | None = None,
    ):
        """`log` is written on if it exists; `on_end` is called once, from a thread, when the process has ended.

        OSError or RuntimeError (no thread) when it cannot be started; nothing stays open, and nothing runs, then.
        """
        self.program, self.name, self.log, self._on_end = program, program.name, log, on_end
        with ExitStack() as opened:
            self._log = opened.enter_context(closing(Log(log)))
            self._lifeline = opened.enter_context(closing(Lifeline()))
            self._pulse = opened.enter_context(closing(Pulse())) if program.moves else None
            self._watchdog = opened.enter_context(closing(Watchdog())) if program.fed else None
            self.process = self._start(subprocess.PIPE if on_line else self._log)
            self.started_s = time.monotonic()
            self.ended_s: float | None = None
            self._threads = [threading.Thread(target=self._watch, daemon=True)]
            if on_line:
                self._threads.append(threading.Thread(target=self._read, args=(on_line,), daemon=True))
            try:
                self._tie()
                for thread in self._threads:
                    thread.start()
            except BaseException:
                self.kill()  # nobody would answer for it
                self.process.wait()
                raise
            self._opened = opened.pop_all()

    def _start(self, stderr) -> subprocess.Popen:
        ties = [tie for tie in (self._pulse, self._watchdog) if tie]
        environment = {name: value for name, value in os.environ.items() if name not in FOREIGN} | {TIMES: "1"}
        for tie in ties:
            environment |= tie.variables
        pipes = [pipe.reading for pipe in (self._lifeline, self._pulse) if pipe]
        return subprocess.Popen(
            self.program.command,
            stdin=subprocess.DEVNULL,
            stdout=self._log,
            stderr=stderr,
            text=True,
            errors="replace",
            start_new_session=True,
            pass_fds=pipes,
            env=environment,
        )

    def _tie(self) -> None:
        self._lifeline.tie(self.process.pid, self.program.orphaned)
        self._log.note(f"started as process {self.process.pid}")
        if self._pulse:
            self._pulse.started()

    def _watch(self) -> None:
        self.process.wait()
        self.ended_s = time.monotonic()
        if self._on_end:
            self._on_end()

    def _read(self, on_line: Callable[[str], None]) -> None:
        for line in self.process.stderr:
            self._log.write(line)
            on_line(line)

    @property
    def running(self) -> bool:
        return self.ended_s is None

    @property
    def failed(self) -> bool:
        return not self.running and self.process.returncode != 0

    def rest(self) -> dict[int, str]:
        """The processes of its group: their states as of proc(5), by pid. Those that are dead do not count."""
        return living(self.process.pid)

    def beat(self) -> None:
        """Tell it, where it can move wheels, that it is watched over."""
        if self._pulse:
            self._pulse.beat()

    def hangs(self, now_s: float) -> bool:
        """Whether its watchdog was not fed in time; to be asked often."""
        return self.running and self._watchdog is not None and self._watchdog.bites(now_s)

    def how(self) -> str:
        """How it ended: an exit code or a signal."""
        return _how(self.process.returncode)

    def failure(self) -> str:
        """One line about a bad end."""
        self._join()
        line = last_line(self.log)
        said = f": {line}" if line else ""
        return f"{self.name} failed ({self.how()}){said}; log: {self.log}"

    def ask_to_end(self) -> None:
        """SIGTERM to it and to what it has started. Those that are stopped go on, so that they can obey."""
        if self.process.poll() is None:
            self._signal(signal.SIGTERM)
            self._signal(signal.SIGCONT)

    def kill(self) -> None:
        """SIGKILL to it and to what it has started."""
        self._signal(signal.SIGKILL)

    def close(self) -> None:
        """End it if it still runs, with whatever it has started."""
        for end in (self.ask_to_end, self.kill):
            if self.process.poll() is None:
                end()
                with contextlib.suppress(subprocess.TimeoutExpired):
                    self.process.wait(timeout=GRACE_S)
        self.kill()  # grandchildren of one that died
        self._join()
        self._log.note(f"ended ({self.how()})")
        self._opened.close()

    @property
    def unwritten(self) -> int:
        """How often its log could not be written."""
        return self._log.unwritten

    def _join(self) -> None:
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(timeout=1.0)

    def _signal(self, sign: signal.Signals) -> None:
        try:
            os.killpg(self.process.pid, sign)
        except ProcessLookupError:
            return


def living(group: int) -> dict[int, str]:
    """The living processes of a process group: their states as of proc(5), by pid."""
    found = {}
    for stat in _processes():
        with contextlib.suppress(OSError):
            state, _, number = stat.read_text(errors="replace").rpartition(")")[2].split()[:3]
            if int(number) == group and state not in DEAD:
                found[int(stat.parent.name)] = state
    return found


def _processes() -> list[Path]:
    """None where the list cannot be read, as when no descriptor is left: what is not known to be there is not waited for."""
    try:
        return list(Path("/proc").glob("[0-9]*/stat"))
    except OSError:
        return []


def _how(code: int) -> str:
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
