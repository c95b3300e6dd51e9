"""docs/results/nav.md from the figures of the bench: what each table and chart shows, what was wanted, what was measured.

Every number comes from the data, and what was wanted from wanted.py."""

import numpy as np

from . import page_cost
from .wanted import OURS, WANTED, least, listed, mm, most, number, percent, picture, table, verdicts, yes

# Rows of the stability matrix where the world is as the filters' model says; all others have a fault.
AS_MODELLED = ("known start", "global start", "kidnap", "prior wrong", "2-fold", "4-fold", "one texture", "no obstacle")


def document(data: dict[str, dict]) -> str:
    """The page of all parts that have been measured, in this order."""
    parts = {
        "matrix": _matrix,
        "tracking": _tracking,
        "locks": _locks,
        "budgets": page_cost.budgets,
        "balance": _balance,
        "variation": _variation,
        "soak": page_cost.soak,
        "pareto": page_cost.pareto,
        "cost": page_cost.cost,
        "passes": page_cost.passes,
    }
    head = (
        "# Navigation: what was measured\n\n"
        "Written by `tools/benches nav` from `bench/results/nav_*.json`. Scenes are level 0 (`whisker scene make "
        "--list-families`), on seeds that no filter was developed on. Times are CPU times of the thread, on one core.\n"
        f"Each section begins with what was wanted of `{OURS}`, the default filter, beside what it does; what it misses "
        "says `no`. In brackets: the middle half of the runs, or where it says so a 95 % interval.\n"
    )
    return head + "".join(f"\n{write(data[part])}" for part, write in parts.items() if part in data)


def _matrix(data: dict) -> str:
    rows, filters = data["rows"], data["filters"]
    runs = max(cell["runs"] for row in rows.values() for cell in row.values())
    cells = [
        [title]
        + [
            f"{percent(c['near_at_end'])}, {100 * c['error_median_m']['median']:.1f}, {percent(c['coverage_90'])}"
            for c in (row[name] for name in filters)
        ]
        for title, row in rows.items()
    ]
    ours = {title: row[OURS] for title, row in rows.items() if OURS in row}
    weak = [f"{t} ({percent(c['near_at_end'])})" for t, c in ours.items() if c["near_at_end"] < WANTED.locked]
    return (
        f"## Stability\n\nWhat makes which filter fail, {runs} seeds of each row. No share of runs was wanted here but for "
        f"a global start and a kidnap (below); wanted were regions that keep their word, and never an answer that is none.\n\n"
        + verdicts(_honesty(ours) + [_faulty(rows)])
        + f"\nRows where `{OURS}` ends near the truth in less than {percent(WANTED.locked)} of the runs: {listed(weak)}.\n\n"
        "All filters. A cell: share of runs within 0.15 m of the truth over their last 100 rows; median error in cm; share "
        "of the time after lock that the 90 % region holds the truth. In symmetric arenas the nearest image of the truth "
        "counts.\n\n"
        + table(["", *filters], cells)
        + picture(
            "matrix",
            "share of runs near the truth at the end",
            "The first number of each cell above; the darker, the more runs were lost. What a filter cannot bear is dark in "
            "its column; a row that is dark all along asks for what no filter here can do.",
        )
        + picture(
            "regions",
            "coverage and size of the 90 % regions, row by row",
            "The third number of each cell above, and what it costs. Left: the grey band is what was wanted where the model "
            "is the world, the line what was wanted where there is a fault; a point left of it is a filter that is surer "
            "than it should be. Right: a region may be honest by being large.",
        )
        + _foretold(data)
    )


def _honesty(ours: dict[str, dict]) -> list[list[str]]:
    """How often the 90 % regions hold the truth, by kind of row."""
    known = {t: c["coverage_90"] for t, c in ours.items() if c["coverage_90"] is not None}
    modelled = {t: v for t, v in known.items() if t.startswith(AS_MODELLED)}
    faults = {t: v for t, v in known.items() if t not in modelled}
    low, high = WANTED.coverage
    out = [
        [
            f"90 % region holds the truth: {t}",
            f"{percent(low)} to {percent(high)}",
            percent(v, 1),
            yes(low <= v <= high),
        ]
        for t, v in modelled.items()
    ]
    if faults:
        worst = min(faults, key=faults.get)
        below = [t for t, v in faults.items() if v < WANTED.coverage_faults]
        told = f"{percent(faults[worst], 1)} ({worst}); {len(faults) - len(below)} of {len(faults)} rows"
        limit = 100 * WANTED.coverage_faults
        out.append(least("the same on each row with a fault, the worst", limit, 100 * faults[worst], " %", told))
    return out


