"""Particle filters of other projects beside this one's filters: same scenes, same likelihood, same clock.

    make bench, or .venv/bin/python tools/benches nav_peers [--seeds N]

Every filter takes the rows of the same scenes through host/nav's intake and weighs poses by host/nav's
likelihood; what differs is the filter. Times are CPU time per row, all of it: intake, motion, weights, resampling,
estimate. A peer that cannot be had is left out with its own error, and the others are measured. A program of
one's own joins by NAV_PEER_<NAME>=PROGRAM, called as PROGRAM SCENE.txt EST.csv --particles N --seed S (peer.hpp).
"""

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tqdm import tqdm

import crunchbot
from crunchbot.nav import localise
from crunchbot.nav.scoring import lock_row, position_errors
from crunchbot.scene import Prior
from crunchbot_lab import scenes

from .. import store

ROOT = Path(__file__).resolve().parents[3]
CACHE = store.kept("nav_peers")
PEERS = Path(__file__).resolve().parent / "peers"
VENV, NATIVE = ROOT / "build/bench/peers-venv", ROOT / "build/bench/peers"
WEIGH = NATIVE / "libweigh.so"
APT = "apt-get install libmrpt-slam-dev"
FAMILIES = ("anchor", "anchor+global", "anchor+kidnap")
SEEDS, PYTHON_SEEDS = 100, 20  # packages in Python take seconds a run
FIRST_SEED = 5000  # nothing was developed on these
OURS = {
    ("odometry", ""): {},
    ("ekf", ""): {},
    ("foveal", "11x11x11"): {},
    ("foveal inflated", "11x11x11"): {"foveal.inflate": 1.0},
    ("grid", "5 cm x 10 deg"): {},
    ("particle", "100"): {"particle.count": 100.0},
    ("particle", "500"): {"particle.count": 500.0},
    ("particle", "2000"): {"particle.count": 2000.0},
    ("particle", "300-20000 KLD"): {},
    ("adaptive", ""): {},
}
Steps = tuple[np.ndarray, np.ndarray]  # poses (n, 3), CPU time (n,) in us


@dataclass(frozen=True)
class Entry:
    """One filter at one size, on every family and seed."""

    filter: str
    setting: str
    seeds: int
    run: Callable[[Path, scenes.Made, int], Steps]


def flat(made: scenes.Made) -> str:
    """A scene and its rows as the numbers that peer.cpp reads, in its order."""
    arena, robot, rows = made.scene.arena, made.scene.robot, made.observations
    floor = arena.floor_indices()
    prior = made.scene.prior or Prior("uniform")
    gaussian = prior.kind == "gaussian"
    tips, rays = robot.of_role("texture"), robot.of_role("object")
    head = [*arena.size_m, arena.tile_m, floor.shape[1], floor.shape[0], len(arena.textures), *floor.ravel()]
    head += [len(arena.obstacles), *(edge for box in arena.obstacles for edge in box)]
    head += [robot.body_radius_m, robot.odometry_relative_sigma, robot.radial_sigma_m]
    head += [len(tips), *(v for w in tips for v in w.tip_m)]
    head += [len(rays), *(v for w in rays for v in (*w.base_m, w.yaw_rad, w.length_m))]
    head += [int(not gaussian), *(prior.mean if gaussian else (0, 0, 0)), *(prior.sigma if gaussian else (1, 1, 1))]
    cells = np.column_stack([rows.t_s, rows.odometry, rows.texture.reshape(len(rows), -1), rows.radial_m])
    lines = [" ".join(repr(float(v)) for v in line) for line in (head, [len(rows)], *cells)]
    return "\n".join(lines) + "\n"


def ours(name: str, settings: dict[str, float]) -> Callable:
    def run(_folder: Path, made: scenes.Made, seed: int) -> Steps:
        result = localise.run(name, made.scene, made.observations, settings, seed)
        return result.poses, result.step_us

    return run


