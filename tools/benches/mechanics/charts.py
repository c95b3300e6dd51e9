"""Charts of the bench: error against speed, base moment against angle."""

import numpy as np
from matplotlib.figure import Figure

from .measure import LEVELS, SMALL_DEG
from .summary import worst

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