def _faulty(rows: dict) -> list[str]:
    count = sum(cell["faulty_rows"] for row in rows.values() for cell in row.values())
    return [
        "answers that are no numbers, or confidences that are no shares, any filter",
        "0",
        str(count),
        yes(count == 0),
    ]


def _foretold(data: dict) -> str:
    kidnapped = data["confidence_kidnap"]
    rows = [
        [name, *(number(f[key]) for f in (everywhere, kidnapped[name]) for key in ("auc", "calibration_error"))]
        for name, everywhere in data["confidence"].items()
    ]
    return (
        "\nDoes `confidence` foretell being lost (more than 0.25 m off)? Area under the curve: how often a row that is lost "
        "has less confidence than one that is not (0.5: no better than chance). Calibration error: how far the confidence "
        "is from the share of rows near the truth, on average. Over all rows of the matrix, and over kidnaps alone. No "
        "figure was wanted, only that it be told.\n\n"
        + table(["filter", "area under curve", "calibration error", "kidnaps: area", "error"], rows)
        + picture(
            "confidence",
            "confidence and the share near the truth",
            "On the grey diagonal a confidence is what it says. Below it a filter is surer than it should be, above it "
            "less sure. Where few rows lie between the ends, points in the middle jump.",
        )
    )


def _tracking(data: dict) -> str:
    head = ["family", "filter", "runs", "median error mm", "RMS mm", "to reference", "us/step", "distinct/step"]
    rows = [
        [family, title, str(c["runs"]), _mm_pair(c)[0], _mm_pair(c)[1], number(c["to_reference"]["median"])]
        + [number(c["step_us_median"]["median"]), number(c["distinct_mean"]), percent(c["coverage_90"])]
        + [number(None if c["region_90_m2"] is None else 1e4 * c["region_90_m2"])]
        for family, cells in data["families"].items()
        for title, c in cells.items()
    ]
    ours = {family: cells[OURS] for family, cells in data["families"].items() if OURS in cells}
    return (
        "## Tracking from a known start\n\n"
        "How far off the filter is while it follows a robot whose start is known, family by family. `to reference`: its "
        "error over that of 50 000 particles on the same seeds, the floor of what these readings tell. The limits were set "
        "for `anchor` and three families more; all are held against them, so that `no` on a family with more noise, or "
        "with one whisker and no texture, is what that family costs. Errors in mm.\n\n"
        + table(
            [
                "family",
                f"median (at most {1000 * WANTED.error_median_m:g})",
                f"RMS (at most {1000 * WANTED.error_rms_m:g})",
            ]
            + [f"to reference (at most {WANTED.to_reference:g})", f"us/step (at most {WANTED.step_us:g})"]
            + [f"distinct/step (at most {WANTED.distinct:g})", "90 % region holds"],
            [[family, *_tracking_line(c)] for family, c in ours.items()],
        )
        + f"\nThe region is wanted to hold {percent(WANTED.coverage[0])} to {percent(WANTED.coverage[1])}; `no` marks a miss. "
        f"The stretch was a median of {1000 * WANTED.stretch_m:g} mm.{_one_whisker(data)}\n\n"
        "All filters: median over runs and the middle half. `distinct`: expected observations worked out per row.\n\n"
        + table([*head, "90 % region holds", "its area cm2"], rows)
        + picture(
            "honesty",
            "coverage and region size",
            "Left: within the grey band a region keeps its word; below it the filter is surer than it should be. Right: "
            "what that costs. Of two filters in the band the one with the smaller region knows more.",
        )
    )


def _one_whisker(data: dict) -> str:
    cells = data["families"].get("one-whisker", {})
    if not {OURS, "reference"} <= cells.keys():
        return ""
    ours, reference = (mm(cells[title]["error_median_m"]) for title in (OURS, "reference"))
    return (
        f" With one object whisker and no texture: {ours} mm, the reference {reference} mm; the best published claim of "
        f"one whisker is below {1000 * WANTED.one_whisker_m:g} mm."
    )


def _mm_pair(c: dict) -> tuple[str, str]:
    return mm(c["error_median_m"]), mm(c["error_rms_m"])


def _tracking_line(c: dict) -> list[str]:
    def held(text: str, met: bool) -> str:
        return text if met else f"{text}: no"

    error, rms = (c[key]["median"] for key in ("error_median_m", "error_rms_m"))
    ratio, us, covered = c["to_reference"]["median"], c["step_us_median"]["median"], c["coverage_90"]
    low, high = WANTED.coverage
    return [
        held(mm(c["error_median_m"]), error <= WANTED.error_median_m),
        held(mm(c["error_rms_m"]), rms <= WANTED.error_rms_m),
        held(number(ratio), ratio <= WANTED.to_reference),
        held(number(us), us <= WANTED.step_us),
        held(number(c["distinct_mean"]), c["distinct_mean"] <= WANTED.distinct),
        held(percent(covered, 1), covered is not None and low <= covered <= high),
    ]


