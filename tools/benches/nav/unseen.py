"""Filters on families of scenes that none of them was made for: arenas, robots, rates, noise and maps of every kind.

    tools/benches nav_unseen --filter grid --seeds 5 --only "two textures" Seeds begin where no
development did.
"""

import argparse
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from crunchbot.nav import localise
from crunchbot.nav.observations import Observations
from crunchbot.nav.scoring import LOCK_M, LOCK_ROWS, heading_errors, lock_row, position_errors
from crunchbot.scene import Arena, Scene
from crunchbot_lab.scenes import arenas, families, faults, robots
from crunchbot_lab.scenes.families import Recipe
from crunchbot_lab.scenes.making import Made, make_recipe
from crunchbot_lab.scenes.readings import World
from crunchbot_lab.scenes.walk import Pace

from .. import store

FIRST_SEED = 70_000
ROWS = 600
SURE, FAR_M, FAR_RAD = 0.9, 0.25, 0.5
SETTLING_ROWS = 30  # after a kidnap, in which no filter can know
REGIONS = 12

CREATE = World(odometry=0.08, odometry_memory_m=0.5, run_gain=0.05, drift_rad=0.03)


def room(low: float, high: float, per_m2: float = 0.4, textures=arenas.TEXTURES, tile=(0.2, 0.5)) -> arenas.Maker:
    """Any size from `low` to `high` m a side, tiles of 20 to 50 cm that need not divide it, boxes anywhere."""

    def make(rng: np.random.Generator, radius: float) -> Arena:
        inner = arenas.scattered((low, low), (high, high), per_m2, textures)(rng, radius)
        edge = float(round(rng.uniform(*tile), 3))
        columns, rows = (math.ceil(side / edge - 1e-6) for side in inner.size_m)
        floor = arenas.random_floor(columns, rows, textures, rng)
        return Arena(inner.size_m, edge, textures, floor, inner.obstacles)

    return make


def nearly_symmetric(shift_m: float) -> arenas.Maker:
    """Alike after 180 degrees but for one box, which stands `shift_m` off."""

    def make(rng: np.random.Generator, radius: float) -> Arena:
        arena = arenas.symmetric(2)(rng, radius)
        if not arena.obstacles:
            return arena
        x0, y0, x1, y1 = arena.obstacles[0]
        by = -shift_m if x1 + shift_m > arena.size_m[0] else shift_m
        return replace(arena, obstacles=((x0 + by, y0, x1 + by, y1), *arena.obstacles[1:]))

    return make


def moved_box(arena: Arena, rng: np.random.Generator) -> Arena:
    """The map as the filters get it: one box stands 10 to 25 cm off."""
    if not arena.obstacles:
        return arena
    gone, turn, by = int(rng.integers(len(arena.obstacles))), rng.uniform(0, 2 * math.pi), rng.uniform(0.1, 0.25)
    x0, y0, x1, y1 = arena.obstacles[gone]
    dx = float(np.clip(by * math.cos(turn), -x0, arena.size_m[0] - x1))
    dy = float(np.clip(by * math.sin(turn), -y0, arena.size_m[1] - y1))
    boxes = list(arena.obstacles)
    boxes[gone] = (x0 + dx, y0 + dy, x1 + dx, y1 + dy)
    return replace(arena, obstacles=tuple(boxes))


def new_box(arena: Arena, rng: np.random.Generator) -> Arena:
    """The map as the filters get it lacks nothing but shows a box where there is none."""
    width, depth = rng.uniform(0.1, 0.4, 2)
    x, y = rng.uniform(0, arena.size_m[0] - width), rng.uniform(0, arena.size_m[1] - depth)
    return replace(arena, obstacles=(*arena.obstacles, (x, y, x + width, y + depth)))


def two_wrong_tiles(arena: Arena, rng: np.random.Generator) -> Arena:
    return faults.wrong_tile(faults.wrong_tile(arena, rng), rng)


def gap(seconds: float) -> faults.Fault:
    """So many seconds of rows never come, their odometry lost, a third of the way through."""

    def fault(o: Observations, scene: Scene, rng: np.random.Generator) -> Observations:
        first, count = len(o) // 3, round(seconds * 10)
        return faults._taken(o, np.concatenate([np.arange(first), np.arange(first + count, len(o))]))

    return fault


