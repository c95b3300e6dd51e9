"""Measures the filters: speed against accuracy, locks, budgets, honesty, the stability matrix, a soak of 10^6 rows.

    tools/benches nav                  everything: bench/results/nav_*.json, docs/charts/nav_*.svg, docs/results/nav.md
    tools/benches nav --quick          few seeds, into build/bench/nav-quick: does it run? tools/benches nav --only
    matrix    one part: pareto, cost, tracking, locks, budgets, balance, variation, matrix, soak,
                                        passes
    tools/benches nav --page           measures nothing: writes the page of what has been measured

Figures but those of time are the same for any number of workers. Seeds are none that filters were developed on.
"""

import argparse
import hashlib
import json
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib

from crunchbot.nav import localise
from crunchbot_lab.scenes import trials
from crunchbot_lab.scenes.sweep import BACKENDS, sweep

from .. import store
from . import charts, figures, page, work

ROOT = Path(__file__).resolve().parents[3]
BUILD = ROOT / "build/release"
FIRST_SEED = 5000
CHUNK = 10  # seeds per job

# Filters at several sizes: title, filter, settings, most seeds (what is slow gets fewer).
SIZES = [
    ("odometry", "odometry", {}, 100),
    ("ekf", "ekf", {}, 100),
    ("ukf", "ukf", {}, 100),
    *((f"foveal {n}^3", "foveal", {"foveal.cells": n}, 100) for n in (7, 11)),
    ("foveal 15^3", "foveal", {"foveal.cells": 15}, 50),
    ("grid 10 cm", "grid", {"grid.cell_m": 0.1, "grid.cell_deg": 20}, 100),
    ("grid 5 cm", "grid", {}, 50),
    ("grid 2.5 cm", "grid", {"grid.cell_m": 0.025, "grid.cell_deg": 5}, 10),
    *((f"particle {n}", "particle", {"particle.count": n}, 100) for n in (2, 100, 300, 1000)),
    ("particle 3000", "particle", {"particle.count": 3000}, 50),
    ("particle 10000", "particle", {"particle.count": 10_000}, 20),
    ("particle kld", "particle", {}, 100),
    ("multi", "multi", {}, 100),
    ("adaptive", "adaptive", {}, 100),
    *((f"adaptive {n}", "adaptive", {"adaptive.least": n}, 100) for n in (100, 1000)),
]
PARETO = ("anchor", "raw", "free", "robot")
TRACKING = ("anchor", "raw", "free", "ring", "three-floor", "noisy", "robot", "one-whisker")
LOCKS = ("anchor+global", "anchor+kidnap", "free+global", "free+kidnap", "raw+global", "raw+kidnap")
TILES, RAYS, CELLS = (3, 5, 8, 12), (0, 2, 4, 8, 12), ((0.1, 20), (0.05, 10), (0.025, 5))

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


@dataclass(frozen=True)
class Scale:
    """How much is measured."""

    seeds: int = 100
    reference_seeds: int = 20
    budget_runs: int = 10
    budget_rows: int = 10_000
    balance_seeds: int = 10
    balance_rows: int = 10_000
    variation_seeds: int = 10
    soak_rows: int = 1_000_000


# Parts of a Scale that have no more runs than `seeds`.
BY_SEED = ("reference_seeds", "budget_runs", "balance_seeds", "variation_seeds")


def scale(seeds: int) -> Scale:
    """The full one with no part of more seeds than this; what is slow has its share of them (`Bench.sizes`)."""
    whole = Scale()
    few = {name: min(seeds, getattr(whole, name)) for name in BY_SEED}
    return replace(whole, seeds=seeds, **few)


QUICK = Scale(4, 2, 2, 1000, 2, 500, 1, 20_000)


class Bench:
    """Jobs, results and charts of one scale."""

    def __init__(self, scale: Scale, cache: Path, results: Path, charts: Path, document: Path, workers, backend, build):
        self.scale, self.jobs = scale, cache / "jobs"
        self.results, self.charts, self.document = results, charts, document
        self.workers, self.backend, self.build = workers, backend, build
        self.filters = localise.filter_names()

    def sweep(self, work, jobs: dict[str, dict], label: str) -> dict[str, dict]:
        return sweep(work, jobs, self.jobs, self.workers, self.backend, label)

    def trials(self, wanted: dict[tuple[str, str], dict], label: str) -> dict[tuple[str, str], list[dict]]:
        """Trials by (row, title), each wanted as family, filter, settings, rows and seeds."""
        jobs, places = {}, {}
        for place, spec in wanted.items():
            for first in range(FIRST_SEED, FIRST_SEED + spec["seeds"], CHUNK):
                seeds = list(range(first, min(first + CHUNK, FIRST_SEED + spec["seeds"])))
                arguments = {k: spec[k] for k in ("family", "filter", "settings", "rows")} | {"seeds": seeds}
                name = job_name("trial", arguments)
                jobs[name] = arguments
                places.setdefault(place, []).append(name)
        done = self.sweep(trials.trials, jobs, label)
        return {place: [t for name in names for t in done[name]["trials"]] for place, names in places.items()}

    def save(self, name: str, data: dict, *figures) -> None:
        store.write_result(f"nav_{name}", data, self.results)
        for title, figure in figures:
            store.write_chart(f"nav_{title}", figure, self.charts)

    def sizes(self) -> list[tuple[str, str, dict, int]]:
        """SIZES of the filters that exist, with the seeds of this scale."""
        known = {name for name, *_ in localise.settings_list()}
        return [
            (title, name, settings, max(1, round(seeds * self.scale.seeds / 100)))
            for title, name, settings, seeds in SIZES
            if name in self.filters and settings.keys() <= known
        ]


