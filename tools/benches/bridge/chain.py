"""Measures the whole chain at RTL level and the demo's localisation: speed as a ratio to real time, errors beside it.

A filter's cost is its time per observation row beside the 0.1 s in which a robot must have its answer.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from tqdm import tqdm

from crunchbot_lab.report import figures
from crunchbot_lab.report.run import Run

from .. import store

CACHE = store.kept("chain")
BENCH_SECONDS = 5
CHAIN_SECONDS = 60
CHAIN_LANES = (6, 28)
DEMO = CACHE / "demo"  # the six-lane run, whose figures go into the documents
LANES = (1, 6, 14, 28)
LINKS = {"SCK/6, gap 0.5 us": (6, 30, 5), "SCK/16, gap 3 us (hardware)": (16, 180, 8)}


def bridge_speed(build: Path, lanes: int, link: tuple[int, int, int]) -> dict:
    """RTL and nodes alone, every frame checked by an internal host."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "speed.json"
        command = [build / "sim/robot/whisker-bridge-sim", "--bench", "--seconds", BENCH_SECONDS]
        command += ["--lanes-populated", lanes, "--speed-report", report]
        command += ["--sck-divider", link[0], "--word-gap", link[1], "--sample-point", link[2]]
        subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)
        speed = json.loads(report.read_text())
    return {"lanes": lanes, "cycles_per_tick": speed["cycles_per_tick"], "realtime_factor": speed["realtime_factor"]}


def chain_speed(build: Path, lanes: int) -> dict:
    """The whole chain: whiskerd under umockdev, whisker-log, pilot and navigator beside it, faults injected."""
    out = DEMO.with_name(f"demo_{lanes}") if lanes != CHAIN_LANES[0] else DEMO
    command = [sys.executable, "-m", "crunchbot_lab.demo", "--out", out, "--build-dir", build, "--lanes", lanes]
    subprocess.run(
        [str(word) for word in [*command, "--level", "rtl", "--seconds", CHAIN_SECONDS]],
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    speed = json.loads((out / "speed.json").read_text())
    summary = json.loads((out / "summary.json").read_text())
    return {"lanes": lanes, "frames_lost": summary["frames_lost"], "realtime_factor": speed["realtime_factor"]}


def measure_chain(build: Path) -> dict:
    jobs = [
        (f"bridge_{n}_{link[0]}", lambda n=n, link=link: bridge_speed(build, n, link))
        for link in LINKS.values()
        for n in LANES
    ]
    jobs += [(f"chain_{n}", lambda n=n: chain_speed(build, n)) for n in CHAIN_LANES]
    done = {name: store.once(CACHE / f"{name}.json", job) for name, job in tqdm(jobs, desc="chain", unit="run")}
    bridge = {title: [done[f"bridge_{n}_{link[0]}"] for n in LANES] for title, link in LINKS.items()}
    return {"bridge": bridge, "whole_chain": [done[f"chain_{n}"] for n in CHAIN_LANES]}


def save_demo() -> None:
    """The report's figures of the six-lane run, for the documents."""
    run = Run.load(DEMO)
    for draw in (figures.arena, figures.errors, figures.texture, figures.radial):
        store.write_chart(f"demo_{draw.__name__}", figures.svg(draw, run))
    store.write_result("demo", json.loads((DEMO / "summary.json").read_text()))


def run(build: Path) -> None:
    store.write_result("chain_speed", measure_chain(build))
    save_demo()
