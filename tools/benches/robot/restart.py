"""Navigators killed and begun anew on level-1 runs: how soon the pose is right again, with and without a checkpoint.

.venv/bin/python tools/benches restart                  20 scenes, 4 moments each; writes bench/results/restart.json
.venv/bin/python tools/benches restart --scenes 2       a short one, printed

Level 1: the world's signals through a pilot with models that it learnt, half a minute a scene.
Each row is weighed. Of each run a navigator is killed at moments drawn by the seed, and the next one, of the same
filter, gets the rows after a gap:

  gap 0, 1, 5 s   from the same pilot, which went on meanwhile
  pilot too       the pilot dies as well, and is back 1 s later, its sum of motion from zero; the robot drove on
  carried         1 s, in which the robot is put where it was at another time of the run: the checkpoint is wrong
"""

import argparse
import json
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from crunchbot.pilot.pilot import Pilot
from crunchbot.robot.memory import Memory
from crunchbot.robot.models import load_models
from crunchbot.robot.network import belief
from crunchbot.robot.network.inbox import Received
from crunchbot.robot.network.rows import Follower, to_message
from crunchbot.robot.network.streams import Envelope
from crunchbot.robot.track import Track
from crunchbot.scene import Prior
from crunchbot_lab.demo.level1 import explore
from crunchbot_lab.demo.training import learn
from crunchbot_lab.scenes.sweep import sweep
from crunchbot_lab.simulation.scenes import make_scene

from .. import store

ROOT = Path(__file__).resolve().parents[3]
FIRST_SEED, SCENES, FILTER = 9101, 20, "adaptive"
RUN_S, FIRST_S, LAST_S, AFTER_S = 200, 30.0, 130.0, 60.0
NEAR_M, STAYS_S = 0.25, 3.0  # as in the drills
EVERY = 5  # rows between two checkpoints: 2 Hz
CASES = {"gap 0 s": (0, 0), "gap 1 s": (10, 0), "gap 5 s": (50, 0), "pilot too": (10, 1), "carried": (10, 2)}


@dataclass
class Run:
    """rows: cells; truth: (n, 3)."""

    scene: object
    rows: list[dict]
    truth: np.ndarray


def make_run(seed: int) -> Run:
    scene, start = make_scene(seed)
    with tempfile.TemporaryDirectory() as folder:
        learn(Path(folder), scene, seed, lambda: None)
        pilot = Pilot(scene.robot, *load_models(Path(folder), scene.robot), seed)
    rows, truth = explore(scene, start, pilot, seed, RUN_S * 2000)
    return Run(scene, rows, np.array([[row["x_m"], row["y_m"], row["theta_rad"]] for row in truth]))


def messages(rows: list[dict], stream: int, first: int = 0, sum_from=(0.0, 0.0, 0.0)) -> list[Received]:
    """As a pilot would have sent them: stamped 0.1 s apart from row `first` of the run on, and so by the wall's
    clock."""
    pose, out = np.array(sum_from), []
    for n, row in enumerate(rows):
        number = n if stream == 2 else first + n
        message = to_message(replace(row, t_s=0.1 * (first + n + 1)), number, pose)
        pose = message.pose
        out.append(Received("observation", message, Envelope(stream, number, message.header.stamp.ns)))
    return out


class Navigator:
    """What crunchbot.robot.navigator does with rows, but for the network."""

    def __init__(self, run: Run, path: Path | None):
        self._scene, self._memory = run.scene, Memory(path, run.scene, (FILTER,))
        self._follower, self._track = Follower(), None

    def take(self, received: Received, stack=None) -> np.ndarray:
        if self._track is None:
            self._begin(received)
        (step,) = self._follower.take([received])
        estimate = self._track.take(step)
        if step.row.seq % EVERY == 0:
            self._memory.keep(step, {FILTER: belief.condense(self._track.filter.components())})
        return np.array(estimate.pose)

    def _begin(self, received: Received) -> None:
        recalled = self._memory.recall(received)
        if recalled:
            self._follower.resume(recalled[0])
        resumed = received.message.header.stamp.ns > 10**8
        scene = replace(self._scene, prior=Prior("uniform")) if resumed else self._scene
        self._track = Track(FILTER, scene, None, None, resumed, recalled and recalled[1][FILTER])


def off(pose, truth) -> float:
    return float(np.hypot(*(pose[:2] - truth[:2])))


