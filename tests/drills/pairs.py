"""Every process of a paced robot, and every two at once, killed and stopped: do the wheels stop, is all back in motion?

PYTHONPATH=tests .venv/bin/python -m drills.pairs --out build/drills/pairs --minutes 60
It goes on from what --out holds. The robot is the real `whisker robot --simulated --desktop --level bytes`; one is used
until a trial ends it. Where a hit concerns them the wheels have to stand within STOP_S, by the emulated base's own list.
"""

import argparse
import json
import os
import random
import select
import shutil
import signal
import subprocess
import sys
import time
import uuid
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from itertools import combinations
from pathlib import Path

from quickmodels import quick_models

from crunchbot.robot.processes.children import DEAD

from .relays import free_ports

NAMES = ("supervisor", "bridge", "whiskerd", "guard", "driver", "pilot", "navigator", "bag", "view")
CONCERN_WHEELS = {"supervisor", "whiskerd", "guard", "driver", "pilot"}
KILL, STOP = "kill", "stop"
SIGNALS = {KILL: signal.SIGKILL, STOP: signal.SIGSTOP}
TIMES, DRAWN = 3, 300
STOP_S = 0.5
HOLD_S = 0.8  # until what was stopped goes on
LOOK_S = 0.01
UP_S, BACK_S, GONE_S = 90.0, 60.0, 30.0
PAUSE_S = (0.2, 0.8)
STEADY_S = 1.2  # all there and moving for so long before the next trial: a base is started again at once after 1 s
MARK = "WHISKER_DRILL"  # in the environment of every process of a run

# What a process is started as, by words of its command line; the driver is the guard's child of the same words.
WORDS = {
    "bridge": "whisker-bridge-sim",
    "whiskerd": "whiskerd",
    "guard": "whisker-base",
    "pilot": "crunchbot.cli\0pilot",
    "navigator": "crunchbot.cli\0navigator",
    "bag": "crunchbot.cli\0bag",
    "view": "crunchbot.cli\0view",
}

Hits = tuple[tuple[str, str], ...]  # (process, kill or stop), at once


@dataclass
class Trial:
    """What came of the hits. Seconds are the wall's; None: it never happened, or was not asked for."""

    number: int
    hits: Hits
    stop_s: float | None = (
        None  # from the hits to the first order to stand; None too where the wheels are not concerned
    )
    back_s: float | None = None  # from the hold's end until all are there and the robot moves
    left: int = 0  # processes left over by a run that ended
    wrong: list[str] = field(default_factory=list)


class Processes:
    """The processes of one run, by the mark in their environment."""

    def __init__(self, mark: str, supervisor: int):
        self._mark, self._supervisor = f"{MARK}={mark}".encode(), supervisor

    def living(self) -> list[int]:
        """All of them, also those that nobody has started again."""
        return [int(p.name) for p in Path("/proc").glob("[0-9]*") if self._mark in _read(p / "environ") and _lives(p)]

    def pids(self) -> dict[str, int]:
        """Those of NAMES that are there."""
        found = {"supervisor": self._supervisor} if _lives(Path(f"/proc/{self._supervisor}")) else {}
        parents = {pid: _parent(pid) for pid in self.living()}
        for pid, parent in parents.items():
            line = _read(Path(f"/proc/{pid}/cmdline")).decode(errors="replace")
            name = next((name for name, words in WORDS.items() if words in line), None)
            if name and parent == self._supervisor:
                found[name] = pid
            elif name == "guard" and parents.get(parent) == self._supervisor:
                found["driver"] = pid
        return found

    def end(self) -> int:
        """How many are left; none is afterwards."""
        left = self.living()
        for pid in left:
            _send(pid, signal.SIGKILL)
        return len(left)


class Wheels:
    """The emulated base's list of what its wheels were ordered, read as it grows: (monotonic s, whether they turn)."""

    def __init__(self, path: Path):
        self._path, self._at, self.reported = path, 0, []

    def read(self) -> list[tuple[float, bool]]:
        if self._path.exists():
            with self._path.open() as file:
                file.seek(self._at)
                text = file.read()
            whole = text[: text.rfind("\n") + 1]
            self._at += len(whole)
            for line in whole.splitlines():
                if not line.startswith("tick"):
                    _, when, v, omega = map(float, line.split(","))
                    self.reported.append((when, v != 0.0 or omega != 0.0))
        return self.reported

    @property
    def turn(self) -> bool:
        reported = self.read()
        return bool(reported) and reported[-1][1]

    def stopped_after(self, begun: float) -> float | None:
        """Seconds until they stood, 0 where they stood; None: they turn on."""
        before = [turns for when, turns in self.read() if when <= begun]
        if not before or not before[-1]:
            return 0.0
        return next((when - begun for when, turns in self.reported if when > begun and not turns), None)


