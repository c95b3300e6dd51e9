"""The sections of docs/results/nav.md on what filters cost: bounds, soak, speed against accuracy and size."""

import numpy as np

from .goals import GOALS, OURS, least, listed, mm, most, number, picture, table, verdicts, work_budget, yes


def budgets(data: dict) -> str:
    rows = [
        [name, str(c["rows"]), number(c["step_us_p999"]), number(c["step_us_max"])]
        + [str(c["evaluations_max"]), str(c["touched_max"])]
        for name, c in data.items()
    ]
    head = ["filter", "rows", "p99.9 us", "slowest us", "most evaluations", "most touched"]
    text = "## Bounds while tracking\n\nThe slowest of many rows, and the most work of any row.\n\n"
    if OURS in data:
        c = data[OURS]
        text += verdicts(
            [
                most(f"p99.9 over {c['rows']} rows", GOALS.p999_us, c["step_us_p999"], " us"),
                most("slowest row", GOALS.slowest_us, c["step_us_max"], " us"),
                most(
                    "work of any row (`adaptive.budget`)",
                    work_budget(),
                    c["touched_max"],
                    " cells",
                    str(c["touched_max"]),
                ),
            ]
        )
    return (
        text
        + "\nAll filters. Evaluations: poses weighed; touched: cells, particles or hypotheses moved or weighed.\n\n"
        + table(head, rows)
    )


def soak(data: dict) -> str:
    rows, judged = [], []
    for name, run in data.items():
        blocks = run["blocks"]
        faulty, touched = sum(b["faulty"] for b in blocks), max(b["touched_max"] for b in blocks)
        slowest = max(b["step_us_max"] for b in blocks)
        slower = blocks[-1]["step_us_median"] / blocks[0]["step_us_median"]
        rows.append(
            [name, str(run["rows"]), str(faulty), number(100 * np.median([b["error_median_m"] for b in blocks]))]
            + [number(slowest), str(touched), number(slower)]
        )
        if name == OURS:
            judged = [
                least("rows", GOALS.soak_rows, run["rows"], "", str(run["rows"])),
                ["invalid results", "0", str(faulty), yes(faulty == 0)],
                most("slowest row", GOALS.slowest_us, slowest, " us"),
                most("work of any row (`adaptive.budget`)", work_budget(), touched, " cells", str(touched)),
            ]
    head = ["filter", "rows", "invalid results", "median error cm", "slowest us", "most touched", "last/first us"]
    return (
        "## Soak\n\nOne run of very many rows, with faults of every kind, the robot carried off every 10 000 rows.\n\n"
        + verdicts(judged)
        + "\nThe same with its error (median of blocks of 10 000 rows), and its time per row at the end over that at the start. "
        "Above 1 it has become slower.\n\n" + table(head, rows)
    )


def pareto(data: dict) -> str:
    rows = [
        [family, title, str(c["runs"]), number(c["step_us_median"]["median"]), number(c["step_us_p99"]["median"])]
        + [mm(c["error_median_m"]), mm(c["error_rms_m"])]
        for family, cells in data["families"].items()
        for title, c in cells.items()
    ]
    head = ["family", "filter", "runs", "us/step", "p99 us", "median error mm", "RMS mm"]
    return (
        "## Speed against accuracy\n\n"
        "Every filter at several sizes, and filters of other projects on the same scenes and likelihood, where they were run. "
        f"Goal: no point of other projects is both quicker and nearer than `{OURS}`. The table lists the points that are.\n\n"
        + table(["family", "of other projects", "of our own filters"], _dominated(data))
        + picture(
            "pareto",
            "microseconds per step against position error",
            "Down is nearer, left is quicker. Bars: the middle half of the runs; the tail to the right ends at the slowest row "
            "in a hundred. Hollow: other projects.",
        )
        + "\nThe points of this project's filters; slow filters have fewer runs.\n\n"
        + table(head, rows)
    )


def _dominated(data: dict) -> list[list[str]]:
    """By family: the points that are at least as quick and as near as the default filter."""
    out = []
    for family, cells in data["families"].items():
        if OURS in cells:
            peers = data.get("peers", {}).get(family)
            theirs = "not run" if peers is None else listed(_better(peers, cells[OURS]))
            out.append([family, theirs, listed(_better(cells, cells[OURS]))])
    return out


def _better(points: dict, ours: dict) -> list[str]:
    us, error = ours["step_us_median"]["median"], ours["error_median_m"]["median"]
    return [
        f"{title} ({number(p['step_us_median']['median'])} us, {1000 * p['error_median_m']['median']:.1f} mm)"
        for title, p in points.items()
        if p is not ours and p["step_us_median"]["median"] <= us and p["error_median_m"]["median"] <= error
    ]


def cost(data: dict) -> str:
    names = {"arena": "arena's side, m", "resolution": "grid's cell, cm", "whiskers": "object whiskers"}
    rows = [
        [names[axis], name, f"{points[0]['x']:g} to {points[-1]['x']:g}"]
        + [f"{number(points[0]['step_us_median'])} to {number(points[-1]['step_us_median'])}"]
        for axis, cells in data.items()
        for name, points in ((name, sorted(points, key=lambda p: p["x"])) for name, points in cells.items())
    ]
    return (
        "## Cost against size\n\n"
        "Median time per step from the smallest to the largest that was tried. There is no goal "
        "for it.\n\n"
        + table(["what grows", "filter", "from, to", "us/step"], rows)
        + picture(
            "cost",
            "cost against arena size, resolution and whiskers",
            "A level line is a filter whose cost does not depend on that. The grid visits every cell of the arena, so its "
            "line climbs with the area and with the cells per metre.",
        )
    )


def passes(data: list[dict]) -> str:
    rows = [
        [
            f"{r['cell_m'] * 100:g} cm x {r['cell_deg']:g} degrees",
            str(round(r["poses"])),
            number(r["ns_per_pose_median"]),
        ]
        + [number(r["ns_per_pose_p90"]), number(r["read_ns_per_float"]), number(r["scale_ns_per_float"])]
        for r in data
    ]
    judged = []
    for poses, limit in GOALS.grid_ns:
        near = min(data, key=lambda r: abs(r["poses"] - poses))
        shown = f"{number(near['ns_per_pose_median'])} ns ({round(near['poses'])} poses)"
        judged.append(most(f"full step at {poses} poses, per pose", limit, near["ns_per_pose_median"], " ns", shown))
    head = ["grid", "poses", "ns per pose", "p90", "reading a float", "scaling a float"]
    return (
        "## The grid's pass\n\n"
        "CPU time of the `grid` filter's full step (motion noise, likelihood, normalising) over its poses, median of many "
        "steps.\n\n"
        + verdicts(judged)
        + "\nBeside it, in the same run, the time to read or to scale as many floats (ns each).\n\n"
        + table(head, rows)
    )
