"""Engines on the fixed list of scenes and logs of `whisker bench touch`, scored alike: this project's filters and the
peers.

    .venv/bin/python tools/benches touch [--data DIR]

DIR holds the logs (DIR/thymio/random_1, ...): they are other people's and are not kept here. Without it the scores of
logs stay as they were stored.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from tqdm import tqdm

from crunchbot.nav import localise
from crunchbot.nav.estimates import Estimates
from crunchbot.nav.judging import judge
from crunchbot_lab import scenes
from crunchbot_lab.scenes import benchmark

from .. import store
from . import charts
from .peer_runs import guests, mrpt_entries, python_entries

SETTINGS = ("500", "2000", "300-20000 KLD")  # of the peers
FILE = store.RESULTS / "touch.json"


def peers(build: Path) -> list:
    entries = mrpt_entries(build, 1) + python_entries(1) + guests(1)
    return [entry for entry in entries if entry.setting in SETTINGS]


def run_peer(peer, wanted: benchmark.Entry) -> Estimates:
    made = scenes.Made(wanted.scene, wanted.observations)
    with tempfile.TemporaryDirectory() as folder:
        poses, us = peer.run(Path(folder), made, 0)
    return Estimates(f"{peer.filter} {peer.setting}", np.arange(len(poses)), poses, step_us=us)


def score(name: str, data: str | None, others: list) -> list[dict] | None:
    """One score an engine; None: its log is not here."""
    try:
        wanted = benchmark.entry(name, data)
    except benchmark.BenchmarkError as error:
        store.leave_out(name, f"{error}; its stored scores stay")
        return None
    ours = [benchmark.run_filter(filter, wanted) for filter in localise.filter_names()]
    found = [*ours, *(run_peer(peer, wanted) for peer in others)]
    return [judge(one, wanted.observations) for one in found]


def draw(table: dict[str, list[dict]]):
    """Share of rows near the truth after 20 cm of travel against time for a row, a panel for each scene."""
    figure, axes = charts.panels(len(table), columns=4, width=3.2, height=2.8)
    mine = set(localise.filter_names())
    for ax, (name, scores) in zip(axes, table.items(), strict=True):
        for found in scores:
            engine, share = found["engine"], found["near_share_after_20cm"]
            look = charts.style(engine)
            if engine not in mine:
                look = {"marker": charts.PEERS.get(engine.split()[0], "8"), "color": "0.4", "markerfacecolor": "none"}
            ax.plot(found["step_us_mean"], 100 * share, linestyle="none", label=engine, **look)
        ax.set(xscale="log", ylim=(-4, 104), title=name, xlabel="us per row", ylabel="rows within 6 cm (%)")
        ax.grid(True, linewidth=0.3)
    handles = {label: handle for ax in axes for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=6, frameon=False, fontsize=8)
    return figure


def run(build: Path, data: str | None = None) -> None:
    table, others = benchmark.stored(FILE), peers(build)
    for name in tqdm(benchmark.NAMES, desc="touch", unit="scene"):
        scores = score(name, data, others)
        if scores is not None:
            table[name] = scores
    benchmark.store(FILE, {name: table[name] for name in benchmark.NAMES if name in table})
    store.record_origin("touch")
    store.write_chart("touch", draw(benchmark.stored(FILE)), letters=True)


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--data", metavar="DIR", help="folder of the logs, as DIR/thymio/random_1")