class Robot:
    """A `whisker robot --simulated` as a process."""

    def __init__(self, out: Path, models: Path, seed: int):
        self.out, mark, port = out, uuid.uuid4().hex, free_ports(4)
        out.mkdir(parents=True)
        words = ["robot", "--simulated", "--desktop", "--level", "bytes", "--seed", seed, "--models", models]
        words += ["--out", out, "--ring", f"whisker-pairs-{mark[:8]}", "--first-port", port, "--view-port", port + 3]
        with (out / "output").open("w") as output:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "crunchbot.cli", *map(str, words)],
                stdout=output,
                stderr=output,
                env=os.environ | {MARK: mark},
                start_new_session=True,
            )
        self.processes, self.wheels = Processes(mark, self.process.pid), Wheels(out / "wheels.csv")

    @property
    def runs(self) -> bool:
        return self.process.poll() is None

    def ends(self, within_s: float) -> bool:
        """Whether the supervisor has ended, or does within so long."""
        if not self.runs:
            return True
        supervisor = os.pidfd_open(self.process.pid)
        try:
            return bool(select.select([supervisor], [], [], within_s)[0])
        finally:
            os.close(supervisor)

    def await_motion(self, patience_s: float) -> bool:
        """Until all are there and the wheels turn, both for STEADY_S but for pauses; False: they are not."""
        until, since, pids = time.monotonic() + patience_s, time.monotonic(), {}
        while time.monotonic() < until and self.runs:
            now = self.processes.pids()
            if now != pids or len(now) < len(NAMES):
                since, pids = time.monotonic(), now
            if time.monotonic() - since >= STEADY_S and self.wheels.turn:
                return True
            self.ends(10 * LOOK_S)
        return False

    def await_gone(self, patience_s: float) -> int:
        """Processes that are there yet after so long; they are ended."""
        await_true(lambda: not self.runs and not self.processes.living(), patience_s)
        return self.processes.end()

    def end(self) -> int:
        """The processes left over by an end in good order."""
        if self.runs:
            self.process.terminate()
        left = self.await_gone(GONE_S)
        self.process.wait()
        return left


def await_true(wanted: Callable[[], bool], patience_s: float) -> bool:
    until = time.monotonic() + patience_s
    while not wanted():
        if time.monotonic() > until:
            return False
        time.sleep(LOOK_S)
    return True


def plan(seed: int) -> list[Hits]:
    """Every process and every two, killed and stopped, TIMES each, and DRAWN more of mixed kinds, in an order drawn."""
    rng = random.Random(seed)
    groups = [(name,) for name in NAMES] + list(combinations(NAMES, 2))
    hits = [tuple((name, kind) for name in group) for group in groups for kind in (KILL, STOP) for _ in range(TIMES)]
    for _ in range(DRAWN):
        names = rng.sample(NAMES, rng.choice((1, 2)))
        hits.append(tuple((name, rng.choice((KILL, STOP))) for name in names))
    rng.shuffle(hits)
    return hits


def ends_run(hits: Hits) -> bool:
    """Whether nobody is left to start again what ended, or the simulation is gone."""
    return bool({("supervisor", KILL), ("bridge", KILL)}.intersection(hits))


def concerns_wheels(hits: Hits) -> bool:
    """Whether they have to stop, and a world that goes on shows it."""
    names = {name for name, _ in hits}
    return bool(CONCERN_WHEELS & names) and "bridge" not in names


def judge_stop(trial: Trial, wheels: Wheels, since: float) -> None:
    """Wait for the wheels to stand; note when they did, and whether that was in time."""
    await_true(lambda: wheels.stopped_after(since) is not None, 10 * STOP_S)
    trial.stop_s = wheels.stopped_after(since)
    if trial.stop_s is None or trial.stop_s > STOP_S:
        trial.wrong.append(f"wheels stopped after {trial.stop_s} s")


def attempt(number: int, hits: Hits, robot: Robot) -> Trial:
    """One trial with a robot that moves."""
    trial, pids = Trial(number, hits), robot.processes.pids()
    targets = [(pids[name], SIGNALS[kind]) for name, kind in hits]
    begun = time.monotonic()
    for pid, sign in targets:
        _send(pid, sign)
    if concerns_wheels(hits):
        judge_stop(trial, robot.wheels, begun)
    time.sleep(max(0.0, begun + HOLD_S - time.monotonic()))
    for pid, sign in targets:
        if sign == signal.SIGSTOP:
            _send(pid, signal.SIGCONT)
    held = time.monotonic()
    if ends_run(hits):
        trial.left = robot.await_gone(GONE_S)
        if trial.left:
            trial.wrong.append(f"{trial.left} processes left over")
    elif robot.await_motion(BACK_S):
        trial.back_s = time.monotonic() - held
    else:
        missing = sorted(set(NAMES) - set(robot.processes.pids()))
        trial.wrong.append(f"not back in motion; missing: {', '.join(missing) or 'nobody'}")
    return trial


