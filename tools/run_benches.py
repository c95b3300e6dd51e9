#!/usr/bin/env python3
"""Measures speed and accuracy, always as ratios in one run, and redraws every chart.

    make bench                        bench/results/*.json, docs/charts/*.svg and .png
    tools/run_benches.py --only ring nav    some topics: each is a module bench_<topic>.py that also runs alone

A measurement that is done is kept in build/bench: an interrupted run goes on where it stopped; `--fresh` begins again.
"""

import argparse
import importlib
import sys
from pathlib import Path

import matplotlib

ROOT = Path(__file__).resolve().parent.parent
TOPICS = sorted(path.stem.removeprefix("bench_") for path in Path(__file__).parent.glob("bench_*.py"))


def main() -> int:
    matplotlib.rcParams["svg.hashsalt"] = "whisker"  # same data, same file
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build-dir", type=Path, default=ROOT / "build/release")
    parser.add_argument("--fresh", action="store_true", help="forget what an interrupted run has measured")
    parser.add_argument("--only", nargs="+", choices=TOPICS, default=TOPICS, metavar="TOPIC", help=", ".join(TOPICS))
    options = parser.parse_args()
    for topic in options.only:
        print(f"bench: {topic}", flush=True)
        importlib.import_module(f"bench_{topic}").run(options.build_dir.resolve(), options.fresh)
    return 0


if __name__ == "__main__":
    sys.exit(main())
