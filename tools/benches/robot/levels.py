"""The same scenes at every level of simulation: pose error, texture accuracy and real-time factor.

One arena, start, prior and seed of the pilot's turns per scene; one robot's whiskers, which learn anew at each
mechanics. A level's cost is processor time of all that runs, from the world to the poses of four filters, start-up
included; training is not.
"""

import json
import resource
import shutil
import tempfile
import time
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from tqdm import tqdm

from crunchbot import scene as scene_files
from crunchbot.nav import localise
from crunchbot.pilot.pilot import Pilot
from crunchbot.robot.models import load_models
from crunchbot.scene import Scene
from crunchbot_lab import scenes
from crunchbot_lab.demo.__main__ import judge, read_dicts
from crunchbot_lab.demo.chain import ChainRun, Link, run_chain
from crunchbot_lab.demo.level1 import explore
from crunchbot_lab.demo.summary import pose_scores, texture_scores
from crunchbot_lab.demo.training import learn
from crunchbot_lab.report.run import FILTERS
from crunchbot_lab.scenes import geometry, readings
from crunchbot_lab.scenes.families import SIGNALS
from crunchbot_lab.simulation.scenes import MECHANICS, make_scene, simulated

SECONDS, ROWS, TICKS = 60.0, 600, 120_000
LANES, LINK = 6, Link(6, 30, 5)
ROBOT = 901  # seed of the whiskers and their training
FIRST_SEED = 8101
POSES = ("x_m", "y_m", "theta_rad")
FAR_M = 0.03  # a contact may be so far beyond the whisker's straight tip
INTERVAL, DRAWS = (2.5, 97.5), 10_000
LEAST_SEEDS = 5  # of an interval that is worth reporting


@dataclass(frozen=True)
class Case:
    """A level, with how many seeds it is given."""

    name: str
    title: str
    seeds: int
    level: int
    mechanics: str = MECHANICS[0]
    create: int | None = None


SIGNAL_CASES = tuple(Case(f"signals_{name}", f"1 signals, {name}", 24, 1, name) for name in MECHANICS)
DEFAULT, FINEST = SIGNAL_CASES[0].name, SIGNAL_CASES[-1].name
CASES = (
    Case("drawn", "0 drawn observations", 24, 0),
    *SIGNAL_CASES,
    Case("bytes_bare", "2 bytes, no Create", 2, 2),
    Case("bytes", "2 bytes, Create 1", 8, 2, create=1),
    Case("rtl", "3 RTL, Create 1", 2, 3, create=1),
)
PAIRS = (
    ("drawn", DEFAULT),
    *((case.name, FINEST) for case in SIGNAL_CASES[:-1]),
    ("bytes_bare", DEFAULT),
    ("bytes", DEFAULT),
    ("rtl", "bytes"),
)
TITLES = {case.name: case.title for case in CASES}
SCORES = {  # score -> title in the tables, scale, digits
    "adaptive_error_median_m": ("adaptive, mm", 1000.0, 0),
    "pose_error_median_m": ("grid, mm", 1000.0, 0),
    "foveal_error_median_m": ("foveal, mm", 1000.0, 0),
    "odometry_error_median_m": ("odometry, mm", 1000.0, 0),
    "texture_accuracy": ("texture right, %", 100.0, 1),
    "texture_windows_share": ("windows read, %", 100.0, 1),
    "distances": ("distances read", 1.0, 0),
    "distance_error_m": ("their rms error, mm", 1000.0, 1),
}