class Campaign:
    """Trials by number, those that have been kept out. `run` until all are done or the time is over."""

    def __init__(self, out: Path, seed: int, say=print):
        out.mkdir(parents=True, exist_ok=True)
        self._out, self._seed, self._say = out, seed, say
        self._path, self._models = out / f"trials-{seed}.jsonl", out / "models"
        lines = self._path.read_text().splitlines() if self._path.exists() else []
        self.results = [json.loads(line) for line in lines]
        if not (self._models / "texture.json").exists():
            self._models.mkdir(exist_ok=True)
            quick_models(self._models, seed)

    def run(self, trials: dict[int, Hits], until_s: float) -> None:
        done, robot = {result["number"] for result in self.results}, None
        try:
            for number in (number for number in trials if number not in done):
                if time.monotonic() > until_s:
                    break
                robot = self._moving(robot)
                robot.ends(random.uniform(*PAUSE_S))
                await_true(lambda r=robot: r.wheels.turn, BACK_S)
                trial = attempt(number, trials[number], robot)
                self._keep(trial)
                if ends_run(trial.hits) or trial.wrong:
                    self._end(robot, keep=bool(trial.wrong))
                    robot = None
        finally:
            if robot:
                self._end(robot, keep=False)

    def _moving(self, robot: Robot | None) -> Robot:
        """This robot, or, where there is none, another."""
        if robot is None:
            robot = Robot(self._out / f"run-{time.time_ns()}", self._models.resolve(), self._seed)
            if not robot.await_motion(UP_S):
                robot.end()
                raise SystemExit(f"drills.pairs: no robot that moves; see {robot.out}")
        return robot

    def _end(self, robot: Robot, keep: bool) -> None:
        left = robot.end()
        if left and not keep:
            self._note({"number": -1, "hits": [], "wrong": [f"{left} processes left over by an end in good order"]})
        if not keep:
            shutil.rmtree(robot.out)

    def _keep(self, trial: Trial) -> None:
        self._note(asdict(trial))
        reported = ", ".join(f"{name} {kind}" for name, kind in trial.hits)
        numbers = f"stopped {_s(trial.stop_s)}  back {_s(trial.back_s)}"
        self._say(f"{trial.number:4}  {reported:36} {numbers}  {'; '.join(trial.wrong)}")

    def _note(self, result: dict) -> None:
        self.results.append(result)
        with self._path.open("a") as file:
            file.write(json.dumps(result) + "\n")

    def summary(self, wanted: int) -> str:
        """How many trials, what was wrong, and how long it took."""
        wrong = [result for result in self.results if result["wrong"]]
        lines = [f"{len({r['number'] for r in self.results} - {-1})} of {wanted} trials, {len(wrong)} with failures"]
        for key, text in (("stop_s", "wheels stopped, s"), ("back_s", "back in motion, s")):
            times = sorted(result[key] for result in self.results if result.get(key) is not None)
            if times:
                lines.append(f"{text}: median {times[len(times) // 2]:.2f}, worst {times[-1]:.2f}, of {len(times)}")
        lines += [f"{count} times: {text}" for text, count in Counter(w for r in wrong for w in r["wrong"]).items()]
        return "\n".join(lines)


def _s(value: float | None) -> str:
    return "   -" if value is None else f"{value:4.2f}"


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:
        return b""


def _stat(path: Path) -> list[str]:
    """State, parent, group ... of proc(5)."""
    return _read(path / "stat").decode(errors="replace").rpartition(")")[2].split()


def _lives(path: Path) -> bool:
    words = _stat(path)
    return bool(words) and words[0] not in DEAD


def _parent(pid: int) -> int:
    words = _stat(Path(f"/proc/{pid}"))
    return int(words[1]) if words else 0


def _send(pid: int, sign: int) -> None:
    try:
        os.kill(pid, sign)
    except ProcessLookupError:
        return


def main() -> int:
    parser = argparse.ArgumentParser(prog="drills.pairs", description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("build/drills/pairs"))
    parser.add_argument("--minutes", type=float, default=24 * 60.0, help="begin no trial after so long (a day)")
    parser.add_argument("--seed", type=int, default=3, help="of scene, robot and order (3)")
    parser.add_argument("--only", type=int, metavar="N", help="the first N trials")
    arguments = parser.parse_args()
    trials = dict(enumerate(plan(arguments.seed)[: arguments.only]))
    campaign = Campaign(arguments.out, arguments.seed, say=lambda text: print(text, flush=True))
    campaign.run(trials, time.monotonic() + 60.0 * arguments.minutes)
    print(campaign.summary(len(trials)))
    return int(any(result["wrong"] for result in campaign.results))


if __name__ == "__main__":
    sys.exit(main())
