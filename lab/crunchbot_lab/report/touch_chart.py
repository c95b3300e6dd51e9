"""The chart of the benchmark by touch: error along the way, and in bits beside what the floor can have given."""

from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from .figures import SETTINGS

LINES, WIDTHS = ("-", "--", "-.", ":"), (1.8, 1.2)
FLOOR_M = 1e-3  # errors below are drawn as this


@dataclass(frozen=True)
class Course:
    """A robot's way of n rows; errors_m: by engine, rows (m,) and distances from the truth (m,)."""

    title: str
    travel_m: np.ndarray  # (n,) since the last start
    area_m2: float
    near_m: float
    bits_wanted: float
    bits_reported: np.ndarray | None  # (n,)
    errors_m: dict[str, tuple[np.ndarray, np.ndarray]]


def save(path: str, course: Course) -> None:
    """Write FILE.svg or FILE.png; ValueError for another ending."""
    if not str(path).endswith((".svg", ".png")):
        raise ValueError("neither SVG nor PNG")
    with matplotlib.rc_context(SETTINGS | {"svg.hashsalt": course.title}):
        options = {"metadata": {"Date": None}} if str(path).endswith(".svg") else {"dpi": 120}
        draw(course).savefig(path, **options)


def draw(course: Course) -> Figure:
    """Left: distance from the truth over the way driven; right: the same as bits, with the bound."""
    figure = Figure(figsize=(10.5, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    way_cm = 100.0 * np.cumsum(np.maximum(np.diff(course.travel_m, prepend=0.0), 0.0))
    for n, (name, (rows, error)) in enumerate(course.errors_m.items()):
        look = {"linestyle": LINES[n % len(LINES)], "linewidth": WIDTHS[n > 0], "color": f"C{n}", "label": name}
        shown = np.clip(np.nan_to_num(error, nan=np.inf), FLOOR_M, np.sqrt(course.area_m2))
        left.plot(way_cm[rows], 100.0 * shown, **look)
        right.plot(way_cm[rows], np.log2(course.area_m2 / (np.pi * shown**2)), **look)
    left.axhline(100.0 * course.near_m, color="0.4", linewidth=0.8)
    left.annotate("near", (way_cm[-1], 100.0 * course.near_m), ha="right", va="bottom", color="0.4")
    left.set(yscale="log", xlabel="way driven (cm)", ylabel="distance from the truth (cm)", title=course.title)
    right.axhline(course.bits_wanted, color="0.4", linewidth=0.8)
    right.annotate("wanted for a near row", (way_cm[-1], course.bits_wanted), ha="right", va="bottom", color="0.4")
    if course.bits_reported is not None:
        right.plot(way_cm, course.bits_reported, color="0.2", linewidth=2.4, label="from the floor, at most")
    right.set(xlabel="way driven (cm)", ylabel="bits: arena's area over that of the error")
    right.set_ylim(-1.0, course.bits_wanted + 6.0)
    for axes in (left, right):
        axes.grid(color="#e4e4e4", linewidth=0.6)
    figure.legend(*right.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure
