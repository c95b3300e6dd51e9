"""From trials to the figures that the bench reports; page.py writes them."""

from collections.abc import Callable

import numpy as np

from crunchbot.nav.scoring import auc

LOST_M = 0.25
BOOTSTRAP = 2000
BINS = 10  # of confidence
KIDNAP = "kidnap"  # the stability matrix's row of that name


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
    """The rows of nav_peers of filters that are not ours, as points of the Pareto chart by family and title."""
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
