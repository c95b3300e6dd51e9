"""From trials to the figures that bench_nav reports, and the document that shows them."""

from collections.abc import Callable

import numpy as np

from whisker.scoring import auc

LOST_M = 0.25
BOOTSTRAP = 2000
BINS = 10  # of confidence
KIDNAP = "kidnap"  # the stability matrix's row of that name
WANTED_COVERAGE, WANTED_COVERAGE_FAULTS = (0.85, 0.95), 0.8


def spread(values) -> dict:
    """Median and the middle half."""
    low, middle, high = np.quantile(np.asarray(values, float), [0.25, 0.5, 0.75])
    return {"median": float(middle), "low": float(low), "high": float(high)}


def by_row(done: dict[tuple[str, str], list[dict]], figure: Callable) -> dict[str, dict]:
    """{row: {title: figure(trials)}}"""
    out = {}
    for (row, title), trials in done.items():
        out.setdefault(row, {})[title] = figure(trials)
    return out


def ledger(trials: list[dict]) -> dict:
    """What most tables show of many trials."""
    coverage, area = _coverage(trials)
    return {
        "runs": len(trials),
        "error_median_m": spread([t["error_median_m"] for t in trials]),
        "error_rms_m": spread([t["error_rms_m"] for t in trials]),
        "near_at_end": float(np.mean([t["near_at_end"] for t in trials])),
        "locked": float(np.mean([t["lock_rows"] is not None for t in trials])),
        "faulty_rows": sum(t["faulty"] for t in trials),
        "coverage_90": coverage,
        "region_90_m2": area,
        "step_us_mean": float(np.mean([t["timing"]["step_us_mean"] for t in trials])),
        "step_us_median": spread([t["timing"]["step_us_median"] for t in trials]),
        "step_us_p99": spread([t["timing"]["step_us_p99"] for t in trials]),
        "distinct_mean": float(np.mean([t["work"]["distinct_mean"] for t in trials])),
        "touched_mean": float(np.mean([t["work"]["touched_mean"] for t in trials])),
        "touched_max": max(t["work"]["touched_max"] for t in trials),
        "peak_bytes": max(t["work"]["bytes_max"] for t in trials),
    }


def _coverage(trials: list[dict]) -> tuple[float | None, float | None]:
    """Share of judged rows after lock whose 90 % region holds the truth, and the regions' median area."""
    held, areas = [], []
    for judged in (t["judged"] for t in trials if t["lock_rows"] is not None):
        after = np.array(judged["after_lock"], bool)
        held += (np.array(judged["level"])[after] <= 0.9).tolist()
        areas += np.array(judged["area_m2"])[after].tolist()
    return (float(np.mean(held)), float(np.median(areas))) if held else (None, None)


def pareto(done) -> dict:
    return {"families": by_row(done, ledger)}


def peers(rows: list[dict], ours: list[str]) -> dict[str, dict]:
    """bench_nav_peers' rows of filters that are not ours, as points of the Pareto chart by family and title."""
    out = {}
    for row in rows:
        if row["filter"].split()[0] in ours:
            continue
        low, high = row["error_median_quartiles_m"]
        out.setdefault(row["family"], {})[f"{row['filter']} {row['setting']}".strip()] = {
            "error_median_m": {"median": row["error_median_m"], "low": low, "high": high},
            "step_us_median": {"median": row["step_us_median"]},
            "step_us_p99": {"median": row["step_us_p99"]},
        }
    return out


def tracking(done) -> dict:
    """Ledgers by family and filter, and the median ratio of errors to the reference's on the same seeds."""
    table = by_row(done, ledger)
    for (family, title), trials in done.items():
        reference = {t["seed"]: t["error_median_m"] for t in done[(family, "reference")]}
        ratios = [t["error_median_m"] / reference[t["seed"]] for t in trials if t["seed"] in reference]
        table[family][title]["to_reference"] = spread(ratios)
    return {"families": table}


