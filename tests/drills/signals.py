"""Pairs of signals, 0 to 200 us apart, at the shared stop code and at every command that uses it: all have to end.

PYTHONPATH=tests .venv/bin/python -m drills.signals --pairs 10000 --each 200 --out build/drills/signals
It goes on from what --out holds. Each trial is a process forked from this one, which has imported everything.
"""

import argparse
import atexit
import contextlib
import json
import os
import random
import select
import signal
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from quickmodels import quick_models

from crunchbot import cli, stopping
from crunchbot import scene as scenes
from crunchbot.bridge.ring import FRAME, Writer
from crunchbot_lab.simulation.scenes import make_scene

from .relays import free_ports

PAIRS = ((signal.SIGTERM, signal.SIGTERM), (signal.SIGTERM, signal.SIGHUP), (signal.SIGINT, signal.SIGTERM))
GAP_MOST_S = 200e-6
BATCH = 200  # pairs at the stop code in one process
UP_S = 60.0  # for a command to have its handlers
LATER_MOST_S = 0.3  # a pair comes so long after them at most
LOOK_S = 0.002  # between two looks at a command's handlers
HUNG_S = 20.0  # a process that lives so long after its pair hangs
BLOCK, BLOCK_S = 40, 0.02  # ticks, and how long they take
SEED = 3
SHARED = "stop code"


@dataclass(frozen=True)
class Surroundings:
    """What the commands are given to work on."""

    folder: Path
    ring: str

    def words(self) -> dict[str, list]:
        """By command: a call of it that goes on until it is stopped."""
        scene, models, port = self.folder / "scene", self.folder / "models", free_ports(4)
        listen = ["--listen", f"tcp/127.0.0.1:{port}", "--connect", "none"]
        robot = [scene, "--models", models, "--port", self.folder / "none", "--first-port", port, "--no-daemon"]
        ring = ["--ring", self.ring]
        return {
            "top": [*ring, "--interval", 3600],
            "stream": [*ring, "--every", 1000],
            "record": [self.folder / "new.mcap", "--overwrite", *ring],
            "replay": [self.folder / "old.mcap", "--lead", 3600, "--ring", f"{self.ring}-replayed"],
            "navigator": [scene, "--stay", *listen],
            "pilot": [scene, "--models", models, "--base", self.folder / "base", *ring, *listen],
            "bag": [self.folder / "bag.mcap", "--overwrite", "--stay", *listen],
            "pyro": ["--port", 0, *listen],
            "view": [*ring, "--port", 0],
            "bridge-sim": ["--level", "bytes", "--ring", f"{self.ring}-sim"],
            "robot": [*robot, "--out", self.folder / "run"],
        }


def prepare(folder: Path) -> Surroundings:
    """Scene, models and recording, made where they are missing; the ring is `feed`'s."""
    made = Surroundings(folder, f"whisker-signals-{os.getpid()}")
    if not (folder / "models/texture.json").exists():
        (folder / "models").mkdir(parents=True, exist_ok=True)
        scenes.write(folder / "scene", make_scene(SEED)[0])
        quick_models(folder / "models", SEED)
    return made


@contextlib.contextmanager
def feed(made: Surroundings):
    """A ring with frames, from a process of its own; and a recording of it."""
    child = os.fork()
    if child == 0:
        _feed(made.ring)
    try:
        words = ["record", made.folder / "old.mcap", "--overwrite", "--ring", made.ring, "--wait", 60, "--frames", 400]
        recorder = begin(words, made.folder / "output")
        assert await_end(recorder, time.monotonic()) == 0, (made.folder / "output").read_text()
        yield
    finally:
        os.kill(child, signal.SIGTERM)
        os.waitpid(child, 0)
        Path("/dev/shm", made.ring).unlink(missing_ok=True)


def _feed(ring: str) -> None:
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM])
    with Writer(ring, 4096) as writer:
        frames = np.zeros(BLOCK, FRAME)
        frames["lane_mask"] = 1
        for number in range(10**9):
            frames["tick"] = np.arange(number * BLOCK, (number + 1) * BLOCK)
            frames["sequence"], frames["time_cycles"] = frames["tick"], frames["tick"] * 30000
            writer.publish(frames)
            if signal.sigtimedwait([signal.SIGTERM], BLOCK_S):
                break
    os._exit(0)


def begin(words: list, output: Path) -> int:
    """The pid of a process that runs this command to its end."""
    child = os.fork()
    if child:
        return child
    file = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    os.setsid()
    os.dup2(file, 1)
    os.dup2(file, 2)
    code = cli.main([str(word) for word in words])
    threading._shutdown()  # as at the interpreter's own end, but without what the process forked from has to end
    atexit._run_exitfuncs()
    sys.stdout.flush()
    os._exit(code)


def await_end(pid: int, since: float) -> int | None:
    """The exit code, negative for a signal; None: it hung, and was killed."""
    if ends(pid, since + HUNG_S - time.monotonic()):
        return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    return None


def ends(pid: int, within_s: float) -> bool:
    """Whether this child ends, and is not yet waited for, within so long."""
    process = os.pidfd_open(pid)
    try:
        return bool(select.select([process], [], [], max(0.0, within_s))[0])
    finally:
        os.close(process)


