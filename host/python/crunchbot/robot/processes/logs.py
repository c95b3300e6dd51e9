"""Logs of processes that another one starts: a folder for each run, notes of start and end, the last line of a log."""

import os
import re
import time
from itertools import count
from pathlib import Path
from typing import TextIO

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


def note(log: TextIO, text: str) -> None:
    """A line of ours in a process's log."""
    log.write(f"{stamp()}{OURS}{text}\n")
    log.flush()
