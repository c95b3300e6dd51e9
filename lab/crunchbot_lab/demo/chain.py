"""Runs the whole robot in lock-step, each part a process: simulated bridge with whiskerd inside and the base's serial
line, whisker-log, whisker-base, pilot; over zenoh the navigator, or a mapper, and the bag's recorder. One seed gives one
result.
"""

import os
import shutil
import socket
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass, field, replace
from pathlib import Path

from crunchbot.pilot.behaviour import BLOCK_TICKS
from crunchbot.robot.network import link as network
from crunchbot.robot.network.truth import TruthWatcher
from crunchbot.robot.policy import RANDOM
from crunchbot.robot.processes import parts
from crunchbot.robot.processes.children import Child, Program

from ..report.run import FILTERS

FOLLOWERS = 2  # whisker-log and the pilot
# Frames of a USB transfer. In lock-step nobody waits for a single frame, but each transfer wakes three processes. More than
# a block would hold the simulation up for good: it goes EFFECT_TICKS beyond the block that the pilot has answered.
BATCH = BLOCK_TICKS
POLL_S = 0.05
LAGGARD_S = 20.0  # for the readers to end after the simulation has


class ChainError(RuntimeError):
    """A part of the chain failed. Its text is one line: which, how, and where its log is."""


@dataclass(frozen=True)
class SpiLink:
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
    link: SpiLink
    create: int | None = 1  # the base: iRobot Create 1 or 2; None: wheels that obey at once, without a serial line
    level: str = "rtl"  # of the bridge; or bytes, or mixed: the same frames
    rtl_seconds: float = 5.0  # level mixed: so long from the start every clock cycle of the bridge is simulated
    filters: tuple[str, ...] = FILTERS
    known: Path | None = None  # scene folder that the navigator is given; None: that of the world
    map_folder: Path | None = None  # a mapper in the navigator's place writes it
    choose: str = RANDOM  # of turns and drives
    before: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # by a program's name: words before its own

    @property
    def scene(self) -> Path:
        return self.out / "scene"

    @property
    def inference(self) -> str:
        """The process that takes the rows."""
        return parts.MAPPER if self.map_folder else parts.NAVIGATOR

    @property
    def logs(self) -> Path:
        return self.out / "logs"

    @property
    def bag(self) -> Path:
        return self.out / "robot.mcap"

    def program(self, name: str) -> str:
        found = next((p for p in sorted(self.build.rglob(name)) if p.is_file() and os.access(p, os.X_OK)), None)
        found = found or shutil.which(name)
        if found is None:
            raise ChainError(f"{self.build}: no program {name}; run 'make build' first")
        return str(found)


@dataclass(frozen=True)
class Places(parts.Places):
    """Where the processes of a chain meet: at endpoints of zenoh, too."""

    pilot: str
    navigator: str
    truth: str


def run_chain(run: ChainRun, progress: Callable[[int], None]) -> float:
    """Run to the end; `progress(tick)` about once a simulated second. Returns wall seconds. Leaves no process behind."""
    run.logs.mkdir(parents=True, exist_ok=True)
    ring = f"whisker-demo-{os.getpid()}"
    began = time.monotonic()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="whisker-")))
        stack.callback(_remove_ring, ring)
        places = Places(ring, folder, *_free_endpoints(3))
        body = parts.Body(run.scene, run.out / "models", run.create, places.serial, run.seed, run.choose)
        table = parts.Table(body, places, run.program)
        bridge = Child(_bridge(run, table), run.logs / "bridge.log", _ticks(progress))
        children = [stack.enter_context(closing(bridge))]
        _await_file(places.simulation, bridge)
        link = stack.enter_context(network.Link("truth", listen=[places.truth], lock_step=True))
        TruthWatcher(places.simulation, link, threading.Event()).start()
        base = [Program.of("base", [*table.base(), "--clock", "stream"], serves=True)] if run.create else []
        others = [make(run, places, table) for make in (_pilot, _mapper if run.map_folder else _navigator, _bag)]
        for program in [*base, _log(run, places), *others]:
            command = (*run.before.get(program.name, ()), *program.command)
            child = Child(replace(program, command=command), run.logs / f"{program.name}.log")
            children.append(stack.enter_context(closing(child)))
        _await_end(children)
    return time.monotonic() - began


