#!/usr/bin/env python3
"""What whisker-view costs: CPU share and bytes per second at 28 lanes and 2 kHz, with no page, one, four and sixteen.

    .venv/bin/python tools/bench_view.py        bench/results/view.json, docs/charts/view_cost.svg and .png

Three processes: a writer at the pace of the hardware, whisker-view, and pages without a screen that take what comes as
the real page does. CPU time is the server process's own, user and system, over each run; a run that is done is kept in
build/bench/view.
"""

import argparse
import asyncio
import json
import multiprocessing
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm
from websockets.asyncio.client import connect

from whisker.protocol import LANES, LIMITS
from whisker.report import figures
from whisker.ring import FRAME, Writer

ROOT = Path(__file__).resolve().parent.parent
RESULTS, CHARTS = ROOT / "bench/results", ROOT / "docs/charts"
HZ = LIMITS["clock_hz"] // LIMITS["tick_period"]
PAGES = (0, 1, 4, 16)
SETTLE_S, RUN_S = 3.0, 15.0
COLUMNS = 1200  # of a page's traces
TICKS_PER_BIN = 16  # the page's first choice: about 10 s across
BATCH = HZ // 500  # frames published at once: 2 ms, four USB packets


def write_ring(name: str, over) -> None:
    """Publish noise on all lanes at 2 kHz until told to end."""
    frames = np.zeros(HZ, FRAME)
    noise = np.random.default_rng(1).normal(0x8000, 300.0, (2, HZ, LANES))
    frames["lane_mask"] = (1 << LANES) - 1
    frames["lane"]["alpha"], frames["lane"]["beta"] = noise
    with Writer(name) as ring:
        began, done = time.monotonic(), 0
        while not over.is_set():
            part = frames[done % HZ : done % HZ + BATCH]
            part["tick"] = part["sequence"] = np.arange(done, done + BATCH)
            part["time_cycles"] = part["tick"] * LIMITS["tick_period"]
            ring.publish(part)
            done += BATCH
            time.sleep(max(0.0, began + done / HZ - time.monotonic()))


class Page:
    """Takes everything, acknowledges it, and counts."""

    def __init__(self):
        self.bytes = self.blocks = self.bins = 0

    async def run(self, url: str, ring: str) -> None:
        async with connect(f"{url.replace('http', 'ws')}ws", compression=None) as socket:
            for request in (
                {"topic": "status", "ring": ring},
                {"topic": "rings"},
                {"topic": "traces", "ring": ring, "ticks_per_bin": TICKS_PER_BIN, "bins": COLUMNS}
                | {"lanes": (1 << LANES) - 1, "subscription": 1},
            ):
                await socket.send(json.dumps({"type": "subscribe"} | request))
            count = 0
            async for message in socket:
                count += 1
                await socket.send(json.dumps({"type": "ack", "count": count}))
                self.bytes += len(message)
                if isinstance(message, bytes):
                    self.blocks += 1
                    self.bins += int.from_bytes(message[4:6], "little")


def take_pages(url: str, ring: str, pages: int, results) -> None:
    """So many pages in one process; what each got per second of the run."""

    async def scenario():
        watched = [Page() for _ in range(pages)]
        tasks = [asyncio.create_task(page.run(url, ring)) for page in watched]
        await asyncio.sleep(SETTLE_S)
        before = [vars(page).copy() for page in watched]
        await asyncio.sleep(RUN_S)
        results.put([{key: (vars(p)[key] - b[key]) / RUN_S for key in b} for p, b in zip(watched, before, strict=True)])
        for task in tasks:
            task.cancel()

    asyncio.run(scenario())


def cpu_s(process: int) -> float:
    """User and system time of a process so far."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def megabytes(process: int) -> float:
    """Most memory that a process has had resident, without the ring it shares."""
    lines = dict(line.split(":", 1) for line in Path(f"/proc/{process}/status").read_text().splitlines())
    return (int(lines["VmHWM"].split()[0]) - int(lines["RssShmem"].split()[0])) / 1024


def measure(pages: int) -> dict:
    """One run with so many pages."""
    ring, over, results = f"whisker-bench-{os.getpid()}", multiprocessing.Event(), multiprocessing.Queue()
    writer = multiprocessing.Process(target=write_ring, args=(ring, over))
    writer.start()
    command = [sys.executable, "-m", "whisker.view", "--ring", ring, "--port", "0"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        url = server.stdout.readline().strip()
        browser = multiprocessing.Process(target=take_pages, args=(url, ring, pages, results))
        browser.start()
        time.sleep(SETTLE_S)
        cpu, began = cpu_s(server.pid), time.monotonic()
        got = results.get()
        share = (cpu_s(server.pid) - cpu) / (time.monotonic() - began)
        memory = megabytes(server.pid)
        browser.join()
    finally:
        over.set()
        server.terminate()
        server.wait()
        writer.join()
    mean = {key: float(np.mean([page[key] for page in got])) if got else 0.0 for key in ("bytes", "blocks", "bins")}
    per_second = {f"{key}_per_s_page": value for key, value in mean.items()}
    return {"pages": pages, "cpu_share": share, "memory_mb": memory} | per_second


def draw(runs: list[dict]) -> Figure:
    figure = Figure(figsize=(7, 3.6), layout="constrained")
    axes = figure.subplots()
    pages, share = [run["pages"] for run in runs], [100 * run["cpu_share"] for run in runs]
    axes.plot(pages, share, "o-", color="#0b5394")
    for x, y in zip(pages, share, strict=True):
        axes.annotate(f"{y:.1f} %", (x, y), textcoords="offset points", xytext=(0, -16), ha="center")
    kilobytes = np.mean([run["bytes_per_s_page"] for run in runs[1:]]) / 1000
    axes.set_title(
        f"28 lanes at 2 kHz; each page gets {kilobytes:.0f} kB/s in {runs[1]['blocks_per_s_page']:.0f} blocks/s",
        fontsize=10,
    )
    axes.set(xlabel="pages looking", ylabel="whisker-view, % of one core", ylim=(0, 1.15 * max(share)), xticks=PAGES)
    return figure


def run(build: Path, fresh: bool) -> None:
    """Measure what is missing and draw; `build` is not used: whisker-view is all Python."""
    cache = ROOT / "build/bench/view"
    if fresh:
        shutil.rmtree(cache, ignore_errors=True)
    cache.mkdir(parents=True, exist_ok=True)
    for pages in tqdm(PAGES, desc="whisker-view", unit="run"):
        path = cache / f"{pages}.json"
        if not path.exists():
            path.write_text(json.dumps(measure(pages)))
    runs = [json.loads((cache / f"{pages}.json").read_text()) for pages in PAGES]
    for folder in (RESULTS, CHARTS):
        folder.mkdir(parents=True, exist_ok=True)
    (RESULTS / "view.json").write_text(json.dumps({"lanes": LANES, "hz": HZ, "runs": runs}, indent=1) + "\n")
    (CHARTS / "view_cost.svg").write_text(figures.svg(draw, runs))
    figures.png(draw, runs, CHARTS / "view_cost.png")
    print("bench/results/view.json, docs/charts/view_cost.svg")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build-dir", type=Path, default=ROOT / "build/release", help="not used")
    parser.add_argument("--fresh", action="store_true", help="forget what an interrupted run has measured")
    options = parser.parse_args()
    run(options.build_dir.resolve(), options.fresh)
    return 0


if __name__ == "__main__":
    sys.exit(main())
