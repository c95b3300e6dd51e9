"""Draws mutants of the committed tree at random and tests each: PYTHONPATH=tests python -m mutants --count 300 --seed 1

Each mutant first meets its nearest tests; one that survives them meets every test that can reach its file. Work is
done in a clone, so the tree stays as it is. Results are appended to a file of their own for each commit and seed, from
which a stopped run goes on. A mutant that does not compile is none: another is drawn. A test that fails counts when it
fails a second time, alone, so that a test that failed by chance kills nothing.
"""

import argparse
import ctypes
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from itertools import count as counter
from pathlib import Path

from tqdm import tqdm

from .nearest import BUILD, SLOW_PROGRAMS, Step, steps_for
from .operators import Mutant, mutants_of
from .report import summarise

ROOT = Path(__file__).resolve().parents[2]
SHARES = {"c": 0.45, "py": 0.4, "v": 0.15}  # of the draw, by language
PRODUCT = ("firmware/dspic", "fpga/bridge_rtl", "host")
NOT_PRODUCT = re.compile(r"/tests?/|/examples/|/gen/|/bench|/fuzz|/model/")
TIMEOUTS_S = (
    300.0,
    1800.0,
)  # for one command of the nearest tests, and of the others; a mutant that hangs is killed by it
PR_SET_CHILD_SUBREAPER = 36  # linux/prctl.h


class Unbuildable(Exception):
    """A mutant that the compiler refuses."""


def _end_children() -> None:
    """Kill every child of this process, those too that a broken program left to it (see main)."""
    listed = Path(f"/proc/self/task/{os.getpid()}/children")
    while children := listed.read_text().split():
        for pid in map(int, children):
            with suppress(ProcessLookupError, ChildProcessError):
                os.kill(pid, signal.SIGKILL)
                os.waitpid(pid, 0)


class Tree:
    """A clone of the committed tree, built; a mutant lives in it for the length of its tests."""

    def __init__(self, folder: Path, commit: str):
        """`folder` is made when it is not there, brought to `commit`, and built."""
        self.folder, self._timeout_s = folder, TIMEOUTS_S[-1]
        if not folder.exists():
            subprocess.run(["git", "clone", "--quiet", ROOT, folder], check=True)
            (folder / ".venv").symlink_to(ROOT / ".venv")
        for words in (["fetch", "--quiet", "origin", commit], ["checkout", "--quiet", "--force", commit]):
            subprocess.run(["git", *words], cwd=folder, check=True)
        for preset in ("release", "asan"):
            if not (folder / "build" / preset / "build.ninja").exists():
                self.run("cmake", "--preset", preset)
        if not self.run("tools/build.sh", BUILD)[0] or not self.run("cmake", "--build", "build/asan")[0]:
            sys.exit("mutants: the tree does not build; run 'make build' and mend what it names")

    def run(self, *words: str) -> tuple[bool, str]:
        """Whether a command ended well, and what it wrote. One that takes too long has failed."""
        # No bytecode: what was compiled of a mutant must not stand for the file restored within the same second.
        environment = os.environ | {"WHISKER_BUILD": BUILD, "PYTHONDONTWRITEBYTECODE": "1"}
        environment["PYTHONPATH"] = os.pathsep.join(
            str(self.folder / place) for place in ("host/python", "lab", "protocol")
        )
        with tempfile.TemporaryFile("w+", errors="replace") as output:
            process = subprocess.Popen(
                words,
                cwd=self.folder,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )
            try:
                good = process.wait(timeout=self._timeout_s) == 0
            except subprocess.TimeoutExpired:
                good = False
                output.write("timeout")
            process.kill()
            process.wait()
            _end_children()
            output.seek(0)
            return good, output.read()

    def first_red(self, step: Step) -> str:
        """The first test of a step that fails, and fails again alone; empty: none. Unbuildable: it does not compile."""
        if step.build and not self._build("release", step.build):
            raise Unbuildable
        for folder in step.ctest:
            if red := self._ctest(f"{BUILD}/{folder}"):
                return red
        if step.sanitizers and self._build("asan", ("all",)) and (red := self._ctest("build/asan")):
            return f"asan {red}"
        return self._pytest(step.pytest)

    def _build(self, preset: str, targets: tuple[str, ...]) -> bool:
        if not self.run("cmake", "--build", f"build/{preset}", "--target", *targets)[0]:
            return False
        return preset != "release" or targets != ("all",) or self.run("tools/build.sh", BUILD)[0]

    def _ctest(self, folder: str) -> str:
        words = ["ctest", "--test-dir", folder, "--stop-on-failure", "--timeout", "120"]
        good, output = self.run(*words, "--parallel", "2", "--exclude-regex", SLOW_PROGRAMS)
        found = re.search(r"^\s*\d+ - (\S+) \(", output, re.M)
        if good or not found:
            return ""
        good, _ = self.run(*words, "--tests-regex", f"^{re.escape(found[1])}$")
        return "" if good else found[1]

    def _pytest(self, paths: tuple[str, ...]) -> str:
        if not paths:
            return ""
        words = [
            ".venv/bin/python",
            "-m",
            "pytest",
            "-x",
            "--no-header",
            "-p",
            "no:cacheprovider",
            "-rfE",
        ]
        spread = ["--numprocesses", "2", "--dist", "loadfile"] if len(paths) > 1 else []
        for _ in range(2):
            good, output = self.run(*words, *spread, *paths)
            found = re.search(r"^(?:FAILED|ERROR) (\S+)", output, re.M)
            if good:
                return ""
            if not found:
                return "timeout" if output.endswith("timeout") else f"pytest: {output.strip().splitlines()[-1]:.100}"
            if not self.run(*words, found[1])[0]:
                return found[1]
        return ""

    def try_one(self, mutant: Mutant, near_only: bool) -> dict:
        """Mutate, test, restore; what became of it."""
        path, began = self.folder / mutant.file, time.monotonic()
        text = path.read_text()
        path.write_text(mutant.apply(text))
        red, step = "", 0
        try:
            for step, tests in enumerate(steps_for(self.folder, mutant.file)[: 1 if near_only else None]):  # noqa: B007
                self._timeout_s = TIMEOUTS_S[step > 0]
                if red := self.first_red(tests):
                    break
            outcome = "killed" if red else "survived"
        except Unbuildable:
            outcome = "invalid"
        finally:
            path.write_text(text)
        spent = round(time.monotonic() - began, 1)
        line = text.splitlines()[mutant.line - 1].strip()
        reported = {
            "file": mutant.file,
            "line": mutant.line,
            "text": line,
            "before": mutant.before,
            "after": mutant.after,
        }
        return reported | {"outcome": outcome, "red": red, "step": step, "near_only": near_only, "seconds": spent}


