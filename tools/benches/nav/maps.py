"""Maps by touch alone with defaults: families, with normals, with a gyroscope, hard worlds; error against cost.

.venv/bin/python tools/benches map [--seeds N] [--workers N]

Each run is a job whose figures are kept for the state of the mapper, the scenes and this file.
"""

import argparse
import math
from pathlib import Path

import matplotlib
import numpy as np

from crunchbot.nav import mapping
from crunchbot.nav.mapper import default_particles
from crunchbot_lab.scenes import map_events, map_scoring, own_map
from crunchbot_lab.scenes.families import NORMAL_SD_DEG
from crunchbot_lab.scenes.making import ROW_S, make
from crunchbot_lab.scenes.sweep import sweep

from .. import store
from ..markdown import table
from . import charts, map_growing

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
    "kidnapped": dict.fromkeys((f"{family}+carried" for family in PAPER), 3000),
}
# Seeds of a family to one of a row of these tables, and to one of 30 minutes.
SHARES, LONG_SHARE = {"hard": 5, "kidnapped": 2}, 20
SWEPT, PARTICLES = ("anchor", "raw"), (1, 4, 12, 36)
SWEEP_SEEDS = 3  # at most
INPUTS = ("host/nav", "host/python/crunchbot/nav", "lab/crunchbot_lab/scenes", "tools/benches/nav/maps.py")
ROWS, FIRST_SEED = 3000, 500
WORKERS = 2
PAGE = store.ROOT / "docs/results/map.md"
WANTED_MM = {"anchor": 20, "robot": 35, "raw": 45, "noisy": 80}
COLUMNS = (  # title, key, factor, digits
    ("error, mm", "error_median_m", 1000, 0),
    ("from the first pose, mm", "anchored_median_m", 1000, 0),
    ("odometry, mm", "odometry_error_median_m", 1000, 0),
    ("90 % regions hold, %", "coverage_90", 100, 0),
    ("faces right, %", "faces_right", 100, 0),
    ("corners found, %", "corners_found", 100, 0),
    ("false, %", "corners_false", 100, 0),
    ("tiles said, %", "tiles_said", 100, 0),
    ("right, %", "tiles_right", 100, 1),
    ("us a row", "step_us_mean", 1, 0),
)
SLOWER, WORSE = (
    1.5,
    1.3,
)  # in the own map: times the rows to lock in the true one; times the root of both errors' squares
OWN_MEDIANS = ("true_rows", "own_rows", "true_error_m", "own_error_m")
OWN_HEAD = ["family", "runs", "locked, true map", "locked, own map", "in time", "rows, true", "rows, own"]
OWN_HEAD += ["error, true, mm", "error, own, mm", "ratio"]
KIDNAP_HEAD = ["family", "runs", "noticed", "joined", "falsely", "false alarms", "rows to notice", "rows to join"]


def one(family: str, seed: int, rows: int = ROWS, own: bool = False, **options) -> dict[str, float | None]:
    """Figures of one run; `own`: also of a drive in the map that it left."""
    made = make(family, seed, rows)
    scene = made.scene
    mapped = mapping.run(scene.robot, scene.arena.textures, made.observations, seed, **options)
    if made.kidnaps:
        return map_events.kidnaps_score(mapped, made.kidnaps)
    found = map_scoring.score(mapped, scene.arena) | map_events.kidnaps_score(mapped, ())
    return found | (own_figures(own_map.score(mapped, family, seed)[0]) if own else {})


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


def kidnaps_summed(runs: list[dict]) -> dict:
    """Of runs with a kidnap: counts, and medians of rows."""
    counts = {
        "noticed": sum(run["noticed_rows"] is not None for run in runs),
        "joined": sum(run["joined"] or 0 for run in runs),
    }
    counts |= {name: sum(run[name] for run in runs) for name in ("joined_false", "alarms_false")}
    for name in ("noticed_rows", "joined_rows"):
        counts[f"{name}_median"] = _median([run[name] for run in runs if run[name] is not None])
    return {"runs": len(runs)} | counts


def _median(values: list[float]) -> float | None:
    return float(np.median(values)) if values else None


