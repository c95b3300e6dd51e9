"""Measures the whisker node: random faults, skew between nodes, time to the armed record, processor load.

    .venv/bin/python tools/benches node        bench/results/node.json, node_faults.json and node_cuts.json,

All on the register model of the chip and the edge-by-edge model of the sensor; nothing here has run on silicon. A
thousand batches of a thousand fault schedules take about six minutes of one core; what is done is kept.
"""

import argparse
import json
import subprocess
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from tqdm import tqdm

from .. import store

BATCHES, CHUNK, PROCESSES = 1000, 50, 2
NODES, TICKS = 28, 10_000
TICK_CYCLES = 19_300  # of 500 us at the slowest oscillator
CONVERSION_NS = 350_000  # the sensor's longest in fast mode
PARTS = ("faults", "storm", "skew", "load")
SPREADS = {"equal": (0, 0), "2 %": (20_000, 100), "4 %": (40_000, 100)}  # ppm of chips, permille of sensors
TOTALS = ("schedules", "ticks", "bad", "missed_line", "missed_link", "displaced", "unexplained", "unforeseen")
TOTALS += ("spurious", "stuck", "violations", "overwritten")


def storm(build: Path, kept: Path, batches: int) -> dict:
    """Schedules of random faults, a million by default: what was flagged against what was broken."""

    def chunk(first: int) -> list[dict]:
        path = kept / f"storm_{first}.jsonl"
        if not path.exists():
            done = subprocess.run(
                [build / "tests/node/node_storm", str(first), str(CHUNK)], capture_output=True, text=True
            )
            path.write_text(done.stdout)
        lines = [json.loads(line) for line in path.read_text().splitlines()]
        if [line["batch"] for line in lines] != list(range(first, first + CHUNK)):
            sys.exit(f"bench_node: {path}: not {CHUNK} whole batches; delete it and start again")
        return lines

    firsts = range(0, batches, CHUNK)
    with ThreadPoolExecutor(PROCESSES) as pool:
        chunks = list(tqdm(pool.map(chunk, firsts), total=len(firsts), desc="fault schedules"))
    lines = [line for lines in chunks for line in lines]
    return {name: sum(line[name] for line in lines) for name in TOTALS}


def timing(build: Path, spread: tuple[int, int], ticks=TICKS, nodes=NODES):
    """ns from SYNC to latch, conversion's age, ns from SYNC to armed record, as [node, tick]; cycles line."""
    command = [build / "tests/node/node_timing", ticks, nodes, spread[0], spread[1], CONVERSION_NS, 7]
    out = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True).stdout
    cycles = [line.split()[1:] for line in out.splitlines() if line.startswith("cycles")][0]
    rows = np.array([line.split() for line in out.splitlines() if not line.startswith("cycles")], float)
    return rows.reshape(nodes, -1, 3), [float(c) for c in cycles]


def load(build: Path) -> dict:
    """Cycles of the interrupts of a tick, each on its longest path: sim/node/node_cycles.h."""
    _, (cycles, interrupts) = timing(build, (0, 0), ticks=2000, nodes=1)
    return {
        "cycles_per_tick": cycles,
        "interrupts_per_tick": interrupts,
        "of_cycles_per_tick": TICK_CYCLES,
        "margin": 1 - cycles / TICK_CYCLES,
    }


def table(build: Path, program: str, name: str) -> list[dict]:
    """What a test program writes down of its cases, kept among the results."""
    path = store.kept("node") / f"{name}.json"
    subprocess.run([build / "tests/node" / program, path], check=True)
    store.write_result(name, json.loads(path.read_text()))
    return store.read_result(name)


def skew(build: Path) -> dict:
    """Where the nodes' sampling instants lie, and how late their records are armed."""
    rows = {name: timing(build, spread)[0] for name, spread in tqdm(SPREADS.items(), desc="skew")}
    armed = {
        f"clocks {'equal' if not ppm else f'{-ppm // 10_000} % slow'}": timing(build, (ppm, 100), ticks=500)[0][:, :, 2]
        for ppm in (0, -20_000, -40_000)
    }
    return {
        "skew": {
            name: {
                "latch_spread_us_max": float(np.ptp(data[:, :, 0], axis=0).max() / 1000),
                "latch_us_mean": float(data[:, :, 0].mean() / 1000),
                "latch_us_min": float(data[:, :, 0].min() / 1000),
                "latch_us_max": float(data[:, :, 0].max() / 1000),
                "true_instant_spread_us_max": float(np.ptp(data[:, :, 0] - data[:, :, 1], axis=0).max() / 1000),
                "age_us_max": float(data[:, :, 1].max() / 1000),
                "age_us_mean": float(data[:, :, 1].mean() / 1000),
                "armed_us_max": float(data[:, :, 2].max() / 1000),
            }
            for name, data in rows.items()
        },
        "armed_us_max": {name: float(data.max() / 1000) for name, data in armed.items()},
    }


def tables(build: Path) -> dict:
    faults = table(build, "test_node_faults", "node_faults")
    cuts = table(build, "test_update_cuts", "node_cuts")
    worst = Counter({row["fault"]: max(r["lost"] for r in row["runs"]) for row in faults}).most_common(3)
    return {"fault_rows": len(faults) + len(cuts), "worst_lost": dict(worst)}


def run(build: Path, only: str = "", batches: int = BATCHES) -> None:
    """All of it, or only one part: the others stay as they were measured before."""
    kept = store.kept("node")
    kept.mkdir(parents=True, exist_ok=True)
    parts = {
        "faults": lambda: tables(build),
        "storm": lambda: {"storm": storm(build, kept, batches)},
        "skew": lambda: skew(build),
        "load": lambda: {"load": load(build)},
    }
    result = store.read_result("node") if only else {}
    for name in [only] if only else PARTS:
        result |= parts[name]()
    store.write_result("node", result)


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--only", choices=PARTS, default="", help="this part; the others stay as they were")
    parser.add_argument("--batches", type=int, default=BATCHES, help="of a thousand schedules each")