def hash_of(commit: str) -> str:
    """The whole hash of a commit of this tree."""
    words = ["git", "rev-parse", "--verify", f"{commit}^{{commit}}"]
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def draw(root: Path, seed: int):
    """Mutants without end, by SHARES; each once."""
    listed = subprocess.run(["git", "ls-files", *PRODUCT], cwd=root, capture_output=True, text=True, check=True)
    files = [file for file in listed.stdout.split() if not NOT_PRODUCT.search(file)]
    chance, pools = random.Random(seed), {}
    for language in SHARES:
        suffixes = (".c", ".h") if language == "c" else (f".{language}",)
        mine = [file for file in files if file.endswith(suffixes)]
        pools[language] = [mutant for file in mine for mutant in mutants_of(file, (root / file).read_text())]
        chance.shuffle(pools[language])
    while all(pools.values()):
        (language,) = chance.choices(list(SHARES), list(SHARES.values()))
        yield pools[language].pop()


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="mutants", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=300, help="mutants that compile (300)")
    parser.add_argument("--seed", type=int, default=1, help="of the draw (1)")
    parser.add_argument("--commit", type=hash_of, default="HEAD", help="which to mutate (HEAD)")
    parser.add_argument("--out", type=Path, default=ROOT / "build/mutants", help="clone and results (build/mutants)")
    parser.add_argument("--near", action="store_true", help="only the nearest tests; survivors wait for a run without")
    parser.add_argument("--least", type=float, default=0.9, help="exit code 1 when a smaller share is killed (0.9)")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    results = options.out / f"{options.commit[:12]}-seed{options.seed}.jsonl"
    known = _read(results)
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)  # orphans below this process become its children
    tree = Tree(options.out.resolve() / "tree", options.commit)
    with tqdm(total=options.count, unit="mutant", smoothing=0) as bar:
        valid = 0
        for number, mutant in zip(counter(), draw(tree.folder, options.seed), strict=False):
            if valid == options.count:
                break
            if not _settled(known.get(number), options.near):
                known[number] = {"number": number} | tree.try_one(mutant, options.near)
                with results.open("a") as file:
                    file.write(json.dumps(known[number]) + "\n")
            if known[number]["outcome"] != "invalid":
                valid += 1
                bar.update()
    summary = summarise([known[number] for number in sorted(known)], options.seed, options.commit)
    (options.out / "mutants.json").write_text(json.dumps(summary, indent=1) + "\n")
    print(summary["line"])
    return int(summary["killed_share"] < options.least)


def _read(results: Path) -> dict[int, dict]:
    """What an earlier run found, by number of the draw; of two results of one mutant the later holds."""
    lines = results.read_text().splitlines() if results.exists() else []
    return {entry["number"]: entry for entry in map(json.loads, lines)}


def _settled(entry: dict | None, near_only: bool) -> bool:
    """Whether a mutant needs no test any more: one that survived its nearest tests may still have to meet the others."""
    return entry is not None and (near_only or entry["outcome"] != "survived" or not entry["near_only"])


if __name__ == "__main__":
    sys.exit(main())
