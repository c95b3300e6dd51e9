"""The whole robot for half an hour: `make demo-long`, the pose error of every estimate.

An interrupted run goes on where it stopped, seed by seed.
"""

import json
import subprocess
import sys
from pathlib import Path

from crunchbot.stopping import interrupt_on_signals
from crunchbot_lab.report import figures, long_figures
from crunchbot_lab.report.run import Run

from .. import store

CACHE = store.kept("robot")
RUNS = (("signals", 7301), ("signals", 7302), ("signals", 7303), ("bytes", 7301))


def long_run(build: Path, level: str, seed: int) -> dict:
    """The summary of a demo-long."""
    out = CACHE / f"long_{level}_{seed}"
    command = [sys.executable, "-m", "crunchbot_lab.demo.long", "--level", level, "--seed", seed, "--out", out]
    subprocess.run([str(word) for word in [*command, "--build-dir", build]], check=True, stdout=subprocess.DEVNULL)
    return json.loads((out / "summary.json").read_text())


def run(build: Path) -> None:
    interrupt_on_signals()  # a run that is ended leaves no process behind
    found = {}
    for level, seed in RUNS:
        path = CACHE / f"long_{level}_{seed}.json"
        found[f"{level}, seed {seed}"] = store.once(path, lambda at=(level, seed): long_run(build, *at))
    store.write_result("robot_long", found)
    store.write_chart("robot_long", figures.svg(long_figures.errors, Run.load(CACHE / "long_bytes_7301")))
