"""Runs the chain: simulated bridge with whiskerd inside, whisker-log, pilot and navigator as processes of their own."""

import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path

from ..children import Child, Program

FOLLOWERS = 2  # whisker-log and the pilot
POLL_S = 0.05
LAGGARD_S = 20.0  # for the readers to end after the simulation has


class ChainError(RuntimeError):
    """A part of the chain failed. Its text is one line: which, how, and where its log is."""


@dataclass(frozen=True)
class Link:
    """Settings of the node link, in cycles of 60 MHz."""

    sck_divider: int
    word_gap: int
    sample_point: int


@dataclass(frozen=True)
class ChainRun:
    """What one run needs, and where it leaves its files."""

    out: Path
    build: Path
    seed: int
    seconds: float
    lanes: int  # populated
    link: Link

    @property
    def scene(self) -> Path:
        return self.out / "scene"

    @property
    def logs(self) -> Path:
        return self.out / "logs"

    def program(self, name: str) -> str:
        found = next((p for p in sorted(self.build.rglob(name)) if p.is_file() and os.access(p, os.X_OK)), None)
        if found is None:
            raise ChainError(f"{self.build}: no program {name}; run 'make build' first")
        return str(found)


def run_chain(run: ChainRun, progress: Callable[[int], None]) -> float:
    """Run to the end; `progress(tick)` about once a simulated second. Returns wall seconds. Leaves no process behind."""
    run.logs.mkdir(parents=True, exist_ok=True)
    ring = f"whisker-demo-{os.getpid()}"
    began = time.monotonic()
    with ExitStack() as stack:
        place = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="whisker-")))
        stack.callback(_remove_ring, ring)
        socket = str(place / "sim.sock")
        bridge = Child(_bridge(run, ring, socket), run.logs / "bridge.log", _ticks(progress))
        children = [stack.enter_context(closing(bridge))]
        _await_socket(Path(socket), bridge)
        rows = place / "rows"
        os.mkfifo(rows)
        for program in (_log(run, ring, socket), _pilot(run, ring, socket, rows), _navigator(run, rows)):
            children.append(stack.enter_context(closing(Child(program, run.logs / f"{program.name}.log"))))
        _await_end(children)
    return time.monotonic() - began


def _bridge(run: ChainRun, ring: str, socket: str) -> Program:
    wrapper = shutil.which("umockdev-wrapper")
    if wrapper is None:
        raise ChainError("umockdev-wrapper is not installed; run 'make setup' first")
    simulation = [wrapper, run.program("whisker-bridge-sim"), "--scene", run.scene / "scene.flat", "--seed", run.seed]
    simulation += ["--seconds", run.seconds, "--socket", socket, "--followers", FOLLOWERS, "--progress"]
    simulation += ["--truth", run.out / "truth.csv", "--faults", run.out / "faults.csv"]
    simulation += ["--usb-faults", run.out / "usb_faults.csv", "--speed-report", run.out / "speed.json"]
    simulation += ["--lanes-populated", run.lanes]
    daemon = [run.program("whiskerd"), "--ring", ring, "--sck-divider", run.link.sck_divider]
    daemon += ["--word-gap", run.link.word_gap, "--sample-point", run.link.sample_point]
    return Program.of("bridge", [*simulation, "--", *daemon])


def _log(run: ChainRun, ring: str, socket: str) -> Program:
    command = [run.program("whisker-log"), "--ring", ring, "--lanes", run.lanes, "--socket", socket]
    return Program.of("log", [*command, "--bad", run.out / "bad.csv", "--summary", run.out / "log.json"])


def _pilot(run: ChainRun, ring: str, socket: str, rows: Path) -> Program:
    command = [sys.executable, "-m", "whisker.demo.pilot_process", "--ring", ring, "--socket", socket]
    command += ["--scene", run.scene, "--models", run.out / "models", "--seed", run.seed]
    command += ["--out", run.scene / "observations.csv", "--rows", rows, "--traces", run.out / "traces.csv"]
    return Program.of("pilot", [*command, "--report", run.out / "pilot.json"])


def _navigator(run: ChainRun, rows: Path) -> Program:
    command = [sys.executable, "-m", "whisker.demo.navigator_process", "--rows", rows, "--scene", run.scene]
    return Program.of("navigator", [*command, "--out", run.out])


def _ticks(progress: Callable[[int], None]) -> Callable[[str], None]:
    def on_line(line: str) -> None:
        words = line.split()
        if len(words) == 3 and words[0] == "progress":
            progress(int(words[1]))

    return on_line


def _await_socket(path: Path, bridge: Child) -> None:
    while not path.exists():
        _raise_failures([bridge])
        if not bridge.running:
            raise ChainError(f"bridge ended before it began; log: {bridge.log}")
        time.sleep(POLL_S)


def _await_end(children: list[Child]) -> None:
    """Wait for all; the readers must follow the simulation's end soon."""
    give_up = None
    while any(child.running for child in children):
        _raise_failures(children)
        if give_up is None and not children[0].running:
            give_up = time.monotonic() + LAGGARD_S
        if give_up is not None and time.monotonic() > give_up:
            late = next(child for child in children if child.running)
            raise ChainError(f"{late.name} did not end with the run; log: {late.log}")
        time.sleep(POLL_S)
    _raise_failures(children)


def _raise_failures(children: list[Child]) -> None:
    """ChainError if a child has failed. One that falls takes others with it: the first to fall is named."""
    failed = [child for child in children if child.failed]
    if failed:
        raise ChainError(min(failed, key=lambda child: child.ended_s).failure())


def _remove_ring(name: str) -> None:
    """whiskerd removes its ring; this is for one that was killed."""
    Path("/dev/shm", name).unlink(missing_ok=True)
