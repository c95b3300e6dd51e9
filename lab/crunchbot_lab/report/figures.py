"""The report's figures, to be drawn by `svg`. Line style and marker tell the curves apart in grey; colour only helps.

Each is drawn wide, or narrow for a telephone: the same panels below each other, with text of the same size.
"""

import io
from collections.abc import Callable
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, Patch, Rectangle

from .run import FILTERS, Run

TITLES = {"grid": "grid (eq. 4)", "adaptive": "adaptive", "foveal": "foveal (eqs. 5-7)", "odometry": "odometry alone"}
STYLES = {
    "grid": {"color": "#0b5394", "linestyle": "-", "marker": "o"},
    "adaptive": {"color": "#1d7a46", "linestyle": "-.", "marker": "D"},
    "foveal": {"color": "#c25700", "linestyle": "--", "marker": "^"},
    "odometry": {"color": "#6b6b6b", "linestyle": ":", "marker": "s"},
}
HATCHES = ("", "....", "////")  # of textures, as the live page draws them
WIDE_IN, NARROW_IN = 11.4, 4.6
SETTINGS = {
    "font.family": "sans-serif",
    "font.size": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "svg.fonttype": "none",
    "legend.frameon": False,
    "hatch.linewidth": 0.5,
    "hatch.color": "#aab2bc",
}


def sized(wide_high: float, narrow_high: float, narrow: bool) -> Figure:
    """An empty figure of these heights, inches."""
    size = (NARROW_IN, narrow_high) if narrow else (WIDE_IN, wide_high)
    return Figure(figsize=size, layout="constrained")


