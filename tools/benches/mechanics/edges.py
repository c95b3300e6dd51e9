"""A tip dragged over an edge of the floor: the simulator's time at the edge and largest moment beside the chain's.

A flat floor with an edge across the path, up or down; the outer whiskers' stance, friction 0.3, a damping ratio of 0.1.
The chain's floor lies where it bends the whisker's tip by the stance's preload. Time at the edge: from the first touch
of the corner to the last. The moment is the base's along the path, its peak counted from 5 mm before the edge on.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np
from matplotlib.figure import Figure

from ..markdown import table
from .measure import EXIT, LENGTH, ROOT, Ours, chain, cone, spec
from .measure import LEVELS as BENDING

TIP, KAPPA, FRICTION, DAMPING = 0.3e-3, 1.0, 0.3, 0.1
HEIGHTS_MM = (0.15, 0.3, 1.0, 3.0, -0.15, -0.3, -1.0, -3.0)
SPEEDS = (0.05, 0.1, 0.2, 0.3)
CHAINS = (20, 40)
LEAD_IN, BEFORE, AFTER, RAMP_S, TICK_S = 60e-3, 5e-3, 25e-3, 0.02, 500e-6
LEVELS = {"static": 0, "modes": 3}
HELD_FACTOR, HELD_S, PEAK_SHARE = 1.5, 10e-3, 0.25  # what counts as agreement: the two of a time are alternatives
TABLE = ROOT / "sim/mechanics/tests/reference_edges.h"


def job(ours: Ours, links: int, height: float, speed: float) -> dict:
    stance = ours.lib.sim_drag_stance()
    reach = np.sqrt(LENGTH**2 - stance.height**2)
    placed = {
        "behind": stance.behind,
        "height": stance.height,
        "preload": stance.preload * reach / LENGTH,  # height of the floor; the stance's is the tip's deflection
        "tip_radius": TIP / 2,
    }
    more = {"stance": placed, "height": height, "speed": speed, "friction": FRICTION, "damping": DAMPING}
    return spec(TIP, KAPPA, links, **more, after=AFTER, contact_s=1e-4)


def drag(ours: Ours, level: int, height: float, speed: float) -> dict:
    from crunchbot_lab.signals.mechanics import EDGE, HOOKED, Whisker
    from crunchbot_lab.signals.mechanics import drag as run

    whisker = Whisker(exit_diameter=EXIT, cone=cone(TIP), kappa=KAPPA, friction=FRICTION, damping=DAMPING)
    flat = ours.ffi.new("struct sim_floor_texture[]", [{"correlation_mm": 1.0}])
    ticks = round((LEAD_IN + AFTER) / speed / TICK_S + RAMP_S / TICK_S)
    travel = speed * TICK_S * np.minimum(1, np.arange(1, ticks + 1) * TICK_S / RAMP_S)
    gone = np.cumsum(travel)
    series = run(whisker, travel, 0, np.where(gone > LEAD_IN, height, 0), seed=1, level=level, textures=flat)
    moment = series.tilt_rad[:, 0] / ours.lib.mech_whisker_compliance(whisker.c)
    held = np.isin(series.what & 3, (EDGE, HOOKED)).sum() * TICK_S
    return {"held_s": float(held), "peak": float(np.abs(moment[gone > LEAD_IN - BEFORE]).max())}


def measure_edges(ours: Ours, bar) -> list[dict]:
    """Every height at every speed; the chains, which take most of the time, run on all cores."""

    def measured(height: float, speed: float) -> dict:
        row = {"height_mm": height, "speed": speed}
        row |= {name: drag(ours, level, height * 1e-3, speed) for name, level in LEVELS.items()}
        for links in CHAINS:
            found = chain("edge", job(ours, links, height * 1e-3, speed))
            row[f"chain_{links}"] = {name: found[name] for name in ("held_s", "peak")}
        row["chains_agree"] = agree(row["chain_20"], row["chain_40"])
        row |= {f"{name}_agrees": agree(row[name], row["chain_20"]) for name in LEVELS}
        bar.update()
        return row

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(measured, *zip(*product(HEIGHTS_MM, SPEEDS), strict=True)))


def agree(one: dict, other: dict) -> bool:
    longer, shorter = max(one["held_s"], other["held_s"]), min(one["held_s"], other["held_s"])
    in_time = longer - shorter <= HELD_S or longer <= HELD_FACTOR * shorter
    return bool(in_time and abs(one["peak"] / other["peak"] - 1) <= PEAK_SHARE)


def draw_edges(rows: list[dict]) -> Figure:
    """Time at the edge and largest moment of steps up, over the speed."""
    figure = Figure(figsize=(10.5, 4.4), layout="constrained")
    panels = figure.subplots(1, 2)
    colours = dict(zip(HEIGHTS_MM[:4], ("#9a9a9a", "#38761d", "#0b5394", "#c25700"), strict=True))
    for height, colour in colours.items():
        up = [row for row in rows if row["height_mm"] == height]
        for axes, what, scale in zip(panels, ("held_s", "peak"), (1e3, 1e6), strict=True):
            for name, style in (("modes", "-"), ("static", ":"), ("chain_20", "x"), ("chain_40", "+")):
                label = f"{height:g} mm" if name == "modes" else None
                axes.plot(SPEEDS, [scale * r[name][what] for r in up], style, color=colour, label=label, markersize=7)
    panels[0].set(yscale="log", ylabel="time at the edge (ms)")
    panels[1].set(ylim=(0, None), ylabel="largest moment along the path (uN m)")
    for axes in panels:
        axes.set(xlabel="speed (m/s)")
        axes.grid(color="0.92")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle("Steps up. Lines: level modes, dotted: static; x and +: MuJoCo, 20 and 40 links", fontsize=10)
    return figure


def edge_summary(rows: list[dict]) -> dict:
    """Cases in which both chains agree, and how many of them each level meets."""
    firm = [row for row in rows if row["chains_agree"]]
    worst = {name: 100 * max(abs(row[name]["peak"] / row["chain_20"]["peak"] - 1) for row in firm) for name in LEVELS}
    met = {f"{name}_met": sum(row[f"{name}_agrees"] for row in firm) for name in LEVELS}
    return {"cases": len(rows), "chains_agree": len(firm), **met, "peak_worst_percent": worst}


def write_table(rows: list[dict]) -> None:
    """The C table that `make test` compares with: cases in which both chains agree."""
    lines = [
        "/* Made by tools/benches mechanics with a 20-link chain in MuJoCo; do not edit. A tip dragged over an edge: "
        "step mm,",
        " * speed m/s, time at the edge ms, largest moment along the path uN m. */",
        "/* clang-format off */",
        "static const double CHAIN_EDGES[][4] = {",
    ]
    for row in (row for row in rows if row["chains_agree"]):
        found = row["chain_20"]
        values = (row["height_mm"], row["speed"], 1e3 * found["held_s"], 1e6 * found["peak"])
        lines.append("    {" + ", ".join(f"{v:.4g}" for v in values) + "},")
    TABLE.write_text("\n".join([*lines, "};", "/* clang-format on */"]) + "\n")


def page(mechanics: dict, edges: dict) -> str:
    """docs/results/mechanics.md: statics, modes and speed, then every case of an edge."""
    rows, found, whole = edges["rows"], edges["summary"], mechanics["summary"]
    speeds = {title: name for name, (title, *_) in BENDING.items()}
    speeds |= {f"MuJoCo, {links} links": f"mujoco_{links}" for links in (5, 10, 20)}
    timed = [[s, f"{whole['times_real'][name]:.3g}"] for s, name in speeds.items() if name in whole["times_real"]]
    at_edges = [
        [f"{row['height_mm']:g}", f"{row['speed']:g}"]
        + [
            f"{1e3 * row[name]['held_s']:.1f}, {1e6 * row[name]['peak']:.1f}"
            for name in (*LEVELS, "chain_20", "chain_40")
        ]
        + ["agrees" if row[f"{name}_agrees"] else "differs" for name in LEVELS]
        for row in rows
    ]
    return (
        "# Whisker mechanics beside MuJoCo\n\n"
        "Generated by `tools/benches page` from `bench/results/mechanics.json` and `mechanics_edges.json`, measured by "
        f"`tools/benches mechanics`. The reference is a chain of 20 links in MuJoCo {mechanics['mujoco']}. "
        "[What the levels are](../mechanics.md).\n\n## Statics and modes\n\n"
        + table(
            ["figure", "value"],
            [
                [
                    f"base moment, {whole['points']} points to slip-off, large deflection: worst, RMS",
                    f"{whole['large_worst_percent']:.1f} %, {whole['large_rms_percent']:.2f} %",
                ],
                ["the same, closed form up to 5 degrees: worst", f"{whole['closed_worst_percent_to_5_deg']:.1f} %"],
                ["natural frequencies: worst", f"{whole['frequency_worst_percent']:.2f} %"],
            ],
        )
        + "\n## Speed\n\n28 whiskers at 2 kHz on one core; 4 of them are in contact all the time and 8 are dragged "
        "over "
        "floors.\n\n" + table(["mechanics", "times real time"], timed) + "\n## A tip at an edge of the floor\n\n"
        "A flat floor has an edge across the path; negative heights are steps down. The stance is that of the outer "
        f"whiskers, the friction {FRICTION:g}, the damping ratio {DAMPING:g}. Held: from the first touch of the step's "
        "corner to the last, in ms. Peak: largest base moment along the path, in uN m. Steps of a floor with a pile, "
        "which hook, are not in it.\n\n"
        f"Two results agree if their times are within a factor of {HELD_FACTOR:g} or {1e3 * HELD_S:g} ms and their "
        f"peaks "
        f"within {100 * PEAK_SHARE:g} %. Chains of 20 and 40 links agree in {found['chains_agree']} of "
        f"{found['cases']} "
        f"cases. In these, `static` agrees with 20 links in {found['static_met']}, `modes` in {found['modes_met']}.\n\n"
        + table(
            ["step mm", "m/s", "static held, peak", "modes held, peak", "20 links held, peak", "40 links held, peak"]
            + ["static", "modes"],
            at_edges,
        )
        + "\n![Time at the edge and largest moment](../charts/mechanics_edges.svg)\n"
    )
