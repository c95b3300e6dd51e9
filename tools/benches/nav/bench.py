"""Measures the filters: speed against accuracy beside other projects' filters, and which fault makes which filter fail.

    tools/benches nav [--seeds N] [--only pareto|matrix] [--workers N]

Figures but those of time are the same for any number of workers. Seeds are none that filters were developed on.
"""

import argparse
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from crunchbot.nav import localise
from crunchbot.nav.scoring import auc
from crunchbot_lab.scenes import trials
from crunchbot_lab.scenes.sweep import sweep

from .. import store

FIRST_SEED = 5000
CHUNK = 10  # seeds per job
LOST_M = 0.25
BINS = 10  # of confidence

# Filters at several sizes: title, filter, settings, most seeds (what is slow gets fewer).
SIZES = [
    ("odometry", "odometry", {}, 100),
    ("ekf", "ekf", {}, 100),
    *((f"foveal {n}^3", "foveal", {"foveal.cells": n}, 100) for n in (7, 11)),
    ("foveal 15^3", "foveal", {"foveal.cells": 15}, 50),
    ("grid 10 cm", "grid", {"grid.cell_m": 0.1, "grid.cell_deg": 20}, 100),
    ("grid 5 cm", "grid", {}, 50),
    ("grid 2.5 cm", "grid", {"grid.cell_m": 0.025, "grid.cell_deg": 5}, 10),
    *((f"particle {n}", "particle", {"particle.count": n}, 100) for n in (2, 100, 300, 1000)),
    ("particle 3000", "particle", {"particle.count": 3000}, 50),
    ("particle 10000", "particle", {"particle.count": 10_000}, 20),
    ("particle kld", "particle", {}, 100),
    ("adaptive", "adaptive", {}, 100),
    *((f"adaptive {n}", "adaptive", {"adaptive.least": n}, 100) for n in (100, 1000)),
]
PARETO = ("anchor", "raw", "free", "robot")

# Rows of the stability matrix: title, family, rows of observations (None: the family's).
MATRIX = [
    ("known start", "anchor", 400),
    ("global start", "anchor+global", None),
    ("kidnap", "anchor+kidnap", None),
    *((f"prior wrong {m:g} m", f"anchor+wrong-{m:g}m", 600) for m in (0.2, 0.5, 1.0)),
    *((f"prior wrong {d} deg", f"anchor+wrong-{d}deg", 600) for d in (90, 180)),
    ("2-fold symmetric, global", "symmetric2+global", 600),
    ("4-fold symmetric, global", "symmetric4+global", 600),
    ("one texture, global", "one-texture+global", 600),
    ("no obstacle, global", "no-obstacle+global", 600),
    *(
        (f"{kind}, one {n}", f"anchor+{kind}-{n}", 400)
        for n in ("frame", "second")
        for kind in ("zero", "nan", "inf", "constant")
    ),
    ("catches", "anchor+catches", 400),
    ("raw windows, catches", "raw", 400),
    ("dead whisker", "anchor+dead", 400),
    ("swapped whiskers", "anchor+swapped", 400),
    ("sign-flipped whisker", "anchor+flipped", 400),
    ("30 % outliers", "anchor+outliers", 400),
    ("10 % missed contacts", "anchor+missed", 400),
    *((f"odometry x {s:g}", f"anchor+scale-{s:g}", 400) for s in (0.8, 0.9, 1.1, 1.2)),
    ("turn bias 20 %", "anchor+turn-bias", 400),
    ("slip", "anchor+slip", 400),
    *((f"rows {kind}", f"anchor+{kind}", 400) for kind in ("late", "doubled", "reordered", "dropped")),
    ("map: a wrong tile", "anchor+map-tile", 400),
    ("map: an obstacle missing", "anchor+map-obstacle", 400),
]


