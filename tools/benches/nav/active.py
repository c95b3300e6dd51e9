"""Where to touch next: seconds to lock in closed loop, by policy and family, the same seeds for all; and what a plan costs.

    tools/benches nav_active --seeds 7

`random` is what the pilot does without a planner. A bound stands beside: the bits that tell a place of the lock's radius from
all others in free space, over the bits that all whiskers together can tell in a row.
"""

import argparse
import math
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from crunchbot.nav.scoring import LOCK_M
from crunchbot.pilot.choices import Choices
from crunchbot.planning.beside import Along, Lanes
from crunchbot.planning.choices import Planned
from crunchbot.planning.information import capacity_bits
from crunchbot.planning.places import ArenaMap, Places
from crunchbot.planning.planner import Planner
from crunchbot_lab.scenes.closed import Loop
from crunchbot_lab.scenes.geometry import LATTICE_M, free_lattice
from crunchbot_lab.scenes.making import ROW_S
from crunchbot_lab.scenes.sweep import sweep

from .. import store

ROOT = Path(__file__).resolve().parents[3]
PLANS = Path(__file__).with_name("plans.py")
PAGE = ROOT / "docs/results/nav_active.md"
FAMILIES = ("anchor+global", "robot+global", "one-texture+global", "anchor+kidnap")
ROWS, FIRST_SEED = 1200, 74_000
REPEATS = (1, 3)  # plans of the two runs whose difference is counted
ATOM_HZ = 0.8e9  # instructions per second of the paper's netbook


def planned(steps: int):
    def policy(loop: Loop, random: Choices) -> Choices:
        return Planned(Planner(Places.of(ArenaMap(loop.arena), loop.robot), loop.vehicle, steps), loop.belief, random)

    return policy


POLICIES = {
    "random": lambda loop, random: random,
    "wall": lambda loop, random: Along(),
    "lanes": lambda loop, random: Lanes(),
    "greedy": planned(1),
    "two-step": planned(2),
}


def one(family: str, policy: str, seed: int) -> dict:
    """A run: rows to lock, None where it did not lock in ROWS; bits and bound of its arena."""
    loop = Loop(family, seed, POLICIES[policy], ROWS)
    begun = time.process_time()
    out = loop.run()
    return {"lock": out.lock_rows, "rows": out.rows, "cpu_s": time.process_time() - begun} | bound(loop)


def bound(loop: Loop) -> dict:
    """Bits wanted, the most bits of a row, and the seconds that follow; the heading is not counted."""
    robot, world = loop.robot, loop.recipe.world
    area = free_lattice(loop.arena, robot.body_radius_m).sum() * LATTICE_M**2
    wanted = math.log2(area / (math.pi * LOCK_M**2))
    window = len(robot.of_role("texture")) * capacity_bits(world.accuracy, len(loop.arena.textures))
    spread = math.sqrt(2.0 * math.pi * math.e) * world.radial_sigma_m  # 2^entropy of a distance's error
    touch = sum(1.0 + max(0.0, math.log2(whisker.length_m / spread)) for whisker in robot.of_role("object"))
    return {"wanted_bits": wanted, "row_bits": window + touch, "bound_s": ROW_S * wanted / (window + touch)}


def judged(runs: list[dict], beside: list[dict]) -> dict:
    """Seconds; a run that did not lock counts as ROWS. The ratio is of paired runs, its interval by bootstrap over seeds."""
    mine, theirs = (
        np.array([ROW_S * (ROWS if r["lock"] is None else r["lock"]) for r in many]) for many in (runs, beside)
    )
    rng = np.random.default_rng(1)
    drawn = rng.integers(0, len(mine), (2000, len(mine)))
    ratios = mine[drawn].mean(axis=1) / np.maximum(theirs[drawn].mean(axis=1), 1e-9)
    return {
        "runs": len(mine),
        "locked": sum(r["lock"] is not None for r in runs),
        "median_s": float(np.median(mine)),
        "mean_s": float(mine.mean()),
        "p90_s": float(np.quantile(mine, 0.9)),
        "worst_s": float(mine.max()),
        "mean_to_random": float(mine.mean() / max(theirs.mean(), 1e-9)),
        "interval": [float(np.quantile(ratios, q)) for q in (0.05, 0.95)],
        "bound_s": float(np.mean([r["bound_s"] for r in runs])),
        "wanted_bits": float(np.mean([r["wanted_bits"] for r in runs])),
        "row_bits": float(np.mean([r["row_bits"] for r in runs])),
    }


def cost(steps: int) -> dict:
    """Instructions of a plan, by valgrind: the difference of two runs, free of start-up."""
    counts = []
    for count in REPEATS:
        command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", sys.executable, str(PLANS)]
        done = subprocess.run([*command, str(count), str(steps)], capture_output=True, text=True, check=True)
        counts.append(int(re.search(r"Collected : (\d+)", done.stderr)[1]))
    each = (counts[1] - counts[0]) / (REPEATS[1] - REPEATS[0])
    return {"instructions": each, "netbook_ms": 1e3 * each / ATOM_HZ}


