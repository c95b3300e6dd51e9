"""The ring beside transports people would pick: latency and throughput for 1 to 32 readers, and what readers cost the
writer.

One program per transport (tools/benches/host/peers), one harness for all: 256-byte frames, publisher on one processor,
all readers on another, the same wait mode in every row of a figure:

  poll   a reader looks, and gives the processor away between looks
  wait   a reader sleeps until it is woken

2 kHz: latency from just before publishing to the reader's hand. Flat out: frames a second that reach every reader,
the publisher never more than 256 frames ahead of the slowest. Free: the ring's writer alone sets the pace.
"""

import argparse
import json
import os
import shutil
from pathlib import Path

import matplotlib
import numpy as np
from tqdm import tqdm

from .. import store
from .ring_charts import draw_latency, draw_throughput, draw_writer
from .ring_peers import CACHE, PEERS, SOURCES, programs
from .ring_run import READERS, Run, quantile

ROUNDS = 3  # each setting again, in turn with the others, so that a busy minute of the machine hits all alike
SECONDS = {"2khz": 3.0, "flat": 2.0, "free": 2.0}
QUANTILES = {"p50": 50, "p90": 90, "p99": 99, "p99.9": 99.9}


def settings(found: dict[str, Path]) -> list[tuple[str, str, str, int]]:
    rows = [
        (peer, mode, pace, readers)
        for pace in ("2khz", "flat")
        for readers in READERS
        for peer in found
        for mode in PEERS[peer][2]
        if pace == "2khz" or peer != "memory"
    ]
    rows += [("whisker", mode, "free", readers) for readers in (0, *READERS) for mode in ("poll", "wait")]
    rows += [(peer, "poll", "2khz", 0) for peer in found]
    return rows


def once(path: Path, run: Run) -> dict:
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(run.measure()) + "\n")
    return json.loads(path.read_text())


def measure(found: dict[str, Path], rounds: int, scale: float) -> list[dict]:
    rows = settings(found)
    done: dict[tuple, list[dict]] = {row: [] for row in rows}
    with tqdm(total=rounds * len(rows), desc="ring", unit="run") as bar:
        for turn in range(rounds):
            for row in rows:
                peer, mode, pace, readers = row
                bar.set_postfix_str(f"{peer} {mode} {pace} {readers}")
                run = Run(found[peer], mode, pace, readers, SECONDS[pace] * scale)
                done[row].append(once(CACHE / "runs" / f"{peer}_{mode}_{pace}_{readers}_{turn}.json", run))
                bar.update()
    return [summary(*row, done[row]) for row in rows]


def summary(peer: str, mode: str, pace: str, readers: int, runs: list[dict]) -> dict:
    """The rounds of a setting: latencies pooled, rates as the median round."""
    counts: dict[str, int] = {}
    for run in runs:
        for bin_, n in run["latency_ns"].items():
            counts[bin_] = counts.get(bin_, 0) + n
    return {
        "peer": peer,
        "mode": mode,
        "pace": pace,
        "readers": readers,
        "sent_per_s": float(np.median([run["sent"] / run["seconds"] for run in runs])),
        "delivered_per_s": float(np.median([min(run["received"] or [0]) / run["seconds"] for run in runs])),
        "publish_ns": float(np.median([run["publish_ns"] for run in runs])),
        "lost": sum(run["lost"] for run in runs),
        "bad": sum(run["bad"] for run in runs),
        "latency_us": {name: quantile(counts, p) for name, p in QUANTILES.items()} if counts else {},
    }


def save(rows: list[dict], left_out: list[str]) -> None:
    versions = [line.strip() for line in (SOURCES / "Cargo.toml").read_text().splitlines() if "version = " in line]
    data = {
        "cores": len(os.sched_getaffinity(0)),
        "frame_bytes": 256,
        "rounds": ROUNDS,
        "seconds": SECONDS,
        "versions": versions,
        "left_out": left_out,
        "rows": rows,
    }
    store.write_result("ring", data)
    for name, draw in (("latency", draw_latency), ("throughput", draw_throughput), ("writer", draw_writer)):
        store.write_chart(f"ring_{name}", draw(rows))
    print("bench/results/ring.json, docs/charts/ring_latency.svg, ring_throughput.svg, ring_writer.svg")


def run(build: Path, fresh: bool, rounds: int = ROUNDS, scale: float = 1.0) -> None:
    """Measure what is not measured yet, and redraw."""
    matplotlib.rcParams["svg.hashsalt"] = "whisker"
    if fresh:
        shutil.rmtree(CACHE / "runs", ignore_errors=True)
    found = programs(build.resolve())
    save(measure(found, rounds, scale), sorted(PEERS.keys() - found.keys()))


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--scale", type=float, default=1.0, help="shorten every run to this share, to try things out")
