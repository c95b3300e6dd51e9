"""Maps of faces, of grids in particles and of a factor graph on the same rows: error against processor time a row.

.venv/bin/python tools/benches map_representations [--seeds N] [--workers N]

Each run is a job whose figures are kept for the state of the mappers, the scenes and this file.
"""

import argparse
import time
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import matplotlib
import numpy as np

from crunchbot.nav import mapping
from crunchbot.nav.filters import ESTIMATE
from crunchbot.nav.grid_mapper import GridMapper
from crunchbot.nav.map_graph import GraphMapper
from crunchbot.nav.mapper import Mapper, MappingError
from crunchbot_lab.scenes import map_scoring
from crunchbot_lab.scenes.making import Made, make
from crunchbot_lab.scenes.sweep import sweep

from .. import store
from ..markdown import table
from . import charts

FAMILIES = ("anchor", "noisy", "raw", "robot", "anchor+round", "free")  # the last two square no more, or cluttered
SWEPT = ("anchor", "noisy")
ROWS, FIRST_SEED, WORKERS, MOST = 3000, 700, 2, 3000
LARGE, LARGE_SEEDS = 1000, 1  # particles from which on a run takes minutes; its scenes, at most
INPUTS = (
    "host/nav",
    "host/python/crunchbot/nav",
    "lab/crunchbot_lab/scenes",
    "tools/benches/nav/map_representations.py",
)


@dataclass(frozen=True)
class Kind:
    """A line of the chart: sizes, of which the last but `spare` are run on SWEPT alone."""

    title: str
    sizes: tuple[int, ...]
    default: int  # the size that all families are run at
    look: str
    grey: str


KINDS = {
    "faces": Kind("faces and tiles", (1, 4, 12, 36), 12, "o-", "0.0"),
    "faces_alone": Kind("faces, no tiles", (1, 4, 12, 36), 12, "o--", "0.55"),
    "grid": Kind("grid, surface proposal", (30, 100, 300, 1000, 3000), 100, "s-", "0.0"),
    "grid_odometry": Kind("grid, odometry's proposal", (30, 100, 300, 1000, 3000), 100, "s--", "0.55"),
    "graph": Kind("factor graph, iSAM2 and batch", (12,), 12, "^-", "0.3"),
    "auto": Kind("faces or grid, by evidence", (12,), 12, "D-", "0.75"),
}


def mapper_of(kind: str, made: Made, seed: int, size: int) -> Mapper | GraphMapper:
    robot, textures, normals = made.scene.robot, made.scene.arena.textures, made.observations.normal is not None
    if kind.startswith("grid"):
        return GridMapper(robot, textures, seed, size, normals=normals, surface=kind == "grid")
    of = GraphMapper if kind == "graph" else Mapper
    return of(robot, textures, seed, size, kind != "faces_alone", normals)


@lru_cache(2 * len(FAMILIES))
def scene(family: str, seed: int) -> Made:
    return make(family, seed, ROWS)


def one(kind: str, family: str, seed: int, size: int) -> dict[str, float | None]:
    """Figures of one run."""
    made = scene(family, seed)
    rows = made.observations
    if kind == mapping.AUTO:
        mapped = mapping.run(made.scene.robot, made.scene.arena.textures, rows, seed, size, representation=kind)
        mapper, table, step_us, taken = None, mapped.table, mapped.step_us, mapped.representation
    else:
        mapper, taken = mapper_of(kind, made, seed, size), None
        table, step_us = mapper.replay(rows, 0, ROWS)
    found = map_scoring.trajectory(table["pose"], rows.truth)
    odometry = map_scoring.trajectory(map_scoring.odometry_path(rows.odometry), rows.truth)
    found |= {
        "odometry_error_median_m": odometry["error_median_m"],
        "coverage_90": map_scoring.coverage(table["pose"], table["covariance"], rows.truth),
        "step_us_mean": float(step_us.mean()),
        "step_us_p99": float(np.quantile(step_us, 0.99)),
        "bytes": int(table["bytes"].max()),
        "evidence": mapper.evidence if isinstance(mapper, GridMapper) else None,
        "grid_taken": None if taken is None else float(taken == "grid"),
        "batch_error_median_m": None,
        "batch_us": None,
    }
    return found | (_batch(mapper, table, rows.truth) if isinstance(mapper, GraphMapper) else {})