def locks(done) -> dict:
    """Share locked, rows until lock, cost until lock, and the ratio to the grid's rows on paired seeds."""
    out = {}
    for (family, title), trials in done.items():
        grid = {t["seed"]: t["lock_rows"] for t in done.get((family, "grid"), [])}
        rows = [t["lock_rows"] for t in trials]
        pairs = [
            (max(t["lock_rows"], 1) / max(grid[t["seed"]], 1))
            for t in trials
            if t["lock_rows"] is not None and grid.get(t["seed"]) is not None
        ]
        until = [t["timing"]["until_lock_us_mean"] for t in trials if t["timing"]["until_lock_us_mean"] is not None]
        out.setdefault(family, {})[title] = {
            "runs": len(trials),
            "locked": sum(r is not None for r in rows),
            "rows": sorted(r for r in rows if r is not None),
            "ratio_to_grid": interval(pairs),
            "until_lock_us_mean": float(np.mean(until)) if until else None,
            "faulty_rows": sum(t["faulty"] for t in trials),
        }
    return {"families": out}


def interval(values: list[float]) -> dict | None:
    """Median with its 95 % bootstrap interval."""
    if not values:
        return None
    drawn = np.random.default_rng(0).choice(np.array(values), (BOOTSTRAP, len(values)))
    low, high = np.quantile(np.median(drawn, axis=1), [0.025, 0.975])
    return {"median": float(np.median(values)), "low": float(low), "high": float(high), "pairs": len(values)}


def budgets(by_filter: dict[str, list[dict]]) -> dict:
    """p99.9 and the slowest of all steps, from the slowest that each run kept."""
    out = {}
    for name, runs in by_filter.items():
        rows, slowest = sum(r["rows"] for r in runs), np.sort(np.concatenate([r["slowest_us"] for r in runs]))
        out[name] = {
            "rows": rows,
            "step_us_p999": float(slowest[-max(1, round(0.001 * rows))]),
            "step_us_max": float(slowest[-1]),
            "evaluations_max": max(r["evaluations_max"] for r in runs),
            "touched_max": max(r["touched_max"] for r in runs),
            "error_median_m": spread([r["error_median_m"] for r in runs]),
        }
    return out


def balance(by_filter: dict[str, list[dict]]) -> dict:
    out = {}
    for name, runs in by_filter.items():
        held = sum(r["both_modes_hold"] for r in runs)
        worst = [r["worst_share"] for r in runs if r["worst_share"] is not None]
        out[name] = {
            "runs": len(runs),
            "judged": sum(r["judged"] for r in runs),
            "both_modes_hold": held,
            "within_45_55": sum(r["within_45_55"] for r in runs) / held if held else None,
            "worst_share": max(worst, default=None),
            "runs_never_outside": sum(r["both_modes_hold"] == r["within_45_55"] for r in runs),
        }
    return out


def variation(by_family: dict[str, list[dict]]) -> dict:
    out = {}
    for family, runs in by_family.items():
        out[family] = {
            title: {
                "variation": spread([r[title]["variation"] for r in runs]),
                "mean": float(np.mean([r[title]["variation"] for r in runs])),
                "touched_mean": float(np.mean([r[title]["touched_mean"] for r in runs])),
            }
            for title in runs[0]
        }
    return out


def matrix(done, filters: list[str]) -> dict:
    """Ledgers by row and filter; how well confidence foretells being lost, by filter, over all rows of the matrix and
    over kidnaps alone."""
    foretold, kidnapped = {}, {}
    for name in filters:
        mine = {row: [t["judged"] for t in trials] for (row, title), trials in done.items() if title == name}
        foretold[name] = foresight(sum(mine.values(), []))
        kidnapped[name] = foresight(mine[KIDNAP])
    return {"filters": filters, "rows": by_row(done, ledger), "confidence": foretold, "confidence_kidnap": kidnapped}


def foresight(judged: list[dict]) -> dict:
    """Area under the curve of low confidence against being lost; share near (0.25 m) by confidence."""
    confidence, error_m = (np.concatenate([j[key] for j in judged]) for key in ("confidence", "error_m"))
    bins = np.minimum((confidence * BINS).astype(int), BINS - 1)
    table = []
    for k in range(BINS):
        inside = bins == k
        if inside.any():
            table.append(
                {
                    "confidence": float(confidence[inside].mean()),
                    "near": float((error_m[inside] <= LOST_M).mean()),
                    "rows": int(inside.sum()),
                }
            )
    gap = sum(b["rows"] * abs(b["confidence"] - b["near"]) for b in table) / max(len(confidence), 1)
    return {"auc": auc(-confidence, error_m > LOST_M), "calibration_error": gap, "bins": table}


