"""Every filter on the same draws of the families: what a row costs, in instructions, beside how often the robot is not
found, how far off it is, and how often the filter is sure and wrong.

    tools/benches nav_filters --data DIR                  all filters of this tree
    tools/benches nav_filters --state TREE:FILTER         one more beside them, as a prototype in another tree

Draws, journals and --data: as of nav_families, a journal a state. Valgrind counts the instructions of one draw's rows.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from crunchbot.nav import localise
from crunchbot.nav.observations import stretch
from crunchbot_lab.scenes import write_scene
from crunchbot_lab.scenes.making import ROW_S

from .. import store
from ..host.bench import ATOM_HZ
from .families import chosen, draw_options, measure, parent_commit, report, seed_of, summed_up
from .states import stated
from .worlds import all_families

ANSWER = """
import sys
from pathlib import Path
from benches.nav.states import stated
stated(sys.argv[2]).answer(Path(sys.argv[1]), 0, 0)
"""
COUNTED, COUNTED_ROWS = "room, anywhere", 300  # the family whose first draw is counted, from the start on
NETBOOK = ATOM_HZ * ROW_S  # instructions in the time of a row
MARKS = "osD^v<>PXhd8p"  # of filters, in their order
PANELS = {
    "not locked, %": lambda one: 100.0 * (1.0 - one["locked"] / one["draws"]),
    "median error after lock, mm": lambda one: one["error_mm"],
    "sure and wrong, % of rows": lambda one: 100.0 * one["sure_wrong"],
}


def instructions(words: str, seed: int) -> float | None:
    """Of a row, by the state's filter alone, without what Python does. None without valgrind."""
    if not shutil.which("valgrind"):
        store.leave_out("instructions", "valgrind is not on this machine")
        return None
    with tempfile.TemporaryDirectory() as folder:
        made = all_families(None)[COUNTED].make(seed)
        write_scene(folder, made.scene, stretch(made.observations, 0, COUNTED_ROWS))
        command = ["valgrind", "--tool=callgrind", "--toggle-collect=nav_replay", f"--callgrind-out-file={folder}/out"]
        command += [sys.executable, "-c", ANSWER, folder, words]
        paths = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
        subprocess.run(command, check=True, capture_output=True, env=paths)
        count = re.search(r"^summary: (\d+)", Path(folder, "out").read_text(), re.MULTILINE)[1]
    return int(count) / COUNTED_ROWS


def draw(states: dict[str, dict]) -> Figure:
    """A point a filter; down is better, left is cheaper."""
    figure = Figure(figsize=(11.0, 3.8), layout="constrained")
    for ax, (title, value) in zip(figure.subplots(1, len(PANELS)), PANELS.items(), strict=True):
        for (name, one), mark in zip(states.items(), MARKS, strict=False):
            if (at := value(one)) is not None and one["instructions"]:
                ours = {"marker": "*", "ms": 13} if name == localise.default_filter() else {"marker": mark, "ms": 7}
                ax.plot(one["instructions"], at, color="black", mfc="none", linestyle="none", label=name, **ours)
        ax.axvline(NETBOOK, color="0.4", linestyle="--", linewidth=0.8, label="the paper's netbook, 10 rows a second")
        ax.set(xscale="log", title=title, xlabel="instructions a row", xlim=(2e4, 2e8))
        ax.set_yscale("log" if "mm" in title else "linear")
        ax.grid(True, linewidth=0.3)
    found = {label: h for ax in figure.axes for h, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    figure.legend(found.values(), found.keys(), loc="outside lower center", ncols=5, frameon=False, fontsize=8)
    return figure


def run(
    _build: Path, runs: int, state: Sequence[str], data: Path | None, only: Sequence[str], parent: str | None
) -> None:
    families, commit = chosen(all_families(data), only), parent or parent_commit()
    words = {name: f"{store.ROOT}:{name}" for name in localise.filter_names()}
    words |= {one.partition(":")[2]: one for one in state}
    found = {}
    for name, one in words.items():
        known = stated(one)
        draws = measure(families, runs, commit, [known])
        found[name] = summed_up(families, draws, [known])[known.words]
        print(report({name: found[name]}), flush=True)
    if only:  # the page shows all
        return
    seed = seed_of(commit, COUNTED, 0)
    states = {
        name: parts["all"]
        | {"instructions": instructions(words[name], seed)}
        | {"groups": {part: one for part, one in parts.items() if part.startswith("all of")}}
        for name, parts in found.items()
    }
    result = {"draws_of": commit, "families": list(families), "netbook": NETBOOK, "states": states}
    store.write_result("nav_filters", result)
    store.write_chart("nav_filters", draw(states))


def options(parser: argparse.ArgumentParser) -> None:
    draw_options(parser, 86)
    parser.add_argument("--state", action="append", default=[], metavar="TREE:FILTER[:KEY=VALUE,...]")