def _batch(mapper: GraphMapper, table: np.ndarray, truth: np.ndarray) -> dict[str, float]:
    """Error of the batch's poses, and the processor time that it adds to a row."""
    begun = time.process_time()
    mapper.map()
    spent = time.process_time() - begun
    smooth = np.zeros(len(mapper.path), ESTIMATE)
    for n, (_, pose) in enumerate(mapper.path):
        smooth["pose"][n] = (pose.x(), pose.y(), pose.theta())
    kept = np.array([row for row, _ in mapper.path])
    poses, truth = smooth["pose"][kept >= 0], truth[kept[kept >= 0]]
    error = map_scoring.trajectory(poses, truth)["error_median_m"] if len(poses) > 1 else None
    return {"batch_error_median_m": error, "batch_us": 1e6 * spent / len(table)}


def summed(runs: list[dict]) -> dict:
    """Medians over runs, the worst error, and in how many the odometry was better."""
    known = {key: [run[key] for run in runs if run[key] is not None] for key in runs[0]}
    out = {key: float(np.median(values)) if values else None for key, values in known.items()}
    taken = known["grid_taken"]
    worse = sum(run["error_median_m"] > run["odometry_error_median_m"] for run in runs)
    return out | {
        "runs": len(runs),
        "error_worst_m": max(run["error_median_m"] for run in runs),
        "worse_than_odometry": worse,
        "grid_taken": float(np.mean(taken)) if taken else None,
    }


def measure(seeds: int, workers: int, most: int) -> dict:
    kinds = dict(KINDS)
    try:
        GraphMapper(make("anchor", 0, 1).scene.robot, ("A", "B"))
    except MappingError as error:
        store.leave_out("factor graph", str(error))
        del kinds["graph"]
    jobs, parts = {}, {}
    for kind, one_kind in kinds.items():
        for family in FAMILIES:
            for size in one_kind.sizes if family in SWEPT else (one_kind.default,):
                if size > most:
                    continue
                few = range(FIRST_SEED, FIRST_SEED + (min(seeds, LARGE_SEEDS) if size >= LARGE else seeds))
                names = {f"{kind}-{family}-{size}-{seed}": seed for seed in few}
                parts[kind, family, size] = list(names)
                options = {"kind": kind, "family": family, "size": size}
                jobs |= {name: options | {"seed": seed} for name, seed in names.items()}
    found = sweep(one, jobs, store.kept("map_representations", *INPUTS), workers, label="representations")
    points = [
        {"kind": kind, "family": family, "size": size, **summed([found[name] for name in names])}
        for (kind, family, size), names in parts.items()
    ]
    return {"rows": ROWS, "seeds": seeds, "points": points}


def chart(data: dict) -> matplotlib.figure.Figure:
    """Error against time for a row, a panel for each swept family."""
    figure, axes = charts.panels(len(SWEPT))
    for ax, family in zip(axes, SWEPT, strict=True):
        for kind, look in KINDS.items():
            points = [p for p in data["points"] if (p["kind"], p["family"]) == (kind, family)]
            places = [(p["step_us_mean"], 1000 * p["error_median_m"], str(p["size"])) for p in points]
            if kind == "graph":
                places = [(us, mm, "iSAM2") for us, mm, _ in places]
                places += [
                    (p["step_us_mean"] + p["batch_us"], 1000 * p["batch_error_median_m"], "batch")
                    for p in points
                    if p["batch_error_median_m"] is not None
                ]
            if not places:
                continue
            us, mm, labels = zip(*places, strict=True)
            ax.plot(us, mm, look.look, color=look.grey, label=look.title)
            for x, y, label in places:
                ax.annotate(label, (x, y), textcoords="offset points", xytext=(3, 4), fontsize=7, color=look.grey)
        odometry = next(p["odometry_error_median_m"] for p in data["points"] if p["family"] == family)
        title = f"{family} (odometry: {1000 * odometry:.0f} mm)"
        ax.set(xscale="log", ylim=(0, None), xlabel="CPU time of a row, us", ylabel="median error, mm", title=title)
        ax.grid(True, linewidth=0.3)
    axes[0].legend(frameon=False, fontsize=8)
    return figure


def _cell(value: float | None, factor: float) -> str:
    return "-" if value is None else f"{factor * value:.0f}"


