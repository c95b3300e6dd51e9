"""Measures speed and accuracy, always as ratios in one run, and redraws every chart.

    make bench                                        all topics: bench/results/*.json, docs/charts/*.svg
    .venv/bin/python tools/benches --only ring nav    some topics, one after the other
    .venv/bin/python tools/benches nav --seeds 5      one topic, with options of its own; `nav --help` lists them

A topic's measurements are kept in build/bench for the state of the tree that they are of: an interrupted run goes on
where it stopped, and in another state all is measured anew; `--fresh` begins again. All topics together take the sizes
of ROUND, so that they end within 100 minutes on two cores; `--whole` takes each at its full size, and a STUDY, too:
its verdict is in docs/decisions.md.
"""

import argparse
import importlib
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import matplotlib

ROOT = Path(__file__).resolve().parents[2]
TOPICS = {  # topic -> module, by room; the page is last, for its tables show what the others have measured
    "bridge": "bridge.bench",
    "chain": "bridge.chain",
    "contact": "contact.bench",
    "damage": "host.damage",
    "floors": "nav.floors",
    "host": "host.bench",
    "image": "node.image",
    "levels": "bridge.levels",
    "map": "nav.maps",
    "map_peers": "nav.map_peers",
    "mechanics": "mechanics.bench",
    "nav": "nav.bench",
    "nav_peers": "nav.peer_runs",
    "nav_families": "nav.families",
    "nav_filters": "nav.filters",
    "nav_worth": "nav.worth",
    "node": "node.bench",
    "pico": "node.pico",
    "radial": "radial.bench",
    "record": "host.record",
    "ring": "host.ring",
    "robot": "robot.bench",
    "texture": "texture.bench",
    "timing": "bridge.timing",
    "usb": "bridge.usb",
    "page": "tables",
}
# Options of the topics whose full size takes more than some minutes, as `make bench` gives them.
ROUND = {
    "bridge": ["--placements", "6"],  # every board with 28 lanes; what is stored of the same gateware stays
    "map": ["--seeds", "15"],
    "nav": ["--seeds", "5"],
    "nav_peers": ["--seeds", "5"],
    "nav_families": ["--runs", "430"],
    "nav_filters": ["--runs", "86"],
    "pico": ["--frames", "100000", "--faults", "1000"],
    "ring": ["--rounds", "1"],
    "usb": ["--frames", "500000"],
}

STUDY = ("nav_worth",)


def main() -> None:
    sys.path[0] = str(ROOT / "tools")  # the benches are a package; this file's own folder is none of its modules'
    matplotlib.rcParams["svg.hashsalt"] = "whisker"  # same data, same file
    topic, *words = sys.argv[1:] or [""]
    if topic in TOPICS:
        run_one(topic, words)
    else:
        run_many(sys.argv[1:])


def run_one(topic: str, words: list[str]) -> None:
    bench = bench_of(topic)
    parser = front(f"tools/benches {topic}", bench.__doc__)
    if hasattr(bench, "options"):
        bench.options(parser)
    chosen = vars(parser.parse_args(words))
    from benches import store

    if chosen.pop("fresh"):
        shutil.rmtree(store.kept(topic), ignore_errors=True)
    bench.run(chosen.pop("build_dir").resolve(), **chosen)


def run_many(words: list[str]) -> None:
    """Each topic in a process of its own; one that fails is no hindrance to the others."""
    parser = front("tools/benches", __doc__)
    parser.add_argument("--only", nargs="+", choices=TOPICS, metavar="TOPIC", help=", ".join(TOPICS))
    parser.add_argument("--whole", action="store_true", help="each topic at its full size, and studies: many hours")
    chosen = parser.parse_args(words)
    failed = []
    for topic in chosen.only or [topic for topic in TOPICS if chosen.whole or topic not in STUDY]:
        options = ["--build-dir", chosen.build_dir, *(["--fresh"] if chosen.fresh else [])]
        options += [] if chosen.whole else ROUND.get(topic, [])
        print(f"bench: {topic}", flush=True)
        if subprocess.run([sys.executable, Path(__file__).parent, topic, *options], check=False).returncode:
            failed.append(topic)
    if failed:
        sys.exit(f"bench: failed: {', '.join(failed)}; the same command goes on with them")


def bench_of(topic: str) -> ModuleType:
    """A module with run(build, ...), what it measures in its text, and options(parser) if run takes more."""
    return importlib.import_module(f"benches.{TOPICS[topic]}")


def front(name: str, description: str | None) -> argparse.ArgumentParser:
    """The options of every bench."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog=name, description=description, formatter_class=form)
    parser.add_argument("--build-dir", type=Path, default=ROOT / "build/release")
    parser.add_argument("--fresh", action="store_true", help="forget what an interrupted run has measured")
    return parser


if __name__ == "__main__":
    main()
