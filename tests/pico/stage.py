"""The executed Pico under umockdev, with whiskerd on it, in a field that the test gives: what its whiskers feel, tick by tick."""

import fcntl
import mmap
import os
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from pico.emulated import IMAGE, SIM, need_emulator

from crunchbot.programs import program

REST = 0x8000
BLOCK = 20  # ticks a write


class Field(threading.Thread):
    """Two angles of each lane and tick, in counts: at rest, but for what is played."""

    def __init__(self, pipe: Path, lanes: int, noise: float = 0.0):
        """`noise`: of rest, in counts, as sensors have it."""
        super().__init__(daemon=True)
        self._pipe, self._lanes, self._noise = pipe, lanes, noise
        self._parts, self._changed, self._random = iter(()), threading.Condition(), np.random.default_rng(1)
        self._idle = threading.Event()

    def play(self, lane: int, counts: np.ndarray, forever: bool = False) -> None:
        """From now on this lane feels these counts (n, 2), the others rest. Returns at their end, or at once if they repeat."""
        block = np.full((-(-len(counts) // BLOCK) * BLOCK, self._lanes, 2), REST, "<u2")
        block[: len(counts), lane] = counts
        block[len(counts) :, lane] = counts[-1]
        with self._changed:
            self._idle.clear()
            self._parts = self._repeat(block) if forever else iter(np.split(block, len(block) // BLOCK))
        if not forever:
            self._idle.wait()

    @staticmethod
    def _repeat(block: np.ndarray) -> Iterator[np.ndarray]:
        while True:
            yield from np.split(block, len(block) // BLOCK)

    def run(self) -> None:
        try:
            with self._pipe.open("wb", buffering=0) as pipe:
                fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, mmap.PAGESIZE)  # what is played next waits for no long past
                while True:
                    pipe.write(self._next().tobytes())
        except BrokenPipeError:
            self._idle.set()

    def _next(self) -> np.ndarray:
        with self._changed:
            part = next(self._parts, None)
        if part is None:
            self._idle.set()
            part = np.rint(self._random.normal(REST, self._noise, (BLOCK, self._lanes, 2)))
        return part.astype("<u2")


@contextmanager
def staged(folder: Path, ring: str, lanes: int, noise: float = 0.0) -> Iterator[Field]:
    """whiskerd's ring is up or will be; folder/log has what the sensors showed (pico.readings)."""
    need_emulator()
    os.mkfifo(folder / "fields")
    words = ["umockdev-wrapper", program("whisker-pico-sim"), "node", SIM / "serve.mjs", IMAGE, lanes, 1]
    words += [folder / "fields", folder / "log", "--", program("whiskerd"), "--ring", ring]
    words += ["--lane-mask", (1 << lanes) - 1]
    field = Field(folder / "fields", lanes, noise)
    with subprocess.Popen(list(map(str, words)), stderr=subprocess.PIPE, text=True) as process:
        field.start()
        yield field
        process.terminate()
        _, said = process.communicate()
    assert process.returncode == 0 and " 0 with damaged records, 0 bytes skipped" in said, said