def _locks(data: dict) -> str:
    rows, judged = [], []
    for family, cells in data["families"].items():
        for title, c in cells.items():
            rows.append(
                [family, title, f"{c['locked']} of {c['runs']}"]
                + [number(np.median(c["rows"]) if c["rows"] else None), _ratio(c), number(c["until_lock_us_mean"])]
            )
        if OURS in cells:
            judged += _lock_lines(family, cells[OURS])
    head = ["family", "filter", "locked", "median rows to lock", "ratio to grid, 95 %", "mean us/step until lock"]
    return (
        "## From a start anywhere, or a kidnap, to lock\n\n"
        "Locked: 100 rows on end within 0.15 m, and the last 100 of the run. Rows until lock are compared with the grid's "
        "on the same seed, where both lock; in brackets the median's 95 % interval.\n\n"
        + verdicts(judged)
        + "\nAll filters. Odometry is left out: it has nothing to lock by.\n\n"
        + table(head, rows)
        + picture(
            "locks",
            "runs locked by rows",
            "The further left a line climbs the sooner runs lock; where it ends below 100 % the rest never did. In brackets "
            "the runs locked. After a kidnap a filter must first notice: its line starts later than from a start anywhere.",
        )
    )


def _ratio(c: dict) -> str:
    ratio = c["ratio_to_grid"]
    return "-" if ratio is None else f"{ratio['median']:.2f} ({ratio['low']:.2f}-{ratio['high']:.2f})"


def _lock_lines(family: str, c: dict) -> list[list[str]]:
    limit = WANTED.ratio_kidnap if "kidnap" in family else WANTED.ratio_global
    ratio, share = c["ratio_to_grid"], 100 * c["locked"] / c["runs"]
    return [
        least(f"{family}: runs locked", 100 * WANTED.locked, share, " %", f"{c['locked']} of {c['runs']}"),
        most(f"{family}: rows to lock, to grid's", limit, None if ratio is None else ratio["median"], "", _ratio(c)),
        most(f"{family}: mean until lock", WANTED.until_lock_us, c["until_lock_us_mean"], " us"),
    ]


def _balance(data: dict) -> str:
    rows = [
        [name, str(c["runs"]), f"{c['both_modes_hold']} of {c['judged']}", percent(c["within_45_55"])]
        + [number(c["worst_share"]), f"{c['runs_never_outside']} of {c['runs']}"]
        for name, c in data.items()
    ]
    judged = [
        most(f"`{name}`: larger mode's share, worst", WANTED.share_of_modes, data[name]["worst_share"], "")
        for name in ("grid", OURS)
        if name in data
    ]
    head = ["filter", "runs", "both modes hold over 0.9", "of these within 45:55", "worst share", "runs never outside"]
    return (
        "## Two modes of a two-fold symmetric arena\n\n"
        "The start is unknown and nothing that is read tells a pose from its image half a turn away, so each must keep half "
        "of the belief for as long as the run lasts. Judged where both together hold more than 0.9.\n\n"
        + verdicts(judged)
        + "\nAll filters that can hold two modes. A share of 1 is a filter that has made up its mind without a reason.\n\n"
        + table(head, rows)
    )


def _variation(data: dict) -> str:
    rows = [
        [family, title, number(c["mean"]), number(c["touched_mean"])]
        for family, cells in data.items()
        for title, c in cells.items()
    ]
    judged = [
        most(f"{family}: mean total variation", WANTED.variation, cells[OURS]["mean"], "", _with_floor(cells))
        for family, cells in data.items()
        if OURS in cells
    ]
    return (
        "## Distance from a converged belief\n\n"
        "Total variation between a filter's belief and that of 50 000 particles with the same model, in bins of 25 cm x 30 "
        "degrees: the share of the belief that lies elsewhere. The reference repeats itself only so well: the same with "
        "another seed is in brackets.\n\n"
        + verdicts(judged)
        + "\nAll filters and sizes, and what they touch for it; `reference again` is the reference with another seed.\n\n"
        + table(["family", "filter", "total variation", "touched/step"], rows)
        + picture(
            "variation",
            "total variation against work",
            "Down is closer to the converged belief, left is less work. The line is what was wanted, the dotted one how well "
            "the reference repeats itself: nothing can be told below it.",
        )
    )


def _with_floor(cells: dict) -> str:
    again = cells.get("reference again")
    return number(cells[OURS]["mean"]) + (f" ({number(again['mean'])})" if again else "")
