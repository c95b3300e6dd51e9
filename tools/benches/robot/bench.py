"""The whole robot: the same scenes at every level of simulation, and half an hour of it.

    .venv/bin/python tools/benches robot                       all of it: two hours and more, most of it the RTL level
    .venv/bin/python tools/benches robot --only levels         one part; --levels 0 1: of the levels only the fast ones

An interrupted run goes on where it stopped, seed by seed.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from crunchbot.stopping import interrupt_on_signals
from crunchbot_lab.report import figures, long_figures
from crunchbot_lab.report.run import Run

from .. import store
from . import levels as simulated

CACHE = store.kept("robot")
LONG_RUNS = (("signals", 7301), ("signals", 7302), ("signals", 7303), ("bytes", 7301))
LEVELS = (0, 1, 2, 3)
PARTS = ("long", "levels")


def long_run(build: Path, level: str, seed: int) -> dict:
    """The summary of a demo-long."""
    out = CACHE / f"long_{level}_{seed}"
    command = [sys.executable, "-m", "crunchbot_lab.demo.long", "--level", level, "--seed", seed, "--out", out]
    subprocess.run([str(word) for word in [*command, "--build-dir", build]], check=True, stdout=subprocess.DEVNULL)
    return json.loads((out / "summary.json").read_text())


def long(build: Path) -> None:
    found = {}
    for level, seed in LONG_RUNS:
        path = CACHE / f"long_{level}_{seed}.json"
        found[f"{level}, seed {seed}"] = store.once(path, lambda at=(level, seed): long_run(build, *at))
    store.write_result("robot_long", found)
    store.write_chart("robot_long", figures.svg(long_figures.errors, Run.load(CACHE / "long_bytes_7301")))


def run(build: Path, only: Sequence[str] = PARTS, levels: Sequence[int] = LEVELS) -> None:
    interrupt_on_signals()  # a run that is ended leaves no process behind
    if "long" in only:
        long(build)
    if "levels" in only:
        simulated.measure(build, CACHE / "levels", set(levels))
        store.write_result("robot_levels", simulated.gather(CACHE / "levels"))


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS, metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--levels", nargs="+", type=int, choices=LEVELS, default=LEVELS, help="of the part levels")