def summed(runs: list[dict]) -> dict:
    """Medians over runs, the worst error, and in how many the odometry was better."""
    known = {key: [run[key] for run in runs if run[key] is not None] for key in runs[0]}
    out = {key: float(np.median(values)) if values else None for key, values in known.items()}
    errors = [run["error_median_m"] for run in runs]
    worse = sum(run["error_median_m"] > run["odometry_error_median_m"] for run in runs)
    alarms = sum(run["alarms_false"] for run in runs)
    return out | {"runs": len(runs), "error_worst_m": max(errors), "worse_than_odometry": worse, "alarms": alarms}


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
    sizes = [(f, p, lattice) for f in SWEPT for p in PARTICLES for lattice in (True, False)]
    for family, particles, lattice in sizes:
        few = range(FIRST_SEED, FIRST_SEED + min(seeds, SWEEP_SEEDS))
        names = {f"{family}-{particles}-{lattice}-{seed}": {"seed": seed} for seed in few}
        parts[family, particles, lattice] = list(names)
        options = {"family": family, "particles": particles, "lattice": lattice}
        jobs |= {name: options | job for name, job in names.items()}
    found = sweep(one, jobs, store.kept("map", *INPUTS), workers, label="map")
    sums = {
        key: (kidnaps_summed if key[0] == "kidnapped" else summed)([found[name] for name in names])
        for key, names in parts.items()
    }
    tables = {title: {f: sums[title, f] | {"rows": rows} for f, rows in t.items()} for title, t in TABLES.items()}
    swept = [{"family": f, "particles": p, "lattice": lattice, **sums[f, p, lattice]} for f, p, lattice in sizes]
    own_sums = {family: own_summed([found[name] for name in parts["families", family]]) for family in PAPER}
    return {"rows": ROWS, "seeds": seeds, "sweep": swept, "own": own_sums, **tables}


def chart(data: dict) -> matplotlib.figure.Figure:
    """Error against time for a row, a panel for each family."""
    figure, axes = charts.panels(len(SWEPT))
    for ax, family in zip(axes, SWEPT, strict=True):
        for lattice, look, title in ((True, "o-", "faces and tiles"), (False, "s--", "faces alone")):
            points = [s for s in data["sweep"] if s["family"] == family and s["lattice"] == lattice]
            cost, error = ([p[key] for p in points] for key in ("step_us_mean", "error_median_m"))
            colour = "0.0" if lattice else "0.5"
            ax.plot(cost, 1000 * np.array(error), look, color=colour, label=title)
            for p in points:
                at = (p["step_us_mean"], 1000 * p["error_median_m"])
                ax.annotate(p["particles"], at, textcoords="offset points", xytext=(3, 4), fontsize=7, color=colour)
        odometry = data["families"][family]["odometry_error_median_m"]
        title = f"{family} (odometry: {1000 * odometry:.0f} mm)"
        ax.set(xscale="log", ylim=(0, None), xlabel="CPU time of a row, us", ylabel="median error, mm", title=title)
        ax.grid(True, linewidth=0.3)
        ax.legend(frameon=False, fontsize=8)
    return figure


def _cell(value: float | None, factor: float, digits: int) -> str:
    return "-" if value is None else f"{factor * value:.{digits}f}"


def rows_of(found: dict[str, dict]) -> list[list[str]]:
    """A row of the page a family."""
    out = []
    for family, one_family in found.items():
        cells = [_cell(one_family[key], factor, digits) for _, key, factor, digits in COLUMNS]
        base, rows = family.removesuffix("+gyro").removesuffix("+normals"), one_family["rows"]
        wanted = str(WANTED_MM[base]) if base in WANTED_MM else ""
        name = family if rows == ROWS else f"{family}, {rows * ROW_S / 60:.0f} min"
        head = [name, str(one_family["runs"]), wanted, cells[0], f"{1000 * one_family['error_worst_m']:.0f}"]
        out.append([*head, str(one_family["worse_than_odometry"]), *cells[1:]])
    return out


def own_rows(found: dict[str, dict]) -> list[list[str]]:
    """A row of the page a family."""
    out = []
    for family, one_family in found.items():
        counts = [str(one_family[key]) for key in ("runs", "locked_true", "locked_own", "in_time")]
        rows = [_cell(one_family[f"{key}_rows_median"], 1, 0) for key in ("true", "own")]
        errors = [_cell(one_family[f"{key}_error_m_median"], 1000, 0) for key in ("true", "own")]
        out.append([family, *counts, *rows, *errors, _cell(one_family["error_ratio_median"], 1, 2)])
    return out


