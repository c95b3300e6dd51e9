"""A tip dragged over an edge of the floor: the simulator's time at the edge and largest moment beside the chain's.

A flat floor with an edge across the path, up or down; the outer whiskers' stance, friction 0.3, a damping ratio of 0.1.
The chain's floor lies where it bends the whisker's tip by the stance's preload. Time at the edge: from the first touch
of the corner to the last. The moment is the base's along the path, its peak counted from 5 mm before the edge on.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np

from .measure import EXIT, LENGTH, ROOT, Ours, chain, cone, spec

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