def arena(run: Run, narrow: bool = False) -> Figure:
    """The arena from above: floor, blocks, true path, and each estimate with its two-sigma ellipses."""
    figure = sized(11.2, 5.9, narrow)
    panels = figure.subplots(2, len(FILTERS) // 2, sharex=True, sharey=True).ravel()
    for axes, name in zip(panels, FILTERS, strict=True):
        draw_floor(axes, run)
        _draw_paths(axes, run, name)
        axes.set_title(TITLES[name], fontsize=10)
        axes.set(xlabel="x (m)", ylabel="y (m)")
        axes.label_outer()
    handles = [*panels[0].get_legend_handles_labels()[0], *_texture_handles(run)]
    figure.legend(handles=handles, loc="outside lower center", ncols=2 if narrow else len(handles))
    return figure


def texture(run: Run, narrow: bool = False) -> Figure:
    """A chart as the paper's Fig. 4: what each floor whisker reported, over its true tile, with the deflection below."""
    figure = sized(5.4, 6.4, narrow)
    names = run.texture_names
    panels = figure.subplots(2 * len(names), 1, sharex=True, height_ratios=[3, 2] * len(names))
    for n, name in enumerate(names):
        _draw_decisions(panels[2 * n], run, name)
        _draw_trace(panels[2 * n + 1], run, name)
    panels[-1].set_xlabel("time (s)")
    panels[-1].set_xlim(0, run.truth["tick"][-1] * 500e-6)
    figure.legend(handles=_texture_handles(run), loc="outside lower center", ncols=3, title="true tile under the tip")
    return figure


def radial(run: Run, narrow: bool = False) -> Figure:
    """A chart as the paper's Fig. 5: peak deflection against radial distance, one panel a whisker, with its fitted line."""
    rows = 2 if narrow and len(run.object_names) % 2 == 0 else 1
    figure = sized(3.2, 5.2, narrow)
    panels = figure.subplots(rows, len(run.object_names) // rows, sharex=True, sharey=True, squeeze=False).ravel()
    for axes, name in zip(panels, run.object_names, strict=True):
        _draw_contacts(axes, run, name)
    figure.supylabel("peak deflection (degrees of field)", fontsize=9.5)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2 if narrow else 3)
    return figure


def errors(run: Run, narrow: bool = False) -> Figure:
    """Position and heading error of the estimates over time."""
    figure = sized(4.6, 5.2, narrow)
    top, bottom = figure.subplots(2, 1, sharex=True)
    seconds = (run.truth["tick"] + 1) * 500e-6
    for name in FILTERS:
        every = {"markevery": max(1, len(seconds) // 14), "markersize": 4.5, "linewidth": 1.4}
        top.plot(seconds, run.position_error(name), label=TITLES[name], **STYLES[name], **every)
        bottom.plot(seconds, np.degrees(run.heading_error(name)), **STYLES[name], **every)
    top.set_ylabel("position error (m)")
    bottom.set_ylabel("heading error (degrees)")
    bottom.set_xlabel("time (s)")
    for axes in (top, bottom):
        axes.set_ylim(bottom=0)
        axes.grid(axis="y", color="#e4e4e4", linewidth=0.6)
    bottom.set_xlim(0, seconds[-1])
    figure.legend(loc="outside lower center", ncols=2 if narrow else len(FILTERS))
    return figure


def spread(run: Run, narrow: bool = False) -> Figure:
    """Median position errors of several seeds, a row a filter: each replayed seed, their median, and this run's own."""
    figure = sized(2.7, 3.4, narrow)
    axes = figure.subplots()
    for row, name in enumerate(FILTERS):
        style, seeds = STYLES[name], run.seeds[f"{name}_m"]
        labels = ("a replayed seed", "their median", "this run") if row == 0 else (None, None, None)
        axes.plot(
            seeds, [row] * len(seeds), style["marker"], color=style["color"], markersize=6,
            fillstyle="none", linestyle="", label=labels[0],
        )  # fmt: skip
        axes.plot(np.median(seeds), row, "|", color="black", markersize=13, markeredgewidth=2.5, label=labels[1])
        here = np.median(run.position_error(name))
        axes.plot(here, row + 0.3, "kv", markersize=8, linestyle="", label=labels[2])
    axes.set_yticks(range(len(FILTERS)), [TITLES[name] for name in FILTERS])
    axes.set_ylim(len(FILTERS) - 0.4, -0.6)
    axes.set(xscale="log", xlabel="median position error of a run (m)")
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:.0e}"[0] in "25" else "")
    axes.grid(axis="x", which="both", color="#e4e4e4", linewidth=0.6)
    figure.legend(loc="outside lower center", ncols=2 if narrow else 3)
    return figure


def draw_floor(axes: Any, run: Run) -> None:
    """Floor, blocks and walls from above."""
    arena, tile = run.arena, run.arena["tile_m"]
    letters = [name[0] for name in arena["textures"]]
    for row, line in enumerate(reversed(arena["floor"])):
        for column, letter in enumerate(line):
            shade = letters.index(letter)
            corner = (column * tile, row * tile)
            axes.add_patch(
                Rectangle(
                    corner, tile, tile, facecolor="white", hatch=_hatch(shade), edgecolor="#aab2bc", linewidth=0.4
                )
            )
    for block in arena.get("obstacle", []):
        (x0, y0), (x1, y1) = block["min_m"], block["max_m"]
        axes.add_patch(Rectangle((x0, y0), x1 - x0, y1 - y0, facecolor="#c9ced5", edgecolor="black", zorder=2))
    size = arena["size_m"]
    axes.add_patch(Rectangle((0, 0), *size, fill=False, linewidth=2, zorder=3))
    axes.set_aspect("equal")
    axes.set_xlim(-0.05, size[0] + 0.05)
    axes.set_ylim(-0.05, size[1] + 0.05)


def _hatch(texture: int) -> str:
    """Of the nth texture."""
    return HATCHES[texture % len(HATCHES)]


def _draw_paths(axes, run: Run, name: str) -> None:
    estimate = run.estimates[name]
    style = STYLES[name] | {"linewidth": 1.3, "markersize": 4, "zorder": 5}
    axes.plot(run.truth["x_m"], run.truth["y_m"], color="black", linewidth=2.2, alpha=0.45, label="true path", zorder=4)
    every = max(1, len(estimate["t_s"]) // (8 if name == "odometry" else 20))  # wide ellipses hide each other
    axes.plot(estimate["x_m"], estimate["y_m"], label="estimate, 2-sigma ellipses", markevery=every, **style)
    axes.plot(
        run.truth["x_m"][0],
        run.truth["y_m"][0],
        "k*",
        markersize=11,
        markeredgecolor="white",
        label="true start",
        zorder=7,
    )
    axes.plot(
        estimate["x_m"][0],
        estimate["y_m"][0],
        "kX",
        markersize=8,
        markeredgecolor="white",
        label="first estimate",
        zorder=7,
    )
    covariance = run.covariances.get(name)
    for k in range(0, len(estimate["t_s"]) if covariance else 0, every):
        matrix = [[covariance["xx_m2"][k], covariance["xy_m2"][k]], [covariance["xy_m2"][k], covariance["yy_m2"][k]]]
        centre = (estimate["x_m"][k], estimate["y_m"][k])
        axes.add_patch(_two_sigma_ellipse(centre, np.array(matrix), style["color"]))


def _two_sigma_ellipse(centre, matrix: np.ndarray, colour: str) -> Ellipse:
    values, vectors = np.linalg.eigh(matrix)
    width, height = 4 * np.sqrt(np.maximum(values, 0))
    angle = np.degrees(np.arctan2(vectors[1, 0], vectors[0, 0]))
    return Ellipse(centre, width, height, angle=angle, fill=False, edgecolor=colour, linewidth=0.8, zorder=4.5)


def _texture_handles(run: Run) -> list[Patch]:
    names = run.arena["textures"]
    return [
        Patch(facecolor="white", hatch=_hatch(n), edgecolor="#aab2bc", linewidth=0.5, label=name)
        for n, name in enumerate(names)
    ]


def _draw_decisions(axes, run: Run, name: str) -> None:
    classes = run.arena["textures"]
    seconds = (run.truth["tick"] + 1) * 500e-6
    tiles = run.truth[f"{name}_tile"]
    edges = np.flatnonzero(tiles[1:] != tiles[:-1]) + 1
    for first, last in zip([0, *edges], [*edges, len(tiles)], strict=True):
        shade = classes.index(str(tiles[first]))
        span = (seconds[first] - 0.1, seconds[last - 1])
        axes.axvspan(*span, facecolor="white", hatch=_hatch(shade), edgecolor="#aab2bc", linewidth=0.4)
    logliks = np.stack([run.observations[f"{name}_{c}"] for c in classes], axis=1)
    read = np.isfinite(logliks).all(axis=1)
    decided = np.argmax(logliks[read], axis=1)
    right = np.array(classes)[decided] == tiles[read]
    axes.plot(seconds[read][right], decided[right], "|", color="#0b5394", markersize=9, markeredgewidth=1.1)
    axes.plot(seconds[read][~right], decided[~right], "x", color="#b00020", markersize=5, markeredgewidth=1.3)
    axes.set_yticks(range(len(classes)), classes)
    axes.set_ylim(-0.6, len(classes) - 0.4)
    axes.set_title(f"{name}: reported ( | agrees with the tile, x does not)", loc="left", fontsize=9.5)


def _draw_trace(axes, run: Run, name: str) -> None:
    traces = run.traces
    axes.fill_between(traces["t_s"], traces[f"{name}_min_deg"], traces[f"{name}_max_deg"], color="#303030", linewidth=0)
    axes.set_ylabel("deflection\n(deg of field)", fontsize=8.5)


def _draw_contacts(axes, run: Run, name: str) -> None:
    table = run.radial
    degrees = table["peak_counts"] * 180 / 65536
    for kind, style in (
        ("fit", {"marker": "o", "color": "#0b5394"}),
        ("held out", {"marker": "x", "color": "#8a8a8a"}),
    ):
        mine = (table["whisker"] == name) & (table["set"] == kind)
        jitter = 1.5 if kind == "held out" else -1.5
        size = {"s": 16, "linewidth": 0.8, "zorder": 3 if kind == "fit" else 2}
        face = {"facecolor": "none", "edgecolor": style.pop("color")} if kind == "fit" else {}
        axes.scatter(
            table["radius_mm"][mine] + jitter, degrees[mine], label=f"{kind} contacts", **style, **size, **face
        )
    a1, a0 = run.radial_lines[name]
    radius = np.array([85.0, 145.0])
    axes.plot(radius, (radius - a0) / a1 * 180 / 65536, "k-", linewidth=1.2, label="fitted line (eq. 3)", zorder=4)
    axes.set_title(name, fontsize=10)
    axes.set_xlabel("radial distance (mm)")


def svg(draw: Callable[..., Figure], run: Run, narrow: bool = False) -> str:
    """A figure as an <svg> element; the same data give the same text."""
    text = io.StringIO()
    with matplotlib.rc_context(SETTINGS | {"svg.hashsalt": draw.__name__ + ("_narrow" if narrow else "")}):
        figure = draw(run, narrow=True) if narrow else draw(run)
        FigureCanvasSVG(figure).print_svg(text, metadata={"Date": None, "Creator": None})
    return "".join(text.getvalue().partition("<svg")[1:])
