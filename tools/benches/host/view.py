"""What whisker-view costs: CPU share and bytes per second, with no page, one, four and sixteen; of 28 lanes at 2 kHz,
and of a robot whose belief has as many poses as a message may.

    .venv/bin/python tools/benches view        bench/results/view.json, docs/charts/view_cost.svg

Three processes: a writer at the pace of the hardware (or of the robot's streams, over zenoh), whisker-view, and pages
without a screen that take what comes as the real page does. CPU time is the server process's own, user and system, over
each run.
"""

import asyncio
import itertools
import json
import multiprocessing
import os
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm
from websockets.asyncio.client import connect

from crunchbot.bridge.ring import FRAME, Writer
from crunchbot.observation import VALUE
from crunchbot.robot.network.link import Link
from crunchbot.robot.network.messages import (
    TOPICS,
    Belief,
    Header,
    Localisation,
    Observation,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    ProcessHealth,
)
from crunchbot.robot.network.ranges import COMPONENTS_MOST
from crunchbot_lab.report import figures
from whisker_protocol import LANES, LIMITS

from .. import store

ROOT = Path(__file__).resolve().parents[3]
PARTS = ("traces", "robot")  # of the page
HZ = LIMITS["clock_hz"] // LIMITS["tick_period"]
PAGES = (0, 1, 4, 16)
SETTLE_S, RUN_S = 3.0, 15.0
COLUMNS = 1200  # of a page's traces
TICKS_PER_BIN = 16  # the page's first choice: about 10 s across
BATCH = HZ // 500  # frames published at once: 2 ms, four USB packets
ROWS_HZ, BELIEFS_HZ = 10, 2  # of the robot's streams
CELLS = [f"floor_{n}_{texture}" for n in range(2) for texture in ("A", "B", "C")] + [f"object_{n}_mm" for n in range(4)]


def write_ring(name: str, over) -> None:
    """Publish noise on all lanes at 2 kHz until the parent ends it."""
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


def report_robot(endpoint: str, over) -> None:
    """Send what pilot, navigator and simulation would, at their pace, until the parent ends it."""
    rng = np.random.default_rng(1)
    with Link("bench", listen=[endpoint]) as link:
        streams = {topic: link.publish(topic) for topic in (*TOPICS, "health/bench")}
        began = time.monotonic()
        for row in itertools.count():
            if over.is_set():
                return
            for topic, message in robot_messages(row, rng):
                streams[topic].send(message)
            time.sleep(max(0.0, began + (row + 1) / ROWS_HZ - time.monotonic()))


