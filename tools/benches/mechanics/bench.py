"""Whisker mechanics beside a chain of rigid links in MuJoCo: error of the base moment, natural frequencies, speed.

The chain (peers/chain.py) knows nothing of the simulator: an independent reference. Its 20-link results
are also written to sim/mechanics/tests/reference_table.h, where `make test` compares the simulator with them.
Speed: 28 whiskers at 2 kHz on one core, 4 against objects all the time, 8 dragged over floors, 16 free; ours and
MuJoCo's rounds take turns.
"""

import json
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

from .. import store
from .edges import HEIGHTS_MM, SPEEDS, draw_edges, edge_summary, measure_edges, page
from .edges import write_table as write_edge_table
from .measure import (
    FINEST,
    LEVELS,
    LINKS,
    ROOT,
    ROUNDS,
    SMALL_DEG,
    Ours,
    chain,
    measure_links,
    measure_modes,
    measure_speed,
    measure_static,
    mode_cases,
    spec,
    static_cases,
    whisker_of,
)

TABLE = ROOT / "sim/mechanics/tests/reference_table.h"


def worst(points: list[dict], name: str, largest_deg: float) -> float:
    """Largest error in percent up to an angle."""
    errors = [abs(p[name]) for p in points if p["theta_deg"] <= largest_deg and np.isfinite(p[name])]
    return 100 * max(errors)


def before_slip(row: dict) -> list[dict]:
    """Points up to 95 % of the angle where either lets go: beyond it a small difference decides."""
    ends = [row["slips_deg"], row["chain_slips_deg"] or np.inf]
    return [p for p in row["points"] if p["theta_deg"] <= 0.95 * min(ends)]


def summary(static: list[dict], modes: list[dict], speed: dict) -> dict:
    kept = [p for row in static for p in before_slip(row)]
    hertz = [abs(np.array(r["ours_hz"]) / r["chain_hz"][FINEST] - 1).max() for r in modes]
    return {
        "cases": len(static),
        "points": len(kept),
        "large_worst_percent": max(100 * abs(p["large"]) for p in kept),
        "large_rms_percent": 100 * float(np.sqrt(np.mean([p["large"] ** 2 for p in kept]))),
        "closed_worst_percent_to_5_deg": worst(kept, "closed", SMALL_DEG + 0.1),
        "arc_worst_mm": max(abs(p["arc_mm"]) for p in kept),
        "frequency_worst_percent": 100 * float(max(hertz)),
        "times_real": {name: round(found["times_real"], 2) for name, found in speed.items()},
    }


def write_table(static: list[dict], modes: list[dict]) -> None:
    """The C table that `make test` compares with."""
    lines = [
        "/* Made by tools/benches mechanics with a 20-link chain in MuJoCo; do not edit. Statics: tip diameter mm, "
        "kappa (0:",
        " * clamped), friction, peg's distance mm and angle rad, base moment uN m, arc length of the contact mm. "
        "Modes: tip",
        " * diameter mm, kappa, pinned at mm (0: free), three frequencies Hz. */",
        "/* clang-format off */",
        "static const double CHAIN_STATIC[][7] = {",
    ]
    for row in static:
        for p in before_slip(row):
            c = p["chain"]
            values = (row["tip"] * 1e3, row["kappa"] or 0, row["friction"], c["a"] * 1e3, c["theta"], c["moment"] * 1e6)
            lines.append("    {" + ", ".join(f"{v:.7g}" for v in (*values, c["arc"] * 1e3)) + "},")
    lines += ["};", "static const double CHAIN_MODES[][6] = {"]
    for row in modes:
        values = (row["tip"] * 1e3, row["kappa"] or 0, row["pinned_at"] * 1e3, *row["chain_hz"][20])
        lines.append("    {" + ", ".join(f"{v:.7g}" for v in values) + "},")
    TABLE.write_text("\n".join([*lines, "};", "/* clang-format on */"]) + "\n")


STYLES = {
    "closed": {"color": "#6b6b6b", "marker": "s"},
    "large": {"color": "#0b5394", "marker": "o"},
    "modes": {"color": "#38761d", "marker": "*"},
}
CHAINS = {
    5: {"color": "#c25700", "marker": "^"},
    10: {"color": "#c25700", "marker": "<"},
    20: {"color": "#c25700", "marker": ">"},
}


