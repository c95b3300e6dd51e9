"""Whisker mechanics beside a chain of rigid links in MuJoCo: error of the base moment, natural frequencies.

The chain (peers/chain.py) knows nothing of the simulator: an independent reference. Its 20-link results
are also written to sim/mechanics/tests/reference_table.h, where `make test` compares the simulator with them.
"""

import json
from pathlib import Path

import numpy as np
from tqdm import tqdm

from .. import store
from .edges import HEIGHTS_MM, SPEEDS, edge_summary, measure_edges
from .edges import write_table as write_edge_table
from .measure import (
    FINEST,
    ROOT,
    SMALL_DEG,
    Ours,
    chain,
    measure_modes,
    measure_static,
    mode_cases,
    spec,
    static_cases,
)

TABLE = ROOT / "sim/mechanics/tests/reference_table.h"


def worst(points: list[dict], name: str, largest_deg: float) -> float:
    """Largest error in percent up to an angle."""
    errors = [abs(p[name]) for p in points if p["theta_deg"] <= largest_deg and np.isfinite(p[name])]
    return 100 * max(errors)


def before_slip(row: dict) -> list[dict]:
    """Points up to 95 % of the angle where either lets go: beyond it a small difference decides."""
    ends = [row["slips_deg"], row["chain_slips_deg"] or np.inf]
    return [p for p in row["points"] if p["theta_deg"] <= 0.95 * min(ends)]


def summary(static: list[dict], modes: list[dict]) -> dict:
    kept = [p for row in static for p in before_slip(row)]
    hertz = [abs(np.array(r["ours_hz"]) / r["chain_hz"][FINEST] - 1).max() for r in modes]
    return {
        "cases": len(static),
        "points": len(kept),
        "large_worst_percent": max(100 * abs(p["large"]) for p in kept),
        "large_rms_percent": 100 * float(np.sqrt(np.mean([p["large"] ** 2 for p in kept]))),
        "closed_worst_percent_to_5_deg": worst(kept, "closed", SMALL_DEG + 0.1),
        "arc_worst_mm": max(abs(p["arc_mm"]) for p in kept),
        "frequency_worst_percent": 100 * float(max(hertz)),
    }


def write_table(static: list[dict], modes: list[dict]) -> None:
    """The C table that `make test` compares with."""
    lines = [
        "/* Made by tools/benches mechanics with a 20-link chain in MuJoCo; do not edit. Statics: tip diameter mm, "
        "kappa (0:",
        " * clamped), friction, peg's distance mm and angle rad, base moment uN m, arc length of the contact mm. "
        "Modes: tip",
        " * diameter mm, kappa, pinned at mm (0: free), three frequencies Hz. */",
        "/* clang-format off */",
        "static const double CHAIN_STATIC[][7] = {",
    ]
    for row in static:
        for p in before_slip(row):
            c = p["chain"]
            values = (row["tip"] * 1e3, row["kappa"] or 0, row["friction"], c["a"] * 1e3, c["theta"], c["moment"] * 1e6)
            lines.append("    {" + ", ".join(f"{v:.7g}" for v in (*values, c["arc"] * 1e3)) + "},")
    lines += ["};", "static const double CHAIN_MODES[][6] = {"]
    for row in modes:
        values = (row["tip"] * 1e3, row["kappa"] or 0, row["pinned_at"] * 1e3, *row["chain_hz"][20])
        lines.append("    {" + ", ".join(f"{v:.7g}" for v in values) + "},")
    TABLE.write_text("\n".join([*lines, "};", "/* clang-format on */"]) + "\n")


def run(build: Path) -> None:
    """Measure what is not measured yet. The simulator is the one that tools/build.sh has built."""
    ours = Ours()
    steps = len(static_cases()) + len(mode_cases()) + len(HEIGHTS_MM) * len(SPEEDS)
    with tqdm(total=steps, desc="mechanics") as bar:
        modes = measure_modes(ours, bar)
        static = measure_static(ours, bar)
        edges = measure_edges(ours, bar)
    found = {"summary": summary(static, modes), "edges": edge_summary(edges), "at_edges": edges}
    found["mujoco"] = chain("modes", spec(0.3e-3, 1.0, 20, pinned_at=0.0))["mujoco"]
    write_table(static, modes)
    write_edge_table(edges)
    store.write_result("mechanics", found)
    print(json.dumps(found["summary"], indent=1))