# ---------------------------------------------------------------------------------------------------------------------
# the document


def document(data: dict[str, dict]) -> str:
    """docs/results_nav.md of all parts that have been measured."""
    parts = {
        "matrix": _matrix_text,
        "tracking": _tracking_text,
        "locks": _locks_text,
        "budgets": _budgets_text,
        "balance": _balance_text,
        "variation": _variation_text,
        "soak": _soak_text,
        "pareto": _pareto_text,
        "cost": _cost_text,
    }
    head = (
        "# Navigation: what was measured\n\n"
        "Written by `tools/bench_nav.py` from `bench/results/nav_*.json`. Scenes are level 0 (`whisker scene make "
        "--list-families`), on seeds that no filter was developed on. Times are CPU times of the thread.\n"
    )
    return head + "".join(f"\n{write(data[part])}" for part, write in parts.items() if part in data)


def _table(head: list[str], rows: list[list[str]]) -> str:
    lines = [" | ".join(head), " | ".join("---" for _ in head), *(" | ".join(row) for row in rows)]
    return "".join(f"| {line} |\n" for line in lines)


def _number(value, digits: int = 3) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def _percent(value) -> str:
    return "-" if value is None else f"{100 * value:.0f} %"


def _mm(value: dict) -> str:
    return f"{1000 * value['median']:.1f} ({1000 * value['low']:.1f}-{1000 * value['high']:.1f})"


def _matrix_text(data: dict) -> str:
    runs = max(cell["runs"] for row in data["rows"].values() for cell in row.values())
    text = (
        f"## Stability\n\n{runs} seeds each. A cell: share of runs within 0.15 m over their last 100 rows; median error "
        "in cm; share of the time after lock that the 90 % region holds the truth. In symmetric arenas the nearest image "
        "of the truth counts.\n\n![share of runs near the truth at the end](charts/nav_matrix.svg)\n\n"
    )
    rows = [
        [title]
        + [
            f"{_percent(c['near_at_end'])}, {100 * c['error_median_m']['median']:.1f}, {_percent(c['coverage_90'])}"
            for c in (row[name] for name in data["filters"])
        ]
        for title, row in data["rows"].items()
    ]
    faulty = sum(cell["faulty_rows"] for row in data["rows"].values() for cell in row.values())
    foretold = [
        [name, *(_number(f[key]) for f in (everywhere, kidnapped) for key in ("auc", "calibration_error"))]
        for (name, everywhere), kidnapped in zip(
            data["confidence"].items(), data["confidence_kidnap"].values(), strict=True
        )
    ]
    return (
        text
        + _table(["", *data["filters"]], rows)
        + f"\nAnswers that are no numbers, or confidences that are no shares: {faulty}.\n\n"
        + "Does `confidence` foretell being lost (more than 0.25 m off)? Over all rows above, and over kidnaps alone:\n\n"
        + _table(["filter", "area under curve", "calibration error", "kidnaps: area", "error"], foretold)
        + "\n![confidence and the share near the truth](charts/nav_confidence.svg)\n"
    )


def _tracking_text(data: dict) -> str:
    rows = [
        [
            family,
            title,
            str(c["runs"]),
            _mm(c["error_median_m"]),
            _mm(c["error_rms_m"]),
            _number(c["to_reference"]["median"]),
            _number(c["step_us_median"]["median"]),
            _number(c["distinct_mean"]),
            _percent(c["coverage_90"]),
            _number(None if c["region_90_m2"] is None else 1e4 * c["region_90_m2"]),
        ]
        for family, table in data["families"].items()
        for title, c in table.items()
    ]
    head = ["family", "filter", "runs", "median error mm", "RMS mm", "to reference", "us/step", "distinct/step"]
    return (
        "## Tracking from a known start\n\nReference: 50 000 particles. Median over runs and the middle half.\n\n"
        + _table([*head, "90 % region holds", "its area cm2"], rows)
        + "\n![coverage and region size](charts/nav_honesty.svg)\n"
    )


