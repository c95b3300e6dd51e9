"""A robot in the map that it made itself, beside the same robot in the true map: from an unknown start in the visited area."""

import math
from dataclasses import replace

import numpy as np

from crunchbot.nav import localise, mapping
from crunchbot.nav.scoring import lock_row
from crunchbot.occupancy import to_map
from crunchbot.scene import Prior, Scene
from crunchbot_lab.scenes import map_scoring
from crunchbot_lab.scenes.families import recipe
from crunchbot_lab.scenes.making import make, make_recipe

FILTER = "adaptive"
ROWS = 600  # of the second drive
VISITED_M = 0.3  # from the first drive's path
DRIVES = 1000  # that are drawn for a start there, at most
SLOWER = 1.5  # times the rows in the true map, which a lock in the own map may take
WORSE = 1.3  # times the root of both errors' squares


def one(family: str, seed: int, rows: int) -> dict[str, float | bool | None]:
    """Figures of one run: rows to lock and median error from then on in both maps, and the error of the map's poses."""
    made = make(family, seed, rows)
    scene, truth = made.scene, made.observations.truth
    mapped = mapping.run(scene.robot, scene.arena.textures, made.observations, seed)
    motion = map_scoring.best_motion(mapped.table["pose"][:, :2], truth[:, :2])
    own, again = mapped.scene(), second_drive(family, seed, truth)
    found = {"map_error_m": map_scoring.trajectory(mapped.table["pose"], truth)["error_median_m"]}
    for name, arena in (("true", scene.arena), ("own", own.arena)):
        poses = localise.run(FILTER, Scene(arena, scene.robot, Prior("uniform")), again).poses
        if name == "own":
            poses = to_map(poses, own.origin)
            poses[:, :2] = motion.points(poses[:, :2])
        error = np.hypot(*(poses[:, :2] - again.truth[:, :2]).T)
        locked = lock_row(error)
        found |= {
            f"{name}_rows": locked,
            f"{name}_error_m": float(np.median(error if locked is None else error[locked:])),
        }
    return found


def second_drive(family: str, seed: int, truth: np.ndarray) -> localise.Observations:
    """Another drive in the same arena that starts where the first one came by."""
    drawn = replace(recipe(family), uniform=True)
    for n in range(DRIVES):
        path_seed = seed + 1_000_000 * (n + 1)
        start = make_recipe(drawn, seed, 1, path_seed).observations.truth[0, :2]
        if np.hypot(*(truth[:, :2] - start).T).min() <= VISITED_M:
            return make_recipe(drawn, seed, ROWS, path_seed).observations
    raise ValueError(f"{family}, seed {seed}: no start in the visited area in {DRIVES} tries")


def summed(runs: list[dict]) -> dict:
    """Shares that lock, and medians."""
    both = [run for run in runs if run["true_rows"] is not None and run["own_rows"] is not None]
    in_time = [run for run in both if run["own_rows"] <= max(SLOWER * run["true_rows"], run["true_rows"] + 1)]
    ratios = [run["own_error_m"] / math.hypot(run["map_error_m"], run["true_error_m"]) for run in both]
    return {
        "runs": len(runs),
        "locked_true": sum(run["true_rows"] is not None for run in runs),
        "locked_own": sum(run["own_rows"] is not None for run in runs),
        "in_time": len(in_time),
        **{f"{name}_median": _median([run[name] for run in both]) for name in ("true_rows", "own_rows")},
        **{f"{name}_median": _median([run[name] for run in both]) for name in ("true_error_m", "own_error_m")},
        "error_ratio_median": _median(ratios),
    }


def _median(values: list[float]) -> float | None:
    return float(np.median(values)) if values else None
