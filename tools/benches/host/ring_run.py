"""One run: a publisher and its subscribers, each a process, and their latencies counted in bins."""

import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

READERS = (1, 2, 8, 32)  # of a run; all on one processor
# Latencies are kept as counts in bins 2.3 % wide, so that rounds can be added.
EDGES = np.concatenate([[0], np.geomspace(50, 2e9, 769)])


def settle(core: int) -> None:
    """In a child: on its processor, and a session of its own.

    The processes of a session share one weight in the scheduler, so many readers on one processor would take time from
    the publisher on the other as soon as anything else runs there.
    """
    os.setsid()
    os.sched_setaffinity(0, {core})


class Run:
    """Publisher and subscribers of one setting, each a process, in a folder of their own."""

    def __init__(self, program: Path, mode: str, pace: str, readers: int, seconds: float):
        self.program, self.mode, self.pace, self.readers, self.seconds = program, mode, pace, readers, seconds
        cores = sorted(os.sched_getaffinity(0))
        self.publisher_core, self.reader_core = cores[0], cores[-1]

    def _start(self, folder: Path, role: str, index: int, core: int) -> subprocess.Popen:
        words = [self.program, role, folder / "control", self.mode, self.pace, self.seconds, self.readers, index]
        words.append(folder / f"latencies_{index}")
        return subprocess.Popen(
            [str(word) for word in words],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "AERON_DIR": str(folder / "aeron")},
            preexec_fn=lambda: settle(core),
        )

    def measure(self) -> dict:
        with tempfile.TemporaryDirectory(dir="/dev/shm", prefix="whisker-bench-") as name:
            folder = Path(name)
            (folder / "control").write_bytes(bytes(8192))
            started = []
            try:
                return self._measure(folder, started)
            finally:
                for process in started:
                    process.kill()
                    process.wait()

    def _measure(self, folder: Path, started: list) -> dict:
        if self.program.name == "peer_aeron":
            started.append(
                subprocess.Popen([str(self.program), "driver"], env={**os.environ, "AERON_DIR": str(folder / "aeron")})
            )
            time.sleep(1.0)
        publisher = self._start(folder, "publish", 0, self.publisher_core)
        started.append(publisher)
        time.sleep(0.5)
        subscribers = [self._start(folder, "subscribe", i, self.reader_core) for i in range(self.readers)]
        started.extend(subscribers)
        sent = self._result(publisher)
        got = [self._result(process) for process in subscribers]
        samples = [np.fromfile(folder / f"latencies_{i}", np.uint32) for i in range(self.readers)]
        return {
            **sent,
            "received": [g["received"] for g in got],
            "lost": sum(g["lost"] for g in got),
            "bad": sum(g["bad"] for g in got),
            "latency_ns": histogram(np.concatenate(samples) if samples else np.zeros(0, np.uint32)),
        }

    def _result(self, process: subprocess.Popen) -> dict:
        out, error = process.communicate(timeout=self.seconds + 120)
        if process.returncode != 0:
            lines = error.strip().splitlines() or ["no reason given"]
            raise RuntimeError(f"{self.program.name} failed: {lines[-1]}")
        return json.loads(out.splitlines()[-1])


def histogram(samples: np.ndarray) -> dict[str, int]:
    counts, _ = np.histogram(samples, EDGES)
    return {str(i): int(counts[i]) for i in np.flatnonzero(counts)}


def quantile(counts: dict[str, int], percent: float) -> float:
    """Microseconds; the middle of the bin that holds it."""
    bins = sorted((int(i), n) for i, n in counts.items())
    total = np.cumsum([n for _, n in bins])
    at = bins[int(np.searchsorted(total, percent / 100 * total[-1]))][0]
    return float((EDGES[at] + EDGES[at + 1]) / 2000)
