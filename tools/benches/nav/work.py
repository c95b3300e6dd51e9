"""Jobs of the bench that are more than trials of filters on scenes: what they return is JSON."""

import dataclasses
import math
import resource

import numpy as np

from crunchbot.nav import localise
from crunchbot.nav.observations import Observations
from crunchbot.nav.scoring import position_errors
from crunchbot_lab import scenes
from crunchbot_lab.scenes import arenas, families, making, robots

REFERENCE = ("particle", {"particle.count": 50_000, "particle.recovery": 0.0, "particle.recovery_fast": 0.0})
SLOWEST = 0.02  # share of the times that a budget job keeps


def cost(tiles: int, rays: int, filter: str, settings: dict, seeds: list[int], rows: int) -> dict:
    """A filter's time per step in an arena of so many tiles of 0.5 m a side, with so many object whiskers."""
    angles = [math.pi * (n + 0.5) / max(rays, 1) - math.pi / 2 for n in range(rays)]
    whiskers = robots.rays(*((0.15 * math.cos(a), 0.15 * math.sin(a), a) for a in angles))
    recipe = dataclasses.replace(
        families.recipe("anchor"),
        arena=arenas.tiled(tiles, round(0.12 * tiles * tiles)),
        robot=lambda: robots.robot(*robots.tips(*robots.SIDES), *whiskers),
    )
    us = []
    for seed in seeds:
        made = making.make_recipe(recipe, seed, rows)
        us.append(localise.run(filter, made.scene, made.observations, settings, seed).step_us)
    return {"step_us_median": float(np.median(us)), "step_us_p99": float(np.quantile(us, 0.99))}


def budget(family: str, seed: int, filter: str, settings: dict, rows: int) -> dict:
    """The slowest steps and the most work of one long run."""
    made = scenes.make(family, seed, rows)
    run = localise.run(filter, made.scene, made.observations, settings, seed)
    kept = max(1, round(SLOWEST * rows))
    return {
        "rows": rows,
        "slowest_us": np.sort(run.step_us)[-kept:].round(2).tolist(),
        "evaluations_max": int(run.table["evaluations"].max()),
        "touched_max": int(run.table["touched"].max()),
        "error_median_m": float(np.median(position_errors(run.poses, made.observations.truth))),
    }


def balance(seed: int, filter: str, settings: dict, rows: int, stride: int) -> dict:
    """In an arena that looks alike after 180 degrees, start unknown: the mass near the truth and near its image."""
    made = scenes.make("symmetric2+global", seed, rows)
    middle, masses = np.array(made.scene.arena.size_m) / 2, []
    running = localise.Filter(filter, made.scene, settings, seed)
    for row in range(stride - 1, rows, stride):
        running.replay(made.observations, row + 1 - stride, stride)
        components, (x, y, heading) = running.components(), made.observations.truth[row]
        image = (2 * middle[0] - x, 2 * middle[1] - y, heading + math.pi)
        masses.append([near(components, (x, y, heading)), near(components, image)])
    both = np.array(masses)
    held = both[both.sum(axis=1) > 0.9]
    share = held[:, 0] / held.sum(axis=1) if len(held) else np.zeros(0)
    return {
        "judged": len(both),
        "both_modes_hold": len(held),
        "within_45_55": int(((share >= 0.45) & (share <= 0.55)).sum()),
        "worst_share": float(np.max(np.abs(share - 0.5)) + 0.5) if len(share) else None,
        "masses": both.round(4).tolist(),
    }


def near(components: np.ndarray, pose) -> float:
    """Mass within 0.25 m and 0.5 rad of a pose."""
    x, y, heading = components["pose"].T
    off = np.remainder(heading - pose[2] + math.pi, 2 * math.pi) - math.pi
    return float(components["mass"][(np.hypot(x - pose[0], y - pose[1]) <= 0.25) & (np.abs(off) <= 0.5)].sum())


def variation(family: str, seed: int, runs: dict[str, list], rows: int, stride: int) -> dict:
    """Mean total variation in coarse bins between filters (title: name and settings) and a converged reference, and
    between that and a second reference of another seed: its own repeatability."""
    made = scenes.make(family, seed, rows)
    reference = _bins(made, *REFERENCE, seed + 1_000_000, stride)[0]
    again = _bins(made, *REFERENCE, seed + 2_000_000, stride)[0]
    out = {
        "reference again": {
            "variation": _variation(again, reference),
            "touched_mean": float(REFERENCE[1]["particle.count"]),
        }
    }
    for title, (name, settings) in runs.items():
        bins, touched = _bins(made, name, settings, seed, stride)
        out[title] = {"variation": _variation(bins, reference), "touched_mean": touched}
    return out


def _bins(made: scenes.Made, name: str, settings: dict, seed: int, stride: int) -> tuple[np.ndarray, float]:
    running, out, touched = localise.Filter(name, made.scene, settings, seed), [], []
    for first in range(0, len(made.observations) - stride + 1, stride):
        table, _ = running.replay(made.observations, first, stride)
        touched.append(table["touched"].mean())
        out.append(running.bins())
    return np.array(out), float(np.mean(touched))


def _variation(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.mean(0.5 * np.abs(one - other).sum(axis=1)))


def soak(filter: str, settings: dict, seed: int, rows: int, block: int) -> dict:
    """One filter through very many rows of a noisy family with every fault of rows, block after block."""
    name = "raw+outliers+missed+catches+doubled+reordered+dropped+nan-second"
    running, blocks, clock = None, [], 0.0
    for number in range(rows // block):
        # The arena is the seed's; path, noise and faults are the block's. Between blocks the robot is carried off.
        made = making.make_recipe(families.recipe(name), seed, block, path_seed=seed + number)
        running = running or localise.Filter(filter, made.scene, settings, seed)
        rows_in = dataclasses.replace(made.observations, t_s=made.observations.t_s + clock)
        clock = float(rows_in.t_s.max())
        table, us = running.replay(rows_in, 0, len(rows_in))
        blocks.append(_block(table, us, rows_in))
    return {"rows": rows, "blocks": blocks, "peak_rss_kb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss}


def _block(table: np.ndarray, us: np.ndarray, rows: Observations) -> dict:
    finite = np.isfinite(table["pose"]).all(axis=1) & np.isfinite(table["covariance"]).all(axis=(1, 2))
    confident = (table["confidence"] >= 0.0) & (table["confidence"] <= 1.0)
    return {
        "faulty": int((~(finite & confident)).sum()),
        "error_median_m": float(np.median(position_errors(table["pose"], rows.truth))),
        "step_us_median": float(np.median(us)),
        "step_us_max": float(us.max()),
        "touched_max": int(table["touched"].max()),
        "bytes_max": int(table["bytes"].max()),
    }
