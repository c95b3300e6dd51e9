"""Charts of the bench. Readable in grey: every filter has its own marker and line."""

import numpy as np
from matplotlib.figure import Figure

MARKERS = {"odometry": "x", "ekf": "<", "ukf": ">", "foveal": "s", "grid": "o", "particle": "^", "multi": "P"}
LINES = {"odometry": ":", "ekf": "-.", "ukf": "-.", "foveal": "--", "grid": "-", "particle": "--", "multi": ":"}
COLOURS = {"odometry": "0.6", "ekf": "C4", "ukf": "C5", "foveal": "C1", "grid": "C0", "particle": "C2", "multi": "C6"}
OURS = {"marker": "*", "line": "-", "colour": "C3"}


def style(title: str) -> dict:
    """Marker and colour by the filter that a title begins with."""
    name = title.split()[0]
    return {"marker": MARKERS.get(name, OURS["marker"]), "color": COLOURS.get(name, OURS["colour"])}


def line(name: str) -> dict:
    return style(name) | {"linestyle": LINES.get(name.split()[0], OURS["line"]), "markersize": 5}


def panels(count: int, columns: int = 2, width: float = 4.6, height: float = 3.6):
    rows = -(-count // columns)
    figure = Figure(figsize=(width * columns, height * rows), layout="constrained")
    axes = list(figure.subplots(rows, columns, squeeze=False).flat)
    for spare in axes[count:]:
        spare.set_visible(False)
    return figure, axes[:count]


def legend_above(figure, axes) -> None:
    """One legend for all panels, beside none of their lines."""
    found = {label: handle for ax in axes for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    figure.legend(found.values(), found.keys(), loc="outside upper center", ncols=len(found), frameon=False, fontsize=7)


PEERS = {"filterpy": "D", "particles": "v", "pfilter": "h", "mrpt": "d"}


def by_filter(points: dict) -> dict[str, list[tuple[str, dict]]]:
    """Points of each filter, its sizes from the quickest on; a title is the filter's name and its size."""
    sizes = {}
    for title, point in sorted(points.items(), key=lambda item: item[1]["step_us_median"]["median"]):
        name, _, size = title.partition(" ")
        sizes.setdefault(name, []).append((size, point))
    return sizes


def draw_sizes(ax, look: dict, name: str, sizes: list[tuple[str, dict]]) -> None:
    """One filter: its sizes joined by a line, the error's middle half as a bar, p99 as a tail to the right."""
    x = np.array([c["step_us_median"]["median"] for _, c in sizes])
    y, low, high = 1000 * np.array([[c["error_median_m"][k] for k in ("median", "low", "high")] for _, c in sizes]).T
    tail = np.maximum([c["step_us_p99"]["median"] for _, c in sizes] - x, 0.0)
    ax.errorbar(
        x, y, xerr=[0 * tail, tail], yerr=[y - low, high - y], **look, linewidth=0.8, elinewidth=0.5, label=name
    )
    for (size, _), at in zip(sizes, zip(x, y, strict=True), strict=True):
        ax.annotate(size, at, textcoords="offset points", xytext=(3, 3), fontsize=5)


def pareto(data: dict) -> Figure:
    """Median us per step (p99 as a tail to the right) against median position error (middle half of the runs)."""
    families = data["families"]
    figure, axes = panels(len(families), width=5.6, height=4.6)
    for ax, (family, table) in zip(axes, families.items(), strict=True):
        for name, sizes in by_filter(table).items():
            draw_sizes(ax, line(name), name, sizes)
        for name, sizes in by_filter(data.get("peers", {}).get(family, {})).items():
            hollow = {"marker": PEERS.get(name, "8"), "color": "0.4", "markerfacecolor": "none", "linestyle": "none"}
            draw_sizes(ax, hollow | {"markersize": 5}, name, sizes)
        ax.set(xscale="log", yscale="log", title=family, xlabel="us per step, median (tail: p99)")
        ax.set_ylabel("median position error (mm)")
        ax.grid(True, which="both", linewidth=0.3)
    legend_above(figure, axes)
    return figure


def cost(data: dict) -> Figure:
    """us per step against the arena's side, the grid's cell and the number of object whiskers."""
    labels = {"arena": "arena's side (m)", "resolution": "grid: cell (cm)", "whiskers": "object whiskers"}
    figure, axes = panels(len(data), columns=3, width=4.0)
    for ax, (axis, table) in zip(axes, data.items(), strict=True):
        for name, points in table.items():
            points = sorted(points, key=lambda p: p["x"])
            ax.plot([p["x"] for p in points], [p["step_us_median"] for p in points], label=name, **line(name))
        ax.set(yscale="log", xlabel=labels[axis], ylabel="us per step, median")
        ax.grid(True, which="both", linewidth=0.3)
    legend_above(figure, axes)
    return figure


def honesty(data: dict) -> Figure:
    """How often the 90 % region holds the truth, and how large it is, by family and filter."""
    families = list(data["families"])
    names = [n for n in data["families"][families[0]] if n != "reference"]
    figure, (left, right) = panels(2, width=5.2, height=4.2)
    places = np.arange(len(families))
    for n, name in enumerate(names):
        cells = [data["families"][family][name] for family in families]
        shift = places + (n - len(names) / 2) * 0.08
        covered = [np.nan if c["coverage_90"] is None else 100 * c["coverage_90"] for c in cells]
        areas = [np.nan if c["region_90_m2"] is None else 1e4 * c["region_90_m2"] for c in cells]
        left.plot(shift, covered, linestyle="none", label=name, **style(name))
        right.plot(shift, areas, linestyle="none", label=name, **style(name))
    left.axhspan(85, 95, color="0.9", zorder=0)
    left.set(ylabel="90 % region holds the truth (%)", ylim=(0, 103))
    right.set(ylabel="area of the 90 % region (cm2), median", yscale="log")
    for ax in (left, right):
        ax.set_xticks(places, families, rotation=40, ha="right")
        ax.grid(True, axis="y", linewidth=0.3)
    legend_above(figure, [left])
    return figure


def locks(data: dict) -> Figure:
    """Share of runs that are locked after so many rows."""
    families = data["families"]
    figure, axes = panels(len(families), columns=2)
    for ax, (family, table) in zip(axes, families.items(), strict=True):
        for name, c in table.items():
            look = {k: v for k, v in line(name).items() if k not in ("marker", "markersize")}
            if c["rows"]:
                share = 100 * np.arange(1, len(c["rows"]) + 1) / c["runs"]
                ax.step(c["rows"], share, where="post", label=f"{name} ({c['locked']})", **look)
        ax.set(title=family, xlabel="rows until lock (0.1 s each)", ylabel="runs locked (%)", ylim=(0, 103))
        ax.grid(True, linewidth=0.3)
        ax.legend(framealpha=0.9, fontsize=7, loc="center right")
    return figure


def variation(data: dict) -> Figure:
    """Mean total variation from the reference against cells, particles or hypotheses touched per step."""
    figure, axes = panels(len(data), columns=3, width=4.4)
    for ax, (family, table) in zip(axes, data.items(), strict=True):
        for title, c in table.items():
            if title == "reference again":
                ax.axhline(c["mean"], color="0.5", linestyle=":")
                ax.annotate(title, (0.02, c["mean"]), xycoords=("axes fraction", "data"), fontsize=6, va="bottom")
                continue
            ax.plot(max(c["touched_mean"], 1.0), c["mean"], linestyle="none", **style(title))
            ax.annotate(
                title, (max(c["touched_mean"], 1.0), c["mean"]), textcoords="offset points", xytext=(4, 3), fontsize=6
            )
        ax.axhline(0.05, color="0.3", linewidth=0.8)
        ax.set(xscale="log", yscale="log", title=family, xlabel="touched per step", ylabel="total variation, mean")
        ax.grid(True, which="both", linewidth=0.3)
    return figure


def matrix(data: dict) -> Figure:
    """Share of runs that end near the truth, row by row and filter by filter."""
    titles, names = list(data["rows"]), data["filters"]
    share = np.array([[100 * data["rows"][t][n]["near_at_end"] for n in names] for t in titles])
    figure = Figure(figsize=(2.6 + 0.75 * len(names), 1.0 + 0.24 * len(titles)), layout="constrained")
    ax = figure.subplots()
    ax.imshow(share, cmap="Greys_r", vmin=-60, vmax=100, aspect="auto")
    for j, row in enumerate(share):
        for i, value in enumerate(row):
            ax.text(i, j, f"{value:.0f}", ha="center", va="center", fontsize=7, color="k" if value > 35 else "w")
    ax.set_xticks(range(len(names)), names, rotation=30, ha="left")
    ax.xaxis.tick_top()
    ax.set_yticks(range(len(titles)), titles, fontsize=7)
    ax.set_xlabel("runs within 0.15 m of the truth over their last 100 rows (%)")
    return figure


def regions(data: dict) -> Figure:
    """How often the 90 % region holds the truth, and how large it is, row by row of the matrix and filter by filter."""
    titles, names = list(data["rows"]), data["filters"]
    figure = Figure(figsize=(10.0, 1.4 + 0.24 * len(titles)), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    places = np.arange(len(titles))
    for n, name in enumerate(names):
        cells = [data["rows"][title][name] for title in titles]
        shift = places + (n - (len(names) - 1) / 2) * 0.08
        covered = [np.nan if c["coverage_90"] is None else 100 * c["coverage_90"] for c in cells]
        areas = [np.nan if c["region_90_m2"] is None else 1e4 * c["region_90_m2"] for c in cells]
        left.plot(covered, shift, linestyle="none", label=name, markersize=4, **style(name))
        right.plot(areas, shift, linestyle="none", markersize=4, **style(name))
    left.axvspan(85, 95, color="0.9", zorder=0)
    left.axvline(80, color="0.3", linewidth=0.8)
    left.set(xlabel="90 % region holds the truth (%)", xlim=(0, 103))
    right.set(xlabel="area of the 90 % region (cm2), median", xscale="log")
    left.set_yticks(places, titles, fontsize=7)
    left.invert_yaxis()
    for ax in (left, right):
        ax.grid(True, linewidth=0.3)
    legend_above(figure, [left])
    return figure


def confidence(data: dict) -> Figure:
    """Share near the truth by what the filter gave as its confidence."""
    figure = Figure(figsize=(5.2, 4.4), layout="constrained")
    ax = figure.subplots()
    ax.plot([0, 1], [0, 1], color="0.7", linewidth=0.8)
    for name, found in data["confidence"].items():
        area = "-" if found["auc"] is None else f"{found['auc']:.2f}"
        bins = found["bins"]
        ax.plot([b["confidence"] for b in bins], [b["near"] for b in bins], label=f"{name} (AUC {area})", **line(name))
    ax.set(xlabel="confidence", ylabel="share of rows within 0.25 m of the truth", xlim=(0, 1.02), ylim=(0, 1.02))
    ax.grid(True, linewidth=0.3)
    ax.legend(frameon=False, fontsize=7)
    return figure
