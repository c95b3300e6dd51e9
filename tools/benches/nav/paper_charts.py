"""Charts of paper.py, after the paper's Fig. 6. Lighter is stronger; line styles and marks tell curves apart."""

import math

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, Polygon, Rectangle

from crunchbot.scene import Arena

SHADES = ("#ffffff", "#dcdcdc", "#b4b4b4")
STYLES = (("-", "o"), ("--", "s"), (":", "^"), ("-.", "D"), ((0, (1, 1, 4, 1)), "v"))
FOVEA_M = 0.25


def floor(axes, arena: Arena) -> None:
    tile = arena.tile_m
    for j, line in enumerate(arena.floor_indices()):
        for i, shade in enumerate(line):
            axes.add_patch(Rectangle((i * tile, j * tile), tile, tile, facecolor=SHADES[shade], linewidth=0))
    for x0, y0, x1, y1 in arena.obstacles:
        axes.add_patch(Rectangle((x0, y0), x1 - x0, y1 - y0, facecolor="black"))
    axes.add_patch(Rectangle((0, 0), *arena.size_m, fill=False, linewidth=1.5))
    axes.set(aspect="equal", xlim=(-0.03, arena.size_m[0] + 0.03), ylim=(-0.03, arena.size_m[1] + 0.03))


def triangle(axes, pose, **style) -> None:
    x, y, heading = pose
    corners = [(0.07, 0.0), (-0.05, 0.04), (-0.05, -0.04)]
    c, s = math.cos(heading), math.sin(heading)
    axes.add_patch(Polygon([(x + c * a - s * b, y + s * a + c * b) for a, b in corners], closed=True, **style))


def strip(axes, cube: np.ndarray) -> None:
    """Eleven slices in a row, heading from -45 to +45 degrees; in each, forward is up and left is left."""
    slices = [np.pad(part[::-1, ::-1], 1, constant_values=np.nan) for part in cube]
    axes.imshow(np.hstack(slices), cmap="gray", vmin=0.0, vmax=cube.max(), interpolation="nearest")
    axes.set(xticks=[], yticks=[])
    for side in axes.spines.values():
        side.set_visible(False)
    axes.set_facecolor("#7a5c3a")


def headings(axes) -> None:
    at = np.arange(11) * 13 + 6
    axes.set_xticks(at, [f"{d:+.0f}" for d in np.linspace(-45, 45, 11)], fontsize=8)
    axes.tick_params(length=0)
    axes.set_xlabel("heading against the fovea's own (degrees)", fontsize=9)


def likelihoods(arena: Arena, data: dict) -> Figure:
    figure = Figure(figsize=(12.5, 5.6), layout="constrained")
    grid = figure.add_gridspec(len(data["cubes"]), 2, width_ratios=(2, 5))
    world = figure.add_subplot(grid[:, 0])
    floor(world, arena)
    for n, pose in enumerate(data["poses"], start=1):
        triangle(world, pose, facecolor="white", edgecolor="black", zorder=4)
        aside = (-30, 13 * (n % 3 - 1))
        leader = {"arrowstyle": "-", "linewidth": 0.8, "shrinkB": 0}
        style = {"fontsize": 11, "weight": "bold", "ha": "center", "va": "center", "zorder": 5}
        style["bbox"] = {"boxstyle": "circle,pad=0.15", "facecolor": "white", "linewidth": 0.6}
        world.annotate(str(n), pose[:2], xytext=aside, textcoords="offset points", arrowprops=leader, **style)
    x, y, heading = data["poses"][0]
    corner = (x - FOVEA_M / 2, y - FOVEA_M / 2)
    turn = {"angle": math.degrees(heading), "rotation_point": "center"}
    world.add_patch(Rectangle(corner, FOVEA_M, FOVEA_M, fill=False, linewidth=1.2, linestyle="--", **turn))
    world.set(xlabel="x (m)", ylabel="y (m)")
    for n, cube in enumerate(data["cubes"]):
        axes = figure.add_subplot(grid[n, 1])
        strip(axes, cube)
        axes.set_ylabel(f"({n + 1})", rotation=0, labelpad=12, va="center")
    headings(axes)
    return figure


def fusion(data: dict) -> Figure:
    figure = Figure(figsize=(10.5, 5.6), layout="constrained")
    parts = figure.subfigures(2, 1)
    for part, example in zip(parts, data["examples"], strict=True):
        panels = part.subplots(3, 1)
        for axes, name in zip(panels, ("prior", "likelihood", "posterior"), strict=True):
            strip(axes, example[name])
            axes.set_ylabel(name, rotation=0, ha="right", va="center")
        headings(panels[-1])
        count = f"{example['peaks']} part{'s' if example['peaks'] > 1 else ''}"
        part.suptitle(f"row {example['row']}: {count} above half the posterior's mode", fontsize=10)
    return figure


