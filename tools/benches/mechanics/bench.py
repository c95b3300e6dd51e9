"""Whisker mechanics beside a chain of rigid links in MuJoCo: error of the base moment, natural frequencies, speed.

The chain (peers/chain.py) knows nothing of the simulator: an independent reference. Its 20-link results
are also written to sim/mechanics/tests/reference_table.h, where `make test` compares the simulator with them.
Speed: 28 whiskers at 2 kHz on one core, 4 against objects all the time, 8 dragged over floors, 16 free; ours and
MuJoCo's rounds take turns.
"""

import json
import shutil
from pathlib import Path

import matplotlib
from tqdm import tqdm

from .. import store
from .charts import draw_moment, draw_speed
from .edges import HEIGHTS_MM, SPEEDS, draw_edges, edge_summary, measure_edges, page
from .edges import write_table as write_edge_table
from .measure import (
    CACHE,
    LINKS,
    ROUNDS,
    Ours,
    chain,
    measure_links,
    measure_modes,
    measure_speed,
    measure_static,
    mode_cases,
    spec,
    static_cases,
    whisker_of,
)
from .summary import summary, write_table


def save(data: dict) -> None:
    store.write_result("mechanics", data)
    for name, draw in (("speed", draw_speed), ("moment", draw_moment)):
        store.write_chart(f"mechanics_{name}", draw(data))
    print("bench/results/mechanics.json, docs/charts/mechanics_speed.svg, mechanics_moment.svg")


def save_edges(rows: list[dict], data: dict) -> None:
    """Result, page, chart and C table of the edges."""
    edges = {"summary": edge_summary(rows), "rows": rows}
    store.write_result("mechanics_edges", edges)
    store.write_chart("mechanics_edges", draw_edges(rows))
    store.write_page(store.ROOT / "docs/results/mechanics.md", page(data, edges))
    write_edge_table(rows)


def keep(ours: Ours, links: list[dict]) -> None:
    """Marks what is before slip-off."""
    for row in links:
        row["kept"] = []
        for p in row["points"]:
            whisker = whisker_of({"tip": 0.3e-3, "kappa": 1.0})
            if p["theta_deg"] <= 0.95 * ours.slip_deg(whisker, p["a"] * 1e-3):
                row["kept"].append(p)


def run(build: Path, fresh: bool) -> None:
    """Measure what is not measured yet, and redraw. The simulator is the one that tools/build.sh has built."""
    matplotlib.rcParams["svg.hashsalt"] = "whisker"
    if fresh:
        for folder in ("chain", "speed"):
            shutil.rmtree(CACHE / folder, ignore_errors=True)
    ours = Ours()
    steps = len(static_cases()) + len(LINKS) + len(mode_cases()) + ROUNDS + len(HEIGHTS_MM) * len(SPEEDS)
    with tqdm(total=steps, desc="mechanics") as bar:
        speed = measure_speed(ours, bar)
        modes = measure_modes(ours, bar)
        static = measure_static(ours, bar)
        links = measure_links(ours, bar)
        edges = measure_edges(ours, bar)
    keep(ours, links)
    data = {"summary": summary(static, modes, speed), "speed": speed, "modes": modes, "static": static, "links": links}
    data["mujoco"] = chain("modes", spec(0.3e-3, 1.0, 20, pinned_at=0.0))["mujoco"]
    write_table(static, modes)
    save(data)
    save_edges(edges, data)
    print(json.dumps(data["summary"], indent=1))
