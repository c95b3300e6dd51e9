"""What each figure shows, in words, from the figure's own data."""

import numpy as np

from .figures import TITLES
from .run import FILTERS, Run


def arena(run: Run) -> str:
    """Of the paths on the arena."""
    way = np.hypot(np.diff(run.truth["x_m"]), np.diff(run.truth["y_m"])).sum()
    width, height = run.arena["size_m"]
    ends = "; ".join(f"{TITLES[name]} ends {run.position_error(name)[-1]:.2f} m off" for name in FILTERS)
    blocks = len(run.arena.get("obstacle", []))
    return (
        f"Maps of the arena of {width:g} m by {height:g} m with {blocks} obstacles, one an estimate: the true path of "
        f"{way:.1f} m and the estimated one. {ends}."
    )


def errors(run: Run) -> str:
    """Of the errors over time."""
    return "Line charts of position and heading error over time. " + " ".join(
        f"{TITLES[name]}: median {np.median(run.position_error(name)):.2f} m and "
        f"{np.degrees(np.median(run.heading_error(name))):.0f} degrees, at most {run.position_error(name).max():.2f} m "
        f"and {np.degrees(run.heading_error(name).max()):.0f} degrees."
        for name in FILTERS
    )


def texture(run: Run) -> str:
    """Of the textures that were reported."""
    classes = np.array(run.arena["textures"])
    parts = []
    for name in run.texture_names:
        logliks = np.stack([run.observations[f"{name}_{c}"] for c in classes], axis=1)
        read = np.isfinite(logliks).all(axis=1)
        right = int((classes[np.argmax(logliks[read], axis=1)] == run.truth[f"{name}_tile"][read]).sum())
        parts.append(f"{name}: {int(read.sum())} windows read, {right} of them agree with the tile.")
    return (
        "Strip charts of the reported floor texture over time, above the true tile, with the deflection. "
        + " ".join(parts)
    )


def radial(run: Run) -> str:
    """Of the calibration of object whiskers."""
    lines = "; ".join(
        f"{name}: distance = {a0:.0f} mm {a1 * 65536 / 180:+.1f} mm per degree"
        for name, (a1, a0) in run.radial_lines.items()
    )
    return f"Scatter charts of peak deflection against radial distance from 85 to 145 mm, with a line fitted. {lines}."


def spread(run: Run) -> str:
    """Of the seeds beside the run."""
    parts = []
    for name in FILTERS:
        seeds = run.seeds[f"{name}_m"]
        here = np.median(run.position_error(name))
        parts.append(
            f"{TITLES[name]}: {seeds.min():.3f} to {seeds.max():.3f} m, median {np.median(seeds):.3f} m, this run {here:.3f} m."
        )
    return f"Dot chart of the median position error of {len(run.seeds['seed'])} seeds. " + " ".join(parts)


def shares(run: Run) -> str:
    """Of the share of the time within an error."""
    return "Line chart of the share of the time within an error. Half and 90 % of the time within: " + "; ".join(
        f"{TITLES[name]} {np.median(run.position_error(name)):.2f} m and {np.quantile(run.position_error(name), 0.9):.2f} m"
        for name in FILTERS
    )
