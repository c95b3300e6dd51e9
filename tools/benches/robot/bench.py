"""The whole robot: levels of simulation, half an hour, odometry, latency, instructions; docs/results/robot.md.

    .venv/bin/python tools/benches robot                       all of it: two hours and more, most of it the RTL level
    .venv/bin/python tools/benches robot --only levels page    some parts; --levels 0 1: of the levels only the fast
    ones

An interrupted run goes on where it stopped, seed by seed; `page` shows what there is so far.
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
from . import instructions, latency, levels, odometry, page

ROOT = Path(__file__).resolve().parents[3]
RESULTS, CACHE = store.RESULTS, store.kept("robot")
LONG_RUNS = (("signals", 7301), ("signals", 7302), ("signals", 7303), ("bytes", 7301))
LEVELS = (0, 1, 2, 3)
ALONE = ("odometry", "latency", "instructions")  # parts whose results stand in one file


def long_run(build: Path, level: str, seed: int) -> dict:
    """The summary of a demo-long."""
    out = CACHE / f"long_{level}_{seed}"
    command = [sys.executable, "-m", "crunchbot_lab.demo.long", "--level", level, "--seed", seed, "--out", out]
    subprocess.run([str(word) for word in [*command, "--build-dir", build]], check=True, stdout=subprocess.DEVNULL)
    return json.loads((out / "summary.json").read_text())


def models() -> Path:
    """Of the robot that the levels are compared with."""
    case = next(case for case in levels.CASES if case.name == levels.DEFAULT)
    return levels.Bench(case, levels.FIRST_SEED, Path(), CACHE / "levels/models").learnt()


def measure(build: Path, part: str, chosen: set[int]) -> None:
    """One part into the cache."""
    if part == "levels":
        levels.measure(build, CACHE / "levels", chosen)
    elif part == "long":
        for level, seed in LONG_RUNS:
            store.once(CACHE / f"long_{level}_{seed}.json", lambda level=level, seed=seed: long_run(build, level, seed))
    elif part == "odometry":
        store.once(CACHE / "odometry.json", lambda: odometry.measure(build))
    elif part == "latency":
        store.once(CACHE / "latency.json", lambda: latency.measure(models()))
    elif part == "instructions":
        store.once(CACHE / "instructions.json", lambda: instructions.measure(build, models()))


def gather() -> dict:
    """Everything measured so far, by part: here, or else what has been published.

    Levels are compared seed by seed: those measured here stand alone.
    """
    found = {part: data for part in (*ALONE, "long", "levels") if (data := read(RESULTS / f"robot_{part}.json"))}
    found |= {part: data for part in ALONE if (data := read(CACHE / f"{part}.json"))}
    paths = {f"{level}, seed {seed}": CACHE / f"long_{level}_{seed}.json" for level, seed in LONG_RUNS}
    found["long"] = found.get("long", {}) | {name: data for name, path in paths.items() if (data := read(path))}
    made = levels.gather(CACHE / "levels")
    return found | ({"levels": made} if made["levels"] or "levels" not in found else {})


def read(path: Path) -> dict | None:
    """Results in a file; None when there is none."""
    return json.loads(path.read_text()) if path.exists() else None


def publish() -> None:
    """Results, charts and the page, of what there is."""
    found = gather()
    drawings = {"levels": levels, "odometry": odometry, "latency": latency}
    for part, module in drawings.items():
        for name, draw in module.DRAWINGS.items() if part in found else ():
            store.write_chart(name, figures.svg(draw, found[part]))
    shown = CACHE / "long_bytes_7301"
    if shown.is_dir():
        store.write_chart("robot_long", figures.svg(long_figures.errors, Run.load(shown)))
    for part, data in found.items():
        if read(RESULTS / f"robot_{part}.json") != data:
            store.write_result(f"robot_{part}", data)
    store.write_page(ROOT / "docs/results/robot.md", page.page(found))


PARTS = ("odometry", "levels", "latency", "instructions", "long", "page")


def run(build: Path, only: Sequence[str] = PARTS, levels: Sequence[int] = LEVELS) -> None:
    interrupt_on_signals()  # a run that is ended leaves no process behind
    for part in only:
        measure(build, part, set(levels))
    publish()


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS, metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--levels", nargs="+", type=int, choices=LEVELS, default=LEVELS, help="of the part levels")
