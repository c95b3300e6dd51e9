"""Measures the host's device side: cable to samples, whiskerd's instructions and memory, the clock mapping.

    .venv/bin/python tools/benches host        bench/results/host.json

- Times: a simulated bridge (RTL, umockdev with its udev events, real libusb and hidapi) is plugged in, pulled and put
  back; watched from a reader of the ring. They hold the simulation's own work: its enumeration, and frames at its
  speed.
- Instructions: valgrind counts whiskerd's at 28 populated lanes, as the difference between a short and a long run, by
  library; umockdev's are left out, what the kernel would do is not in. libusb's are an upper bound: under umockdev it
  is woken also when there is nothing.
- Memory: of whiskerd while it streams. Clock: an hour of the synthetic trace of the library's test.
"""

import csv
import io
import os
import re
import shutil
import socket
import subprocess
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from tqdm import tqdm

from crunchbot.bridge.ring import Reader
from crunchbot_lab.simulation.scenes import make_scene
from whisker_protocol import LANES, LIMITS

from .. import store

ROOT = Path(__file__).resolve().parents[3]
CACHE = store.kept("host")
HZ = LIMITS["clock_hz"] // LIMITS["tick_period"]
ATOM_HZ = 0.8e9  # instructions per second of the paper's netbook
LINK = ("--sck-divider", "6", "--word-gap", "30", "--sample-point", "5")
LONG_S = 600  # simulated; the runs are ended before
CYCLES = 10  # pulls and puts of the cable
COUNTED_S = (1, 4)  # simulated seconds of the two counted runs
BATCHES = (2, 4, 8, 16)
SETTLE = 400  # frames after which a stream counts as up
LOOK_S = 0.0002
PATIENCE_S = 60
CLOCK_SEEDS = (101, 102, 103)


def program(build: Path, name: str) -> str:
    return str(next(path for path in build.rglob(name) if path.is_file() and os.access(path, os.X_OK)))


def simulation(build: Path, folder: Path, seconds: int, *options) -> list[str]:
    scene, start = make_scene(1)
    path = folder / "scene.flat"
    path.write_text(scene.flat(start))
    words = ["umockdev-wrapper", program(build, "whisker-bridge-sim"), "--scene", path, "--seconds", seconds]
    return [str(word) for word in [*words, "--lanes-populated", LANES, *options, "--"]]


# ---------------------------------------------------------------------------------------------------------------------
# cable


@contextmanager
def bridge(build: Path, *options) -> Iterator[tuple[socket.socket, Reader]]:
    """A simulated bridge with whiskerd: the socket that pulls its cable, and a reader of its ring."""
    ring = f"whisker-bench-{os.getpid()}"
    with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as link:
        path = Path(folder) / "sim.sock"
        command = simulation(build, Path(folder), LONG_S, "--socket", path, *options)
        command += [program(build, "whiskerd"), "--ring", ring, "--wait", *LINK]
        process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        try:
            until(lambda: link.connect_ex(str(path)) == 0)
            with Reader(ring, wait_s=PATIENCE_S) as reader:
                yield link, reader
        finally:
            process.terminate()
            process.wait(PATIENCE_S)


def until(condition: Callable[[], bool]) -> None:
    give_up = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > give_up:
            raise RuntimeError("bench_host: the bridge does not react; run tests/chain/test_daemon.py")
        time.sleep(LOOK_S)


def connected(reader: Reader) -> bool:
    stats = reader.stats
    return stats is not None and stats.connected == 1


def timed(link: socket.socket, message: str, happened: Callable[[], bool]) -> float:
    """Seconds from a word to the cable until it shows."""
    begin = time.monotonic()
    link.send(message.encode())
    until(happened)
    return time.monotonic() - begin


def more(reader: Reader, count: int) -> Callable[[], bool]:
    wanted = reader.info.published + count
    return lambda: reader.info.published >= wanted


def cable_times(build: Path) -> dict:
    """Seconds of each event, CYCLES times."""
    times = defaultdict(list)
    for _ in tqdm(range(CYCLES), desc="plug in", unit="time"):
        with bridge(build, "--unplugged") as (link, reader):
            until(lambda reader=reader: reader.stats is not None)
            times["plug"].append(timed(link, "plug", more(reader, 1)))
    with bridge(build) as (link, reader):
        for _ in tqdm(range(CYCLES), desc="pull, put back", unit="time"):
            until(more(reader, SETTLE))
            times["unplug"].append(timed(link, "unplug", lambda: not connected(reader)))
            times["replug"].append(timed(link, "plug", more(reader, 1)))
    return dict(times)


