#!/usr/bin/env python3
"""Runs every fuzzer of the host for long, in slices, and adds up what they did.

    .venv/bin/python tools/fuzz.py                    10^8 inputs in all, goes on where an earlier run stopped
    .venv/bin/python tools/fuzz.py --total 1e6        a short one
    .venv/bin/python tools/fuzz.py --only decoder     one target; what the results say of the others stays

Targets: programs `fuzz_*` of the build (libFuzzer with AddressSanitizer and UBSan) and host/python/tests and lab/tests, */fuzz_*.py. What
they have found and counted is kept in build/bench/fuzz; a change of a target begins it anew.
Writes bench/results/fuzz.json. An input that makes a target fail stays there too; then the exit code is 1.
"""

import argparse
import hashlib
import json
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

from benches.store import RESULTS, write_result
from tqdm import tqdm

ROOT = Path(__file__).resolve().parent.parent
TESTS = (ROOT / "host/python/tests", ROOT / "lab/tests")
STATE = ROOT / "build/bench/fuzz"
TOTAL = 10**8
SLOW_SHARE = 1 / 500  # of the inputs, to each target that takes some hundred times as long over one as the others
SLOW = {"rows"}  # every filter over a whole run; and all of Python
SLICE_S = 20  # about so long is a slice
FIRST_SLICE = 2000
FAILED_TEXT = 2000  # characters of a failing target's output that are shown


@dataclass
class Tally:
    """What one target has done so far."""

    target: str
    fingerprint: str
    inputs: int = 0
    crashes: int = 0
    seconds: float = 0.0
    slices: int = 0


@dataclass(frozen=True)
class Target:
    name: str
    program: Path

    @property
    def python(self) -> bool:
        return self.program.suffix == ".py"

    @property
    def slow(self) -> bool:
        return self.python or self.name in SLOW

    @property
    def folder(self) -> Path:
        return STATE / self.name

    def fingerprint(self) -> str:
        return hashlib.sha256(self.program.read_bytes()).hexdigest()[:16]

    def load(self) -> Tally:
        path = self.folder / "tally.json"
        fresh = Tally(self.name, self.fingerprint())
        if not path.exists():
            return fresh
        kept = Tally(**json.loads(path.read_text()))
        return kept if kept.fingerprint == fresh.fingerprint else fresh

    def save(self, tally: Tally) -> None:
        (self.folder / "tally.json").write_text(json.dumps(asdict(tally), indent=1) + "\n")

    def command(self, inputs: int, seed: int) -> list[str]:
        if self.python:
            return [sys.executable, str(TESTS[0] / "fuzz.py"), self.name, "--inputs", str(inputs), "--seed", str(seed)]
        options = [f"-runs={inputs}", f"-seed={seed}", "-verbosity=0", "-max_len=1300", "-timeout=10"]
        return [str(self.program), *options, f"-artifact_prefix={self.folder}/", str(self.folder / "corpus")]


def find_targets(build: Path) -> list[Target]:
    programs = [path for path in build.rglob("fuzz_*") if path.is_file() and os.access(path, os.X_OK)]
    scripts = (script for folder in TESTS for script in folder.glob("*/fuzz_*.py"))
    return [Target(path.stem.removeprefix("fuzz_"), path) for path in sorted([*programs, *scripts])]


def run_slice(target: Target, tally: Tally, inputs: int) -> bool:
    """One slice, counted in the tally; False when the target failed."""
    begin = time.monotonic()
    (target.folder / "corpus").mkdir(parents=True, exist_ok=True)
    done = subprocess.run(target.command(inputs, tally.slices + 1), capture_output=True, text=True)
    tally.seconds += time.monotonic() - begin
    tally.slices += 1
    if done.returncode != 0:
        tally.crashes += 1
        print(f"fuzz: {target.name} failed; see {target.folder}\n{(done.stdout + done.stderr)[-FAILED_TEXT:]}")
    else:
        tally.inputs += inputs
    target.save(tally)
    return done.returncode == 0


def run_target(target: Target, wanted: int, bar: tqdm) -> Tally:
    """Slices until `wanted` inputs are done or one fails."""
    tally = target.load()
    bar.update(min(tally.inputs, wanted))
    while tally.inputs < wanted and tally.crashes == 0:
        rate = tally.inputs / tally.seconds if tally.inputs else FIRST_SLICE / SLICE_S
        inputs = min(wanted - tally.inputs, max(FIRST_SLICE, int(rate * SLICE_S)))
        if run_slice(target, tally, inputs):
            bar.update(inputs)
    return tally


def shares(targets: list[Target], total: int) -> dict[str, int]:
    """How many of the inputs each target gets: few for slow ones, the rest evenly."""
    slow = sum(target.slow for target in targets)
    few = int(total * SLOW_SHARE)
    each = -(-(total - few * slow) // max(1, len(targets) - slow))
    return {target.name: few if target.slow else each for target in targets}


def write_results(tallies: list[Tally], targets: dict[str, dict]) -> None:
    """`targets`: entries of the results file that stay; those of `tallies` are added or take their place."""
    targets = targets | {
        tally.target: {
            "inputs": tally.inputs,
            "crashes": tally.crashes,
            "inputs_per_s": round(tally.inputs / tally.seconds, 1) if tally.seconds else 0,
        }
        for tally in tallies
    }
    data = {
        "inputs": sum(entry["inputs"] for entry in targets.values()),
        "crashes": sum(entry["crashes"] for entry in targets.values()),
        "targets": targets,
    }
    write_result("fuzz", data)
    print(f"fuzz: {data['inputs']} inputs, {data['crashes']} crashes; bench/results/fuzz.json")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build-dir", type=Path, default=ROOT / "build/release")
    parser.add_argument("--total", type=float, default=TOTAL, help="inputs of all targets together (1e8)")
    parser.add_argument("--only", help="the one target of this name")
    parser.add_argument("--jobs", type=int, default=2, help="targets at a time (2)")
    options = parser.parse_args()
    targets = find_targets(options.build_dir.resolve())
    if not targets:
        print(f"fuzz: no fuzz_* in {options.build_dir}; run make build (it needs clang)", file=sys.stderr)
        return 1
    wanted = shares(targets, int(options.total))
    chosen = [target for target in targets if options.only in (None, target.name)]
    if not chosen:
        print(f"fuzz: no target {options.only}; there are {', '.join(wanted)}", file=sys.stderr)
        return 2
    with (
        tqdm(total=sum(wanted[t.name] for t in chosen), unit="input", unit_scale=True) as bar,
        ThreadPoolExecutor(options.jobs) as pool,
    ):
        tallies = list(pool.map(lambda target: run_target(target, wanted[target.name], bar), chosen))
    kept = RESULTS / "fuzz.json"
    others = json.loads(kept.read_text())["targets"] if options.only and kept.exists() else {}
    write_results(tallies, others)
    return 1 if any(tally.crashes for tally in tallies) else 0


if __name__ == "__main__":
    sys.exit(main())
