"""Logs of processes that another one starts: a folder for each run, notes of start and end, the last line of a log."""

import contextlib
import os
import re
import time
from itertools import count
from pathlib import Path

from ...outputs import unwritable
from ...stamping import stamp

TAIL_BYTES = 4096
OURS = "-- "  # begins what is not the process's own, behind the time
# What a run leaves, by what it is; in place of {} its number, from the second run on
FILES = {
    "bag": "robot{}.mcap",
    "map": "map{}",
    "scene": "scene{}",
    "flat": "scene{}.flat",
    "truth": "truth{}.csv",
    "wheels": "wheels{}.csv",
}
STAMP = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d{3} ")


def run_files(folder: Path) -> dict[str, Path]:
    """Places of FILES in this folder, all of one number, of which nothing is there."""
    for number in count(1):
        mark = "" if number == 1 else f"-{number}"
        files = {what: folder / name.format(mark) for what, name in FILES.items()}
        if not any(map(os.path.lexists, files.values())):
            return files


def run_folder(logs: Path) -> Path:
    """A new folder of `logs`, named by the time of now. OutputError when there can be none."""
    name = time.strftime("%Y%m%d-%H%M%S")
    for number in count(1):
        folder = logs / (name if number == 1 else f"{name}-{number}")
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            continue
        except OSError as error:
            raise unwritable(folder, error) from error
        return folder


def last_line(log: Path) -> str:
    """The process's own last line that is no progress, without its time, of a log's last 4 KiB; empty: there is none.

    Bytes that are no UTF-8 are replaced: a program may print names of files and devices as they are.
    """
    try:
        with log.open("rb") as file:
            file.seek(max(0, file.seek(0, os.SEEK_END) - TAIL_BYTES))
            text = file.read(TAIL_BYTES).decode(errors="replace")
    except OSError:
        return ""
    lines = [STAMP.sub("", line, count=1) for line in text.splitlines()]
    return next((line for line in reversed(lines) if line and not line.startswith(("progress ", OURS))), "")


class Log:
    """A process's log, written on if it is there, without a buffer. What is said about a process decides nothing over it: what
    cannot be opened or written is counted in `unwritten`. OSError when not even /dev/null can be opened."""

    def __init__(self, path: Path):
        self.unwritten = 0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o666)
        except OSError:
            self.unwritten += 1
            self._file = os.open(os.devnull, os.O_WRONLY | os.O_CLOEXEC)

    def fileno(self) -> int:
        """For the process's own output."""
        return self._file

    def write(self, text: str) -> None:
        try:
            os.write(self._file, text.encode(errors="replace"))
        except OSError:
            self.unwritten += 1

    def note(self, text: str) -> None:
        """A line of ours."""
        self.write(f"{stamp()}{OURS}{text}\n")

    def close(self) -> None:
        with contextlib.suppress(OSError):  # of an earlier write, as on a network's disk
            os.close(self._file)