def _chosen(points: list[dict]) -> str:
    """What choosing by evidence pays, in a sentence; empty where it was not measured."""
    by_kind = {
        kind: {
            p["family"]: p["error_median_m"] for p in points if (p["kind"], p["size"]) == (kind, KINDS[kind].default)
        }
        for kind in ("faces", "auto")
    }
    ratios = [error / by_kind["faces"][family] for family, error in by_kind["auto"].items()]
    if not ratios:
        return ""
    mean = float(np.exp(np.mean(np.log(ratios))))
    verdict = "so it is not the default" if mean > 0.95 else "for the time of both"
    return f"Faces or grid by evidence has {mean:.2f} times the error of faces (geometric mean over families), {verdict}.\n\n"


def page(data: dict) -> str:
    """docs/results/map_representations.md."""
    lines = []
    for family in FAMILIES:
        for p in (p for p in data["points"] if p["family"] == family and p["size"] == KINDS[p["kind"]].default):
            cells = [_cell(p[key], 1000) for key in ("error_median_m", "error_worst_m", "batch_error_median_m")]
            cells += [_cell(p["odometry_error_median_m"], 1000), str(p["worse_than_odometry"])]
            cells += [
                _cell(p.get("grid_taken"), 100),
                _cell(p["coverage_90"], 100),
                _cell(p["step_us_mean"], 1),
                _cell(p["step_us_p99"], 1),
            ]
            lines.append([family, KINDS[p["kind"]].title, str(p["size"]), str(p["runs"]), *cells])
    head = ["family", "representation", "size", "runs", "error, mm", "worst, mm", "batch, mm", "odometry, mm"]
    head += ["odometry better in", "grid taken, %", "90 % regions hold, %", "us a row", "p99, us"]
    most = max((p for p in data["points"] if p["kind"] == "grid"), key=lambda p: p["size"])
    return (
        "# Representations of a map by touch\n\n"
        "Generated by `tools/benches page` from `bench/results/map_representations.json`, measured by "
        f"`tools/benches map_representations`: {data['rows']} rows (5 minutes) a run, no gyroscope, the same scenes and "
        f"one setting for all; scenes a family: {data['seeds']}. Errors are medians over a run's rows after the rigid motion that fits the path best, then "
        "medians over the runs; batch: of the poses that the factor graph holds, from all rows.\n\n"
        "- Faces and tiles: `whisker map`, its default, by hypotheses.\n"
        "- Grid: `whisker map --representation grid`, Rao-Blackwellised particles with grid maps, by particles. The "
        "surface proposal draws poses where contacts lie on surfaces of the map, the other from the odometry alone.\n"
        "- Factor graph: `whisker map --representation graph`; what is of which face is the mapper's, with 12 hypotheses; "
        "time includes the mapper's.\n"
        "- Faces or grid, by evidence: `whisker map --representation auto`. Both map all rows; the one is taken whose path gives the "
        "rows the greater likelihood. Time is that of both and of the comparison.\n\n"
        + table(head, lines)
        + "\n![error against cost by representation and size](../charts/map_representations.svg)\n\n"
        f"Numbers beside the points: hypotheses or particles; runs of {LARGE} and more: {LARGE_SEEDS} at most. "
        f"{most['size']} particles take {most['bytes'] / 1e6:.0f} MB with the rows that are kept.\n\n"
        + _chosen(data["points"])
        + "What bounds the grid: a drawn path is only chosen, never corrected. Particles spread as the "
        "odometry might err, and a wall that is felt for the first time chooses among them by its direction alone. "
        "Regions of particles that descend from few are too small. What bounds the graph: it takes what is of which face "
        "from the mapper, and a face that is new when it is felt joins the graph a second later.\n"
    )


def run(_build: Path, seeds: int = 6, workers: int = WORKERS, most: int = MOST) -> None:
    data = measure(seeds, workers, most)
    store.write_result("map_representations", data)
    store.write_chart("map_representations", chart(data), letters=True)
    store.write_page(store.ROOT / "docs/results/map_representations.md", page(data))


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seeds", type=int, default=6, help="scenes of each family (default: %(default)s)")
    parser.add_argument("--most", type=int, default=MOST, help="particles of a run, at most (default: %(default)s)")
    parser.add_argument("--workers", type=int, default=WORKERS, help="processes (default: %(default)s)")
