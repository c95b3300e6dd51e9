"""A tip dragged over an edge of the floor: the simulator's time at the edge and largest moment beside the chain's.

A flat floor with an edge across the path, up or down; the outer whiskers' stance, friction 0.3, a damping ratio of 0.1.
The chain's floor lies where it bends the whisker's tip by the stance's preload. Time at the edge: from the first touch of
the corner to the last. The moment is the base's along the path, its peak counted from 5 mm before the edge on.
"""

import numpy as np
from matplotlib.figure import Figure

from .measure import EXIT, LENGTH, ROOT, Ours, chain, cone, spec

TIP, KAPPA, FRICTION, DAMPING = 0.3e-3, 1.0, 0.3, 0.1
HEIGHTS_MM = (0.15, 0.3, 1.0, 3.0, -0.15, -0.3, -1.0, -3.0)
SPEEDS = (0.05, 0.1, 0.2, 0.3)
CHAINS = (20, 40)
LEAD_IN, BEFORE, AFTER, RAMP_S, TICK_S = 60e-3, 5e-3, 25e-3, 0.02, 500e-6
LEVELS = {"static": 0, "modes": 3}
HELD_FACTOR, HELD_S, PEAK_SHARE = 1.5, 10e-3, 0.25  # what counts as agreement: the two of a time are alternatives
PAGE = ROOT / "docs/results/mechanics_edges.md"
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
    from signals.mechanics import EDGE, HOOKED, Whisker
    from signals.mechanics import drag as run

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
    rows = []
    for height in HEIGHTS_MM:
        for speed in SPEEDS:
            row = {"height_mm": height, "speed": speed}
            row |= {name: drag(ours, level, height * 1e-3, speed) for name, level in LEVELS.items()}
            for links in CHAINS:
                found = chain("edge", job(ours, links, height * 1e-3, speed))
                row[f"chain_{links}"] = {name: found[name] for name in ("held_s", "peak")}
            row["chains_agree"] = agree(row["chain_20"], row["chain_40"])
            row |= {f"{name}_agrees": agree(row[name], row["chain_20"]) for name in LEVELS}
            rows.append(row)
            bar.update()
    return rows


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
        "/* Made by tools/benches mechanics with a 20-link chain in MuJoCo; do not edit. A tip dragged over an edge: step mm,",
        " * speed m/s, time at the edge ms, largest moment along the path uN m. */",
        "/* clang-format off */",
        "static const double CHAIN_EDGES[][4] = {",
    ]
    for row in (row for row in rows if row["chains_agree"]):
        found = row["chain_20"]
        values = (row["height_mm"], row["speed"], 1e3 * found["held_s"], 1e6 * found["peak"])
        lines.append("    {" + ", ".join(f"{v:.4g}" for v in values) + "},")
    TABLE.write_text("\n".join([*lines, "};", "/* clang-format on */"]) + "\n")


def write_page(rows: list[dict], version: str) -> None:
    """The table of every case."""
    found = edge_summary(rows)
    lines = [
        "# A whisker's tip at an edge of the floor, beside MuJoCo",
        "",
        "Made by `tools/benches mechanics`; do not edit.",
        "",
        "A flat floor with an edge across the path, negative heights are steps down. Stance of the outer whiskers,",
        f"friction {FRICTION:g}, damping ratio {DAMPING:g}. Held: from the first touch of the step's corner to the last, ms.",
        "Peak: largest base moment along the path, uN m. Steps of a floor with a pile, which hook, are not in it.",
        "",
        f"Agreement: time within a factor of {HELD_FACTOR:g} or {1e3 * HELD_S:g} ms, and peak within {100 * PEAK_SHARE:g} %.",
        f"Chains of 20 and 40 links agree in {found['chains_agree']} of {found['cases']} cases; there `static` agrees with",
        f"20 links in {found['static_met']}, `modes` in {found['modes_met']}. MuJoCo {version}.",
        "",
        "| step mm | m/s | static held, peak | modes held, peak | 20 links held, peak | 40 links held, peak | static | modes |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        pairs = " | ".join(
            f"{1e3 * row[name]['held_s']:.1f}, {1e6 * row[name]['peak']:.1f}"
            for name in (*LEVELS, "chain_20", "chain_40")
        )
        verdicts = " | ".join("agrees" if row[f"{name}_agrees"] else "differs" for name in LEVELS)
        lines.append(f"| {row['height_mm']:g} | {row['speed']:g} | {pairs} | {verdicts} |")
    lines += ["", "![Time at the edge and largest moment](../charts/mechanics_edges.svg)"]
    PAGE.write_text("\n".join(lines) + "\n")
