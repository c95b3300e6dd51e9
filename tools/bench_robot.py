#!/usr/bin/env python3
"""The whole robot: levels of simulation, half an hour, odometry, latency, instructions; docs/results_robot.md.

    .venv/bin/python tools/bench_robot.py                       all of it: two hours and more, most of it the RTL level
    .venv/bin/python tools/bench_robot.py --only levels page    some parts; --levels 0 1: of the levels only the fast ones

What is done is kept in build/bench/robot: an interrupted run goes on where it stopped, seed by seed; `page` tells what there is so far.
"""

import argparse
import json
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import matplotlib
import robot_instructions
import robot_latency
import robot_levels
import robot_odometry
import robot_page

from whisker.report import figures, long_figures
from whisker.report.run import Run

ROOT = Path(__file__).resolve().parent.parent
RESULTS, CHARTS, CACHE = ROOT / "bench/results", ROOT / "docs/charts", ROOT / "build/bench/robot"
LONG_RUNS = (("signals", 7301), ("signals", 7302), ("signals", 7303), ("bytes", 7301))
LEVELS = (0, 1, 2, 3)


def once(path: Path, measure: Callable[[], dict]) -> dict:
    """A measurement, from the cache if an earlier run has made it."""
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(measure(), indent=1) + "\n")
    return json.loads(path.read_text())


def long_run(build: Path, level: str, seed: int) -> dict:
    """The summary of a demo-long."""
    out = CACHE / f"long_{level}_{seed}"
    command = [sys.executable, "-m", "whisker.demo.long", "--level", level, "--seed", seed, "--out", out]
    subprocess.run([str(word) for word in [*command, "--build-dir", build]], check=True, stdout=subprocess.DEVNULL)
    return json.loads((out / "summary.json").read_text())


def models() -> Path:
    """Of the robot that the levels are compared with."""
    case = next(case for case in robot_levels.CASES if case.name == robot_levels.SIGNALS_AUTO)
    return robot_levels.Bench(case, robot_levels.FIRST_SEED, Path(), CACHE / "levels/models").learnt()


def measure(build: Path, part: str, levels: set[int]) -> None:
    """One part into the cache."""
    if part == "levels":
        robot_levels.measure(build, CACHE / "levels", levels)
    elif part == "long":
        for level, seed in LONG_RUNS:
            once(CACHE / f"long_{level}_{seed}.json", lambda level=level, seed=seed: long_run(build, level, seed))
    elif part == "odometry":
        once(CACHE / "odometry.json", lambda: robot_odometry.measure(build))
    elif part == "latency":
        once(CACHE / "latency.json", lambda: robot_latency.measure(models()))
    elif part == "instructions":
        once(CACHE / "instructions.json", lambda: robot_instructions.measure(build, models()))


def gather() -> dict:
    """Everything measured so far, by part."""
    found = {part: CACHE / f"{part}.json" for part in ("odometry", "latency", "instructions")}
    found = {part: json.loads(path.read_text()) for part, path in found.items() if path.exists()}
    paths = {f"{level}, seed {seed}": CACHE / f"long_{level}_{seed}.json" for level, seed in LONG_RUNS}
    found["long"] = {name: json.loads(path.read_text()) for name, path in paths.items() if path.exists()}
    return {"levels": robot_levels.gather(CACHE / "levels")} | found


def save(name: str, draw: Callable, data) -> None:
    """A chart in both its forms."""
    (CHARTS / f"{name}.svg").write_text(figures.svg(draw, data))
    figures.png(draw, data, CHARTS / f"{name}.png")


def publish() -> None:
    """Results, charts and the page, of what there is."""
    found = gather()
    drawings = {"levels": robot_levels, "odometry": robot_odometry, "latency": robot_latency}
    for part, module in drawings.items():
        for name, draw in module.DRAWINGS.items() if part in found else ():
            save(name, draw, found[part])
    shown = next((path for level, seed in LONG_RUNS if (path := CACHE / f"long_{level}_{seed}").is_dir()), None)
    if shown:
        save("robot_long", long_figures.errors, Run.load(shown))
    for part, data in found.items():
        (RESULTS / f"robot_{part}.json").write_text(json.dumps(data, indent=1) + "\n")
    (ROOT / "docs/results_robot.md").write_text(robot_page.page(found))
    print("bench/results/robot_*.json, docs/charts/robot_*.svg, docs/results_robot.md")


PARTS = ("odometry", "levels", "latency", "instructions", "long", "page")


def run(build: Path, fresh: bool, parts: tuple[str, ...] = PARTS, levels: tuple[int, ...] = LEVELS) -> None:
    if fresh:
        shutil.rmtree(CACHE, ignore_errors=True)
    for part in parts:
        measure(build, part, set(levels))
    publish()


def main() -> int:
    matplotlib.rcParams["svg.hashsalt"] = "whisker"  # same data, same file
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build-dir", type=Path, default=ROOT / "build/release")
    parser.add_argument("--fresh", action="store_true", help="forget what an interrupted run has measured")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS, metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--levels", nargs="+", type=int, choices=LEVELS, default=LEVELS, help="of the part levels")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a run that is ended leaves no process behind
    run(options.build_dir.resolve(), options.fresh, tuple(options.only), tuple(options.levels))
    return 0


if __name__ == "__main__":
    sys.exit(main())
