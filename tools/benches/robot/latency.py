"""From a touch to the pose on the desktop, part by part. Three kinds of time, never mixed:

simulated   time of the robot's clock, from level-1 runs: the same on any machine
processor   time of one processor of this machine, free of what else runs on it
wall        of two processes on this machine, with what else ran on it then
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from crunchbot.nav import localise
from crunchbot.nav.observations import Observations
from crunchbot.observation import Row
from crunchbot.pilot.behaviour import BLOCK_TICKS, ODOMETRY_TICKS, TICK_S
from crunchbot.pilot.pilot import Pilot
from crunchbot.robot.models import load_models
from crunchbot.robot.network.link import Link
from crunchbot.robot.network.messages import Observation, decode, encode
from crunchbot.robot.network.rows import RowPublisher, to_message, to_row
from crunchbot_lab import scenes
from crunchbot_lab.demo.level1 import explore
from crunchbot_lab.signals import World
from crunchbot_lab.simulation.scenes import make_scene

SEEDS, SECONDS = range(8201, 8207), 60
PORTS = (17651, 17652)
WALL_ROWS = 300
PATIENCE_S = 60.0
FILTERS = ("adaptive", "grid")
DECIDED_TICKS = 1  # reading n is sent at tick n + 1
MS = 1e3


class Watched(World):
    """A world that notes when whiskers touch."""

    def __init__(self, flat: str, seed: int, lanes: list[int]):
        super().__init__(flat, seed)
        self._tick = -1
        self.touches: dict[int, list[int]] = {lane: [] for lane in lanes}
        self._touching = dict.fromkeys(lanes, False)

    def run(self, ticks: int) -> np.ndarray:
        return np.concatenate([self._step() for _ in range(ticks)])

    def _step(self) -> np.ndarray:
        counts, self._tick = super().run(1), self._tick + 1
        for lane, before in self._touching.items():
            self._touching[lane] = self.contact(lane).touching
            if self._touching[lane] and not before:
                self.touches[lane].append(self._tick)
        return counts


class Stopwatch:
    """Processor times in ms, by what they were spent on."""

    def __init__(self):
        self.times: dict[str, list[float]] = {}

    def around(self, name: str, function: Callable) -> Callable:
        def timed(*arguments):
            began = time.thread_time_ns()
            result = function(*arguments)
            self.times.setdefault(name, []).append((time.thread_time_ns() - began) / 1e6)
            return result

        return timed


def measure(models: Path) -> dict:
    """Stages: {"simulated" | "processor" | "wall" -> {what -> {"n", "p50_ms", "p99_ms"}}}, and the load of the
    machine."""
    watch = Stopwatch()
    found = [_contacts(seed, models, watch) for seed in SEEDS]
    together = {name: [value for one in found for value in one[name]] for name in found[0]}
    wall = {f"row sent, pose of {name} received": _wall_ms(name) for name in FILTERS}
    kinds = {"simulated": together, "processor": watch.times, "wall": wall}
    shown = {kind: {name: spread(values) for name, values in of.items()} for kind, of in kinds.items()}
    return shown | {"load_average": round(os.getloadavg()[0], 1)}


def spread(ms: list[float]) -> dict:
    """Quantiles of times in ms."""
    return {"n": len(ms), "p50_ms": float(np.quantile(ms, 0.5)), "p99_ms": float(np.quantile(ms, 0.99))}


def _contacts(seed: int, models: Path, watch: Stopwatch) -> dict[str, list[float]]:
    """Simulated times of every contact of a run; the processor times go to the stopwatch."""
    scene, start = make_scene(seed)
    pilot = Pilot(scene.robot, *load_models(models, scene.robot), seed)
    world = Watched(scene.flat(start), seed, pilot.object_lanes)
    onsets: dict[int, list[int]] = {lane: [] for lane in pilot.object_lanes}
    block, odometry = pilot.block, pilot.odometry

    def noted_block(*arguments):
        drive = block(*arguments)
        for lane, contact in pilot.contacts.items():
            if contact.onset >= 0 and contact.onset not in onsets[lane][-1:]:
                onsets[lane].append(contact.onset)
        return drive

    pilot.block = watch.around("pilot, a block", noted_block)
    pilot.odometry = watch.around("pilot, a row", odometry)
    rows, _ = explore(scene, start, pilot, seed, round(SECONDS / TICK_S), world=world)
    _desktop(scene, rows, watch)
    pushes = [MS * TICK_S * (whisk["release"] - whisk["onset"]) for whisk in pilot.whisks]
    return {**_stages(world.touches, onsets), "body whisk: touch noticed, distance known (release)": pushes}


def _stages(touches: dict[int, list[int]], onsets: dict[int, list[int]]) -> dict[str, list[float]]:
    """Of every onset with a true touch before it that no other onset came after."""
    out: dict[str, list[float]] = {name: [] for name in STAGES}
    for lane, ticks in onsets.items():
        for before, onset in zip([-1, *ticks], ticks, strict=False):
            touched = [t for t in touches[lane] if before < t <= onset]
            if touched:
                ready = onset + DECIDED_TICKS
                block = -(-(ready + 1) // BLOCK_TICKS) * BLOCK_TICKS
                row = -(-block // ODOMETRY_TICKS) * ODOMETRY_TICKS
                times = (onset - touched[-1], DECIDED_TICKS, block - ready, row - block, row - touched[-1])
                for name, value in zip(STAGES, times, strict=True):
                    out[name].append(MS * TICK_S * value)
    return out


STAGES = (
    "touch, first sample beyond the threshold",
    "sensor, link and frame",
    "wait for the block of 20 ms",
    "wait for the row of 100 ms",
    "touch, end of the row that knows of it",
)


def _desktop(scene, rows: list[dict], watch: Stopwatch) -> None:
    """What a row costs on its way, and in the filters."""
    pack, unpack = watch.around("row to bytes", _packed), watch.around("bytes to row", _unpacked)
    steps = {name: watch.around(f"filter {name}", localise.Filter(name, scene).step) for name in FILTERS}
    for n, row in enumerate(rows):
        cells = unpack(pack(row, n))
        for step in steps.values():
            step(cells)


def _packed(row: dict, n: int) -> bytes:
    return encode(to_message(Row.of(row), n, np.zeros(3)))


def _unpacked(data: bytes) -> dict:
    return to_row(decode(Observation, data, "observation"))


# ---------------------------------------------------------------------------------------------------------------------


def _wall_ms(name: str) -> list[float]:
    """From a row sent to the pose received, one at a time, over zenoh on loopback, with a real navigator between."""
    made = scenes.make("robot", SEEDS[0], WALL_ROWS)
    rows = _as_rows(made.observations, made.scene)
    ours, theirs = (f"tcp/127.0.0.1:{port}" for port in PORTS)
    with tempfile.TemporaryDirectory() as folder, Link("pilot", listen=[ours], lock_step=True) as link:
        scenes.write_scene(folder, made.scene, made.observations)
        poses = link.subscribe("pose")
        with _navigator(folder, name, theirs, ours):
            if not link.wait_for(["navigator"], PATIENCE_S):
                raise RuntimeError(f"bench_robot: no navigator at {theirs}; is the port taken?")
            publisher = RowPublisher(link)
            times = [_round(publisher, poses, row) for row in rows]
            publisher.end()
    return times[1:]  # the first holds the filter's making


def _round(publisher: RowPublisher, poses, row: dict) -> float:
    began = time.monotonic()
    publisher.send(Row.of(row))
    if not poses.take(PATIENCE_S):
        raise RuntimeError("bench_robot: no pose came; run host/python/tests/robot/test_robot_navigator.py")
    return MS * (time.monotonic() - began)


@contextmanager
def _navigator(folder: str, name: str, listen: str, connect: str):
    command = [sys.executable, "-m", "crunchbot.cli", "navigator", folder, "--lock-step", "--filter", name]
    process = subprocess.Popen([*command, "--listen", listen, "--connect", connect], stdout=subprocess.DEVNULL)
    try:
        yield
        process.wait(PATIENCE_S)
    finally:
        process.kill()
        process.wait()


def _as_rows(observations: Observations, scene) -> list[dict]:
    """Cells as the pilot gives them."""
    tips, rays = scene.robot.of_role("texture"), scene.robot.of_role("object")
    rows = []
    for n in range(len(observations)):
        row = {"t_s": float(observations.t_s[n])}
        row |= zip(localise.ODOMETRY, map(float, observations.odometry[n]), strict=True)
        for tip, logliks in zip(tips, observations.texture[n].tolist(), strict=True):
            names = [f"{tip.name}_{texture}" for texture in scene.arena.textures]
            row |= {k: v if np.isfinite(v) else None for k, v in zip(names, logliks, strict=True)}
        for ray, metres in zip(rays, observations.radial_m[n].tolist(), strict=True):
            row[f"{ray.name}_mm"] = None if np.isposinf(metres) else 1000.0 * metres
        rows.append(row)
    return rows


# ---------------------------------------------------------------------------------------------------------------------

SHADES = {"simulated": "0.25", "processor": "0.6", "wall": "0.85"}


def draw(found: dict) -> Figure:
    """Median and 99 % of every part; the kind of time by shade."""
    rows = [(kind, name, values) for kind in SHADES for name, values in found[kind].items()]
    figure = Figure(figsize=(9.5, 0.36 * len(rows) + 1.2), layout="constrained")
    axes = figure.subplots()
    for y, (kind, _, values) in enumerate(rows):
        low, high = (max(values[key], 1e-3) for key in ("p50_ms", "p99_ms"))
        axes.barh(y, low, color=SHADES[kind], edgecolor="0.2", height=0.6)
        axes.plot([low, high], [y, y], color="black", linewidth=1)
        axes.plot(high, y, "k|", markersize=9)
    handles = [axes.barh(0, 0, color=shade, edgecolor="0.2", label=f"{kind} time") for kind, shade in SHADES.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8)
    axes.set(yticks=range(len(rows)), yticklabels=[name for _, name, _ in rows], xscale="log")
    axes.set(xlabel="time (ms): bar to the median, line to 99 %")
    axes.invert_yaxis()
    axes.grid(axis="x", linewidth=0.3)
    return figure


DRAWINGS = {"robot_latency": draw}
