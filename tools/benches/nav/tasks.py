"""Tasks of a robot in closed loop: an unknown arena to be mapped, by policy; and a tile that is suspected to be otherwise.

    tools/benches nav_tasks --seeds 15

`random`, `wall` and `lanes` are the pilot's choices beside `map`. Of the same seeds all have the same arenas and starts.
"""

import argparse
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from crunchbot.planning.beside import Along, Lanes
from crunchbot.scene import Arena
from crunchbot_lab.scenes.closed import Loop
from crunchbot_lab.scenes.families import Recipe, recipe
from crunchbot_lab.scenes.making import ROW_S
from crunchbot_lab.scenes.sweep import sweep
from crunchbot_lab.scenes.tasks import CheckLoop, MapLoop, mapping, reachable

from .. import store
from .active import ATOM_HZ, REPEATS

ROOT = Path(__file__).resolve().parents[3]
PLANS = Path(__file__).with_name("coverage_plans.py")
PAGE = ROOT / "docs/results/nav_tasks.md"
FIRST_SEED = 300
INPUTS = ("host/nav", "host/python/crunchbot", "lab/crunchbot_lab", "tools/benches/nav/tasks.py")  # of a run
FAMILIES = {
    "robot": recipe("robot"),
    "anchor": recipe("anchor"),
    "free": recipe("free"),
}
POLICIES = {
    "random": lambda loop, random: random,
    "wall": lambda loop, random: Along(),
    "lanes": lambda loop, random: Lanes(),
    "map": mapping,
}
MINUTES = (1, 2, 3, 4, 5)
ROWS_A_MINUTE = 600
GOAL = 0.9
CHECK_ROWS = 1200
KINDS = ("as mapped", "otherwise", "not reachable")


def mapped(family: str, policy: str, seed: int) -> dict:
    """A run of 5 minutes: shares of the tiles visited after each, m driven, error of the pose, m."""
    begun = time.process_time()
    loop = MapLoop(FAMILIES[family], seed, POLICIES[policy], ROWS_A_MINUTE * MINUTES[-1])
    out = loop.run(until_locked=False)
    return {
        "shares": [loop.visited(ROWS_A_MINUTE * minutes) for minutes in MINUTES],
        "driven_m": float(np.hypot(*np.diff(out.truth[:, :2], axis=0).T).sum()),
        "error_m": float(np.median(out.error_m)),
        "cpu_s": time.process_time() - begun,
    }


def checked(family: str, kind: str, seed: int) -> dict:
    """A tile of this kind: what was found, whether that is true, and s until then."""
    r = FAMILIES[family]
    tile, said = suspect(r, kind, seed)
    loop = CheckLoop(r, seed, tile, said, CHECK_ROWS)
    found, rows = loop.check()
    true = loop.arena.textures[loop.arena.floor_indices()[tile[1], tile[0]]]
    right = found == (f"otherwise: {true}" if kind == "otherwise" else kind)
    return {"found": found, "right": right, "seconds": ROW_S * rows}


def suspect(r: Recipe, kind: str, seed: int) -> tuple[tuple[int, int], int | None] | None:
    """A tile (column, row) of this kind, and the texture that the map says it has, None: its own. None: there is no such tile."""
    loop, rng = Loop(r, seed, POLICIES["random"], 1), np.random.default_rng([seed, len(kind)])
    floor = loop.arena.floor_indices()
    could = reachable(loop.arena, loop.robot.body_radius_m, loop.begin)
    tiles = np.argwhere(solid(loop.arena) if kind == "not reachable" else could)
    if not len(tiles):
        return None
    row, column = rng.permutation(tiles)[0]
    classes = len(loop.arena.textures)
    said = int((floor[row, column] + rng.integers(1, classes)) % classes) if kind == "otherwise" else None
    return (int(column), int(row)), said