def robot_messages(row: int, rng: np.random.Generator) -> list[tuple[str, object]]:
    """What is sent for a row."""
    header, pose = Header.at(row * 10**9 // ROWS_HZ), (1.0 + rng.normal(0, 0.1), 1.0, 0.5)
    cells = np.full(len(CELLS), VALUE, np.uint8)
    values = rng.normal(-3, 1, len(CELLS))
    covariance = PoseWithCovariance.planar(pose, np.eye(3) * 1e-3)
    reported = [
        ("observation", Observation(header, row, 0, np.zeros(3), np.array(pose), CELLS, cells, values)),
        ("localisation", Localisation(header, "adaptive", covariance, 0.9, row)),
        ("truth", PoseStamped(header, Pose.planar(*pose))),
    ]
    if row % (ROWS_HZ // BELIEFS_HZ) == 0:
        columns = (
            rng.normal(1.0, 0.3, (3, COMPONENTS_MOST)),
            np.full((3, COMPONENTS_MOST), [[1 / COMPONENTS_MOST], [0.02], [0.05]]),
        )
        reported.append(
            ("belief", Belief(header, "adaptive", row, COMPONENTS_MOST, 1.0, *np.concatenate(columns).astype("f4")))
        )
    if row % ROWS_HZ == 0:
        reported.append(("health/bench", ProcessHealth(header, "bench", os.getpid(), "running")))
    return reported


class Page:
    """Takes everything, acknowledges it, and counts."""

    def __init__(self):
        self.bytes = self.blocks = self.bins = 0

    async def run(self, url: str, requests: list[dict]) -> None:
        async with connect(f"{url.replace('http', 'ws')}ws", compression=None) as plug:
            for request in requests:
                await plug.send(json.dumps({"type": "subscribe"} | request))
            count = 0
            async for message in plug:
                count += 1
                await plug.send(json.dumps({"type": "ack", "count": count}))
                self.bytes += len(message)
                if isinstance(message, bytes):
                    self.blocks += 1
                    self.bins += int.from_bytes(message[4:6], "little")


def requests_of(part: str, ring: str) -> list[dict]:
    """What a page subscribes to when this part of it is looked at."""
    always = [{"topic": "status", "ring": ring}, {"topic": "rings"}]
    if part == "robot":
        return always + [{"topic": topic} for topic in ("scene", "robot", "belief")]
    traces = {"topic": "traces", "ring": ring, "ticks_per_bin": TICKS_PER_BIN, "bins": COLUMNS}
    return [*always, traces | {"lanes": (1 << LANES) - 1, "subscription": 1}]


def take_pages(url: str, requests: list[dict], pages: int, results) -> None:
    """So many pages in one process; what each got per second of the run."""

    async def scenario():
        watched = [Page() for _ in range(pages)]
        tasks = [asyncio.create_task(page.run(url, requests)) for page in watched]
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


def free_endpoint() -> str:
    with socket.create_server(("127.0.0.1", 0)) as plug:
        return f"tcp/127.0.0.1:{plug.getsockname()[1]}"


def measure(part: str, pages: int) -> dict:
    """One run with so many pages that look at this part."""
    ring, over, results = f"whisker-bench-{os.getpid()}", multiprocessing.Event(), multiprocessing.Queue()
    command = [sys.executable, "-m", "crunchbot.view", "--ring", ring, "--port", "0"]
    target, place = write_ring, ring
    if part == "robot":
        target, place = report_robot, free_endpoint()
        command += ["--robot", "--connect", place]
    writer = multiprocessing.Process(target=target, args=(place, over))
    writer.start()
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        url = server.stdout.readline().strip()
        browser = multiprocessing.Process(target=take_pages, args=(url, requests_of(part, ring), pages, results))
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


def draw(runs: dict[str, list[dict]]) -> Figure:
    figure = Figure(figsize=(7, 3.8), layout="constrained")
    axes = figure.subplots()
    looks = {
        "traces": ("28 lanes at 2 kHz", "#0b5394", "o-", 8),
        "robot": ("robot, belief of 2000 poses", "#b44d00", "s--", -16),
    }
    for part, (what, colour, line, above) in looks.items():
        pages, share = [run["pages"] for run in runs[part]], [100 * run["cpu_share"] for run in runs[part]]
        kilobytes = np.mean([run["bytes_per_s_page"] for run in runs[part][1:]]) / 1000
        axes.plot(pages, share, line, color=colour, label=f"{what}: {kilobytes:.0f} kB/s a page")
        for x, y in zip(pages, share, strict=True):
            axes.annotate(
                f"{y:.1f} %", (x, y), textcoords="offset points", xytext=(0, above), ha="center", color=colour
            )
    axes.legend(frameon=False)
    axes.set(xlabel="pages looking", ylabel="whisker-view, % of one core", xticks=PAGES)
    axes.set_ylim(0, 1.15 * axes.get_ylim()[1])
    return figure


def run(build: Path) -> None:
    """Measure what is missing and draw; `build` is not used: whisker-view is all Python."""
    cache, turns = store.kept("view"), [(part, pages) for part in PARTS for pages in PAGES]
    runs: dict[str, list[dict]] = {part: [] for part in PARTS}
    for part, pages in tqdm(turns, desc="whisker-view", unit="run"):
        found = store.once(cache / f"{part}-{pages}.json", lambda part=part, pages=pages: measure(part, pages))
        runs[part].append(found)
    found = {
        "lanes": LANES,
        "hz": HZ,
        "runs": runs["traces"],
        "robot": {"poses": COMPONENTS_MOST, "runs": runs["robot"]},
    }
    store.write_result("view", found)
    store.write_chart("view_cost", figures.svg(draw, runs))