def _locks_text(data: dict) -> str:
    rows = []
    for family, table in data["families"].items():
        for title, c in table.items():
            ratio = c["ratio_to_grid"]
            told = "-" if ratio is None else f"{ratio['median']:.2f} ({ratio['low']:.2f}-{ratio['high']:.2f})"
            rows.append(
                [family, title, f"{c['locked']} of {c['runs']}"]
                + [_number(np.median(c["rows"]) if c["rows"] else None), told, _number(c["until_lock_us_mean"])]
            )
    head = ["family", "filter", "locked", "median rows to lock", "ratio to grid, 95 %", "mean us/step until lock"]
    return (
        "## From a start anywhere, or a kidnap, to lock\n\nLocked: 100 rows on end within 0.15 m, and the last 100.\n\n"
        + _table(head, rows)
        + "\n![runs locked by rows](charts/nav_locks.svg)\n"
    )


def _budgets_text(data: dict) -> str:
    rows = [
        [name, str(c["rows"]), _number(c["step_us_p999"]), _number(c["step_us_max"])]
        + [str(c["evaluations_max"]), str(c["touched_max"])]
        for name, c in data.items()
    ]
    head = ["filter", "rows", "p99.9 us", "slowest us", "most evaluations", "most touched"]
    return "## Bounds while tracking\n\n" + _table(head, rows)


def _balance_text(data: dict) -> str:
    rows = [
        [name, str(c["runs"]), f"{c['both_modes_hold']} of {c['judged']}", _percent(c["within_45_55"])]
        + [_number(c["worst_share"]), f"{c['runs_never_outside']} of {c['runs']}"]
        for name, c in data.items()
    ]
    head = ["filter", "runs", "both modes hold over 0.9", "of these within 45:55", "worst share", "runs never outside"]
    return "## Two modes of a two-fold symmetric arena\n\n" + _table(head, rows)


def _variation_text(data: dict) -> str:
    rows = [
        [family, title, _number(c["mean"]), _number(c["touched_mean"])]
        for family, table in data.items()
        for title, c in table.items()
    ]
    return (
        "## Distance from a converged belief\n\nMean total variation in bins of 25 cm x 30 degrees from 50 000 "
        "particles; `reference again` is the same with another seed.\n\n"
        + _table(["family", "filter", "total variation", "touched/step"], rows)
        + "\n![total variation against work](charts/nav_variation.svg)\n"
    )


def _soak_text(data: dict) -> str:
    rows = []
    for name, run in data.items():
        blocks = run["blocks"]
        rows.append(
            [name, str(run["rows"]), str(sum(b["faulty"] for b in blocks))]
            + [_number(100 * np.median([b["error_median_m"] for b in blocks]))]
            + [_number(max(b["step_us_max"] for b in blocks)), str(max(b["touched_max"] for b in blocks))]
            + [_number(blocks[-1]["step_us_median"] / blocks[0]["step_us_median"])]
        )
    head = ["filter", "rows", "answers that are none", "median error cm", "slowest us", "most touched", "last/first us"]
    return "## Soak\n\nFaults of every kind, the robot carried off every 10 000 rows.\n\n" + _table(head, rows)


def _pareto_text(data: dict) -> str:
    rows = [
        [family, title, str(c["runs"]), _number(c["step_us_median"]["median"]), _number(c["step_us_p99"]["median"])]
        + [_mm(c["error_median_m"]), _mm(c["error_rms_m"])]
        for family, table in data["families"].items()
        for title, c in table.items()
    ]
    head = ["family", "filter", "runs", "us/step", "p99 us", "median error mm", "RMS mm"]
    return (
        "## Speed against accuracy\n\n![microseconds per step against position error](charts/nav_pareto.svg)\n\n"
        + _table(head, rows)
    )


def _cost_text(data: dict) -> str:
    return "## Cost against size\n\n![cost against arena size, resolution and whiskers](charts/nav_cost.svg)\n"