def chart(data: dict) -> Figure:
    """Median and 90 % quantile by family and policy, and the bound."""
    figure = Figure(figsize=(9.2, 3.4), layout="constrained")
    greys = dict(zip(data["policies"], ("0.85", "0.65", "0.5", "0.3", "0.1"), strict=False))
    for ax, (family, by) in zip(figure.subplots(1, len(data["families"])), data["families"].items(), strict=True):
        for n, (policy, r) in enumerate(by.items()):
            ax.bar(n, r["median_s"], color=greys[policy], edgecolor="black", linewidth=0.6)
            ax.plot([n, n], [r["median_s"], r["p90_s"]], color="black", linewidth=1.0)
            ax.plot(n, r["mean_s"], "D", color="white", markeredgecolor="black", markersize=4)
        ax.axhline(r["bound_s"], color="black", linestyle=":", linewidth=1.0)
        ax.set_title(family, fontsize=9)
        ax.set_xticks(range(len(by)), list(by), rotation=60, fontsize=8)
        ax.set_ylim(0, None)
    figure.axes[0].set_ylabel(
        "s until lock: bar median, diamond mean,\nline to the 90 % quantile; dots: bound", fontsize=8
    )
    return figure


def page(data: dict) -> str:
    """docs/results/nav_active.md."""
    lines = [
        "# Where to touch next",
        "",
        "Generated by `tools/benches page` from `bench/results/nav_active.json`, measured by `tools/benches nav_active`.",
        "",
        "A robot in closed loop at level 0, from a start that nothing is known of, or carried away after 30 s. The filter "
        "`adaptive` reads along. Seconds until lock; a run that does not lock in 120 s counts as 120. Every policy has the "
        "same seeds, and so the same arenas, starts and noise. `random` is the pilot's default. The ratio is that of the "
        "means, with the 90 % interval of a bootstrap over seeds.",
        "",
        "| family | policy | locked | median, s | mean | 90 % | worst | mean over random's |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for family, by in data["families"].items():
        for policy, r in by.items():
            low, high = r["interval"]
            lines.append(
                f"| {family} | {policy} | {r['locked']} of {r['runs']} | {r['median_s']:.1f} | {r['mean_s']:.1f} | "
                f"{r['p90_s']:.1f} | {r['worst_s']:.1f} | {r['mean_to_random']:.2f} ({low:.2f} to {high:.2f}) |"
            )
    lines += ["", "![seconds until lock by family and policy](../charts/nav_active.svg)", "", "## The bound", ""]
    for family, by in data["families"].items():
        r = by["random"]
        lines.append(
            f"- {family}: {r['wanted_bits']:.1f} bits tell the lock's circle from the rest of free space. All whiskers "
            f"together tell at most {r['row_bits']:.1f} bits in a row of 0.1 s. No policy's mean is below {r['bound_s']:.2f} s."
        )
    lines += [
        "",
        "Rows of one place repeat each other, so that the bound is far from reach.",
        "",
        "## What a plan costs",
        "",
    ]
    for name, c in data["cost"].items():
        lines.append(
            f"- {name}: {c['instructions'] / 1e6:.1f} million instructions, {c['netbook_ms']:.0f} ms of the paper's netbook "
            "(0.8e9 instructions a second)."
        )
    lines += [
        "",
        "The pilot plans once a drive, every 2 to 4 s, and takes one step. A plan keeps it from its samples for so long.",
    ]
    return "\n".join(lines) + "\n"


def run(_build: Path, seeds: int = 7, workers: int = 1) -> None:
    """Measures what is not kept, and writes result, chart and page."""
    jobs = {
        f"{family}_{policy}_{seed}": {"family": family, "policy": policy, "seed": FIRST_SEED + seed}
        for seed in range(seeds)
        for family in FAMILIES
        for policy in POLICIES
    }
    folder = store.kept("nav_active")
    found = sweep(one, jobs, folder, workers, "processes" if workers > 1 else "serial", "nav_active")
    by = {f: {p: [found[f"{f}_{p}_{s}"] for s in range(seeds)] for p in POLICIES} for f in FAMILIES}
    families = {f: {p: judged(runs, of["random"]) for p, runs in of.items()} for f, of in by.items()}
    data = {"policies": list(POLICIES), "families": families}
    data["cost"] = {name: cost(steps) for name, steps in (("greedy", 1), ("two-step", 2))}
    store.write_result("nav_active", data)
    store.write_chart("nav_active", chart(data))
    store.write_page(PAGE, page(data))


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seeds", type=int, default=7, help="of each family (default: %(default)s)")
    parser.add_argument("--workers", type=int, default=1, help="processes (default: %(default)s)")
