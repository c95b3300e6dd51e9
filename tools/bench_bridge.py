#!/usr/bin/env python3
"""The bridge in an FPGA and in simulation: lanes against resources, clock, cycles per tick and speed; five seeds per board.

Place and route takes minutes each, an hour in all; every one is kept in build/bench/bridge, so that an interrupted run goes on
where it stopped. Timing figures are nextpnr's own; the limits of the PHY's pins are those of fpga/boards/report.py.
"""

import argparse
import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import matplotlib
from bench_chain import LANES, LINKS, bridge_speed
from matplotlib.figure import Figure
from tqdm import tqdm

ROOT = Path(__file__).resolve().parent.parent
RESULTS, CHARTS, CACHE = ROOT / "bench/results", ROOT / "docs/charts", ROOT / "build/bench/bridge"
sys.path.insert(0, str(ROOT / "fpga" / "boards"))

import build as boards  # noqa: E402
import report  # noqa: E402

from whisker.protocol import FRAME_BYTES, LIMITS  # noqa: E402

SWEPT = "colorlight_i9"  # has pins for every number of lanes
SEEDS = tuple(range(1, 6))
FRAMER_CYCLES = 5  # as fpga/tb/bridge has it


def once(name: str, measure: Callable[[], dict]) -> dict:
    """A measurement, from the cache if an earlier run has made it."""
    path = CACHE / f"{name}.json"
    if not path.exists():
        value = measure()
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(value, indent=1) + "\n")
    return json.loads(path.read_text())


def placed(name: str, lanes: int, seed: int) -> dict:
    """One place and route; the netlist is made once per board and number of lanes."""
    board = boards.load(name)
    out = CACHE / f"{name}_{lanes}"
    netlist = out / "netlist.json"
    if not netlist.exists():
        boards.prepare(board, lanes, out)
    found = boards.place(board, lanes, netlist, out, seed)
    return {**found, "problems": report.timing_problems(found, board.speed, board.phy_clock)}


def fabric() -> dict:
    """Five seeds per board, and the sweep over lanes."""
    jobs = [(name, boards.load(name).lanes, seed) for seed in SEEDS for name in boards.boards()]
    jobs += [(SWEPT, lanes, SEEDS[0]) for lanes in LANES if lanes != boards.load(SWEPT).lanes]
    done = {}
    for name, lanes, seed in tqdm(jobs, desc="place and route", unit="run"):
        done[name, lanes, seed] = once(f"{name}_{lanes}_{seed}", lambda j=(name, lanes, seed): placed(*j))
    return {
        "seeds": {name: seeds_of(done, name) for name in boards.boards()},
        "lanes": [{"lanes": n, **done[SWEPT, n, SEEDS[0]]} for n in LANES],
    }


def seeds_of(done: dict, name: str) -> dict:
    """A board's five results beside its limits."""
    board = boards.load(name)
    runs = [done[name, board.lanes, seed] for seed in SEEDS]
    facts = {key: getattr(board, key) for key in ("title", "part", "speed", "lanes")}
    return {**facts, "limits": report.pin_limits(board.speed, board.phy_clock), "runs": runs}


def transfer_cycles(link: tuple[int, int, int]) -> int:
    """One tick on the nodes' bus: SYNC, set-up, bits, gaps, hold."""
    divider, gap, _ = link
    return gap + 9 + 64 * divider + 3 * gap + 4


def latency(link: tuple[int, int, int]) -> dict:
    """From the SYNC that starts a reading to the first byte of its frame for USB, at worst: a period, then the next tick."""
    cycles = LIMITS["tick_period"] + transfer_cycles(link) + FRAME_BYTES + FRAMER_CYCLES
    return {"transfer_cycles": transfer_cycles(link), "first_byte_us": cycles / LIMITS["clock_hz"] * 1e6}