@dataclass
class Bench:
    """One seed's scene at one level, run once."""

    case: Case
    seed: int
    build: Path
    models: Path  # folder of the models of every mechanics

    @cached_property
    def scene(self) -> tuple[Scene, tuple[float, float, float]]:
        """With this robot's whiskers."""
        scene, start = make_scene(self.seed, self.case.mechanics)
        return replace(scene, simulated=simulated(self.case.mechanics, ROBOT)), start

    def learnt(self) -> Path:
        """The models at this mechanics, learnt on first use."""
        folder = self.models / self.case.mechanics
        if not (folder / "whole").exists():
            learn(folder, self.scene[0], ROBOT, lambda: None)
            (folder / "whole").touch()
        return folder

    def run(self) -> dict:
        folder = self.learnt()
        return (self._drawn, self._signals, self._chain, self._chain)[self.case.level](folder)

    def _explored(self, folder: Path) -> tuple[Pilot, list[dict], list[dict]]:
        scene, start = self.scene
        pilot = Pilot(scene.robot, *load_models(folder, scene.robot), self.seed)
        return pilot, *explore(scene, start, pilot, self.seed, TICKS)

    def _signals(self, folder: Path) -> dict:
        began = time.process_time()
        pilot, rows, truth = self._explored(folder)
        answers = localised(self.scene[0], rows)
        cost = time.process_time() - began
        return self._scores(rows, truth, answers) | {"whisks": len(pilot.whisks), "processor_s": cost}

    def _drawn(self, folder: Path) -> dict:
        """The path of the signal-level run, with answers drawn as `whisker scene make --family robot` draws them; its cost is
        that command's."""
        pilot, rows, truth = self._explored(folder)
        rows = drawn_rows(*self.scene, rows, truth, self.seed)
        began = time.process_time()
        scenes.make("robot", self.seed, ROWS)
        answers = localised(self.scene[0], rows)
        cost = time.process_time() - began
        return self._scores(rows, truth, answers) | {"whisks": len(pilot.whisks), "processor_s": cost}

    def _scores(self, rows: list[dict], truth: list[dict], answers: dict[str, np.ndarray]) -> dict:
        scene, poses = self.scene[0], poses_of(truth)
        return texture_scores(rows, truth, scene) | pose_scores(answers, poses) | distance_scores(rows, poses, scene)

    def _chain(self, folder: Path) -> dict:
        scene, start = self.scene
        level = ("", "", "bytes", "rtl")[self.case.level]
        with tempfile.TemporaryDirectory() as out:
            run = ChainRun(Path(out), self.build, self.seed, SECONDS, LANES, LINK, self.case.create, level)
            scene_files.write(run.scene, scene)
            (run.scene / "scene.flat").write_text(scene.flat(start))
            shutil.copytree(folder, run.out / "models")
            before = children_s()
            wall_s = run_chain(run, lambda tick: None)
            cost = children_s() - before
            pilot = json.loads((run.out / "pilot.json").read_text())
            path = localise.observations_path(run.scene)
            rows, truth = path.read_text(), poses_of(read_dicts(run.out / "truth.csv"))
            reported = [
                {key: float(value) if value else None for key, value in row.items()} for row in read_dicts(path)
            ]
            scores = judge(run.out, scene) | distance_scores(reported, truth, scene)
        return scores | {"whisks": len(pilot["whisks"]), "processor_s": cost, "wall_s": wall_s, "rows": rows}


def children_s() -> float:
    """Processor seconds of all children that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def poses_of(truth: list[dict]) -> np.ndarray:
    """(n, 3)"""
    return np.array([[float(row[key]) for key in POSES] for row in truth])


def distance_scores(rows: list[dict], poses: np.ndarray, scene: Scene) -> dict:
    """How many distances the rows hold, and their root mean square error, m; of what the whisker did not meet nothing
    is said."""
    errors = []
    for whisker in scene.robot.of_role("object"):
        reported = np.array([np.nan if (mm := row[f"{whisker.name}_mm"]) is None else mm / 1000 for row in rows], float)
        true = geometry.ranges(scene.arena, poses, replace(whisker, length_m=whisker.length_m + FAR_M))
        errors.append((reported - true)[np.isfinite(reported)])
    met = np.concatenate(errors)
    met = met[np.isfinite(met)]
    return {"distances": len(met), "distance_error_m": float(np.sqrt(np.mean(met**2))) if len(met) else 0.0}


def localised(scene: Scene, rows: list[dict]) -> dict[str, np.ndarray]:
    """(n, 3) poses of every filter."""
    made = {name: localise.Filter(name, scene) for name in FILTERS}
    return {name: np.array([filter_.step(row).pose for row in rows]) for name, filter_ in made.items()}


def drawn_rows(
    scene: Scene, start: tuple[float, float, float], rows: list[dict], truth: list[dict], seed: int
) -> list[dict]:
    """Level 0 along the same path: what was read stays read, and when; the answers are drawn from level 0's models."""
    rng, path = np.random.default_rng([seed, 0]), np.vstack([start, poses_of(truth)])
    reported = np.array([[row[key] for key in localise.ODOMETRY] for row in rows])
    odometry = readings.hold_back(readings.odometry(path, SIGNALS, rng), ~reported.any(axis=1))
    texture = readings.texture_windows(scene.arena, scene.robot, path[1:], SIGNALS, rng)
    rays = [replace(w, length_m=w.length_m + FAR_M) for w in scene.robot.of_role("object")]
    ranges = np.array([geometry.ranges(scene.arena, path[1:], ray) for ray in rays]).T
    distance = ranges + SIGNALS.radial_sigma_m * rng.standard_normal(ranges.shape)
    return [
        {**row}
        | dict(zip(localise.ODOMETRY, map(float, odometry[n]), strict=True))
        | _drawn_textures(scene, row, texture[n])
        | _drawn_distances(scene, row, distance[n])
        for n, row in enumerate(rows)
    ]