def follow(navigator: Navigator, rows: list[Received], truth: np.ndarray) -> tuple[float, float | None]:
    """Error after the first row; seconds until the pose is near and stays so, None: not within these rows."""
    first, near = None, 0
    for n, (row, at) in enumerate(zip(rows, truth, strict=True)):
        error = off(navigator.take(row), at)
        first = error if first is None else first
        near = near + 1 if error <= NEAR_M else 0
        if near == round(STAYS_S * 10):
            return first, (n + 1 - near) / 10.0
    return first, None


def after(run: Run, killed: int, case: str) -> tuple[list[Received], np.ndarray]:
    """Rows that the new navigator gets, and their truth."""
    gap, kind = CASES[case]
    begins, count = killed + gap, round(AFTER_S * 10)
    source = begins
    if kind == 2:  # half of the run away, round its end
        source = begins + 600 if begins + 600 + count <= len(run.rows) else begins - 600
    rows, truth = run.rows[source : source + count], run.truth[source : source + count]
    if kind == 1:
        return messages(rows, 2, begins), truth
    found = messages(run.rows[:begins], 1)[-1].message.pose
    return messages(rows, 1, begins, found), truth


def trial(run: Run, killed: int, folder: Path, before: dict) -> list[dict]:
    out = []
    for case in CASES:
        rows, truth = after(run, killed, case)
        for way in ("checkpoint", "uniform"):
            path = folder / f"{case}.checkpoint"
            path.write_bytes(before["file"])
            navigator = Navigator(run, path if way == "checkpoint" else None)
            first, again_s = follow(navigator, rows, truth)
            out.append({"case": case, "way": way, "right": before["right"], "first": first, "again_s": again_s})
    return out


def trials(seed: int, moments: int) -> dict[str, list[dict]]:
    run, rng = make_run(seed), np.random.default_rng([seed, 1])
    killed = sorted(rng.choice(np.arange(round(FIRST_S * 10), round(LAST_S * 10)), moments, replace=False))
    out = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "checkpoint"
        navigator, errors = Navigator(run, path), []
        for n, received in enumerate(messages(run.rows[: killed[-1] + 1], 1)):
            if n in killed:
                out += trial(run, n, Path(folder), {"file": path.read_bytes(), "right": errors[-1] <= NEAR_M})
            errors.append(off(navigator.take(received), run.truth[n]))
    return {"restarts": out}


def summary(entries: list[dict]) -> dict:
    """By case and way: shares, and seconds until near again."""
    found = {}
    for case in CASES:
        for way in ("checkpoint", "uniform"):
            of = [e for e in entries if e["case"] == case and e["way"] == way]
            of = [e for e in of if e["right"]]
            again = np.array([np.inf if e["again_s"] is None else e["again_s"] for e in of])
            found[f"{case}, {way}"] = {
                "restarts": len(of),
                "near at once": round(float(np.mean([e["first"] <= NEAR_M for e in of])), 3),
                "near again within 60 s": round(float(np.mean(np.isfinite(again))), 3),
                "again_s": [None if np.isinf(q) else round(float(q), 1) for q in quantiles(again)],
            }
    return found


def quantiles(values: np.ndarray) -> np.ndarray:
    """Median, 90 %, worst: values that were reached, for some are infinite."""
    return np.quantile(values, [0.5, 0.9, 1.0], method="higher")


def run(build: Path, scenes: int = SCENES, moments: int = 4, out: Path | None = None) -> None:
    """`build` is not used: the Python modules are what counts."""
    seeds = range(FIRST_SEED, FIRST_SEED + scenes)
    jobs = {f"{seed}, {moments} moments": {"seed": seed, "moments": moments} for seed in seeds}
    done = sweep(trials, jobs, store.kept("restart"), label="restart")
    entries = [entry for of in done.values() for entry in of["restarts"]]
    found = {"filter": FILTER, "scenes": scenes, "moments": moments, "cases": summary(entries)}
    kills = len(entries) // (2 * len(CASES))
    found |= {"kills": kills, "right before": sum(e["right"] for e in entries) // (2 * len(CASES))}
    print(json.dumps(found, indent=1))
    out = out or (store.RESULTS / "restart.json" if scenes == SCENES else None)
    if out:
        out.write_text(json.dumps(found, indent=1) + "\n")
    if out == store.RESULTS / "restart.json":
        store.record_origin("restart")


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--scenes", type=int, default=SCENES)
    parser.add_argument("--moments", type=int, default=4, help="kills per scene (4)")
    parser.add_argument("--out", type=Path, help="default: bench/results/restart.json when all scenes are run")