def event_rows(found: dict[str, dict]) -> list[list[str]]:
    """A row of the page a family."""
    out = []
    for family, one_family in found.items():
        out.append([family, _cell(one_family["step_us_p99"], 1, 0), f"{one_family['alarms']:.0f}"])
    return out


def kidnap_rows(found: dict[str, dict]) -> list[list[str]]:
    """A row of the page a family."""
    keys = ("runs", "noticed", "joined", "joined_false", "alarms_false", "noticed_rows_median", "joined_rows_median")
    return [[family, *(_cell(one_family[key], 1, 0) for key in keys)] for family, one_family in found.items()]


def page(data: dict) -> str:
    """docs/results/map.md."""
    titles = [title for title, *_ in COLUMNS]
    head = ["family", "runs", "wanted, mm", titles[0], "worst, mm", "odometry better in", *titles[1:]]
    families, normals, gyroscope, hard = (
        table(head, rows_of(data[title])) for title in ("families", "normals", "gyroscope", "hard")
    )
    return (
        "# Maps by touch alone\n\n"
        "Generated by `tools/benches page` from `bench/results/map.json`, measured by `tools/benches map`: "
        f"`whisker map` with its defaults, {data['rows']} rows (5 minutes) a run. [How to reproduce one and to score a "
        "SLAM of your own](../own_world.md#your-own-map).\n\n"
        "Medians over the runs. Errors are medians over a run's rows after the rigid motion that fits the path best; "
        "from the first pose, without it. Poses are those of the time, from the rows until then. Odometry is aligned, "
        "too. Faces are right within 15 mm and 1 degree after that motion, by length; corners within 50 mm, of those "
        "within reach of the path. Tiles: places that a texture whisker visited.\n\n"
        "![a map after 10, 30, 100 and 300 seconds](../charts/map_growing.svg)\n\n"
        f"A map of `{map_growing.FAMILY}`, seed {map_growing.SEED}, as it grows. Grey: floor known to be free. Thick lines: faces "
        "that were felt. Circles: corners. Thin line: estimated path; dots: true path. Dashes: true walls and boxes, which the "
        "robot does not know.\n\n"
        "## No gyroscope\n\n"
        + families
        + "\n"
        + table(["family", "us a row, 99 %", "kidnaps that were none"], event_rows(data["families"]))
        + f"\n## With normals of the faces that are touched, to {NORMAL_SD_DEG:g} degrees\n\n"
        + normals
        + "\n## With a gyroscope of 0.2 degrees a row\n\n"
        + gyroscope
        + "\n## Hard worlds\n\n"
        "`whisker scene make --list-families` says what each is. Where the floor has no tiles, or the wall no "
        "straight faces, tiles, faces and corners are judged against the fine tiles and boxes that stand for them; "
        "after textures were renamed, by their first names.\n\n" + hard + "\n## Kidnapped while mapping\n\n"
        "Carried at least 0.8 m after half of the rows. Joined: at the end the poses are in the first map's frame. Falsely: "
        "a median error beyond 0.3 m after a join.\n\n"
        + table(KIDNAP_HEAD, kidnap_rows(data["kidnapped"]))
        + "\n## In its own map\n\n"
        f"A second drive of {own_map.ROWS} rows from an unknown start within {own_map.VISITED_M:g} m of the first one's "
        f"path; the filter `{own_map.FILTER}` in the map that the first drive left, and on the same rows in the true map. In "
        f"time: at most {SLOWER:g} times the rows. Ratio: error in the own map over the root of (error of the "
        f"mapping poses squared + error in the true map squared), {WORSE:g} wanted.\n\n"
        + table(OWN_HEAD, own_rows(data["own"]))
        + "\n## Error against cost\n\n"
        "![error against cost by the number of hypotheses](../charts/map.svg)\n\n"
        "Numbers beside the points: hypotheses held at a time; the default is "
        f"{default_particles()}.\n"
    )


def run(_build: Path, seeds: int = 100, workers: int = WORKERS) -> None:
    data = measure(seeds, workers)
    store.write_result("map", data)
    store.write_chart("map", chart(data), letters=True)
    store.write_chart("map_growing", map_growing.figure())
    store.write_page(PAGE, page(data))


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seeds", type=int, default=100, help="scenes of each family (default: %(default)s)")
    parser.add_argument("--workers", type=int, default=WORKERS, help="processes (default: %(default)s)")