def handles(pid: int) -> bool:
    """Whether it has a handler for SIGTERM, by what the kernel knows of it."""
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith("SigCgt:"):
                return bool(int(line.split()[1], 16) >> (signal.SIGTERM - 1) & 1)
    return False


def send_pair(pid: int, pair: tuple[int, int], gap_s: float) -> None:
    first, second = pair
    os.kill(pid, first)
    until = time.perf_counter() + gap_s
    while time.perf_counter() < until:
        continue
    os.kill(pid, second)


def at_command(name: str, words: list, made: Surroundings, rng: random.Random) -> dict:
    """One pair at one run of a command; what came of it."""
    pair, gap_s, later_s = rng.choice(PAIRS), rng.uniform(0.0, GAP_MOST_S), rng.uniform(0.0, LATER_MOST_S)
    pid = begin([name, *words], made.folder / "output")
    up_by = time.monotonic() + UP_S
    while not handles(pid):
        assert time.monotonic() < up_by and not ends(pid, LOOK_S), (made.folder / "output").read_text()
    assert not ends(pid, later_s), (made.folder / "output").read_text()
    send_pair(pid, pair, gap_s)
    code = await_end(pid, time.monotonic())
    result = {"what": name, "pairs": 1, "hung": int(code is None), "code": code}
    return result | {"signals": [int(s) for s in pair], "gap_us": round(gap_s * 1e6)}


def at_stop_code(pairs: int, rng: random.Random) -> dict:
    """So many pairs at one process that waits as the supervisor does; it is replaced when it hangs."""
    done = hung = 0
    while done < pairs:
        pid, woken = _waiter()
        with os.fdopen(woken, "rb", buffering=0) as reported:
            while done < pairs:
                assert reported.read(1) == b"r"
                send_pair(pid, rng.choice(PAIRS), rng.uniform(0.0, GAP_MOST_S))
                done += 1
                if not _answers(reported):
                    hung += 1
                    break
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
    return {"what": SHARED, "pairs": done, "hung": hung, "code": 0}


def _waiter() -> tuple[int, int]:
    """(pid of a process, pipe): it writes r when it waits for a signal, d when it has been stopped by one."""
    reading, writing = os.pipe()
    child = os.fork()
    if child:
        os.close(writing)
        return child, reading
    while True:
        stop, woken = stopping.stop_on_signals(), threading.Event()
        threading.Thread(target=lambda s=stop, w=woken: (s.wait(), w.set()), daemon=True).start()
        os.write(writing, b"r")
        while not stop.is_set():
            woken.wait(0.05)
        os.write(writing, b"d")


def _answers(reported) -> bool:
    return bool(select.select([reported], [], [], HUNG_S)[0]) and reported.read(1) == b"d"


class Campaign:
    """Trials and their results, a line of JSON each in `results`, from which a later run goes on."""

    def __init__(self, out: Path, seed: int):
        out.mkdir(parents=True, exist_ok=True)
        self._path, self._rng = out / "signals.jsonl", random.Random(f"{seed} {time.time_ns()}")
        self.results = [json.loads(line) for line in self._path.read_text().splitlines()] if self._path.exists() else []

    def fill(self, what: str, wanted: int, most: int, trial: Callable[[int, random.Random], dict]) -> None:
        """Trials of at most `most` pairs until there are `wanted`."""
        while (left := wanted - self.count("pairs", what)) > 0:
            self.results.append(trial(min(left, most), self._rng))
            with self._path.open("a") as file:
                file.write(json.dumps(self.results[-1]) + "\n")

    def count(self, key: str, what: str) -> int:
        return sum(result[key] for result in self.results if result["what"] == what)

    def summary(self) -> str:
        lines = []
        for what in dict.fromkeys(result["what"] for result in self.results):
            codes = Counter(str(result["code"]) for result in self.results if result["what"] == what)
            reported = ", ".join(f"{count} times {code}" for code, count in codes.items())
            lines.append(
                f"{what:12} {self.count('pairs', what):6} pairs, {self.count('hung', what)} hung; exit {reported}"
            )
        return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(prog="drills.signals", description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=10000, help="at the shared stop code (10000)")
    parser.add_argument("--each", type=int, default=200, help="at each command (200)")
    parser.add_argument("--only", action="append", metavar="COMMAND", help="of the commands; repeatable")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("build/drills/signals"))
    arguments = parser.parse_args()
    for name in cli.COMMANDS:
        cli.command_module(name)
    campaign = Campaign(arguments.out, arguments.seed)
    campaign.fill(SHARED, arguments.pairs, BATCH, at_stop_code)
    made = prepare(arguments.out.resolve())
    with feed(made):
        for name, words in made.words().items():
            if not arguments.only or name in arguments.only:
                campaign.fill(name, arguments.each, 1, lambda _, rng, n=name, w=words: at_command(n, w, made, rng))
    print(campaign.summary())
    return int(any(result["hung"] or result["code"] for result in campaign.results))


if __name__ == "__main__":
    sys.exit(main())