def job_name(kind: str, arguments: dict) -> str:
    """A readable name that changes with any argument."""
    text = json.dumps(arguments, sort_keys=True)
    words = [kind, *(str(arguments[k]) for k in ("family", "filter", "seed") if k in arguments)]
    return "-".join(words) + "-" + hashlib.sha256(text.encode()).hexdigest()[:12]


def pareto(bench: Bench) -> None:
    """Microseconds per step against position error."""
    wanted = {
        (family, title): {"family": family, "filter": name, "settings": settings, "rows": 600, "seeds": seeds}
        for family in PARETO
        for title, name, settings, seeds in bench.sizes()
    }
    data = figures.pareto(bench.trials(wanted, "pareto"))
    measured = ROOT / "bench/results/nav_peers.json"  # of the topic nav_peers: on fewer seeds of the same families
    data["peers"] = figures.peers(json.loads(measured.read_text()) if measured.exists() else [], bench.filters)
    bench.save("pareto", data, ("pareto", charts.pareto(data)))


def cost(bench: Bench) -> None:
    """Microseconds per step against arena size, resolution and number of object whiskers."""
    seeds, names = list(range(FIRST_SEED, FIRST_SEED + 3)), [n for n in bench.filters if n != "odometry"]
    wanted = {(f"{tiles * 0.5:g}", "arena", name): (tiles, 4, name, {}) for tiles in TILES for name in names}
    wanted |= {(str(rays), "whiskers", name): (5, rays, name, {}) for rays in RAYS for name in names}
    for cell, degrees in CELLS:
        settings = {"grid.cell_m": cell, "grid.cell_deg": degrees}
        wanted[(f"{100 * cell:g}", "resolution", "grid")] = (5, 4, "grid", settings)
    keys = ("tiles", "rays", "filter", "settings")
    jobs = {place: dict(zip(keys, spec, strict=True)) | {"seeds": seeds, "rows": 200} for place, spec in wanted.items()}
    done = bench.sweep(work.cost, {job_name("cost", a): a for a in jobs.values()}, "cost")
    data = {}
    for (x, axis, name), arguments in jobs.items():
        data.setdefault(axis, {}).setdefault(name, []).append({"x": float(x)} | done[job_name("cost", arguments)])
    bench.save("cost", data, ("cost", charts.cost(data)))


def tracking(bench: Bench) -> None:
    """Errors from a known start by family and filter, beside 50 000 particles on the same seeds; honesty."""
    wanted = {}
    for family in TRACKING:
        for name in bench.filters:
            spec = {"family": family, "filter": name, "settings": {}, "rows": 600, "seeds": bench.scale.seeds}
            wanted[(family, name)] = spec
        reference, settings = work.REFERENCE
        seeds = bench.scale.seeds if family == "anchor" else bench.scale.reference_seeds
        wanted[(family, "reference")] = {"family": family, "filter": reference, "settings": settings, "rows": 600} | {
            "seeds": seeds
        }
    data = figures.tracking(bench.trials(wanted, "tracking"))
    bench.save("tracking", data, ("honesty", charts.honesty(data)))


def locks(bench: Bench) -> None:
    """Steps from a start or kidnap until lock, paired with the grid's."""
    wanted = {
        (family, name): {"family": family, "filter": name, "settings": {}, "rows": None, "seeds": bench.scale.seeds}
        for family in LOCKS
        for name in bench.filters
        if name != "odometry"
    }
    data = figures.locks(bench.trials(wanted, "locks"))
    bench.save("locks", data, ("locks", charts.locks(data)))


def budgets(bench: Bench) -> None:
    """The slowest of 10^5 tracking steps, and the most work of any."""
    jobs = {}
    for name in bench.filters:
        for seed in range(FIRST_SEED, FIRST_SEED + bench.scale.budget_runs):
            arguments = {
                "family": "anchor",
                "seed": seed,
                "filter": name,
                "settings": {},
                "rows": bench.scale.budget_rows,
            }
            jobs[job_name("budget", arguments)] = arguments
    done = bench.sweep(work.budget, jobs, "budgets")
    by_filter = {n: [done[j] for j, a in jobs.items() if a["filter"] == n] for n in bench.filters}
    bench.save("budgets", figures.budgets(by_filter))


