"""Runs one of the fuzzers of the rooms, fuzz_*.py. Each has fuzz(inputs, seed), which gives counts of what came out by what
is counted, and raises when something came out that must not.

python host/python/tests/fuzz.py recording --inputs 100000 --seed 1
"""

import argparse
import importlib
import resource
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
LAB = HERE.parents[2] / "lab/tests"
TARGETS = {path.stem.removeprefix("fuzz_"): path for tests in (HERE, LAB) for path in tests.glob("**/fuzz_*.py")}
MEMORY_MOST = 2 << 30  # address space a run may take: what a length in a file asks for is not believed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("target", choices=sorted(TARGETS))
    parser.add_argument("--inputs", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    target = TARGETS[options.target]
    sys.path[:0] = [str(HERE / "kit"), str(target.parent)]
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_MOST, MEMORY_MOST))
    counts = importlib.import_module(target.stem).fuzz(options.inputs, options.seed)
    print(f"{options.inputs} inputs", *(f"{count} {what}" for what, count in counts.items()), sep=", ")
    return 0


if __name__ == "__main__":
    sys.exit(main())