def many(count_tips: int, count_rays: int):
    def make():
        angles = [2 * math.pi * n / max(count_rays, 1) for n in range(count_rays)]
        places = [(0.15 * math.cos(a), 0.15 * math.sin(a), math.remainder(a, 2 * math.pi)) for a in angles]
        spots = [(0.2 * math.cos(1.0 + 2.4 * n), 0.2 * math.sin(1.0 + 2.4 * n)) for n in range(count_tips)]
        return robots.robot(*robots.tips(*spots), *robots.rays(*places))

    return make


BASE = Recipe("", room(2.0, 3.5), rows=ROWS)
TWO = arenas.TEXTURES[:2]


def world(**changes) -> World:
    return replace(BASE.world, **changes)


@dataclass(frozen=True)
class Family:
    """A recipe and how its runs start; `folds`: images of the truth that count."""

    recipe: Recipe
    starts: str = "known"  # known, anywhere, kidnap: any of these, by their first letters
    folds: int = 1


FAMILIES: dict[str, Family] = {
    "room 1.5 m": Family(replace(BASE, arena=room(1.5, 1.8)), "ka"),
    "room 2-3.5 m": Family(BASE, "kad"),
    "room 6-8 m": Family(replace(BASE, arena=room(6.0, 8.0, 0.3), rows=1200), "ka"),
    "room 12 m": Family(replace(BASE, arena=room(11.0, 12.0, 0.2), rows=1200), "ka"),
    "2 whiskers": Family(replace(BASE, robot=many(1, 1)), "ka"),
    "28 whiskers": Family(replace(BASE, robot=many(12, 16)), "ka"),
    "textures only": Family(replace(BASE, robot=many(4, 0)), "ka"),
    "two textures": Family(replace(BASE, arena=room(2.0, 3.5, textures=TWO)), "kad"),
    "contacts only": Family(replace(BASE, robot=many(0, 6)), "ka"),
    "5 Hz": Family(replace(BASE, pace=Pace(0.06, 0.5, 0.03)), "ka"),
    "50 Hz": Family(replace(BASE, pace=Pace(0.005, 0.05, 0.0025), rows=1800), "ka"),
    "noise 0.5": Family(replace(BASE, world=world(odometry=0.025, odometry_memory_m=0.3, radial_sigma_m=0.0025)), "ka"),
    "noise 3": Family(replace(BASE, world=world(odometry=0.15, odometry_memory_m=0.3, radial_sigma_m=0.015)), "ka"),
    "real Create": Family(replace(BASE, world=CREATE), "ka"),
    "catches": Family(replace(BASE, world=world(catch=0.5)), "ka"),
    "raw windows": Family(replace(BASE, world=families.RAW), "ka"),
    "spinning wheels": Family(replace(BASE, slips=4), "k"),
    "gap 5 s": Family(replace(BASE, faults=(gap(5.0),)), "k"),
    "gap 15 s": Family(replace(BASE, faults=(gap(15.0),), rows=750), "k"),
    **{
        f"symmetric but {mm} mm": Family(replace(BASE, arena=nearly_symmetric(mm / 1000.0)), "a", 2)
        for mm in (1, 10, 50)
    },
    "a wrong tile": Family(replace(BASE, map_fault=faults.wrong_tile), "k"),
    "two wrong tiles": Family(replace(BASE, map_fault=two_wrong_tiles), "ad"),
    "a box moved": Family(replace(BASE, map_fault=moved_box), "k"),
    "a box missing": Family(replace(BASE, map_fault=faults.lost_obstacle), "k"),
    "a box too many": Family(replace(BASE, map_fault=new_box), "k"),
    "dead whisker": Family(replace(BASE, faults=(faults.dead,)), "k"),
    "swapped whiskers": Family(replace(BASE, faults=(faults.swapped,)), "k"),
    "dropped rows": Family(replace(BASE, faults=(faults.dropped,)), "k"),
    "wheels 10 % off": Family(replace(BASE, world=world(run_gain=0.1)), "k"),
    "anchor": Family(replace(families.recipe("anchor"), rows=ROWS), "kad"),
}
STARTS: dict[str, tuple[str, Callable[[Recipe], Recipe]]] = {
    "k": ("known", lambda r: r),
    "a": ("anywhere", lambda r: replace(r, uniform=True)),
    "d": ("kidnap", lambda r: replace(r, kidnap_rows=(200,), rows=max(r.rows, 800))),
}