def rates() -> dict:
    """What the bridge sustains when nodes can follow: by its settings' limit, and by the link at its fastest."""
    fastest = transfer_cycles(next(iter(LINKS.values())))
    hertz = {"settings_hz": LIMITS["clock_hz"] / LIMITS["tick_period_min"], "link_hz": LIMITS["clock_hz"] / fastest}
    return {
        **hertz,
        "usb_bytes_per_s": {name: rate * FRAME_BYTES for name, rate in (("at 2 kHz", 2000), *hertz.items())},
    }


def simulation(build: Path) -> dict:
    """The Verilated bridge with nodes and host, as bench_chain measures it."""
    jobs = [(title, link, n) for title, link in LINKS.items() for n in LANES]
    done = {title: [] for title in LINKS}
    for title, link, n in tqdm(jobs, desc="simulation", unit="run"):
        done[title].append(once(f"sim_{n}_{link[0]}", lambda n=n, link=link: bridge_speed(build, n, link)))
    return done


def draw_lanes(found: dict) -> Figure:
    """Resources and clock over lanes."""
    figure = Figure(figsize=(7, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    points = found["lanes"]
    for (name, style), marker in zip((("LUT", "-"), ("FF", "--"), ("distributed RAM", ":")), "os^", strict=True):
        left.plot(LANES, [p["used"][name] for p in points], style, marker=marker, color="0.2", label=name)
    left.set(xlabel="lanes", ylabel="cells (of 43 848 LUT)", ylim=(0, None), xticks=LANES)
    left.legend(frameon=False)
    right.plot(LANES, [p["fmax_mhz"] for p in points], "o-", color="0.2")
    right.axhline(60, color="0.5", linewidth=1, linestyle="--")
    right.annotate("60 MHz wanted", (1, 60), textcoords="offset points", xytext=(0, 4), color="0.3")
    right.set(xlabel="lanes", ylabel="clock, MHz (nextpnr, one seed)", ylim=(50, None), xticks=LANES)
    return figure


def draw_seeds(found: dict) -> Figure:
    """Clock and slack of the PHY's pins for each seed."""
    figure = Figure(figsize=(7, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    for (_, board), marker in zip(sorted(found["seeds"].items()), "os", strict=True):
        label = f"{board['title']}, grade {board['speed']}"
        left.plot(SEEDS, [run["fmax_mhz"] for run in board["runs"]], marker, color="0.2", label=label)
        slack = [min(limit - (run[name] or 0) for name, limit in board["limits"].items()) for run in board["runs"]]
        right.plot(SEEDS, slack, marker, color="0.2", label=label)
    for axes, level in ((left, 60), (right, 0)):
        axes.axhline(level, color="0.5", linewidth=1, linestyle="--")
        axes.set(xlabel="seed", xticks=SEEDS)
        axes.legend(frameon=False, fontsize=8)
    left.set(ylabel="clock, MHz (dashed: wanted)", ylim=(50, None))
    right.set(ylabel="least slack of the PHY's pins, ns")
    return figure


def save(figure: Figure, name: str) -> None:
    CHARTS.mkdir(parents=True, exist_ok=True)
    figure.savefig(CHARTS / f"bridge_{name}.svg", metadata={"Date": None})
    figure.savefig(CHARTS / f"bridge_{name}.png", dpi=120)


def run(build: Path, fresh: bool) -> None:
    """All figures of the bridge: bench/results/bridge.json and docs/charts/bridge_*."""
    if fresh:
        shutil.rmtree(CACHE, ignore_errors=True)
    found = fabric()
    found |= {"latency": {title: latency(link) for title, link in LINKS.items()}, "rates": rates()}
    found["simulation"] = simulation(build)
    (RESULTS / "bridge.json").write_text(json.dumps(found, indent=1) + "\n")
    save(draw_lanes(found), "lanes")
    save(draw_seeds(found), "seeds")


def main() -> None:
    matplotlib.rcParams["svg.hashsalt"] = "whisker"  # same data, same file
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build-dir", type=Path, default=ROOT / "build/release")
    parser.add_argument("--fresh", action="store_true", help="forget what an interrupted run has measured")
    options = parser.parse_args()
    run(options.build_dir.resolve(), options.fresh)


if __name__ == "__main__":
    main()
