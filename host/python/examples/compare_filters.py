"""All filters on one scene, with a chart of speed against accuracy.

Usage: whisker examples; python compare_filters.py [SCENE] [CHART.SVG]   (default: examples/scene, filters.svg)

SCENE is a folder as docs/formats.md says, with the true pose in observations.csv. Needs matplotlib
(pip install 'crunchbot[report]').
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from crunchbot import scene as scenes
from crunchbot.nav import localise

MARKERS = "osD^vP"


def measure(folder: Path) -> dict[str, tuple[float, float]]:
    """By filter: median processor time of a row, us, and median position error, m."""
    scene = scenes.load(folder)
    observations = localise.read_observations(localise.observations_path(folder), scene)
    found = {}
    for name in localise.filter_names():
        run = localise.run(name, scene, observations)
        error = localise.pose_errors(run.poses, observations.truth)["pose_error_median_m"]
        found[name] = float(np.median(run.step_us)), error
        print(f"{name:10} {found[name][0]:9.1f} us a row {1000 * error:7.1f} mm")
    return found


def draw(found: dict[str, tuple[float, float]]) -> Figure:
    """Each filter a marker of its own, so that grey tells them apart; what is left and low is fast and right."""
    figure = Figure(figsize=(7.0, 4.4), layout="constrained")
    axes = figure.subplots()
    for marker, (name, (us, error)) in zip(MARKERS, found.items(), strict=True):
        axes.plot(us, 1000 * error, marker, color="0.2", markersize=8, label=name)
    axes.set(xscale="log", yscale="log", xlabel="processor time of a row, median (us)")
    axes.set_ylabel("position error, median (mm)")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:e}"[0] in "25" else "")
    axes.grid(which="both", linewidth=0.3)
    figure.legend(loc="outside right upper")
    return figure


def main(folder: Path = Path("examples/scene"), chart: Path = Path("filters.svg")) -> dict[str, tuple[float, float]]:
    """What was measured; the chart is written."""
    found = measure(folder)
    draw(found).savefig(chart)
    print(chart)
    return found


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
