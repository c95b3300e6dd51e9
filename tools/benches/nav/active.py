"""Where to touch next: seconds to lock in closed loop, by policy and family, the same seeds for all; and what a plan costs.

    tools/benches nav_active --seeds 30

`random` is what the pilot does without a planner. A bound stands beside, which no mean may beat: the bench fails if one does.
"""

import argparse
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from crunchbot.pilot.choices import Choices
from crunchbot.planning.beside import Along, Lanes
from crunchbot.planning.choices import Planned
from crunchbot.planning.ground import ArenaMap, Ground
from crunchbot.planning.planner import BUDGET, Planner
from crunchbot_lab.scenes.closed import Loop
from crunchbot_lab.scenes.making import ROW_S
from crunchbot_lab.scenes.sweep import sweep

from .. import store
from .bound import bound

ROOT = Path(__file__).resolve().parents[3]
PLANS = Path(__file__).with_name("plans.py")
PAGE = ROOT / "docs/results/nav_active.md"
FAMILIES = (
    *("anchor+global", "robot+global", "one-texture+global", "anchor+kidnap", "robot+kidnap"),
    *("free+global", "small+global", "large+global", "symmetric2+global", "raw+kidnap"),  # it was not made for these
)
ROWS, FIRST_SEED = 1200, 74_000
INPUTS = ("host/nav", "host/python/crunchbot", "lab/crunchbot_lab", "tools/benches/nav/bound.py")  # of a run
REPEATS = (1, 3)  # plans of the two runs whose difference is counted
ATOM_HZ = 0.8e9  # instructions per second of the paper's netbook
SECOND_OF = 3  # first actions after which `two-step` looks into a second one


def planned(after: int = 0, budget: int = BUDGET, true_readings: bool = False):
    def policy(loop: Loop, random: Choices) -> Choices:
        planner = Planner(Ground.of(ArenaMap(loop.arena), loop.robot), loop.vehicle, after, budget=budget)
        truth = (lambda: np.array(loop.true_pose)) if true_readings else None
        return Planned(planner, loop.belief, random, truth)

    return policy


POLICIES = {
    "random": lambda loop, random: random,
    "wall": lambda loop, random: Along(),
    "lanes": lambda loop, random: Lanes(),
    "greedy": planned(),
    "two-step": planned(SECOND_OF, budget=0),
    "greedy, true readings": planned(true_readings=True),
}


def one(family: str, policy: str, seed: int) -> dict:
    """A run: rows to lock, None where it did not lock in ROWS; bits and bound of its arena."""
    loop = Loop(family, seed, POLICIES[policy], ROWS)
    begun = time.process_time()
    out = loop.run()
    return {"lock": out.lock_rows, "rows": out.rows, "cpu_s": time.process_time() - begun} | bound(loop)


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
        "first_bits": float(np.mean([r["first_bits"] for r in runs])),
        "row_bits": float(np.mean([r["row_bits"] for r in runs])),
    }


def cost(after: int) -> dict:
    """Instructions of a plan, by valgrind: the difference of two runs, free of start-up."""
    counts = []
    for count in REPEATS:
        command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", sys.executable, str(PLANS)]
        done = subprocess.run([*command, str(count), str(after)], capture_output=True, text=True, check=True)
        counts.append(int(re.search(r"Collected : (\d+)", done.stderr)[1]))
    each = (counts[1] - counts[0]) / (REPEATS[1] - REPEATS[0])
    return {"instructions": each, "netbook_ms": 1e3 * each / ATOM_HZ}