def crossing(data: dict, scene: dict) -> Figure:
    figure = Figure(figsize=(11.5, 4.6), layout="constrained")
    world, error = figure.subplots(1, 2, width_ratios=(4, 5))
    shown = np.linspace(4, scene["rows"] - 1, 5).astype(int)
    draw_belief(world, data, scene, shown)
    rows = np.arange(1, scene["rows"] + 1)
    for (title, ahead), (line, mark) in zip(data["ahead_m"].items(), STYLES, strict=True):
        error.plot(rows, ahead, linestyle=line, marker=mark, markevery=4, markersize=5, label=title)
    error.axvline(data["crossed_row"] + 0.5, color="0.4", linewidth=1)
    error.annotate("tips cross", (data["crossed_row"] + 0.7, error.get_ylim()[0]), fontsize=8, va="bottom")
    error.axhspan(-FOVEA_M / 2, FOVEA_M / 2, color="0.92", zorder=0)
    error.set(xlabel="row (2 cm each)", ylabel="belief ahead of the robot (m)")
    error.legend(frameon=False, fontsize=8)
    error.set_title("grey: within the fovea's radius", fontsize=9)
    return figure


def draw_belief(axes, data: dict, scene: dict, shown: np.ndarray) -> None:
    """Five true poses and the foveal filter's beliefs at the same rows, as in the paper's screenshot."""
    axes.axvspan(0.3, scene["border_m"], color=SHADES[0], zorder=0)
    axes.axvspan(scene["border_m"], 1.6, color=SHADES[2], zorder=0)
    title = next(iter(data["poses"]))
    for n, k in enumerate(shown, start=1):
        triangle(axes, (data["truth_x_m"][k], 1.25, 0.0), facecolor="white", edgecolor="black")
        axes.text(data["truth_x_m"][k], 1.32, str(n), ha="center", fontsize=9)
        x, y, _ = data["poses"][title][k]
        values, vectors = np.linalg.eigh(data["covariance"][title][k][:2, :2])
        angle = math.degrees(math.atan2(*vectors[::-1, 0]))
        size = 2.0 * np.sqrt(values)
        axes.add_patch(Ellipse((x, y - 0.25), *size, angle=angle, fill=False, linewidth=1.2))
        axes.text(x, y - 0.25, str(n), ha="center", va="center", fontsize=9)
    axes.set(xlim=(0.3, 1.6), ylim=(0.7, 1.5), aspect="equal", xlabel="x (m)", yticks=[])
    axes.set_title(f"above: truth; below: {title} (one sigma)", fontsize=9)


def banana(data: dict) -> Figure:
    figure = Figure(figsize=(11.5, 4.4), layout="constrained")
    shape, error = figure.subplots(1, 2, width_ratios=(3, 2))
    motions = data["motions"]
    turns = [f", {m['turn_deg']:.0f}°" if m["turn_deg"] else "" for m in motions]
    labels = [f"{m['way_m']:g} m{turn}" for m, turn in zip(motions, turns, strict=True)]
    at = np.arange(len(motions), dtype=float) + np.repeat(np.arange(3) * 0.7, len(motions) // 3)
    for key, label, face, hatch in (
        ("gaussian_variation", "Gaussian approximation", "#c9c9c9", ""),
        ("inflated_variation", "blown up to the fovea", "#ffffff", "////"),
    ):
        shift = -0.2 if key.startswith("g") else 0.2
        shape.bar(
            at + shift, [m[key] for m in motions], 0.4, label=label, facecolor=face, hatch=hatch, edgecolor="black"
        )
    shape.plot(at, [m["repeat"] for m in motions], "k_", markersize=14, label="banana, drawn again")
    shape.set_xticks(at, labels, rotation=60, ha="right", fontsize=8)
    for n, start in enumerate((2, 10, 25)):
        middle = at[n * len(motions) // 3 : (n + 1) * len(motions) // 3].mean()
        shape.text(middle, 1.0, f"heading known to {start}°", ha="center", fontsize=9)
    shape.set(ylim=(0, 1.3), ylabel="total variation from the exact transition")
    shape.legend(frameon=False, fontsize=8, loc="upper center", ncols=3)
    draw_errors(error, data["end_to_end"])
    return figure


def draw_errors(axes, worlds: dict) -> None:
    titles = list(next(iter(worlds.values())))
    for n, (world, runs) in enumerate(worlds.items()):
        for k, title in enumerate(titles):
            low, middle, high = runs[title]["error_quartiles_m"]
            mark = STYLES[n][1]
            label = world if k == 0 else None
            bars = [[middle - low], [high - middle]]
            axes.errorbar(k + 0.2 * n - 0.1, middle, bars, fmt=mark, color=f"C{n}", capsize=4, label=label)
            note = f"{100 * runs[title]['lost_share']:.0f} % lost"
            axes.annotate(
                note, (k + 0.2 * n - 0.1, high), xytext=(0, 4), textcoords="offset points", ha="center", fontsize=8
            )
    axes.set_xticks(range(len(titles)), [t.replace(": ", "\n") for t in titles], fontsize=8)
    axes.set(yscale="log", ylabel="median position error (m), quartiles of the seeds", xlim=(-0.5, len(titles) - 0.5))
    axes.legend(frameon=False, fontsize=8, loc="upper left")
