#!/usr/bin/env python3
"""Measures the whisker node: random faults, skew between nodes, time to the armed record, processor load.

    .venv/bin/python tools/bench_node.py        bench/results/node.json and node_faults.json, docs/node_faults.md,
                                                docs/charts/node_*.svg and .png

All on the register model of the chip and the edge-by-edge model of the sensor; nothing here has run on silicon. A
thousand batches of a thousand fault schedules take about six minutes of one core; what is done is kept in build/bench/node.
"""

import argparse
import json
import re
import subprocess
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

from whisker.report import figures

ROOT = Path(__file__).resolve().parent.parent
RESULTS, CHARTS = ROOT / "bench/results", ROOT / "docs/charts"
BATCHES, CHUNK, PROCESSES = 1000, 50, 2
NODES, TICKS = 28, 10_000
TICK_CYCLES = 19_300  # of 500 us at the slowest oscillator
CONVERSION_NS = 350_000  # the sensor's longest in fast mode
SPREADS = {"equal": (0, 0), "2 %": (20_000, 100), "4 %": (40_000, 100)}  # ppm of chips, permille of sensors
TOTALS = ("schedules", "ticks", "bad", "missed_line", "missed_link", "unexplained", "spurious", "stuck", "violations")


def storm(build: Path, kept: Path, fresh: bool) -> dict:
    """A million schedules of random faults: what was flagged against what was broken."""

    def chunk(first: int) -> list[dict]:
        path = kept / f"storm_{first}.jsonl"
        if fresh or not path.exists():
            done = subprocess.run(
                [build / "sim/node/node_storm", str(first), str(CHUNK)], capture_output=True, text=True
            )
            path.write_text(done.stdout)
        return [json.loads(line) for line in path.read_text().splitlines()]

    firsts = range(0, BATCHES, CHUNK)
    with ThreadPoolExecutor(PROCESSES) as pool:
        chunks = list(tqdm(pool.map(chunk, firsts), total=len(firsts), desc="fault schedules"))
    lines = [line for lines in chunks for line in lines]
    kinds = {
        kind: {
            "injected": sum(line["kinds"][kind][0] for line in lines),
            "altered": sum(line["kinds"][kind][1] for line in lines),
        }
        for kind in lines[0]["kinds"]
    }
    return {name: sum(line[name] for line in lines) for name in TOTALS} | {"kinds": kinds}


def timing(build: Path, spread: tuple[int, int], work: int = 60, ticks: int = TICKS, nodes: int = NODES):
    """ns from SYNC to latch, conversion's age, ns from SYNC to armed record, as [node, tick]; cycles line."""
    command = [build / "sim/node/node_timing", ticks, nodes, spread[0], spread[1], CONVERSION_NS, work, 7]
    out = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True).stdout
    cycles = [line.split()[1:] for line in out.splitlines() if line.startswith("cycles")][0]
    rows = np.array([line.split() for line in out.splitlines() if not line.startswith("cycles")], float)
    return rows.reshape(nodes, -1, 3), [float(c) for c in cycles]


def load(build: Path) -> dict:
    """Cycles: the port's register accesses from the model, the core's work from simavr, a stand-in for the dsPIC."""
    _, (accesses, interrupts) = timing(build, (0, 0), work=0, ticks=2000, nodes=1)
    avr = subprocess.run(
        ["ctest", "--test-dir", str(build), "-R", "firmware_avr_cycles", "-V"], capture_output=True, text=True
    ).stdout
    words = dict(re.findall(r"(\w+) (\d+)", " ".join(re.findall(r"(?:cycles|bytes) .*", avr))))
    core = int(words.get("tick", 0))
    return {
        "port_cycles_per_tick": accesses,
        "interrupts_per_tick": interrupts,
        "core_cycles_per_tick_atmega1284p": core,
        "of_cycles_per_tick": TICK_CYCLES,
        "margin": 1 - (accesses + core) / TICK_CYCLES,
        "node_bytes_atmega1284p": int(words.get("node", 0)),
        "stack_bytes_atmega1284p": int(words.get("stack", 0)),
        "atmega1284p": words,
    }


