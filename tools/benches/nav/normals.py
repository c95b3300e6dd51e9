"""What the direction of a touched surface is worth to navigation: the same rows with and without it, seed by seed.

    tools/benches normals --seeds 8 --flights 6

Scenes at level 0 (`normals`: 5 degrees, one in twenty wrong), and the simulated robot, whose pilot runs the contact
filter on its whiskers' signals.
"""

import argparse
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from crunchbot.nav import localise
from crunchbot.nav.observations import Observations, read_observations
from crunchbot.nav.scoring import heading_errors, lock_row, position_errors
from crunchbot.observation import has_normals
from crunchbot.pilot.pilot import Pilot
from crunchbot.robot.models import load_models
from crunchbot.robot.rowfiles import Rows
from crunchbot.scene import Prior, Scene
from crunchbot_lab import scenes
from crunchbot_lab.demo.level1 import explore
from crunchbot_lab.demo.training import learn
from crunchbot_lab.scenes.geometry import directions
from crunchbot_lab.simulation.scenes import make_scene

from .. import store

ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs/results/nav_normals.md"
FAMILIES = ("anchor", "noisy", "one-texture+global", "one-whisker", "one-whisker+global", "robot", "robot+global")
FILTERS = ("adaptive",)
ROWS, FIRST_SEED = 1000, 72_000
FLIGHT, LEARN_SEED, FLIGHT_TICKS = "simulated robot", 11, 240_000
POSE = ("x_m", "y_m", "theta_rad")
LOOSE_M, CORNER_M = 0.01, 0.005  # of a whisker that has let go; of the end of a face
NINETY = 1.645
POINT_M = 0.001  # deviation of a contact's point


def figures(name: str, scene: Scene, rows: Observations) -> dict:
    run = localise.run(name, scene, rows)
    far = position_errors(run.poses, rows.truth)
    return {
        "error_mm": 1e3 * float(np.median(far)),
        "heading_deg": math.degrees(float(np.median(heading_errors(run.poses, rows.truth)))),
        "lock": lock_row(far),
        "us": float(run.step_us.mean()),
    }


def both(scene: Scene, rows: Observations) -> dict:
    """Figures by filter, with the direction and without."""
    plain = replace(rows, normal=None)
    return {name: [figures(name, scene, rows), figures(name, scene, plain)] for name in FILTERS}


def drawn(family: str, seed: int) -> dict:
    made = scenes.make(f"{family}+normals", FIRST_SEED + seed, ROWS)
    read = int(np.isfinite(made.observations.normal[..., 0]).sum())
    return both(made.scene, made.observations) | {"read": read}


def models(folder: Path, scene: Scene) -> tuple[dict, dict]:
    if not (folder / "texture.json").exists():
        learn(folder, make_scene(LEARN_SEED)[0], LEARN_SEED, lambda: None)
    return load_models(folder, scene.robot)


def flown(build: Path, seed: int) -> dict:
    """A flight of the simulated robot: navigation, and errors of its directions with their stated deviations, rad."""
    scene, start = make_scene(FIRST_SEED + seed)
    pilot = Pilot(scene.robot, *models(build / "normals", scene), seed)
    rows, truth = explore(scene, start, pilot, FIRST_SEED + seed, FLIGHT_TICKS)
    path = build / "normals" / f"observations_{seed}.csv"
    with path.open("w", newline="") as file:
        out = Rows(file)
        for row, true in zip(rows, truth, strict=True):
            out.write({**row} | {f"true_{name}": true[name] for name in POSE})
    assert has_normals(rows[0])
    reported = read_observations(path, scene)
    read = np.isfinite(reported.normal[..., 0])
    errors = [off for n in range(read.shape[1]) for off in off_truth(scene, reported, n)]
    anywhere = replace(scene, prior=Prior("uniform"))
    sharp = replace(anywhere, robot=replace(scene.robot, radial_sigma_m=POINT_M))
    points, rows_reported = np.isfinite(reported.point[..., 0]), with_points(scene, reported)
    alone = np.isfinite(rows_reported.radial_m) & ~np.isfinite(reported.radial_m)
    made = both(anywhere, reported) | {"read": int(read.sum()), "normals": errors}
    made |= {"points": int(points.sum()), "points_alone": int(alone.sum())}
    return made | {"sharp": {name: [figures(name, sharp, rows_reported), made[name][0]] for name in FILTERS}}


