"""Runs the chain: simulated bridge with whiskerd inside, whisker-log and the pilot as processes of their own."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

FOLLOWERS = 2  # whisker-log and the pilot
POLL_S = 0.05
GRACE_S = 10.0  # for a child to end after SIGTERM, before SIGKILL
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


class Child:
    """A child process in a group of its own, its output in a log file."""

    def __init__(self, name: str, command: list[str], log: Path, on_line: Callable[[str], None] | None = None):
        self.name, self.log = name, log
        self._log = open(log, "w")  # noqa: SIM115 - closed by close()
        where = subprocess.PIPE if on_line else self._log
        self.process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=self._log, stderr=where, text=True, start_new_session=True
        )
        self._reader = threading.Thread(target=self._read, args=(on_line,), daemon=True) if on_line else None
        if self._reader:
            self._reader.start()

    def _read(self, on_line) -> None:
        for line in self.process.stderr:
            self._log.write(line)
            on_line(line)

    def check(self) -> bool:
        """Whether it has ended well; ChainError if badly."""
        code = self.process.poll()
        if code:
            if self._reader:
                self._reader.join(timeout=1.0)
            self._log.flush()
            lines = [line for line in self.log.read_text().splitlines() if not line.startswith("progress ")]
            said = f": {lines[-1]}" if lines else ""
            raise ChainError(f"{self.name} failed ({_how(code)}){said}; log: {self.log}")
        return code is not None

    def close(self) -> None:
        """End it if it still runs, with whatever it has started."""
        for sign in (signal.SIGTERM, signal.SIGKILL):
            if self.process.poll() is None:
                self._signal(sign)
                try:
                    self.process.wait(timeout=GRACE_S)
                except subprocess.TimeoutExpired:
                    continue
        self._signal(signal.SIGKILL)  # grandchildren of one that died
        if self._reader:
            self._reader.join(timeout=1.0)
        self._log.close()

    def _signal(self, sign: signal.Signals) -> None:
        try:
            os.killpg(self.process.pid, sign)
        except ProcessLookupError:
            return


def run_chain(run: ChainRun, progress: Callable[[int], None]) -> float:
    """Run to the end; `progress(tick)` about once a simulated second. Returns wall seconds. Leaves no process behind."""
    run.logs.mkdir(parents=True, exist_ok=True)
    ring = f"whisker-demo-{os.getpid()}"
    began = time.monotonic()
    with ExitStack() as stack:
        place = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="whisker-")))
        stack.callback(_remove_ring, ring)
        socket = str(place / "sim.sock")
        children = [
            stack.enter_context(
                _closing(Child("bridge", _bridge(run, ring, socket), run.logs / "bridge.log", _ticks(progress)))
            )
        ]
        _await_socket(Path(socket), children[0])
        for name, command in (("log", _log(run, ring, socket)), ("pilot", _pilot(run, ring, socket))):
            children.append(stack.enter_context(_closing(Child(name, command, run.logs / f"{name}.log"))))
        _await_end(children)
    return time.monotonic() - began


def _bridge(run: ChainRun, ring: str, socket: str) -> list[str]:
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
    return [str(word) for word in [*simulation, "--", *daemon]]


def _log(run: ChainRun, ring: str, socket: str) -> list[str]:
    command = [run.program("whisker-log"), "--ring", ring, "--lanes", run.lanes, "--socket", socket]
    return [str(word) for word in [*command, "--bad", run.out / "bad.csv", "--summary", run.out / "log.json"]]


def _pilot(run: ChainRun, ring: str, socket: str) -> list[str]:
    command = [sys.executable, "-m", "whisker.demo.pilot_process", "--ring", ring, "--socket", socket]
    command += ["--scene", run.scene, "--models", run.out / "models", "--seed", run.seed]
    command += ["--out", run.scene / "observations.csv", "--traces", run.out / "traces.csv"]
    return [str(word) for word in [*command, "--report", run.out / "pilot.json"]]


def _ticks(progress: Callable[[int], None]) -> Callable[[str], None]:
    def on_line(line: str) -> None:
        words = line.split()
        if len(words) == 3 and words[0] == "progress":
            progress(int(words[1]))

    return on_line


def _await_socket(path: Path, bridge: Child) -> None:
    while not path.exists():
        if bridge.check():
            raise ChainError(f"bridge ended before it began; log: {bridge.log}")
        time.sleep(POLL_S)


def _await_end(children: list[Child]) -> None:
    """Wait for all; the readers must follow the simulation's end soon."""
    running, give_up = list(children), None
    while running:
        running = [child for child in running if not child.check()]
        if give_up is None and children[0] not in running:
            give_up = time.monotonic() + LAGGARD_S
        if running and give_up is not None and time.monotonic() > give_up:
            raise ChainError(f"{running[0].name} did not end with the run; log: {running[0].log}")
        time.sleep(POLL_S)


class _closing:
    def __init__(self, child: Child):
        self._child = child

    def __enter__(self) -> Child:
        return self._child

    def __exit__(self, *exception) -> None:
        self._child.close()


def _remove_ring(name: str) -> None:
    """whiskerd removes its ring; this is for one that was killed."""
    Path("/dev/shm", name).unlink(missing_ok=True)


def _how(code: int) -> str:
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