def draw_speed(data: dict) -> Figure:
    """Error of the base moment against speed."""
    figure = Figure(figsize=(10.5, 4.6), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, largest, title in zip(panels, (SMALL_DEG + 0.1, 90), ("up to 5 degrees", "up to slip-off"), strict=True):
        for row in data["links"]:
            name = f"mujoco_{row['links']}"
            error = worst(row["kept"], "chain", largest)
            axes.plot(
                data["speed"][name]["times_real"],
                error,
                label=f"MuJoCo, {row['links']} links",
                markersize=8,
                linestyle="",
                **CHAINS[row["links"]],
            )
        for level, style in STYLES.items():
            error = worst(data["links"][-1]["kept"], "closed" if level == "closed" else "large", largest)
            axes.plot(
                data["speed"][level]["times_real"],
                error,
                label=LEVELS[level][0],
                markersize=13 if level == "modes" else 8,
                linestyle="",
                **style,
            )
        axes.axvline(200, color="0.6", linewidth=0.8, linestyle="--")
        axes.axhline(5, color="0.6", linewidth=0.8, linestyle=":")
        axes.set(xscale="log", yscale="log", title=title, xlabel="times real time, 28 whiskers at 2 kHz, one core")
        axes.grid(color="0.92")
    panels[0].set_ylabel("largest error of the base moment (%)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle(
        "Contacts at 80-130 mm against the exact elastica, plug kappa 1. Dashed: 200 times real; dotted: 5 %",
        fontsize=10,
    )
    return figure


def draw_moment(data: dict) -> Figure:
    """Base moment against angle, the chain's points over the levels' curves."""
    figure = Figure(figsize=(10.5, 4.2), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, kappa, title in zip(panels, (None, 1.0), ("clamped", "plug, kappa 1"), strict=True):
        for a, style in ((0.090, "-"), (0.110, "--"), (0.130, "-.")):
            row = next(
                r for r in data["static"] if (r["kappa"], r["a"], r["friction"], r["tip"]) == (kappa, a, 0.0, 0.3e-3)
            )
            shown = [p for p in row["points"] if np.isfinite(p["large"])]
            angle = [p["theta_deg"] for p in shown]
            chained = np.array([p["chain"]["moment"] * 1e6 for p in shown])
            axes.plot(
                angle,
                chained * (1 + np.array([p["large"] for p in shown])),
                style,
                color="#0b5394",
                label=f"large deflection, {a * 1e3:.0f} mm",
            )
            axes.plot(
                angle, chained * (1 + np.array([p["closed"] for p in shown])), style, color="#9a9a9a", linewidth=1
            )
            axes.plot(
                angle, chained, "x", color="#c25700", markersize=5, label="MuJoCo, 20 links" if a == 0.130 else None
            )
            axes.plot(row["slips_deg"], 0, "v", color="#0b5394", clip_on=False, markersize=6)
        axes.set(title=title, xlabel="imposed angle (degrees)", ylim=(0, 2700))
        axes.grid(color="0.92")
    panels[0].set_ylabel("base moment (uN m)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle(
        "Frictionless peg. Grey: closed form; triangles: where the simulator lets the whisker slip off", fontsize=10
    )
    return figure


def save(data: dict) -> None:
    store.write_result("mechanics", data)
    for name, draw in (("speed", draw_speed), ("moment", draw_moment)):
        store.write_chart(f"mechanics_{name}", draw(data))


def save_edges(rows: list[dict], data: dict) -> None:
    """Result, page, chart and C table of the edges."""
    edges = {"summary": edge_summary(rows), "rows": rows}
    store.write_result("mechanics_edges", edges)
    store.write_chart("mechanics_edges", draw_edges(rows))
    store.write_page(store.ROOT / "docs/results/mechanics.md", page(data, edges))
    write_edge_table(rows)


def keep(ours: Ours, links: list[dict]) -> None:
    """Marks what is before slip-off."""
    for row in links:
        row["kept"] = []
        for p in row["points"]:
            whisker = whisker_of({"tip": 0.3e-3, "kappa": 1.0})
            if p["theta_deg"] <= 0.95 * ours.slip_deg(whisker, p["a"] * 1e-3):
                row["kept"].append(p)


def run(build: Path) -> None:
    """Measure what is not measured yet, and redraw. The simulator is the one that tools/build.sh has built."""
    matplotlib.rcParams["svg.hashsalt"] = "whisker"
    ours = Ours()
    steps = len(static_cases()) + len(LINKS) + len(mode_cases()) + ROUNDS + len(HEIGHTS_MM) * len(SPEEDS)
    with tqdm(total=steps, desc="mechanics") as bar:
        speed = measure_speed(ours, bar)
        modes = measure_modes(ours, bar)
        static = measure_static(ours, bar)
        links = measure_links(ours, bar)
        edges = measure_edges(ours, bar)
    keep(ours, links)
    data = {"summary": summary(static, modes, speed), "speed": speed, "modes": modes, "static": static, "links": links}
    data["mujoco"] = chain("modes", spec(0.3e-3, 1.0, 20, pinned_at=0.0))["mujoco"]
    write_table(static, modes)
    save(data)
    save_edges(edges, data)
    print(json.dumps(data["summary"], indent=1))