def program(command: list, folder: Path, scene: Path, seed: int) -> Steps:
    """A peer's own process; one thread, as everybody has."""
    out = folder / "est.csv"
    alone = {name: "1" for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS")}
    environment = os.environ | alone | {"PYTHONPATH": str(Path(crunchbot.__file__).parents[1]), "NAV_WEIGH": str(WEIGH)}
    words = [str(word) for word in (*command[:-1], scene, out, *command[-1], "--seed", seed)]
    done = subprocess.run(words, env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{words[0]} failed: {done.stderr.strip().splitlines()[-1:]}")
    table = np.genfromtxt(out, delimiter=",", names=True)
    return np.column_stack([table["x_m"], table["y_m"], table["theta_rad"]]), table["step_us"]


def native(path: Path, *options) -> Callable:
    def run(folder: Path, made: scenes.Made, seed: int) -> Steps:
        (folder / "scene.txt").write_text(flat(made))
        return program([path, options], folder, folder / "scene.txt", seed)

    return run


def python(peer: str, *options) -> Callable:
    def run(folder: Path, made: scenes.Made, seed: int) -> Steps:
        scenes.write_scene(folder / "scene", made.scene, made.observations)
        command = [VENV / "bin/python", PEERS / "python_peer.py", peer, options]
        return program(command, folder, folder / "scene", seed)

    return run


def python_entries(build: Path, most: int) -> list[Entry]:
    """Installs the packages into a virtual environment of their own, once."""
    if not built(build, WEIGH.name):
        return []
    pip = (VENV / "bin/pip", "install", "--disable-pip-version-check", "--require-hashes")
    ready = VENV / "ready"
    if not ready.exists():
        lock = PEERS / "requirements.lock"
        install = ((*pip, "-r", PEERS / "build.lock"), (*pip, "--no-build-isolation", "-r", lock))
        if error := store.failure((sys.executable, "-m", "venv", VENV), *install):
            store.leave_out("filterpy, particles, pfilter", f"{lock.relative_to(ROOT)} cannot be installed: {error}")
            return []
        ready.touch()
    return [
        Entry(peer, str(n), min(most, PYTHON_SEEDS), python(peer, "--particles", n))
        for peer in ("filterpy", "particles", "pfilter")
        for n in (500, 2000)
    ]


def built(build: Path, program: str) -> Path | None:
    """Builds the native peers; None: this one cannot be had, and is left out with its error."""
    library = next(iter(sorted(build.rglob("libwhisker-nav.a"))), None)
    cmake = ("cmake", "-S", PEERS, "-B", NATIVE, f"-DNAV_LIBRARY={library}")
    if error := store.failure(cmake, ("cmake", "--build", NATIVE)):
        store.leave_out(
            "MRPT, Python packages, programs of one's own", f"{PEERS.relative_to(ROOT)} does not build: {error}"
        )
        return None
    if not (NATIVE / program).exists():
        store.leave_out("MRPT", f"not installed; {APT}")
        return None
    return NATIVE / program


def mrpt_entries(build: Path, most: int) -> list[Entry]:
    peer = built(build, "mrpt_peer")
    if not peer:
        return []
    sizes = [Entry("mrpt standard", str(n), most, native(peer, "--particles", n)) for n in (100, 500, 2000)]
    kld = Entry("mrpt standard", "300-20000 KLD", most, native(peer, "--particles", 20000, "--kld", 20000))
    others = [
        Entry(f"mrpt {kind}", str(n), min(most, PYTHON_SEEDS), native(peer, "--particles", n, "--algorithm", kind))
        for kind, n in (("auxiliary", 500), ("optimal", 100))
    ]
    return [*sizes, kld, *others]


def guests(most: int) -> list[Entry]:
    """Programs named in the environment."""
    prefix = "NAV_PEER_"
    found = {key.removeprefix(prefix).lower(): value for key, value in os.environ.items() if key.startswith(prefix)}
    for name in {"beluga", "nav2"} - found.keys():
        store.leave_out(name, f"no program; set {prefix}{name.upper()} to one that peer.hpp describes")
    return [
        Entry(name, str(n), min(most, PYTHON_SEEDS), native(Path(path), "--particles", n))
        for name, path in sorted(found.items())
        for n in (500, 2000)
    ]


def judge(made: scenes.Made, steps: Steps) -> dict:
    poses, us = steps
    distance = position_errors(poses, made.observations.truth)
    return {
        "step_us_median": float(np.median(us)),
        "step_us_p99": float(np.quantile(us, 0.99)),
        "error_median_m": float(np.median(distance)),
        "error_rms_m": float(np.sqrt(np.mean(distance**2))),
        "lost": lock_row(distance) is None,
    }


def measure(entry: Entry, family: str, seed: int) -> dict:
    name = "_".join([entry.filter, entry.setting, family, str(seed)]).replace(" ", "-")

    def judged() -> dict:
        made = scenes.make(family, FIRST_SEED + seed)
        with tempfile.TemporaryDirectory() as folder:
            return judge(made, entry.run(Path(folder), made, seed))

    return store.once(CACHE / f"{name}.json", judged)


def summed_up(entry: Entry, family: str, runs: list[dict]) -> dict:
    """Medians over seeds; the spread is the quartiles'."""

    def over(key: str) -> np.ndarray:
        return np.array([run[key] for run in runs])

    quartiles = np.quantile(over("error_median_m"), (0.25, 0.75)).tolist()
    return {
        "filter": entry.filter,
        "setting": entry.setting,
        "family": family,
        "seeds": len(runs),
        "step_us_median": float(np.median(over("step_us_median"))),
        "step_us_p99": float(np.median(over("step_us_p99"))),
        "error_median_m": float(np.median(over("error_median_m"))),
        "error_median_quartiles_m": quartiles,
        "error_rms_m": float(np.median(over("error_rms_m"))),
        "lost_share": float(np.mean(over("lost"))),
    }


def run(build: Path, seeds: int = SEEDS) -> None:
    known = localise.filter_names()
    entries = [
        Entry(*key, seeds, ours(key[0].split()[0], settings))
        for key, settings in OURS.items()
        if key[0].split()[0] in known
    ]
    entries += mrpt_entries(build, seeds) + python_entries(build, seeds) + guests(seeds)
    jobs = [(e, family, seed) for e in entries for family in FAMILIES for seed in range(e.seeds)]
    results = {}
    for entry, family, seed in tqdm(jobs, desc="nav_peers", unit="run"):
        results.setdefault((entry, family), []).append(measure(entry, family, seed))
    store.write_result("nav_peers", [summed_up(*key, runs) for key, runs in results.items()])


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seeds", type=int, default=SEEDS)