def chart(data: dict) -> Figure:
    """Median and 90 % quantile by family and policy, and the bound."""
    figure = Figure(figsize=(9.2, 6.4), layout="constrained")
    greys = dict(zip(data["policies"], ("0.95", "0.8", "0.65", "0.45", "0.25", "0.0"), strict=True))
    places = figure.subplots(2, (len(data["families"]) + 1) // 2).ravel()
    for ax, (family, by) in zip(places, data["families"].items(), strict=False):
        for n, (policy, r) in enumerate(by.items()):
            ax.bar(n, r["median_s"], color=greys[policy], edgecolor="black", linewidth=0.6)
            ax.plot([n, n], [r["median_s"], r["p90_s"]], color="black", linewidth=1.0)
            ax.plot(n, r["mean_s"], "D", color="white", markeredgecolor="black", markersize=4)
        ax.axhline(r["bound_s"], color="black", linestyle=":", linewidth=1.0)
        ax.set_title(family, fontsize=9)
        names = [policy.replace(", ", ",\n") for policy in by]
        ax.set_xticks(range(len(by)), names, rotation=90, fontsize=8)
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
        "same seeds, and so the same arenas, starts and noise. `random` is the pilot's default; `greedy` is `--choose plan`; "
        f"`two-step` looks into a second action after the best {SECOND_OF}, without a budget; `greedy, true readings` expects "
        "the readings of the true pose. It is no bound: what is best now need not be best in the end. The ratio is that of the means, with the 90 % interval of a bootstrap over seeds.",
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
    lines += [
        "A row repeats the one before it unless a texture whisker has crossed a border or an object whisker can touch "
        "(`tools/benches/nav/bound.py`). Windows are taken to be right and a touch to tell all; the heading is not counted. "
        "No mean beats it: the bench fails, and writes nothing, if one does.",
        "",
        "| family | bits that tell the lock's circle | in the first row | in a further row | bound, s | best mean, s |",
        "|---|---|---|---|---|---|",
    ]
    for family, by in data["families"].items():
        r, best = by["random"], min(by, key=lambda policy: by[policy]["mean_s"])
        bits = " | ".join(f"{r[key]:.1f}" for key in ("wanted_bits", "first_bits", "row_bits"))
        lines.append(f"| {family} | {bits} | {r['bound_s']:.2f} | {by[best]['mean_s']:.1f} ({best}) |")
    lines += ["", "## What a plan costs", ""]
    for name, c in data["cost"].items():
        lines.append(
            f"- {name}: {c['instructions'] / 1e6:.1f} million instructions, {c['netbook_ms']:.0f} ms of the paper's netbook "
            "(0.8e9 instructions a second)."
        )
    lines += [
        "",
        f"The budget is {BUDGET / 1e6:g} million pairs of hypotheses times readings, whatever the machine; the pilot plans at "
        f"the end of a drive or a turn, every {data['plan_every_s']:.1f} s on average in family robot.",
    ]
    return "\n".join(lines) + "\n"


def refuse_below_bound(families: dict) -> None:
    """Ends the bench with one line for the first family and policy whose mean is below the bound: what is measured is wrong, or the bound is."""
    for family, by in families.items():
        for policy, r in by.items():
            if r["mean_s"] < r["bound_s"]:
                raise SystemExit(
                    f"nav_active: {family}, {policy}: mean {r['mean_s']:.2f} s, bound {r['bound_s']:.2f} s; "
                    "mend the bound (tools/benches/nav/bound.py) or the loop that beats it"
                )


def every() -> float:
    """Mean seconds between plans until lock in family robot."""
    plans, seconds = 0, 0.0
    for seed in range(FIRST_SEED, FIRST_SEED + 5):
        made: list[Planned] = []

        def watched(loop: Loop, random: Choices, made: list[Planned] = made) -> Choices:
            made.append(POLICIES["greedy"](loop, random))
            return made[-1]

        seconds += ROW_S * Loop("robot+global", seed, watched, ROWS).run().rows
        plans += sum(planned.plans for planned in made)
    return seconds / plans


def run(_build: Path, seeds: int = 30, workers: int | None = None) -> None:
    """Measures what is not kept, and writes result, chart and page."""
    jobs = {
        f"{family}_{policy}_{seed}": {"family": family, "policy": policy, "seed": FIRST_SEED + seed}
        for seed in range(seeds)
        for family in FAMILIES
        for policy in POLICIES
    }
    folder = store.kept("nav_active", *INPUTS)
    found = sweep(one, jobs, folder, workers, label="nav_active")
    by = {f: {p: [found[f"{f}_{p}_{s}"] for s in range(seeds)] for p in POLICIES} for f in FAMILIES}
    families = {f: {p: judged(runs, of["random"]) for p, runs in of.items()} for f, of in by.items()}
    refuse_below_bound(families)
    data = {
        "policies": list(POLICIES),
        "families": families,
        "plan_every_s": store.once(folder.with_name("every.json"), every),
    }
    data["cost"] = {"greedy": store.once(folder.with_name("cost.json"), lambda: cost(0))}
    store.write_result("nav_active", data)
    store.write_chart("nav_active", chart(data))
    store.write_page(PAGE, page(data))


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seeds", type=int, default=30, help="of each family (default: %(default)s)")
    parser.add_argument("--workers", type=int, help="processes (default: all cores)")
