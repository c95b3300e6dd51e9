"""Half an hour of the whole robot: how well it knows where it is, how often it is lost, and what it met on the way.

python -m crunchbot_lab.demo.long --out build/demo-long --build-dir build/release --seed 1 --level bytes

Levels: `signals` (world, pilot and filters in this process, wheels without a Create, no bit and no network), `bytes` and `rtl` (all
processes, as in the demo). Leaves in the folder what the demo leaves (radial contacts only with a chain), summary.json and report.html.
"""

import argparse
import json
import math
import sys
import time
from pathlib import Path

import numpy as np
from tqdm import tqdm

from crunchbot import scene as scenes
from crunchbot.arguments import warn
from crunchbot.nav import localise
from crunchbot.nav.scoring import position_errors
from crunchbot.observation import cell
from crunchbot.outputs import put
from crunchbot.pilot.behaviour import BLOCK_TICKS
from crunchbot.pilot.pilot import Pilot
from crunchbot.recording.mcapfile import McapFile
from crunchbot.robot.models import load_models
from crunchbot.robot.network.messages import Contact, decode

from ..report.long_figures import LOST_M
from ..report.long_page import write_report
from ..report.run import FILTERS, read_columns
from .__main__ import (
    TICKS_PER_S,
    add_run_options,
    guarded,
    judge,
    learn_models,
    prepare,
    read_poses,
    run,
    write_dicts,
    write_summary,
)
from .level1 import explore

LEVELS = ("bytes", "signals", "rtl")  # the first is the default

FOUND_ROWS = 10  # within LOST_M, one after the other: a loss is over
ROW_S = 0.1
CONTACT_TOPIC = "/contact"