def _bridge(run: ChainRun, table: parts.Table) -> Program:
    if shutil.which("umockdev-wrapper") is None:
        raise ChainError("umockdev-wrapper is not installed; run 'make setup' first")
    simulated = parts.Simulated(run.scene / "scene.flat", run.level, run.seed, run.seconds, None, run.out / "truth.csv")
    simulation = [*table.bridge(simulated), "--followers", FOLLOWERS, "--progress", "--lanes-populated", run.lanes]
    simulation += ["--faults", run.out / "faults.csv", "--usb-faults", run.out / "usb_faults.csv"]
    simulation += ["--speed-report", run.out / "speed.json"]
    simulation += ["--rtl-seconds", run.rtl_seconds] if run.level == "mixed" else []
    daemon = [*table.daemon(), "--batch", BATCH, "--sck-divider", run.link.sck_divider]
    daemon += ["--word-gap", run.link.word_gap, "--sample-point", run.link.sample_point]
    return Program.of(parts.BRIDGE, [*simulation, "--", *daemon])


def _log(run: ChainRun, places: Places) -> Program:
    command = [run.program("whisker-log"), "--ring", places.ring, "--lanes", run.lanes, "--socket", places.simulation]
    return Program.of("log", [*command, "--bad", run.out / "bad.csv", "--summary", run.out / "log.json"])


def _pilot(run: ChainRun, places: Places, table: parts.Table) -> Program:
    command = [*table.pilot(), "--simulation", places.simulation, *(["--base", places.base] if run.create else [])]
    command += ["--lock-step", "--listen", places.pilot, "--connect", "none"]
    command += [word for name in (run.inference, "bag") for word in ("--await", name)]
    command += ["--out", run.scene / "observations.csv", "--traces", run.out / "traces.csv"]
    return Program.of("pilot", [*command, "--report", run.out / "pilot.json"])


def _navigator(run: ChainRun, places: Places, table: parts.Table) -> Program:
    navigator = parts.Table(replace(table.body, scene=run.known or run.scene), places, table.find).navigator()
    command = [*navigator, "--lock-step", "--listen", places.navigator, "--connect", places.pilot]
    command += [word for name in run.filters for word in ("--filter", name)]
    return Program.of("navigator", [*command, "--out", run.out, "--report", run.out / "navigator.json"])


def _mapper(run: ChainRun, places: Places, table: parts.Table) -> Program:
    command = [*table.mapper(run.map_folder), "--lock-step", "--listen", places.navigator, "--connect", places.pilot]
    return Program.of("mapper", [*command, "--report", run.out / "mapper.json"])


def _bag(run: ChainRun, places: Places, table: parts.Table) -> Program:
    command = [*table.bag(run.bag), "--lock-step", "--connect", places.pilot]
    command += ["--connect", places.navigator, "--connect", places.truth]
    return Program.of("bag", command)


def _free_endpoints(count: int) -> list[str]:
    """So many of this machine's that nobody listened at a moment ago."""
    with ExitStack() as stack:
        servers = [stack.enter_context(socket.create_server(("127.0.0.1", 0))) for _ in range(count)]
        return [f"tcp/127.0.0.1:{server.getsockname()[1]}" for server in servers]


def _ticks(progress: Callable[[int], None]) -> Callable[[str], None]:
    def on_line(line: str) -> None:
        words = line.split()
        if len(words) == 3 and words[0] == "progress":
            progress(int(words[1]))

    return on_line


def _await_file(path: Path, bridge: Child) -> None:
    while not path.exists():
        _raise_failures([bridge])
        if not bridge.running:
            raise ChainError(f"bridge ended before it began; log: {bridge.log}")
        time.sleep(POLL_S)


def _await_end(children: list[Child]) -> None:
    """Wait for all but those that serve; the readers must follow the simulation's end soon."""
    give_up = None
    while any(child.running and not child.program.serves for child in children):
        _raise_failures(children)
        if give_up is None and not children[0].running:
            give_up = time.monotonic() + LAGGARD_S
        if give_up is not None and time.monotonic() > give_up:
            late = next(child for child in children if child.running and not child.program.serves)
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
