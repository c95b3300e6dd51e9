"""Maps by touch alone with defaults: families, with normals, with a gyroscope, hard worlds.

.venv/bin/python tools/benches map [--seeds N] [--workers N]

Each run is a job whose figures are kept for the state of the mapper, the scenes and this file.
"""

import argparse
import math
from pathlib import Path

import numpy as np

from crunchbot.nav import mapping
from crunchbot_lab.scenes import map_scoring, own_map
from crunchbot_lab.scenes.making import make
from crunchbot_lab.scenes.sweep import sweep

from .. import store

PAPER = ("anchor", "robot", "raw", "noisy")
TABLES = {  # of the page: family -> rows
    "families": dict.fromkeys((*PAPER, "free", "ring"), 3000),
    "normals": dict.fromkeys((f"{family}+normals" for family in PAPER), 3000),
    "gyroscope": dict.fromkeys((f"{family}+gyro" for family in PAPER), 3000),
    "hard": dict.fromkeys(
        (
            *("one-texture", "one-texture+round", "anchor+round", "anchor+turned-tiles", "anchor+hexagons"),
            *("anchor+pitch-0.3", "anchor+pitch-0.42", "anchor+moving-box", "anchor+dead", "anchor+renamed"),
            *("anchor+silent-minute", "anchor+dropped", "anchor+nan-second"),
        ),
        3000,
    )
    | {"free": 18000},
}
# Seeds of a family to one of a row of this table, and to one of 30 minutes.
SHARES, LONG_SHARE = {"hard": 5}, 20
INPUTS = ("host/nav", "host/python/crunchbot/nav", "lab/crunchbot_lab/scenes", "tools/benches/nav/maps.py")
ROWS, FIRST_SEED = 3000, 500
WORKERS = 2
SLOWER = 1.5  # in the own map: times the rows to lock in the true one
OWN_MEDIANS = ("true_rows", "own_rows", "true_error_m", "own_error_m")


def one(family: str, seed: int, rows: int = ROWS, own: bool = False) -> dict[str, float | None]:
    """Figures of one run; `own`: also of a drive in the map that it left."""
    made = make(family, seed, rows)
    scene = made.scene
    mapped = mapping.run(scene.robot, scene.arena.textures, made.observations)
    return map_scoring.score(mapped, scene.arena) | (own_figures(own_map.score(mapped, family, seed)[0]) if own else {})


def own_figures(drive: own_map.Drive) -> dict[str, float | None]:
    """Of one drive: rows to lock and error from then on, in both maps; and the error of the poses that made the map."""
    found = {"map_error_m": drive.map_error_m}
    for name, located in (("own", drive.own), ("true", drive.true)):
        found |= {f"{name}_rows": located.rows_to_lock, f"{name}_error_m": located.error_m}
    return found


def own_summed(runs: list[dict]) -> dict:
    """Of drives in own maps: how many lock, and medians of those that lock in both maps."""
    both = [run for run in runs if run["true_rows"] is not None and run["own_rows"] is not None]
    ratios = [run["own_error_m"] / math.hypot(run["map_error_m"], run["true_error_m"]) for run in both]
    return {
        "runs": len(runs),
        "locked_true": sum(run["true_rows"] is not None for run in runs),
        "locked_own": sum(run["own_rows"] is not None for run in runs),
        "in_time": sum(run["own_rows"] <= SLOWER * run["true_rows"] for run in both),
        "error_ratio_median": _median(ratios),
    } | {f"{name}_median": _median([run[name] for run in both]) for name in OWN_MEDIANS}


def _median(values: list[float]) -> float | None:
    return float(np.median(values)) if values else None


def summed(runs: list[dict]) -> dict:
    """Medians over runs, the worst error, and in how many the odometry was better."""
    known = {key: [run[key] for run in runs if run[key] is not None] for key in runs[0]}
    out = {key: float(np.median(values)) if values else None for key, values in known.items()}
    errors = [run["error_median_m"] for run in runs]
    worse = sum(run["error_median_m"] > run["odometry_error_median_m"] for run in runs)
    return out | {"runs": len(runs), "error_worst_m": max(errors), "worse_than_odometry": worse}


def seeds_of(table: str, rows: int, seeds: int) -> range:
    """Fewer of hard worlds and of long runs."""
    share = LONG_SHARE if rows > ROWS else SHARES.get(table, 1)
    return range(FIRST_SEED, FIRST_SEED + max(1, seeds // share))


def measure(seeds: int, workers: int) -> dict:
    jobs, parts = {}, {}
    for title, families in TABLES.items():
        for family, rows in families.items():
            names = {f"{family}-{rows}-{seed}": {"seed": seed} for seed in seeds_of(title, rows, seeds)}
            parts[title, family] = list(names)
            own = {"own": True} if title == "families" and family in PAPER else {}
            jobs |= {name: {"family": family, "rows": rows, **own, **job} for name, job in names.items()}
    found = sweep(one, jobs, store.kept("map", *INPUTS), workers, label="map")
    tables = {
        title: {f: summed([found[name] for name in parts[title, f]]) | {"rows": rows} for f, rows in t.items()}
        for title, t in TABLES.items()
    }
    own_sums = {family: own_summed([found[name] for name in parts["families", family]]) for family in PAPER}
    return {"rows": ROWS, "seeds": seeds, "own": own_sums, **tables}


def run(_build: Path, seeds: int = 100, workers: int = WORKERS) -> None:
    store.write_result("map", measure(seeds, workers))


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seeds", type=int, default=100, help="scenes of each family (default: %(default)s)")
    parser.add_argument("--workers", type=int, default=WORKERS, help="processes (default: %(default)s)")