def skew_chart(rows: dict) -> Figure:
    """Spread over the nodes of each tick's sampling instant: what the node adds, and what the sensor does."""
    figure = Figure(figsize=(9.6, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    styles = {"equal": ("-", "o"), "2 %": ("--", "^"), "4 %": (":", "s")}
    for name, data in rows.items():
        spread = np.sort(np.ptp(data[:, :, 0], axis=0)) / 1000
        share = np.linspace(0, 1, len(spread))
        line, marker = styles[name]
        left.plot(spread, share, line, marker=marker, markevery=0.2, color="#0b5394", label=f"clocks {name}")
    left.set_xlabel("SYNC to latch, spread over 28 nodes (us)")
    left.set_ylabel("share of ticks")
    left.set_xlim(left=0)
    left.legend()
    ages = rows["2 %"][:, :, 1].ravel() / 1000
    right.hist(ages, bins=80, color="#c25700", histtype="stepfilled", alpha=0.6)
    right.set_xlabel("age of the sensor's conversion at the latch (us)")
    right.set_ylabel("samples")
    return figure


def fault_table(build: Path) -> list[dict]:
    """The fault matrix, written as a page too."""
    path = RESULTS / "node_faults.json"
    subprocess.run([build / "sim/node/test_node_faults", path], check=True)
    rows = json.loads(path.read_text())
    text = ["# What a node makes of faults", "", "Made by `tools/bench_node.py` from `sim/node/fault_matrix.c`.", ""]
    text += [
        "Verdicts on consecutive records, the first on the record that the broken tick brings (the tick before's):"
    ]
    text += ["`.` good, `e` error bits, `S` starting, `R` resync, `L` late, `x` sensor_sum, `0` sensor_start,"]
    text += ["`a` sensor_absent, `j` step, `P` `W` `T` reset_power, _watchdog, _trap, `O` overrun, `-` absent,"]
    text += ["`c` link_crc, `t` link_tick. Empty: nothing is lost.", ""]
    text += ["| Fault | Verdicts | Ticks lost, at most | Remark |", "|---|---|---|---|"]
    for row in rows:
        runs = row["runs"]
        verdicts = f"`{runs[0]['verdicts']}`" if runs[0]["verdicts"] else ""
        text.append(f"| {row['fault']} | {verdicts} | {max(r['lost'] for r in runs)} | {row['remark']} |")
    (ROOT / "docs/node_faults.md").write_text("\n".join(text) + "\n")
    return rows


def run(build: Path, fresh: bool) -> None:
    """All of it."""
    kept = build / "bench/node"
    kept.mkdir(parents=True, exist_ok=True)
    RESULTS.mkdir(parents=True, exist_ok=True)
    rows = {name: timing(build, spread)[0] for name, spread in tqdm(SPREADS.items(), desc="skew")}
    slowest, _ = timing(build, (-40_000, 100), ticks=500, nodes=NODES)
    faults = fault_table(build)
    result = {
        "storm": storm(build, kept, fresh),
        "skew": {
            name: {
                "latch_spread_us_max": float(np.ptp(data[:, :, 0], axis=0).max() / 1000),
                "latch_us_mean": float(data[:, :, 0].mean() / 1000),
                "true_instant_spread_us_max": float(np.ptp(data[:, :, 0] - data[:, :, 1], axis=0).max() / 1000),
                "age_us_max": float(data[:, :, 1].max() / 1000),
                "age_us_mean": float(data[:, :, 1].mean() / 1000),
                "armed_us_max": float(data[:, :, 2].max() / 1000),
            }
            for name, data in rows.items()
        },
        "armed_us_max_at_minus_4_percent": float(slowest[:, :, 2].max() / 1000),
        "load": load(build),
        "fault_rows": len(faults),
        "worst_lost": dict(
            Counter({row["fault"]: max(r["lost"] for r in row["runs"]) for row in faults}).most_common(3)
        ),
    }
    (RESULTS / "node.json").write_text(json.dumps(result, indent=1) + "\n")

    def draw(_):
        return skew_chart(rows)

    draw.__name__ = "node_skew"
    (CHARTS / "node_skew.svg").write_text(figures.svg(draw, None))
    figures.png(draw, None, CHARTS / "node_skew.png")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build-dir", type=Path, default=ROOT / "build/release")
    parser.add_argument("--fresh", action="store_true", help="forget what an interrupted run has measured")
    options = parser.parse_args()
    run(options.build_dir.resolve(), options.fresh)