def solid(arena: Arena) -> np.ndarray:
    """(rows, columns) bool: tiles that a box covers."""
    rows, columns = arena.floor_indices().shape
    out, edge = np.zeros((rows, columns), bool), arena.tile_m
    for x0, y0, x1, y1 in arena.obstacles:
        for row in range(rows):
            for column in range(columns):
                low, high = (edge * column, edge * row), (edge * (column + 1), edge * (row + 1))
                out[row, column] |= x0 <= low[0] and y0 <= low[1] and x1 >= high[0] and y1 >= high[1]
    return out


def judged(runs: list[dict], beside: list[dict]) -> dict:
    """Shares over the seeds; and how much more than random's, of paired runs, its interval by bootstrap over seeds."""
    shares, theirs = (np.array([run["shares"] for run in many]) for many in (runs, beside))
    more = shares[:, -1] - theirs[:, -1]
    drawn = np.random.default_rng(1).integers(0, len(more), (2000, len(more)))
    return {
        "runs": len(runs),
        "mean": shares.mean(axis=0).tolist(),
        "median": float(np.median(shares[:, -1])),
        "worst": float(shares[:, -1].min()),
        "reached": int((shares[:, -1] >= GOAL).sum()),
        "more": float(more.mean()),
        "interval": [float(np.quantile(more[drawn].mean(axis=1), q)) for q in (0.05, 0.95)],
        "driven_m": float(np.mean([run["driven_m"] for run in runs])),
        "error_m": float(np.median([run["error_m"] for run in runs])),
    }


def found(runs: list[dict]) -> dict:
    """Of checks of one kind: how many said what is true, how many said nothing, and s until then."""
    seconds = np.array([run["seconds"] for run in runs if run["found"]])
    return {
        "runs": len(runs),
        "right": sum(run["right"] for run in runs),
        "silent": sum(not run["found"] for run in runs),
        "median_s": float(np.median(seconds)) if len(seconds) else None,
        "p90_s": float(np.quantile(seconds, 0.9)) if len(seconds) else None,
    }


def cost() -> dict:
    """Instructions of a plan of task map, by valgrind: the difference of two runs, free of start-up."""
    counts = []
    for count in REPEATS:
        command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", sys.executable, str(PLANS)]
        done = subprocess.run([*command, str(count)], capture_output=True, text=True, check=True)
        counts.append(int(re.search(r"Collected : (\d+)", done.stderr)[1]))
    each = (counts[1] - counts[0]) / (REPEATS[1] - REPEATS[0])
    return {"instructions": each, "netbook_ms": 1e3 * each / ATOM_HZ}


def chart(data: dict) -> Figure:
    """Mean share of the tiles visited over time, by family and policy."""
    styles = {"random": ":", "wall": "-.", "lanes": "--", "map": "-"}
    figure = Figure(figsize=(9.2, 2.9), layout="constrained")
    for ax, (family, by) in zip(figure.subplots(1, len(data["map"])), data["map"].items(), strict=True):
        for policy, r in by.items():
            ax.plot(MINUTES, [100 * share for share in r["mean"]], styles[policy], color="black", label=policy)
        ax.axhline(100 * GOAL, color="0.6", linewidth=0.8)
        ax.set(title=family, xlabel="minutes", ylim=(0, 102), xticks=MINUTES)
    figure.axes[0].set_ylabel("tiles visited, % of the reachable;\ngrey: the goal", fontsize=8)
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside right center", fontsize=8, frameon=False)
    return figure