def with_points(scene: Scene, reported: Observations) -> Observations:
    """Rows in which a point and its direction stand for the distance to the face, where there is none."""
    radial = reported.radial_m.copy()
    for n, whisker in enumerate(scene.robot.of_role("object")):
        normal, along = reported.normal[:, n, 0], np.array([math.cos(whisker.yaw_rad), math.sin(whisker.yaw_rad)])
        out = np.column_stack([np.cos(normal), np.sin(normal)])
        reach = ((reported.point[:, n, :2] - whisker.base_m) * out).sum(axis=1) / (out @ along)
        use = np.isnan(radial[:, n]) & (reach > 0.0) & (reach < 1.4 * whisker.length_m)
        radial[use, n] = reach[use]
    return replace(reported, radial_m=radial)


def off_truth(scene: Scene, reported: Observations, n: int) -> list[tuple[float, float]]:
    """Errors of the directions of whisker n and their deviations, where it truly met a face."""
    whisker = scene.robot.of_role("object")[n]
    longer = replace(whisker, length_m=whisker.length_m + LOOSE_M)
    off = reported.normal[:, n, 0] - directions(scene.arena, reported.truth, longer, CORNER_M) + reported.truth[:, 2]
    known = np.isfinite(off)
    return [(math.remainder(o, 2 * math.pi), s) for o, s in zip(off[known], reported.normal[known, n, 1], strict=True)]


def paired(runs: list[dict], filter: str, key: str) -> list[float]:
    """Mean with, mean without, mean difference and its standard error."""
    a, b = np.array([[one[filter][n][key] for one in runs] for n in (0, 1)], float)
    return [float(a.mean()), float(b.mean()), float((a - b).mean()), float((a - b).std(ddof=1) / math.sqrt(len(a)))]


def summed(runs: list[dict], filter: str) -> dict:
    locks = [[one[filter][n]["lock"] for one in runs] for n in (0, 1)]
    locked = [pair for pair in zip(*locks, strict=True) if None not in pair]
    us = np.array([[one[filter][n]["us"] for n in (0, 1)] for one in runs])
    return {
        "error_mm": paired(runs, filter, "error_mm"),
        "heading_deg": paired(runs, filter, "heading_deg"),
        "locked": [sum(lock is not None for lock in which) for which in locks],
        "rows_to_lock": [float(np.median(which)) for which in zip(*locked, strict=True)] if locked else None,
        "time_ratio": float(np.median(us[:, 0] / us[:, 1])),
    }


def judged(runs: list[dict]) -> dict:
    out = {"runs": len(runs), "read": float(np.mean([one["read"] for one in runs]))}
    return out | {filter: summed(runs, filter) for filter in FILTERS}


def of_directions(runs: list[dict]) -> dict:
    off, sd = np.array([pair for one in runs for pair in one["normals"]]).T
    degrees = np.degrees(np.abs(off))
    return {
        "n": len(off),
        "median_deg": float(np.median(degrees)),
        "rms_deg": float(np.sqrt(np.mean(degrees**2))),
        "beyond_15_deg": int(np.sum(degrees > 15.0)),
        "held_90": float(np.mean(np.abs(off) < NINETY * sd)),
    }


def of_points(runs: list[dict]) -> dict:
    sums = {name: sum(one[name] for one in runs) for name in ("points", "points_alone")}
    return sums | paired_of([one["sharp"] for one in runs])


def paired_of(runs: list[dict]) -> dict:
    return {name: {key: paired(runs, name, key) for key in ("error_mm", "heading_deg")} for name in FILTERS}


