"""Other projects' SLAM on the same rows of touch.

.venv/bin/python tools/benches map_peers [--seeds N]

MRPT's Rao-Blackwellised particle filter is built where libmrpt-slam-dev is installed. Any other program joins by
MAP_PEER_<NAME>=PROGRAM (GMapping's proposal: MAP_PEER_GMAPPING). It reads from its standard input

    ROWS WHISKERS SEED PARTICLES SIGMA_M ODOMETRY_RELATIVE DRIFT_RAD
    X_M Y_M YAW_RAD LENGTH_M                      of each whisker's base, robot frame
    DX_M DY_M TURN_RAD DISTANCE_M ...             of each row; inf: touches nothing, nan: not read

and writes X_M Y_M THETA_RAD CPU_US of each row, the first pose about the origin. What cannot be had is left out with its
own error.
"""

import argparse
import os
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from crunchbot.nav import mapping
from crunchbot.nav.observations import Observations
from crunchbot.scene import Robot
from crunchbot_lab.scenes import map_scoring
from crunchbot_lab.scenes.making import make
from crunchbot_lab.scenes.sweep import sweep

from .. import store
from . import peer_runs

FAMILIES = ("anchor", "robot", "raw", "noisy")
OURS = "faces and tiles"
PREFIX = "MAP_PEER_"
ROWS, FIRST_SEED, WORKERS, PARTICLES = 3000, 700, 1, 30
PROBE = 20  # rows that a peer is tried on
DRIFT_RAD = 0.02
INPUTS = (
    *("host/nav", "host/python/crunchbot/nav", "lab/crunchbot_lab/scenes", "tools/benches/nav/peers"),
    "tools/benches/nav/map_peers.py",
)
Rows = tuple[Robot, tuple[str, ...], Observations]


@cache
def scene(family: str, seed: int) -> Rows:
    made = make(family, seed, ROWS)
    return made.scene.robot, made.scene.arena.textures, made.observations


def rows_text(rows: Rows, seed: int) -> str:
    """What a peer reads."""
    robot, _, seen = rows
    whiskers = robot.of_role("object")
    head = (len(seen), len(whiskers), seed, PARTICLES, robot.radial_sigma_m, robot.odometry_relative_sigma, DRIFT_RAD)
    lines = [*((*w.base_m, w.yaw_rad, w.length_m) for w in whiskers), *np.column_stack([seen.odometry, seen.radial_m])]
    numbers = "".join(" ".join(repr(float(v)) for v in line) + "\n" for line in lines)
    return f"{' '.join(map(str, head))}\n{numbers}"


def by_program(program: str, rows: Rows, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) poses and (n,) CPU time in us."""
    done = subprocess.run([program], input=rows_text(rows, seed), capture_output=True, text=True)
    lines = [line.split() for line in done.stdout.splitlines()]
    if done.returncode or len(lines) != len(rows[2]):
        error = (done.stderr.strip().splitlines() or ["no error given"])[-1]
        raise RuntimeError(f"{program}: {len(lines)} rows of {len(rows[2])}: {error}")
    found = np.array(lines, float)
    return found[:, :3], found[:, 3]


def programs(build: Path) -> dict[str, str]:
    """Peers that can be had: name -> program."""
    found = {key.removeprefix(PREFIX).lower(): value for key, value in os.environ.items() if key.startswith(PREFIX)}
    if mrpt := peer_runs.built(build, "mrpt_map"):
        found["mrpt"] = str(mrpt)
    if "gmapping" not in found:
        store.leave_out(
            "gmapping", f"no program; set {PREFIX}GMAPPING to one that tools/benches/nav/map_peers.py describes"
        )
    return {name: program for name, program in found.items() if _answers(name, program)}


def _answers(name: str, program: str) -> bool:
    """Whether a program answers a few rows; else it is left out with its error."""
    robot, textures, rows = scene(FAMILIES[0], FIRST_SEED)
    few = replace(rows, **{key: getattr(rows, key)[:PROBE] for key in ("t_s", "odometry", "radial_m")})
    try:
        by_program(program, (robot, textures, few), 0)
    except (OSError, RuntimeError, ValueError) as error:
        store.leave_out(name, str(error))
        return False
    return True


def one(name: str, program: str, world: tuple, seed: int) -> dict[str, float | str]:
    """Figures of one run, or the `error` of a peer; `world`: arguments of `scene`."""
    rows = scene(*world)
    wheels = map_scoring.odometry_path(rows[2].odometry)
    if name == "odometry":
        poses, us = wheels, np.zeros(len(wheels))
    elif program:
        try:
            poses, us = by_program(program, rows, seed)
        except RuntimeError as error:
            return {"error": str(error)}
    else:
        run = mapping.run(*rows)
        poses, us = run.table["pose"], run.step_us
    return {
        "error_median_m": map_scoring.trajectory(poses, rows[2].truth)["error_median_m"],
        "odometry_error_median_m": map_scoring.trajectory(wheels, rows[2].truth)["error_median_m"],
        "step_us_mean": float(us.mean()),
    }


def measure(build: Path, seeds: int, workers: int) -> dict:
    peers = programs(build)
    worlds = {family: [(family, FIRST_SEED + n) for n in range(seeds)] for family in FAMILIES}
    jobs, parts = {}, {}
    for world, runs in worlds.items():
        for name in ("odometry", OURS, *peers):
            parts[name, world] = [f"{name}-{world}-{n}".replace(" ", "") for n in range(len(runs))]
            jobs |= {
                job: {"name": name, "program": peers.get(name, ""), "world": run, "seed": n}
                for n, (job, run) in enumerate(zip(parts[name, world], runs, strict=True))
            }
    found = sweep(one, jobs, store.kept("map_peers", *INPUTS), workers, label="map_peers")
    points = []
    for (name, world), names in parts.items():
        runs = [found[job] for job in names]
        if errors := [run["error"] for run in runs if "error" in run]:
            store.leave_out(f"{name}, {world}", errors[0])
            continue
        medians = {key: float(np.median([run[key] for run in runs])) for key in runs[0]}
        worst = max(run["error_median_m"] for run in runs)
        points.append({"mapper": name, "world": world, "runs": len(runs), "error_worst_m": worst, **medians})
    return {"rows": ROWS, "seeds": seeds, "particles": PARTICLES, "peers": sorted(peers), "points": points}


def run(build: Path, seeds: int = 3, workers: int = WORKERS) -> None:
    store.write_result("map_peers", measure(build, seeds, workers))


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seeds", type=int, default=3, help="scenes of each family (default: %(default)s)")
    parser.add_argument("--workers", type=int, default=WORKERS, help="processes (default: %(default)s)")