def measured(wanted: dict[tuple[str, str], dict], label: str, workers: int | None) -> dict[tuple[str, str], list[dict]]:
    """Trials by (row, title), each wanted as family, filter, settings, rows and seeds."""
    jobs, places = {}, {}
    for place, spec in wanted.items():
        for first in range(FIRST_SEED, FIRST_SEED + spec["seeds"], CHUNK):
            seeds = list(range(first, min(first + CHUNK, FIRST_SEED + spec["seeds"])))
            arguments = {k: spec[k] for k in ("family", "filter", "settings", "rows")} | {"seeds": seeds}
            text = json.dumps(arguments, sort_keys=True).encode()
            name = f"{spec['family']}-{spec['filter']}-{hashlib.sha256(text).hexdigest()[:12]}"
            jobs[name] = arguments
            places.setdefault(place, []).append(name)
    done = sweep(trials.trials, jobs, store.kept("nav") / "jobs", workers, label=label)
    return {place: [t for name in names for t in done[name]["trials"]] for place, names in places.items()}


def by_row(done: dict[tuple[str, str], list[dict]], figures) -> dict[str, dict]:
    """{row: {title: figures(trials)}}"""
    out: dict[str, dict] = {}
    for (row, title), made in done.items():
        out.setdefault(row, {})[title] = figures(made)
    return out


def point(made: list[dict]) -> dict:
    """Of speed against accuracy: medians over runs, and the middle half of the error."""
    low, error, high = np.quantile([t["error_median_m"] for t in made], [0.25, 0.5, 0.75])
    us, p99 = (float(np.median([t["timing"][key] for t in made])) for key in ("step_us_median", "step_us_p99"))
    rms = float(np.median([t["error_rms_m"] for t in made]))
    spread = {"error_m": float(error), "error_low_m": float(low), "error_high_m": float(high)}
    return {"runs": len(made), "us": us, "us_p99": p99, **spread, "rms_m": rms}


def stable(made: list[dict]) -> dict:
    """Of a cell of the matrix; coverage: of the 90 % regions after lock."""
    held = []
    for judged in (t["judged"] for t in made if t["lock_rows"] is not None):
        held += (np.array(judged["level"])[np.array(judged["after_lock"], bool)] <= 0.9).tolist()
    return {
        "near_at_end": float(np.mean([t["near_at_end"] for t in made])),
        "error_m": float(np.median([t["error_median_m"] for t in made])),
        "coverage_90": float(np.mean(held)) if held else None,
        "faulty_rows": sum(t["faulty"] for t in made),
    }


def foresight(judged: list[dict]) -> dict:
    """How well confidence foretells being lost: area under its curve, and how far it is from the share near the truth."""
    confidence, error_m = (np.concatenate([j[key] for j in judged]) for key in ("confidence", "error_m"))
    bins, gap = np.minimum((confidence * BINS).astype(int), BINS - 1), 0.0
    for inside in (bins == k for k in range(BINS)):
        if inside.any():
            gap += inside.sum() * abs(confidence[inside].mean() - (error_m[inside] <= LOST_M).mean())
    return {"auc": auc(-confidence, error_m > LOST_M), "calibration_error": gap / max(len(confidence), 1)}


def pareto(seeds: int, workers: int | None) -> None:
    wanted = {
        (family, title): {"family": family, "filter": name, "settings": settings, "rows": 600}
        | {"seeds": max(1, round(most * seeds / 100))}
        for family in PARETO
        for title, name, settings, most in SIZES
    }
    store.write_result("nav_pareto", by_row(measured(wanted, "pareto", workers), point))


def matrix(seeds: int, workers: int | None) -> None:
    names = localise.filter_names()
    wanted = {
        (title, name): {"family": family, "filter": name, "settings": {}, "rows": rows, "seeds": seeds}
        for title, family, rows in MATRIX
        for name in names
    }
    done = measured(wanted, "matrix", workers)
    judged = {name: [t["judged"] for (_, n), made in done.items() if n == name for t in made] for name in names}
    confidence = {name: foresight(judged[name]) for name in names}
    store.write_result("nav_matrix", {"seeds": seeds, "rows": by_row(done, stable), "confidence": confidence})


PARTS = {"pareto": pareto, "matrix": matrix}


def run(_build: Path, only: Sequence[str] = tuple(PARTS), workers: int | None = None, seeds: int = 100) -> None:
    """The filters are those of the Python module."""
    for part in only:
        PARTS[part](seeds, workers)


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seeds", type=int, default=100, help="at most, of each family (default: %(default)s)")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS), metavar="PART")
    parser.add_argument("--workers", type=int, help="processes (default: all cores)")