def table(data: dict) -> list[str]:
    head = (
        "position error, mm: with, without, difference | heading error, degrees | locked | rows to lock | time of a row"
    )
    lines = [f"| rows | directions a run | filter | {head} |", "|" + "---|" * 8]
    for family, reported in data["families"].items():
        for name in FILTERS:
            r = reported[name]
            error, heading = (
                "{:.{p}f}, {:.{p}f}, {:+.{p}f} +- {:.{p}f}".format(*r[key], p=places)
                for key, places in (("error_mm", 1), ("heading_deg", 2))
            )
            rows = "{:.0f}, {:.0f}".format(*r["rows_to_lock"]) if r["rows_to_lock"] else "-"
            lines.append(
                f"| {family} | {reported['read']:.0f} | `{name}` | {error} | {heading} | {r['locked'][0]}, "
                f"{r['locked'][1]} of "
                f"{reported['runs']} | {rows} | {r['time_ratio']:.2f} times |"
            )
    return lines


def the_point(reported: dict) -> list[str]:
    """Why the point of contact has no likelihood of its own."""
    error, heading = (reported[FILTERS[0]][key] for key in ("error_mm", "heading_deg"))
    return [
        f"The {reported['points']} points of contact have no likelihood of their own. With its direction a point "
        f"gives the distance of the face along the whisker, and",
        f"the distance in the same row gives it too, in all but {reported['points_alone']} rows. With those filled in "
        f"from the points, and all distances taken to be as good as points",
        f"({1e3 * POINT_M:.0f} mm instead of the robot's own deviation), the error is {error[0]:.1f} mm instead of "
        f"{error[1]:.1f} ({error[2]:+.1f} +- {error[3]:.1f}) and",
        f"{heading[0]:.2f} degrees instead of {heading[1]:.2f} ({heading[2]:+.2f} +- {heading[3]:.2f}).",
    ]


def page(data: dict) -> str:
    """docs/results/nav_normals.md."""
    d = data["directions"]
    lines = [
        "# What the direction of a touched surface is worth",
        "",
        "Generated by `tools/benches page` from `bench/results/nav_normals.json`, measured by `tools/benches "
        "normals`. The same rows with the columns `<whisker>_normal_rad` and",
        f"without, seed by seed; means over the runs of each run's median error, and the difference with its standard "
        f"error. {ROWS} rows of a scene;",
        "directions are good to 5 degrees and one in twenty is wrong. Rows to lock: medians over the runs that lock "
        "both ways.",
        "",
        f"`{FLIGHT}`: {FLIGHT_TICKS // 2000} s of its signals, start unknown. Its pilot runs the [contact "
        f"filter](../contact.md) in body whisks. Its {d['n']}",
        f"directions err by {d['median_deg']:.1f} degrees in the median and {d['rms_deg']:.1f} RMS, "
        f"{d['beyond_15_deg']} by more than 15;",
        f"the stated 90 % holds {100 * d['held_90']:.0f} %.",
        "",
        *table(data),
        "",
        "## The point",
        "",
        *the_point(data["points"]),
    ]
    return "\n".join(lines) + "\n"


def run(build: Path, seeds: int = 8, flights: int = 6) -> None:
    jobs = [(drawn, family, seed) for family in FAMILIES for seed in range(seeds)]
    jobs += [(flown, build, seed) for seed in range(flights)]
    found: dict[str, list[dict]] = {}
    cache = store.kept("normals")
    for make, what, seed in tqdm(jobs, desc="normals", unit="run"):
        family = what if make is drawn else FLIGHT
        one = store.once(cache / f"{family}_{seed}.json", lambda make=make, what=what, seed=seed: make(what, seed))
        found.setdefault(family, []).append(one)
    data = {"families": {family: judged(runs) for family, runs in found.items()}}
    data["directions"] = of_directions(found[FLIGHT])
    data["points"] = of_points(found[FLIGHT])
    store.write_result("nav_normals", data)
    store.write_page(PAGE, page(data))


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seeds", type=int, default=8, help="of each family")
    parser.add_argument("--flights", type=int, default=6, help="of the simulated robot, at least 2")