def judge(made: Made, run: localise.Run, folds: int) -> dict:
    """Figures of one run."""
    truth = made.observations.truth
    off = position_errors(run.poses, truth)
    turned = heading_errors(run.poses, truth)
    levels, areas = run.levels, run.areas_m2
    if folds == 2:
        size = np.array(made.scene.arena.size_m)
        image = np.column_stack([size - truth[:, :2], truth[:, 2] + math.pi])
        other = position_errors(run.poses, image)
        turned = np.where(other < off, heading_errors(run.poses, image), turned)
        off = np.minimum(off, other)  # the regions are judged by the truth itself
    begun = made.kidnaps[-1] if made.kidnaps else 0
    lock = lock_row(off[begun:])
    after = begun + lock if lock is not None else len(off)
    sure = run.table["confidence"] > SURE
    counted = np.ones(len(off), bool)
    counted[begun : begun + SETTLING_ROWS * bool(made.kidnaps)] = False
    wrong = sure & ((off > FAR_M) | (turned > FAR_RAD)) & counted
    at = np.array(localise.judged_rows(made.observations, REGIONS))
    near = ((off <= FAR_M) & (turned <= FAR_RAD))[counted]
    return {
        "locked": lock is not None,
        "near": bool((off[-LOCK_ROWS:] <= LOCK_M).all()),
        "rows": lock,
        "error_m": float(np.median(off[after:])) if lock is not None else None,
        "covered": (levels[at >= after] <= 0.9).tolist(),
        "area_m2": areas[at >= after].tolist(),
        "sure_wrong": float(wrong.sum() / counted.sum()),
        "brier": float(np.mean((run.table["confidence"][counted] - near) ** 2)),
        "us": float(run.step_us.mean()),
        "us_p999": float(np.quantile(run.step_us, 0.999)),
    }


def measure(name: str, start: str, filter: str, settings: dict, seeds: range) -> dict:
    """Figures of one family and start over seeds."""
    family = FAMILIES[name]
    recipe = STARTS[start][1](family.recipe)
    runs = []
    for seed in seeds:
        made = make_recipe(recipe, seed)
        run = localise.run(filter, made.scene, made.observations, settings, seed, REGIONS)
        runs.append(judge(made, run, family.folds))
    covered = [c for run in runs for c in run["covered"]]
    areas = [a for run in runs for a in run["area_m2"]]
    errors = [run["error_m"] for run in runs if run["locked"]]
    return {
        "runs": len(runs),
        "locked": sum(run["locked"] for run in runs),
        "rows_to_lock": float(np.median([run["rows"] for run in runs if run["locked"]] or [np.nan])),
        "error_mm": 1000 * float(np.median(errors or [np.nan])),
        "coverage_90": float(np.mean(covered)) if covered else None,
        "region_90_cm2": 1e4 * float(np.median(areas)) if areas else None,
        "sure_wrong": float(np.mean([run["sure_wrong"] for run in runs])),
        "brier": float(np.mean([run["brier"] for run in runs])),
        "us": float(np.mean([run["us"] for run in runs])),
        "us_p999": float(np.max([run["us_p999"] for run in runs])),
        "seeds_lost": [seed for seed, run in zip(seeds, runs, strict=True) if not run["locked"]],
    }


def run(
    _build: Path,
    filter: str = "adaptive",
    seeds: int = 20,
    first: int = FIRST_SEED,
    only: Sequence[str] = (),
    set: Sequence[str] = (),
) -> None:
    settings = {key: float(value) for key, value in (pair.split("=") for pair in set)}
    done = {}
    for name, family in FAMILIES.items():
        if only and not any(word in name for word in only):
            continue
        for start in family.starts:
            title = f"{name}, {STARTS[start][0]}"
            done[title] = measure(name, start, filter, settings, range(first, first + seeds))
    locked, runs = (sum(r[key] for r in done.values()) for key in ("locked", "runs"))
    print(f"locked {locked} of {runs}, sure and wrong {np.mean([r['sure_wrong'] for r in done.values()]):.4f}")
    store.write_result("nav_unseen", {"filter": filter, "settings": settings, "families": done})


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--filter", default="adaptive")
    parser.add_argument("--seeds", type=int, default=20, help="of each family and start (default: %(default)s)")
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="seed (default: %(default)s)")
    parser.add_argument("--only", action="append", default=[], help="families whose names hold this; may be repeated")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="of the filter; may be repeated"
    )