def page(data: dict) -> str:
    """docs/results/nav_tasks.md."""
    first, last = data["seeds"]
    lines = [
        "# Tasks: a map, a tile",
        "",
        "Generated by `tools/benches page` from `bench/results/nav_tasks.json`, measured by `tools/benches nav_tasks`.",
        "",
        "## An unknown arena",
        "",
        f"A robot in closed loop at level 0, seeds {first} to {last}, 5 simulated minutes. It knows nothing of its arena; where it "
        "is and what is there, it has from its own map (`Mapper`). A tile is visited when the robot's middle has stood on it; "
        "reachable are the tiles on which it can stand. `random` is the pilot's default, `map` is `--choose map`. "
        "The last column is the mean of the differences from random, "
        "of the same seeds, with the 90 % interval of a bootstrap over seeds. The pose's error is the median over rows and seeds.",
        "",
        f"| family | policy | visited, mean | median | worst | {100 * GOAL:.0f} % and more | after 2 minutes, mean | driven, m | "
        "pose, mm | more than random |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for family, by in data["map"].items():
        for policy, r in by.items():
            low, high = (100 * bound for bound in r["interval"])
            lines.append(
                f"| {family} | {policy} | {100 * r['mean'][-1]:.0f} % | {100 * r['median']:.0f} % | {100 * r['worst']:.0f} % | "
                f"{r['reached']} of {r['runs']} | {100 * r['mean'][1]:.0f} % | {r['driven_m']:.0f} | {1000 * r['error_m']:.0f} | "
                f"{100 * r['more']:+.0f} ({low:+.0f} to {high:+.0f}) |"
            )
    lines += [
        "",
        "![tiles visited over time by family and policy](../charts/nav_tasks.svg)",
        "",
        f"A plan costs {data['cost']['instructions'] / 1e6:.1f} million instructions, {data['cost']['netbook_ms']:.0f} ms of the "
        "paper's netbook (0.8e9 instructions a second), all of it: what the map says, and the search.",
        "",
        "## A suspected tile",
        "",
        f"The start is known to 2 cm and 0.03 rad, and one tile is checked. Until it is known, at most {ROW_S * CHECK_ROWS:.0f} s. "
        "`as mapped`: the map is right. `otherwise`: the map has another texture there. `not reachable`: a box covers the tile.",
        "",
        "| family | tile | said what is true | said nothing | median, s | 90 % |",
        "|---|---|---|---|---|---|",
    ]
    for family, by in data["check"].items():
        for kind, r in by.items():
            if r["runs"]:
                times = [f"{r[key]:.1f}" if r[key] is not None else "none" for key in ("median_s", "p90_s")]
                lines.append(
                    f"| {family} | {kind} | {r['right']} of {r['runs']} | {r['silent']} | {times[0]} | {times[1]} |"
                )
    return "\n".join(lines) + "\n"


def run(_build: Path, seeds: int = 15, workers: int | None = None) -> None:
    """Measures what is not kept, and writes result, chart and page."""
    of = range(FIRST_SEED, FIRST_SEED + seeds)
    jobs = {f"{f}_{p}_{s}": {"family": f, "policy": p, "seed": s} for s in of for f in FAMILIES for p in POLICIES}
    tiles = {
        f"{f}_{k.replace(' ', '-')}_{s}": (f, k, s)
        for s in of
        for f in FAMILIES
        for k in KINDS
        if suspect(FAMILIES[f], k, s)
    }
    checks = {name: {"family": f, "kind": k, "seed": s} for name, (f, k, s) in tiles.items()}
    folder = store.kept("nav_tasks", *INPUTS)
    maps = sweep(mapped, jobs, folder / "map", workers, label="map")
    looks = sweep(checked, checks, folder / "check", workers, label="check")
    by = {f: {p: [maps[f"{f}_{p}_{s}"] for s in of] for p in POLICIES} for f in FAMILIES}
    data = {
        "seeds": [of[0], of[-1]],
        "map": {
            f: {p: judged(runs, of_family["random"]) for p, runs in of_family.items()} for f, of_family in by.items()
        },
        "check": {
            f: {k: found([looks[name] for name, (g, j, _) in tiles.items() if (g, j) == (f, k)]) for k in KINDS}
            for f in FAMILIES
        },
        "cost": store.once(folder / "cost.json", cost),
    }
    store.write_result("nav_tasks", data)
    store.write_chart("nav_tasks", chart(data))
    store.write_page(PAGE, page(data))


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seeds", type=int, default=15, help="of each family (default: %(default)s)")
    parser.add_argument("--workers", type=int, help="processes (default: all cores)")
