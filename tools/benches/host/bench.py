"""Measures the host's device side: whiskerd's instructions, the clock mapping.

- Instructions: valgrind counts whiskerd's at 28 populated lanes, as the difference between a short and a long run, by
  library; umockdev's are left out, what the kernel would do is not in. libusb's are an upper bound: under umockdev it
  is woken also when there is nothing.
- Clock: an hour of the synthetic trace of the library's test.
"""

import csv
import io
import os
import re
import shutil
import subprocess
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np
from tqdm import tqdm

from crunchbot_lab.simulation.scenes import make_scene
from whisker_protocol import LANES, LIMITS

from .. import store

ROOT = Path(__file__).resolve().parents[3]
CACHE = store.kept("host")
HZ = LIMITS["clock_hz"] // LIMITS["tick_period"]
ATOM_HZ = 0.8e9  # instructions per second of the paper's netbook
LINK = ("--sck-divider", "6", "--word-gap", "30", "--sample-point", "5")
COUNTED_S = (1, 4)  # simulated seconds of the two counted runs
BATCHES = (2, 4, 8, 16)
CLOCK_SEEDS = (101, 102, 103)


def program(build: Path, name: str) -> str:
    return str(next(path for path in build.rglob(name) if path.is_file() and os.access(path, os.X_OK)))


def simulation(build: Path, folder: Path, seconds: int, *options) -> list[str]:
    scene, start = make_scene(1)
    path = folder / "scene.flat"
    path.write_text(scene.flat(start))
    words = ["umockdev-wrapper", program(build, "whisker-bridge-sim"), "--scene", path, "--seconds", seconds]
    return [str(word) for word in [*words, "--lanes-populated", LANES, *options, "--"]]


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
    results: dict = {}
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
