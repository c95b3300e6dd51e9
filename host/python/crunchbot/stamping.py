"""Lines that begin with the time, for a process whose output is a log (crunchbot.robot.processes.logs)."""

import os
import sys
import time
from collections.abc import Iterable
from typing import TextIO

VARIABLE = "WHISKER_LOG_TIMES"  # set by who keeps the log


def stamp() -> str:
    """The local time, to the millisecond, and a space."""
    now = time.time()
    return f"{time.strftime('%Y-%m-%d %H:%M:%S', time.localtime(now))}.{int(now * 1000) % 1000:03} "


def stamp_output() -> None:
    """Standard output and error carry times from now on, if VARIABLE is set."""
    if VARIABLE in os.environ:
        sys.stdout, sys.stderr = Stamped(sys.stdout), Stamped(sys.stderr)


class Stamped:
    """A text stream whose lines begin with the time; else it is the stream that it was made of."""

    def __init__(self, stream: TextIO):
        self._stream, self._begins = stream, True

    def write(self, text: str) -> int:
        lines = text.splitlines(keepends=True)
        stamped = [stamp() + line for line in lines]
        if lines:
            stamped[0] = stamped[0] if self._begins else lines[0]
            self._begins = lines[-1].endswith("\n")
            self._stream.write("".join(stamped))
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str):
        return getattr(self._stream, name)
