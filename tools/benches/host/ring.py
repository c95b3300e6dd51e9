"""The ring beside transports people would pick: latency and throughput for 1 to 32 readers, and what readers cost the
writer.

One program per transport (tools/benches/host/peers), one harness for all: 256-byte frames, publisher on one processor,
all readers on another, the same wait mode in every row of a figure:

  poll   a reader looks, and gives the processor away between looks
  wait   a reader sleeps until it is woken

2 kHz: latency from just before publishing to the reader's hand. Flat out: frames a second that reach every reader,
the publisher never more than 256 frames ahead of the slowest. Free: the ring's writer alone sets the pace.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from tqdm import tqdm

from .. import store

ROOT = Path(__file__).resolve().parents[3]
SOURCES = ROOT / "tools/benches/host/peers"
BUILT, RUNS = store.BENCH / "ring", store.kept("ring")
CMAKE_NEEDED = (3, 30)

# name -> title, program, wait modes, what it needs
PEERS = {
    "whisker": ("whisker ring", "peer_whisker", ("poll", "wait")),
    "iceoryx2": ("iceoryx2", "peer_iceoryx2", ("poll", "wait")),
    "aeron": ("Aeron IPC", "peer_aeron", ("poll",)),  # has no receive that sleeps
    "zenoh": ("zenoh, shared memory", "peer_zenoh", ("poll", "wait")),
    "zeromq": ("ZeroMQ, ipc", "peer_zeromq", ("poll", "wait")),
    "lcm": ("LCM, UDP multicast", "peer_lcm", ("poll", "wait")),
    "memory": ("limit: bare shared memory", "peer_memory", ("poll",)),  # no queue: of latency alone
}


def build_c(name: str, flags: list[str]) -> Path | None:
    """A program in C; None: it is left out."""
    program = BUILT / "bin" / f"peer_{name}"
    program.parent.mkdir(parents=True, exist_ok=True)
    command = ["cc", "-O2", "-std=gnu11", f"-I{ROOT}/host/libwhisker/include"]
    command += [SOURCES / f"peer_{name}.c", SOURCES / "harness.c", "-o", program, *flags]
    return built(name, program, store.failure(command))


def built(name: str, program: Path, error: str) -> Path | None:
    if error:
        store.leave_out(PEERS[name][0], error)
        return None
    return program


def build_linked(name: str, module: str, package: str) -> Path | None:
    """A program in C over a library that pkg-config knows; None: it is left out."""
    found = subprocess.run(["pkg-config", "--cflags", "--libs", module], capture_output=True, text=True, check=False)
    if found.returncode != 0:
        return built(name, BUILT, f"no library; apt-get install {package}")
    return build_c(name, found.stdout.split())


def cmake_folder() -> Path:
    """Where a CMake new enough for Aeron is: the system's, or one in a virtual environment of the bench's own.

    RuntimeError: neither can be had.
    """
    text = subprocess.run(["cmake", "--version"], capture_output=True, text=True).stdout.split()
    if tuple(map(int, text[2].split(".")[:2])) >= CMAKE_NEEDED:
        return Path(shutil.which("cmake")).parent
    folder = BUILT / "venv"
    if not (folder / "bin/cmake").exists():
        pip = [folder / "bin/pip", "install", "--quiet", "--disable-pip-version-check", "--require-hashes"]
        install = [*pip, "-r", SOURCES / "requirements.lock"]
        if error := store.failure([sys.executable, "-m", "venv", folder], install):
            raise RuntimeError(f"CMake {CMAKE_NEEDED[0]}.{CMAKE_NEEDED[1]} cannot be installed: {error}")
    return folder / "bin"


def build_rust(name: str) -> Path | None:
    """A program in Rust, each by a build of its own; compiling takes minutes the first time. None: it is left out."""
    if not shutil.which("cargo"):
        return built(name, BUILT, "no cargo; install Rust 1.85 or newer (rustup)")
    target = Path(os.environ.get("CARGO_TARGET_DIR", BUILT / "target"))
    environment = {**os.environ, "CARGO_TARGET_DIR": str(target)}
    try:
        if name == "aeron":
            environment["PATH"] = f"{cmake_folder()}:{environment['PATH']}"
    except RuntimeError as error:
        return built(name, BUILT, str(error))
    print(f"ring bench: compiling {PEERS[name][0]} (minutes the first time)", flush=True)
    command = ["cargo", "build", "--release", "--locked", "--quiet", "--features", name, "--bin", f"peer_{name}"]
    return built(name, target / f"release/peer_{name}", store.failure(command, cwd=SOURCES, env=environment))


def programs(build: Path) -> dict[str, Path]:
    """The programs there are. What cannot be built is left out alone, with its own error."""
    found = {
        "whisker": build_c("whisker", [str(build / "host/libwhisker/libwhisker.a")]),
        "memory": build_c("memory", []),
        "lcm": build_linked("lcm", "lcm", "liblcm-dev"),
        "zeromq": build_linked("zeromq", "libzmq", "libzmq3-dev"),
        **{name: build_rust(name) for name in ("iceoryx2", "zenoh", "aeron")},
    }
    return {name: found[name] for name in found if found[name]}


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


ROUNDS = 3  # each setting again, in turn with the others, so that a busy minute of the machine hits all alike
SECONDS = {"2khz": 3.0, "flat": 2.0, "free": 2.0}
QUANTILES = {"p50": 50, "p90": 90, "p99": 99, "p99.9": 99.9}


def settings(found: dict[str, Path]) -> list[tuple[str, str, str, int]]:
    rows = [
        (peer, mode, pace, readers)
        for pace in ("2khz", "flat")
        for readers in READERS
        for peer in found
        for mode in PEERS[peer][2]
        if pace == "2khz" or peer != "memory"
    ]
    rows += [("whisker", mode, "free", readers) for readers in (0, *READERS) for mode in ("poll", "wait")]
    rows += [(peer, "poll", "2khz", 0) for peer in found]
    return rows


def measure(found: dict[str, Path], rounds: int, scale: float) -> list[dict]:
    rows = settings(found)
    done: dict[tuple, list[dict]] = {row: [] for row in rows}
    with tqdm(total=rounds * len(rows), desc="ring", unit="run") as bar:
        for turn in range(rounds):
            for row in rows:
                peer, mode, pace, readers = row
                bar.set_postfix_str(f"{peer} {mode} {pace} {readers}")
                run = Run(found[peer], mode, pace, readers, SECONDS[pace] * scale)
                path = RUNS / f"{peer}_{mode}_{pace}_{readers}_{turn}_{scale:g}.json"
                done[row].append(store.once(path, run.measure))
                bar.update()
    return [summary(*row, done[row]) for row in rows]


def summary(peer: str, mode: str, pace: str, readers: int, runs: list[dict]) -> dict:
    """The rounds of a setting: latencies pooled, rates as the median round."""
    counts: dict[str, int] = {}
    for run in runs:
        for bin_, n in run["latency_ns"].items():
            counts[bin_] = counts.get(bin_, 0) + n
    return {
        "peer": peer,
        "mode": mode,
        "pace": pace,
        "readers": readers,
        "sent_per_s": float(np.median([run["sent"] / run["seconds"] for run in runs])),
        "delivered_per_s": float(np.median([min(run["received"] or [0]) / run["seconds"] for run in runs])),
        "publish_ns": float(np.median([run["publish_ns"] for run in runs])),
        "lost": sum(run["lost"] for run in runs),
        "bad": sum(run["bad"] for run in runs),
        "latency_us": {name: quantile(counts, p) for name, p in QUANTILES.items()} if counts else {},
    }


def save(rows: list[dict], left_out: list[str], rounds: int) -> None:
    versions = [line.strip() for line in (SOURCES / "Cargo.toml").read_text().splitlines() if "version = " in line]
    data = {
        "cores": len(os.sched_getaffinity(0)),
        "frame_bytes": 256,
        "rounds": rounds,
        "seconds": SECONDS,
        "versions": versions,
        "left_out": left_out,
        "rows": rows,
    }
    store.write_result("ring", data)


def run(build: Path, rounds: int = ROUNDS, scale: float = 1.0) -> None:
    """Measure what is not measured yet."""
    found = programs(build.resolve())
    save(measure(found, rounds, scale), sorted(PEERS.keys() - found.keys()), rounds)


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--scale", type=float, default=1.0, help="shorten every run to this share, to try things out")
