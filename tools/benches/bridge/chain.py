"""Measures the whole chain at RTL level and the demo's localisation: speed as a ratio to real time, errors beside it.

A filter's cost is its time per observation row beside the 0.1 s in which a robot must have its answer.
"""

import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

from crunchbot.nav import localise
from crunchbot.observation import cell
from crunchbot.pilot.pilot import Pilot
from crunchbot.robot.models import load_models
from crunchbot_lab.demo.level1 import explore
from crunchbot_lab.demo.training import learn
from crunchbot_lab.report import figures
from crunchbot_lab.report.run import Run
from crunchbot_lab.simulation.scenes import make_scene

from .. import store

ROOT = Path(__file__).resolve().parents[3]
CACHE = store.kept("chain")
ROW_S = 0.1
BENCH_SECONDS = 5
CHAIN_SECONDS = 60
CHAIN_LANES = (6, 28)
DEMO = CACHE / "demo"  # the six-lane run, whose figures go into the documents
LANES = (1, 6, 14, 28)
LINKS = {"SCK/6, gap 0.5 us": (6, 30, 5), "SCK/16, gap 3 us (hardware)": (16, 180, 8)}
SEEDS = tuple(range(101, 109))
TICKS = 120_000
FILTERS = {
    "odometry": ("odometry", {}),
    "foveal 11x11x11": ("foveal", {}),
    "grid 10 cm x 20 deg": ("grid", {"grid.cell_m": 0.1, "grid.cell_deg": 20.0}),
    "grid 5 cm x 10 deg": ("grid", {}),
    "grid 2.5 cm x 5 deg": ("grid", {"grid.cell_m": 0.025, "grid.cell_deg": 5.0}),
}


# ---------------------------------------------------------------------------------------------------------------------
# the chain


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


def draw_chain(chain: dict) -> Figure:
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    for (title, points), style in zip(chain["bridge"].items(), ("o-", "s--"), strict=True):
        axes.plot(
            [p["lanes"] for p in points],
            [p["realtime_factor"] for p in points],
            style,
            label=f"bridge and nodes, {title}",
        )
    points = chain["whole_chain"]
    axes.plot(
        [p["lanes"] for p in points],
        [p["realtime_factor"] for p in points],
        "^:",
        label="whole chain to the pilot, SCK/6",
    )
    axes.axhline(1.0, color="0.3", linewidth=1)
    axes.annotate("real time", (1, 1.0), textcoords="offset points", xytext=(0, 4), color="0.3")
    axes.set(xlabel="populated lanes", ylabel="simulated seconds per wall second", ylim=(0, None), xticks=LANES)
    axes.legend(frameon=False)
    return figure


# ---------------------------------------------------------------------------------------------------------------------
# localisation


def localisation(seed: int) -> dict:
    """Every filter on the observations of one exploration at level 1: median position error and time per row."""
    scene, start = make_scene(seed)
    with tempfile.TemporaryDirectory() as folder:
        learn(Path(folder) / "models", scene, seed, lambda: None)
        pilot = Pilot(scene.robot, *load_models(Path(folder) / "models", scene.robot), seed)
        rows, truth = explore(scene, start, pilot, seed, TICKS)
        path = Path(folder) / "observations.csv"
        write_rows(path, rows, truth)
        observations = localise.read_observations(path, scene)
    return {title: _judge(scene, observations, *spec) for title, spec in FILTERS.items()}


def write_rows(path: Path, rows: list[dict], truth: list[dict]) -> None:
    """observations.csv (docs/formats.md), with the truth."""
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*rows[0], *localise.TRUTH])
        for row, true in zip(rows, truth, strict=True):
            writer.writerow([*map(cell, row.values()), *(true[key.removeprefix("true_")] for key in localise.TRUTH)])


def _judge(scene, observations: localise.Observations, name: str, settings: dict) -> dict:
    run = localise.run(name, scene, observations, settings)
    return {
        "error_median_m": localise.pose_errors(run.poses, observations.truth)["pose_error_median_m"],
        "step_us_mean": float(np.mean(run.step_us)),
        "step_us_p99": float(np.percentile(run.step_us, 99)),
        "share_of_row": float(np.mean(run.step_us) * 1e-6 / ROW_S),
    }


def measure_localisation() -> dict:
    return {
        str(seed): store.once(CACHE / f"localisation_{seed}.json", lambda s=seed: localisation(s))
        for seed in tqdm(SEEDS, desc="localisation", unit="seed")
    }


def draw_localisation(runs: dict) -> Figure:
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    for title, marker in zip(FILTERS, "sv^oD", strict=True):
        cost = [run[title]["step_us_mean"] for run in runs.values()]
        error = [run[title]["error_median_m"] for run in runs.values()]
        axes.plot(cost, error, marker, color="0.7", markersize=4)
        axes.plot(np.median(cost), np.median(error), marker, markersize=10, label=title)
    axes.axhline(0.08, color="0.3", linewidth=1, linestyle=":")
    axes.annotate("goal: 0.08 m", (1.0, 0.08), xycoords=("axes fraction", "data"), ha="right", va="bottom", color="0.3")
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="mean time per 0.1 s row (us, one core)",
        ylabel="median position error over 60 s (m)",
    )
    axes.legend(frameon=False, fontsize=8)
    return figure


def save(name: str, data: dict, figure: Figure) -> None:
    store.write_result(name, data)
    store.write_chart(name, figure)


def save_demo() -> None:
    """The report's figures of the six-lane run, for the documents."""
    run = Run.load(DEMO)
    for draw in (figures.arena, figures.errors, figures.texture, figures.radial):
        store.write_chart(f"demo_{draw.__name__}", figures.svg(draw, run))
    store.write_result("demo", json.loads((DEMO / "summary.json").read_text()))


def run(build: Path) -> None:
    chain = measure_chain(build)
    save("chain_speed", chain, draw_chain(chain))
    save_demo()
    runs = measure_localisation()
    save("localisation", runs, draw_localisation(runs))
