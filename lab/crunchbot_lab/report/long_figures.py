"""Figures of a long run: where it went, how far off each estimate was and how often. Distinguished in grey by line and marker."""

import numpy as np
from matplotlib.figure import Figure

from .figures import STYLES, TITLES, draw_floor, sized
from .run import FILTERS, Run

LOST_M = 0.25  # an estimate further off is lost
WINDOW_ROWS = 100  # 10 s
LEAST_M = 1e-3  # of a logarithmic axis
LOST_STYLE = {"color": "0.3", "linewidth": 0.8, "linestyle": ":"}


def path(run: Run, narrow: bool = False) -> Figure:
    """The true path from above, and where each estimate that is not odometry was lost."""
    names = [name for name in FILTERS if name != "odometry"]
    figure = sized(4.6, 12.6, narrow)
    shape = (len(names), 1) if narrow else (1, len(names))
    for axes, name in zip(figure.subplots(*shape, sharex=True, sharey=True), names, strict=True):
        draw_floor(axes, run)
        x, y = run.truth["x_m"], run.truth["y_m"]
        axes.plot(x, y, color="#0b5394", linewidth=0.5, label="true path", zorder=4)
        lost = run.position_error(name) > LOST_M
        axes.plot(x[lost], y[lost], "k.", markersize=3, label=f"estimate more than {LOST_M:g} m off", zorder=5)
        axes.set_title(TITLES[name], fontsize=10)
        axes.set(xlabel="x (m)", ylabel="y (m)")
        axes.label_outer()
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=1 if narrow else 2)
    return figure


def errors(run: Run, narrow: bool = False) -> Figure:
    """Medians of 10 s of every estimate's position error over the run."""
    figure = sized(4.2, 4.2, narrow)
    axes = figure.subplots()
    count = max(1, len(run.truth["tick"]) // WINDOW_ROWS)
    minutes = np.array([part[-1] for part in np.array_split(run.truth["tick"], count)]) * 500e-6 / 60
    for name in FILTERS:
        medians = [np.median(part) for part in np.array_split(run.position_error(name), count)]
        every = {"markevery": max(1, count // 14), "markersize": 4.5, "linewidth": 1.2}
        axes.plot(minutes, np.maximum(medians, LEAST_M), label=TITLES[name], **STYLES[name], **every)
    axes.axhline(LOST_M, **LOST_STYLE)
    axes.annotate("lost", (1.0, LOST_M), xycoords=("axes fraction", "data"), ha="right", va="bottom", color="0.3")
    axes.set(yscale="log", xlabel="time (minutes)", ylabel="position error, median of 10 s (m)")
    axes.grid(axis="y", color="#e4e4e4", linewidth=0.6)
    figure.legend(loc="outside lower center", ncols=2 if narrow else len(FILTERS))
    return figure


def shares(run: Run, narrow: bool = False) -> Figure:
    """Share of the time within an error, of every estimate."""
    figure = sized(4.2, 4.2, narrow)
    axes = figure.subplots()
    for name in FILTERS:
        error = np.sort(np.maximum(run.position_error(name), LEAST_M))
        share = 100.0 * np.arange(1, len(error) + 1) / len(error)
        axes.plot(error, share, label=TITLES[name], **STYLES[name], markevery=max(1, len(error) // 9), markersize=4.5)
    axes.axvline(LOST_M, **LOST_STYLE)
    axes.annotate("lost", (LOST_M, 1.0), xycoords=("data", "axes fraction"), ha="left", va="bottom", color="0.3")
    axes.set(xscale="log", xlabel="position error (m)", ylabel="share of the time within it (%)", ylim=(0, 101))
    axes.grid(color="#e4e4e4", linewidth=0.6)
    axes.legend(loc="lower right")
    return figure