def balance(bench: Bench) -> None:
    """Two modes of a two-fold symmetric arena, for 10 000 steps."""
    jobs = {}
    for name in [n for n in bench.filters if n in ("grid", "adaptive", "particle", "multi")]:
        for seed in range(FIRST_SEED, FIRST_SEED + bench.scale.balance_seeds):
            arguments = {"seed": seed, "filter": name, "settings": {}, "rows": bench.scale.balance_rows, "stride": 50}
            jobs[job_name("balance", arguments)] = arguments
    done = bench.sweep(work.balance, jobs, "balance")
    by_filter = {}
    for job, arguments in jobs.items():
        by_filter.setdefault(arguments["filter"], []).append(done[job])
    bench.save("balance", figures.balance(by_filter))


def variation(bench: Bench) -> None:
    """Total variation from a converged reference against work, while tracking."""
    # What is too slow for as many seeds as the others is left out: a reference costs enough.
    quick_ones = {title for title, _, _, seeds in SIZES if seeds == 100 and title != "odometry"}
    runs = {title: [name, settings] for title, name, settings, _ in bench.sizes() if title in quick_ones}
    jobs = {}
    for family in ("anchor", "raw", "free"):
        for seed in range(FIRST_SEED, FIRST_SEED + bench.scale.variation_seeds):
            arguments = {"family": family, "seed": seed, "runs": runs, "rows": 400, "stride": 20}
            jobs[job_name("variation", arguments)] = arguments
    done = bench.sweep(work.variation, jobs, "variation")
    by_family = {}
    for job, arguments in jobs.items():
        by_family.setdefault(arguments["family"], []).append(done[job])
    data = figures.variation(by_family)
    bench.save("variation", data, ("variation", charts.variation(data)))


def matrix(bench: Bench) -> None:
    """Filter by filter, what makes which one fail."""
    wanted = {
        (title, name): {"family": family, "filter": name, "settings": {}, "rows": rows, "seeds": bench.scale.seeds}
        for title, family, rows in MATRIX
        for name in bench.filters
    }
    data = figures.matrix(bench.trials(wanted, "matrix"), bench.filters)
    drawn = {"matrix": charts.matrix, "regions": charts.regions, "confidence": charts.confidence}
    bench.save("matrix", data, *((name, draw(data)) for name, draw in drawn.items()))


def soak(bench: Bench) -> None:
    """10^6 rows of a noisy family with faults of every kind."""
    jobs = {}
    for name in ("adaptive",) if "adaptive" in bench.filters else ("grid",):
        arguments = {"filter": name, "settings": {}, "seed": FIRST_SEED, "rows": bench.scale.soak_rows, "block": 10_000}
        jobs[job_name("soak", arguments)] = arguments
    done = bench.sweep(work.soak, jobs, "soak")
    bench.save("soak", {arguments["filter"]: done[job] for job, arguments in jobs.items()})


def passes(bench: Bench) -> None:
    """What the grid's full step costs per pose, beside plain passes over as many floats: nav_bench."""
    name = "host/nav/nav_bench"
    if not (bench.build / name).exists():
        raise SystemExit(f"bench_nav: {bench.build}: no {name}; run 'make build' or give --build-dir")
    done = subprocess.run([bench.build / name], capture_output=True, text=True, check=True)
    bench.save("passes", [json.loads(line) for line in done.stdout.splitlines()])


PARTS = {f.__name__: f for f in (pareto, cost, tracking, locks, budgets, balance, variation, matrix, soak, passes)}


def measure(bench: Bench, parts: list[str]) -> None:
    """The parts, and the document of all that has been measured."""
    matplotlib.rcParams["svg.hashsalt"] = "whisker"  # same data, same file
    for part in parts:
        PARTS[part](bench)
    done = {part: bench.results / f"nav_{part}.json" for part in PARTS}
    data = {part: json.loads(path.read_text()) for part, path in done.items() if path.exists()}
    store.write_page(bench.document, page.document(data))


def full(workers=None, backend: str = "processes", build: Path = BUILD, seeds: int = 100) -> Bench:
    cache = store.kept("nav")
    places = (cache, store.RESULTS, store.CHARTS, ROOT / "docs/results/nav.md")
    return Bench(scale(seeds), *places, workers, backend, build)


def small(workers=None, backend: str = "processes", build: Path = BUILD) -> Bench:
    cache = store.BENCH / "nav-quick"
    return Bench(QUICK, cache, cache, cache, cache / "nav.md", workers, backend, build)


def run(
    build: Path,
    only: Sequence[str] = tuple(PARTS),
    quick: bool = False,
    page: bool = False,
    workers: int | None = None,
    backend: str = "processes",
    seeds: int = 100,
) -> None:
    """The filters are those of the Python module; `build` holds nav_bench."""
    bench = small(workers, backend, build) if quick else full(workers, backend, build, seeds)
    measure(bench, [] if page else only)


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quick", action="store_true", help="few seeds, results into build/bench/nav-quick")
    parser.add_argument("--seeds", type=int, default=100, help="at most, of each family (default: %(default)s)")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS), metavar="PART")
    parser.add_argument("--workers", type=int, help="processes (default: all cores)")
    parser.add_argument("--backend", choices=BACKENDS, default="processes")
    parser.add_argument("--page", action="store_true", help="measure nothing: write the page of what has been measured")