def memory(build: Path) -> dict:
    """Bytes of whiskerd while it streams: resident, of which its own (private), and of which the ring and libraries."""
    with bridge(build) as (_, reader):
        until(more(reader, SETTLE))
        rollup = Path("/proc", str(reader.info.writer_pid), "smaps_rollup").read_text()
        ring_bytes = reader.info.capacity * 256
    kib = {name: int(value) for name, value in re.findall(r"^(\w+): +(\d+) kB$", rollup, re.MULTILINE)}
    return {
        "resident_bytes": 1024 * kib["Rss"],
        "private_dirty_bytes": 1024 * kib["Private_Dirty"],
        "ring_bytes": ring_bytes,
    }


# ---------------------------------------------------------------------------------------------------------------------
# instructions


def by_library(profile: str) -> dict[str, int]:
    """Instructions by object file of a callgrind profile: self cost, calls' inclusive lines left out."""
    names, totals, library, skip = {}, defaultdict(int), "", False
    for line in profile.splitlines():
        if match := re.match(r"ob=\((\d+)\)(?: (.*))?", line):
            names.setdefault(match[1], match[2] or "")
            library = Path(names[match[1]]).name
        elif match := re.match(r"cob=\((\d+)\) (.*)", line):
            names.setdefault(match[1], match[2])
        elif line.startswith("calls="):
            skip = True
        elif re.match(r"[+*\-\d]\S* \d+$", line):
            totals[library] += 0 if skip else int(line.split()[1])
            skip = False
    return dict(totals)


def group(library: str) -> str | None:
    """The name under which a library is shown; None: not counted."""
    if "umockdev" in library:
        return None
    for name in ("whisker", "libusb", "hidapi"):
        if name in library:
            return {"whisker": "libwhisker and whiskerd"}.get(name, name)
    return "libc and others"


def counted(build: Path, seconds: int, batch: int) -> dict[str, int]:
    """Instructions of a run of whiskerd, by group of libraries."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "callgrind.out"
        command = simulation(build, Path(folder), seconds)
        command += ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", program(build, "whiskerd")]
        command += ["--ring", f"whisker-count-{os.getpid()}", "--batch", str(batch), *LINK]
        subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
        totals = defaultdict(int)
        for library, count in by_library(out.read_text()).items():
            if name := group(library):
                totals[name] += count
    return totals


def instructions(build: Path, batch: int) -> dict:
    """Instructions per frame in batches of this size, by group of libraries."""
    short, long = (counted(build, seconds, batch) for seconds in COUNTED_S)
    frames = (COUNTED_S[1] - COUNTED_S[0]) * HZ
    return {name: (long[name] - short.get(name, 0)) / frames for name in sorted(long)}


# ---------------------------------------------------------------------------------------------------------------------
# clock


def clock(build: Path, seed: int) -> dict:
    """An hour of a synthetic trace: largest error after five seconds, share of moments within the uncertainty."""
    text = subprocess.run([program(build, "clock_chart"), str(seed)], check=True, capture_output=True, text=True).stdout
    rows = {name: np.array(values) for name, values in columns(text).items()}
    settled = rows["t_s"] > 5
    error = np.abs(rows["error_us"][settled])
    return {
        "error_us_max": float(error.max()),
        "covered": float(np.mean(error <= rows["uncertainty_us"][settled])),
        "delay_us_max": float(rows["delay_us"].max()),
    }


def columns(text: str) -> dict[str, list[float]]:
    rows = list(csv.DictReader(io.StringIO(text)))
    return {name: [float(row[name]) for row in rows] for name in rows[0]}


def run(build: Path) -> None:
    """Measure what is not measured yet, write results."""
    times = store.once(CACHE / "cable.json", lambda: cable_times(build))
    results = {
        "times_s": {event: {"median": float(np.median(t)), "max": max(t), "n": len(t)} for event, t in times.items()},
        "memory": store.once(CACHE / "memory.json", lambda: memory(build)),
    }
    if shutil.which("valgrind"):
        counts = {
            str(b): store.once(CACHE / f"instructions_{b}.json", lambda b=b: instructions(build, b))
            for b in tqdm(BATCHES, desc="instructions", unit="batch")
        }
        results["lanes"], results["rate_hz"] = LANES, HZ
        results["instructions_per_frame"] = {
            batch: {**count, "total": sum(count.values()), "atom_share": sum(count.values()) * HZ / ATOM_HZ}
            for batch, count in counts.items()
        }
    else:
        results["instructions_per_frame"] = "skipped: valgrind is not on this machine"
    clocks = {
        str(seed): store.once(CACHE / f"clock_{seed}.json", lambda s=seed: clock(build, s)) for seed in CLOCK_SEEDS
    }
    results["clock"] = clocks
    store.write_result("host", results)