def _drawn_textures(scene: Scene, row: dict, logliks: np.ndarray) -> dict:
    tips, textures = scene.robot.of_role("texture"), scene.arena.textures
    names = [[f"{whisker.name}_{texture}" for texture in textures] for whisker in tips]
    read = [not any(row[name] is None for name in of_tip) for of_tip in names]
    return {
        name: float(logliks[tip, k]) for tip, of_tip in enumerate(names) if read[tip] for k, name in enumerate(of_tip)
    }


def _drawn_distances(scene: Scene, row: dict, distance_m: np.ndarray) -> dict:
    """Where the signals gave a distance; a whisk that met nothing the map knows is not read."""
    named = {f"{w.name}_mm": m for w, m in zip(scene.robot.of_role("object"), distance_m, strict=True)}
    measured = {name for name in named if row[name] is not None and np.isfinite(row[name])}
    return {name: 1000.0 * max(named[name], 0.0) if np.isfinite(named[name]) else np.nan for name in measured}


# ---------------------------------------------------------------------------------------------------------------------


def turns() -> list[tuple[Case, int]]:
    """Every case and seed; seed by seed, so that what is done when the bench is interrupted is alike for all."""
    most = max(case.seeds for case in CASES)
    return [(case, FIRST_SEED + n) for n in range(most) for case in CASES if n < case.seeds]


def measure(build: Path, cache: Path, levels: set[int]) -> None:
    """What is not measured yet of these levels, into the cache."""
    for case, seed in tqdm([turn for turn in turns() if turn[0].level in levels], desc="levels", unit="run"):
        path = cache / f"{case.name}_{seed}.json"
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(Bench(case, seed, build, cache / "models").run()) + "\n")


def gather(cache: Path) -> dict:
    """Everything measured so far: {"levels": summary, "pairs": differences, "rtl_rows_equal_bytes"}."""
    runs = {
        case.name: {
            str(seed): json.loads(path.read_text())
            for seed in range(FIRST_SEED, FIRST_SEED + case.seeds)
            if (path := cache / f"{case.name}_{seed}.json").exists()
        }
        for case in CASES
    }
    runs = {name: by_seed for name, by_seed in runs.items() if by_seed}
    equal = {
        seed: run["rows"] == runs["bytes"][seed]["rows"]
        for seed, run in runs.get("rtl", {}).items()
        if seed in runs["bytes"]
    }
    kept = {name: {seed: _without_rows(run) for seed, run in by.items()} for name, by in runs.items()}
    levels = {name: summary(list(by_seed.values())) for name, by_seed in kept.items()}
    pairs = {f"{a} - {b}": paired(kept[a], kept[b]) for a, b in PAIRS if a in kept and b in kept}
    return {"seconds": SECONDS, "levels": levels, "pairs": pairs, "rtl_rows_equal_bytes": equal}


def _without_rows(run: dict) -> dict:
    return {key: round(value, 6) for key, value in run.items() if key != "rows"}


def summary(runs: list[dict]) -> dict:
    """Median and quartiles over seeds of every score; real-time factor from the median cost."""
    quartiles = {key: [float(q) for q in np.quantile([run[key] for run in runs], (0.25, 0.5, 0.75))] for key in SCORES}
    cost = float(np.median([run["processor_s"] for run in runs]))
    return {"seeds": len(runs), "realtime_factor": SECONDS / cost, "quartiles": quartiles}


def paired(ours: dict[str, dict], theirs: dict[str, dict]) -> dict:
    """Mean difference over the seeds both have, with its 95 % bootstrap interval."""
    seeds, rng = sorted(set(ours) & set(theirs)), np.random.default_rng(0)
    out = {"seeds": len(seeds)}
    for key in SCORES:
        difference = np.array([ours[seed][key] - theirs[seed][key] for seed in seeds])
        means = rng.choice(difference, (DRAWS, len(difference))).mean(axis=1)
        out[key] = {"mean": float(difference.mean()), "interval": [float(v) for v in np.percentile(means, INTERVAL)]}
    return out
