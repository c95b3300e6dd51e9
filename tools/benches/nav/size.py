"""Start unknown in arenas of 10 to 100 m: locks, memory, set-up and the cost of a row once locked.

    tools/benches nav_size --seeds 20 --side 50

Tiles of 0.5 m, boxes of 10 to 30 cm, the default filter. Also the set-up in 50 m with 10 000 boxes.
"""

import argparse
import math
import time
from collections.abc import Sequence
from dataclasses import replace
from json import dumps
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from crunchbot.nav import localise
from crunchbot.nav.filters import Filter
from crunchbot.nav.scoring import lock_row, position_errors
from crunchbot.scene import Arena, Prior, Scene
from crunchbot.scenes import arenas, robots
from crunchbot.scenes.families import Recipe
from crunchbot.scenes.making import make_recipe

from .. import store

ROOT = Path(__file__).resolve().parents[3]
RESULT, PAGE = store.RESULTS / "nav_size.json", ROOT / "docs/results/nav_size.md"
SIDES = (10, 25, 50, 100)
TILE = 0.5
PER_M2 = 0.36
ROWS = 1200
FIRST_SEED = 71_000
CROWDED_SIDE, CROWDED_BOXES = 50, 10_000


def floor(side: float, boxes: int):
    """Square of `side` m with so many boxes anywhere."""

    def make(rng: np.random.Generator, _radius: float) -> Arena:
        tiles = math.ceil(side / TILE - 1e-6)
        sizes = rng.uniform(0.1, 0.3, (boxes, 2))
        corners = rng.uniform(0.0, side - sizes)
        placed = np.round(np.hstack([corners, corners + sizes]), 3)
        letters = arenas.random_floor(tiles, tiles, arenas.TEXTURES, rng)
        return Arena((float(side),) * 2, TILE, arenas.TEXTURES, letters, tuple(map(tuple, placed.tolist())))

    return make


def one(side: float, seed: int) -> dict:
    """Figures of one run."""
    made = make_recipe(replace(Recipe("", floor(side, round(PER_M2 * side * side)), rows=ROWS), uniform=True), seed)
    run = localise.run("adaptive", made.scene, made.observations, {}, seed)
    lock = lock_row(position_errors(run.poses, made.observations.truth))
    return {
        "locked": lock,
        "us": None if lock is None else float(np.median(run.step_us[lock:])),
        "us_most": float(run.step_us.max()),
        "bytes": int(run.table["bytes"].max()),
        "setup_s": float(run.setup_s),
    }


def crowded() -> dict:
    """Set-up, CPU time, of a filter in an arena with many boxes."""
    rng = np.random.default_rng(1)
    arena = floor(CROWDED_SIDE, CROWDED_BOXES)(rng, 0.0)
    begun = time.process_time()
    Filter("adaptive", Scene(arena, robots.anchor(), Prior("uniform")), {}, 1)
    return {"side_m": CROWDED_SIDE, "boxes": CROWDED_BOXES, "setup_s": time.process_time() - begun}


def measure(side: float, seeds: range) -> dict:
    runs = [one(side, seed) for seed in seeds]
    locked = [run for run in runs if run["locked"] is not None]
    return {
        "runs": len(runs),
        "locked": len(locked),
        "rows_to_lock": float(np.median([run["locked"] for run in locked] or [np.nan])),
        "us_locked": float(np.median([run["us"] for run in locked] or [np.nan])),
        "us_most": max(run["us_most"] for run in runs),
        "megabytes": max(run["bytes"] for run in runs) / 1e6,
        "setup_s": float(np.median([run["setup_s"] for run in runs])),
    }


def power(sides: dict[str, dict]) -> float:
    """Power of the area that a row's cost follows once locked."""
    areas = [2.0 * math.log(float(side)) for side in sides]
    return float(np.polyfit(areas, [math.log(r["us_locked"]) for r in sides.values()], 1)[0])


def chart(data: dict) -> Figure:
    sides = [float(side) for side in data["sides"]]
    figure = Figure(figsize=(9.2, 3.2), layout="constrained")
    panels = (
        ("megabytes", "memory, MB", 64.0),
        ("us_locked", "CPU time of a row once locked, us", None),
        ("rows_to_lock", "rows to lock", None),
    )
    for ax, (key, title, wanted) in zip(figure.subplots(1, 3), panels, strict=True):
        ax.plot(sides, [r[key] for r in data["sides"].values()], "*-", color="C3")
        if wanted:
            ax.axhline(wanted, color="0.6", linestyle=":")
        ax.set(xscale="log", ylim=(0, None), xlabel="side of the arena, m", title=title)
        ax.set_xticks(sides, [f"{side:g}" for side in sides], minor=False)
        ax.minorticks_off()
    return figure


def page(data: dict) -> str:
    """docs/results/nav_size.md."""
    lines = [
        "# Start unknown, by the arena's size",
        "",
        f"`tools/benches nav_size`: the filter `adaptive` with its defaults in squares with tiles of {TILE} m and boxes of 10 to"
        " 30 cm,",
        f"{PER_M2} of them a square metre, the robot of the family `anchor`, {ROWS} rows. Locked, and how the error is taken: as in"
        " [navigation](nav.md).",
        "Times are CPU times on a busy machine.",
        "",
        "| side, m | locked | rows to lock | us a row, once locked | slowest row, us | MB | set-up, s |",
        "|---|---|---|---|---|---|---|",
    ]
    for side, r in data["sides"].items():
        lines.append(
            f"| {side} | {r['locked']} of {r['runs']} | {r['rows_to_lock']:.0f} | {r['us_locked']:.0f} | {r['us_most']:.0f} "
            f"| {r['megabytes']:.1f} | {r['setup_s']:.2f} |"
        )
    c = data["crowded"]
    lines += [
        "",
        f"Once locked, a row's cost follows the area to the power {data['power']:.2f}. Set-up in {c['side_m']} m with"
        f" {c['boxes']} boxes: {c['setup_s']:.2f} s.",
        "",
        "![memory, cost and rows to lock by the arena's side](../charts/nav_size.svg)",
    ]
    return "\n".join(lines) + "\n"


def run(
    _build: Path, _fresh: bool, seeds: int = 20, first: int = FIRST_SEED, side: Sequence[int] = (), json: Path = RESULT
) -> None:
    sides = {}
    for metres in side or SIDES:
        sides[str(metres)] = measure(metres, range(first, first + seeds))
        print(metres, sides[str(metres)], flush=True)
    data = {"sides": sides, "power": power(sides) if len(sides) > 1 else None, "crowded": crowded()}
    json.write_text(dumps(data, indent=1) + "\n")
    if json == RESULT:
        store.record_origin("nav_size")
        store.write_chart("nav_size", chart(data))
        PAGE.write_text(page(data))


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seeds", type=int, default=20, help="runs of each size (default: %(default)s)")
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="seed (default: %(default)s)")
    parser.add_argument("--side", type=int, action="append", default=[], help="m; may be repeated (default: all)")
    parser.add_argument("--json", type=Path, default=RESULT, help="where to write (default: %(default)s)")
