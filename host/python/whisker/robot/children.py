"""Processes that another one starts and answers for: each in a group of its own, its output in a log, none left behind."""

import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

GRACE_S = 10.0  # for a child to end after SIGTERM, before SIGKILL


@dataclass(frozen=True)
class Program:
    """A line of a process table.

    serves: it goes on until it is asked to end, and is missed when it ends before; tells: it tells of itself on a health
    topic.
    """

    name: str
    command: tuple[str, ...]
    serves: bool = False
    tells: bool = False

    @classmethod
    def of(cls, name: str, command: list, **options) -> "Program":
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
        """`log` is written on if it exists; `on_end` is called once, from a thread, when the process has ended."""
        self.program, self.name, self.log, self._on_end = program, program.name, log, on_end
        self._log = open(log, "a")  # noqa: SIM115 - closed by close()
        where = subprocess.PIPE if on_line else self._log
        self.process = subprocess.Popen(
            program.command, stdin=subprocess.DEVNULL, stdout=self._log, stderr=where, text=True, start_new_session=True
        )
        self.started_s = time.monotonic()
        self.ended_s: float | None = None
        self._threads = [threading.Thread(target=self._watch, daemon=True)]
        if on_line:
            self._threads.append(threading.Thread(target=self._read, args=(on_line,), daemon=True))
        for thread in self._threads:
            thread.start()

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

    @property
    def leaves(self) -> bool:
        """It has ended, and processes that it started are still there."""
        if self.running:
            return False
        try:
            os.killpg(self.process.pid, 0)
        except ProcessLookupError:
            return False
        return True

    def how(self) -> str:
        """How it ended: an exit code or a signal."""
        return _how(self.process.returncode)

    def failure(self) -> str:
        """One line about a bad end."""
        self._join()
        self._log.flush()
        lines = [line for line in self.log.read_text().splitlines() if not line.startswith("progress ")]
        said = f": {lines[-1]}" if lines else ""
        return f"{self.name} failed ({self.how()}){said}; log: {self.log}"

    def ask_to_end(self) -> None:
        """SIGTERM to it and to what it has started."""
        if self.process.poll() is None:
            self._signal(signal.SIGTERM)

    def close(self) -> None:
        """End it if it still runs, with whatever it has started."""
        for sign in (signal.SIGTERM, signal.SIGKILL):
            if self.process.poll() is None:
                self._signal(sign)
                try:
                    self.process.wait(timeout=GRACE_S)
                except subprocess.TimeoutExpired:
                    continue
        self._signal(signal.SIGKILL)  # grandchildren of one that died
        self._join()
        self._log.close()

    def _join(self) -> None:
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(timeout=1.0)

    def _signal(self, sign: signal.Signals) -> None:
        try:
            os.killpg(self.process.pid, sign)
        except ProcessLookupError:
            return


def _how(code: int) -> str:
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