def parse(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m crunchbot_lab.demo.long", description=__doc__.splitlines()[0])
    add_run_options(parser, Path("build/demo-long"), 1800.0)
    parser.add_argument("--level", choices=LEVELS, default=LEVELS[0], help="of the simulation (%(default)s)")
    return parser.parse_args(argv)


def main(argv: list[str] | None = None) -> int:
    return guarded("demo-long", demonstrate, parse(argv))


def demonstrate(options: argparse.Namespace) -> dict:
    """All steps in order; leaves summary.json and report.html in the output folder, and returns the summary."""
    began = time.monotonic()
    out, scene, start = prepare(options)
    learn_models(out, scene, options)
    results = {"seed": options.seed, "simulated_s": options.seconds, "lanes": options.lanes, "level": options.level}
    chained = options.level != "signals"
    results |= run(out, options, options.level) if chained else explore_signals(out, scene, start, options)
    results |= judge(out, scene)
    results["filters"] = {name: long_scores(out, name) for name in FILTERS}
    results |= travelled(out, scene)
    results["whisks"] = len(json.loads((out / "pilot.json").read_text())["whisks"])
    if chained:
        results["contacts"] = contacts_reported(out / "robot.mcap")
    results["wall_s"] = time.monotonic() - began
    write_summary(out, results)
    tell(results)
    print(write_report(out))
    return results


def explore_signals(
    out: Path, scene: scenes.Scene, start: tuple[float, float, float], options: argparse.Namespace
) -> dict:
    """Writes the same files as a chain, from a run at level 1, as far as there is something to put in them."""
    began, ticks = time.monotonic(), round(options.seconds * TICKS_PER_S)
    pilot = Pilot(scene.robot, *load_models(out / "models", scene.robot), options.seed)
    onsets = Onsets(pilot)
    with tqdm(total=ticks, desc="world and pilot, signals", unit="tick") as bar:

        def on_block(first: int, counts: np.ndarray) -> None:
            onsets.look()
            bar.update(BLOCK_TICKS)

        rows, truth = explore(scene, start, pilot, options.seed, ticks, on_block=on_block)
    path = localise.observations_path(out / "scene")
    cells = [{key: cell(value) for key, value in row.items()} for row in rows]
    write_dicts(path, list(cells[0]), cells)
    write_dicts(out / "truth.csv", list(truth[0]), truth)
    observations = localise.read_observations(path, scene)
    for name in tqdm(FILTERS, desc="filters", unit="filter"):
        localise.write_estimates(out / f"est_{name}.csv", localise.run(name, scene, observations), observations)
    put(out / "pilot.json", json.dumps({"rows": len(rows), "whisks": pilot.whisks, "base": {}}, indent=1) + "\n")
    return {"chain_wall_s": time.monotonic() - began, "contacts": onsets.count}


class Onsets:
    """Counts contacts of a pilot, looked at once a block."""

    def __init__(self, pilot: Pilot):
        self._contacts, self.count = pilot.contacts, 0
        self._seen = {lane: contact.onset for lane, contact in pilot.contacts.items()}

    def look(self) -> None:
        for lane, contact in self._contacts.items():
            self.count += contact.onset != self._seen[lane]
            self._seen[lane] = contact.onset


def long_scores(out: Path, name: str) -> dict:
    """Errors of one filter's positions over the whole run, and its losses."""
    truth = read_columns(out / "truth.csv")
    error = position_errors(read_poses(out / f"est_{name}.csv"), np.column_stack([truth["x_m"], truth["y_m"]]))
    found = losses(error)
    return {
        "median_m": float(np.median(error)),
        "p90_m": float(np.quantile(error, 0.9)),
        "max_m": float(error.max()),
        "lost_share": float(np.mean(error > LOST_M)),
        "losses": len(found),
        "longest_loss_s": max((ROW_S * (end - begin) for begin, end in found), default=0.0),
    }


def losses(error: np.ndarray) -> list[tuple[int, int]]:
    """Rows [begin, end): from the first beyond LOST_M to the first of FOUND_ROWS in a row within it, or to the end."""
    found, begin, near = [], None, 0
    for row, lost in enumerate(error > LOST_M):
        near = 0 if lost else near + 1
        if lost and begin is None:
            begin = row
        elif begin is not None and near == FOUND_ROWS:
            found.append((begin, row + 1 - FOUND_ROWS))
            begin = None
    return found if begin is None else [*found, (begin, len(error))]


def travelled(out: Path, scene: scenes.Scene) -> dict:
    """Metres driven, and tiles under the robot's middle, of those that are no obstacle."""
    truth = read_columns(out / "truth.csv")
    x, y, tile = truth["x_m"], truth["y_m"], scene.arena.tile_m
    columns, rows = (math.ceil(side / tile) for side in scene.arena.size_m)
    middles = [(tile * (column + 0.5), tile * (row + 0.5)) for column in range(columns) for row in range(rows)]
    return {
        "driven_m": float(np.hypot(np.diff(x), np.diff(y)).sum()),
        "tiles_visited": len({*zip((x // tile).tolist(), (y // tile).tolist(), strict=True)}),
        "tiles": sum(scene.arena.is_free(*middle, 0.0) for middle in middles),
    }


def contacts_reported(path: Path) -> int:
    """Onsets in a bag."""
    with McapFile(path) as bag:
        reported = (m for m in bag.messages() if m.topic.endswith(CONTACT_TOPIC))
        onsets = sum(decode(Contact, bytes(m.data), m.topic).touching for m in reported)
        for line in bag.damage:
            warn(line)
        return onsets


def tell(s: dict) -> None:
    """Lines a person can read."""
    print(
        f"drove: {s['driven_m']:.0f} m, {s['tiles_visited']} of {s['tiles']} tiles, {s['contacts']} contacts, {s['whisks']} whisks measured"
    )
    print(f"touch: texture {100 * s['texture_accuracy_all']:.1f} % of windows right")
    for name, f in s["filters"].items():
        text = f"{1000 * f['median_m']:.0f} mm median, {1000 * f['p90_m']:.0f} mm in 90 % of the time"
        print(f"pose:  {name:8} {text}, lost {100 * f['lost_share']:.1f} % of it, {f['losses']} times")


if __name__ == "__main__":
    sys.exit(main())
