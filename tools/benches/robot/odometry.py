"""What the base's driver reports of straight lines and turns, against the truth: both Creates, remainder kept and
dropped.

Emulator and driver in one process, on an open floor, with the wheel errors of sim/world: a scale of 1 % for a run and 2
% for a move, in what the wheels count; the wheels themselves run just as ordered. Each move on worlds of their own,
from rest to rest.
"""

import csv
import io
import math
import subprocess
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

METRES, RADIANS = 2.0, math.pi
SPEEDS = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5)  # m/s; the robot explores at 0.15
TURNS = (math.pi / 24, 0.3, 0.62, 1.0, 2.0)  # rad/s; the first is the body whisk's
FIRST_SEED, SEEDS = 4101, 40
PAPER = 0.05  # relative odometry error
LEAST = 2e-4  # of the chart

CASES = {  # title: model, remainder, policy of whisker-base
    "Create 1, remainder kept, packets 19 and 20": ("1", "kept", "reported"),
    "Create 1, remainder dropped, packets 19 and 20": ("1", "dropped", "reported"),
    "Create 1, remainder kept, auto": ("1", "kept", "auto"),
    "Create 1, remainder dropped, auto": ("1", "dropped", "auto"),
    "Create 2, encoders": ("2", "kept", "encoders"),
}
STYLES = (("o-", "black"), ("^-", "0.35"), ("s--", "0.5"), ("v:", "0.5"), ("D-.", "0.15"))


def measure(build: Path) -> dict:
    """Everything, in seconds: title -> {"straight", "turn"} -> list of moves."""
    program = next(path for path in build.rglob("bench_base_odometry") if path.is_file())
    moves = {"straight": [(v, 0.0, METRES) for v in SPEEDS], "turn": [(0.0, omega, RADIANS) for omega in TURNS]}
    return {
        title: {kind: [_move(program, case, *move) for move in of_kind] for kind, of_kind in moves.items()}
        for title, case in CASES.items()
    }


def _move(program: Path, case: tuple[str, str, str], v_m_s: float, omega_rad_s: float, amount: float) -> dict:
    words = [program, *case, v_m_s, omega_rad_s, amount, FIRST_SEED, SEEDS]
    text = subprocess.run(list(map(str, words)), check=True, capture_output=True, text=True).stdout
    rows = list(csv.DictReader(io.StringIO(text)))
    kind, speed = ("m", "ordered_m_s") if v_m_s else ("rad", "ordered_rad_s")
    error = np.array([float(row[f"reported_{kind}"]) / float(row[f"true_{kind}"]) - 1.0 for row in rows])
    return {
        "asked": v_m_s or omega_rad_s,
        "ordered": float(rows[0][speed]),
        "mean": float(error.mean()),
        "rms": float(np.sqrt(np.mean(error**2))),
        "worst": float(np.abs(error).max()),
        "beyond_paper": float(np.mean(np.abs(error) > PAPER)),
    }


def draw(found: dict) -> Figure:
    """Root mean square of the relative error against the speed really driven."""
    figure = Figure(figsize=(10.5, 4.6), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    named = (("straight", f"straight, {METRES:g} m: speed (m/s)"), ("turn", "turn, 180 degrees: rate (rad/s)"))
    for axes, (kind, label) in zip(panels, named, strict=True):
        for (title, moves), (style, colour) in zip(found.items(), STYLES, strict=True):
            x = [move["ordered"] for move in moves[kind]]
            y = [100.0 * max(move["rms"], LEAST) for move in moves[kind]]
            axes.plot(x, y, style, color=colour, label=title, fillstyle="none", linewidth=1.1)
        axes.axhline(100.0 * PAPER, color="0.3", linewidth=0.8, linestyle=":")
        axes.annotate("paper: below 5 %", (x[-1], 100.0 * PAPER), ha="right", va="bottom", color="0.3", fontsize=8)
        axes.set(xscale="log", yscale="log", xlabel=label)
        ticks = SPEEDS if kind == "straight" else TURNS
        axes.set_xticks(ticks, [f"{tick:.2g}" for tick in ticks])
        axes.minorticks_off()
        axes.grid(axis="y", linewidth=0.3)
    panels[0].set_ylabel("odometry error, root mean square (%)")
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=8, frameon=False
    )
    return figure


DRAWINGS = {"robot_odometry": draw}
