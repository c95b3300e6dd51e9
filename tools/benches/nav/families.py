"""Filters on draws that nobody can have tuned them to: many families of scenes, seeds from the hash of the parent commit.

    tools/benches nav_families --runs 1000 --data DIR                     this tree's default filter, for the page
    tools/benches nav_families --state . --state ../other                 this tree and another, draw by draw
    tools/benches nav_families --state . --state .:adaptive:trust=0       one setting, against the default
    tools/benches nav_families --only contact                             groups and families whose names hold this

States after the first are compared with the first, all of them on the same draws; 200 runs screen, 1 000 decide. What is
done stands in a journal: the same command goes on where it was stopped. DIR holds recordings of others, as
DIR/thymio/random_1; without it their families are left out.
"""

import argparse
import hashlib
import json
import math
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from crunchbot_lab.scenes import write_scene

from .. import store
from ..tables import NONE, lined, table
from .judge import FIGURES, REGIONS, differences, figures, judged
from .states import State, stated
from .worlds import RECORDINGS, Family, all_families, recordings_option

CHANCE_DRAWS = 10  # of fewer the spread says little
# What draws and figures follow from, beside the states.
MADE_BY = ("tools/benches/nav/worlds.py", "tools/benches/nav/judge.py", "lab/crunchbot_lab/scenes")

KEPT = ("locked", "rows", "error_mm", "sure_wrong", "log_score")  # of every draw, in the stored result


def parent_commit() -> str:
    """Of what is measured: of the last commit, or that one where there are changes since."""

    def git(*words: str) -> str:
        done = subprocess.run(["git", *words], cwd=store.ROOT, capture_output=True, text=True, check=True)
        return done.stdout.strip()

    changed = git("status", "--porcelain", "--untracked-files=no")
    return git("rev-parse", "HEAD" if changed else "HEAD^")


def seed_of(parent: str, family: str, draw: int) -> int:
    return int.from_bytes(hashlib.sha256(f"{parent} {family} {draw}".encode()).digest()[:4], "big")


def drawn(family: Family, seed: int, states: Sequence[State]) -> list[dict]:
    """Figures of each state on one draw; the first state is a different one with each seed."""
    made = family.make(seed)
    found: list[dict] = [{}] * len(states)
    with tempfile.TemporaryDirectory() as name:
        write_scene(name, made.scene, made.observations)
        for n in range(len(states)):
            at = (n + seed) % len(states)
            found[at] = judged(made, states[at].answer(Path(name), seed, REGIONS), family.folds)
    return found


def journal_path(parent: str, states: Sequence[State]) -> Path:
    whole = json.dumps([parent, store.state(*MADE_BY), *(state.identity() for state in states)])
    return store.BENCH / "families" / f"{hashlib.sha256(whole.encode()).hexdigest()[:16]}.jsonl"


def kept(path: Path) -> dict[tuple[str, int], list[dict]]:
    """Of a journal, by family and draw; a last line that was cut off is not there."""
    if not path.exists():
        return {}
    whole, _, cut = path.read_text().rpartition("\n")
    if cut:
        path.write_text(f"{whole}\n" if whole else "")
    return {(one["family"], one["draw"]): one["states"] for one in map(json.loads, whole.splitlines())}


def measure(families: dict[str, Family], runs: int, parent: str, states: Sequence[State]) -> dict[str, list]:
    """By family, of each draw the figures of each state. Families take turns, so that a part is a part of each."""
    path = journal_path(parent, states)
    done = kept(path)
    jobs = [(name, n) for n in range(-(-runs // len(families))) for name in families][:runs]
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as journal, tqdm(total=len(jobs), desc="nav_families", unit="run") as bar:
        for name, n in jobs:
            if (name, n) not in done:
                seed = seed_of(parent, families[name].seed_of or name, n)
                done[name, n] = drawn(families[name], seed, states)
                journal.write(json.dumps({"family": name, "draw": n, "seed": seed, "states": done[name, n]}) + "\n")
                journal.flush()
            bar.update()
    print(f"every draw: {path}", flush=True)
    out: dict[str, list] = {}
    for name, n in jobs:
        out.setdefault(name, []).append(done[name, n])
    return out


def summed_up(families: dict[str, Family], found: dict[str, list], states: Sequence[State]) -> dict:
    """By state, then by family and over all: figures, and differences from the first state."""
    groups = {f"all of '{group}'": [] for group in dict.fromkeys(families[name].group for name in found)}
    for name, draws in found.items():
        groups[f"all of '{families[name].group}'"] += draws
    parts = found | groups | {"all": [draw for draws in found.values() for draw in draws]}
    out = {}
    for n, state in enumerate(states):
        shown = out[state.words] = {}
        for name, draws in parts.items():
            mine, base = [draw[n] for draw in draws], [draw[0] for draw in draws]
            shown[name] = figures(mine) | ({"against": differences(mine, base)} if n else {})
    return out


def against(parts: dict[str, dict]) -> str:
    """Differences and twice their standard errors, of error and time ratios and their bounds; a star where that is more
    than chance. Fewer draws than CHANCE_DRAWS tell no standard error."""

    def star(mean: float, error: float, draws: int) -> str:
        return " *" if draws >= CHANCE_DRAWS and abs(mean) > 2.0 * error else ""

    def difference(scale: float, mean: float, error: float, draws: int) -> str:
        return f"{scale * mean:+.3g} +- {2.0 * scale * error:.2g}{star(mean, error, draws)}" if draws > 1 else NONE

    def ratio(mean: float, error: float, draws: int) -> str:
        low, middle, high = (math.exp(mean + n * error) for n in (-2.0, 0.0, 2.0))
        return f"{middle:.2f} ({low:.2f}-{high:.2f}){star(mean, error, draws)}" if draws > 1 else NONE

    differing = {"locked": ("locked, %", 100.0), "log_score": ("log score", 1.0)}
    differing |= {"sure_wrong": ("sure and wrong, %", 100.0), "coverage": ("90 % region holds, %", 100.0)}
    rows = [
        [name, *(difference(scale, *one["against"][key]) for key, (_, scale) in differing.items())]
        + [ratio(*one["against"][key]) for key in ("error", "time")]
        for name, one in parts.items()
    ]
    return table(["family", *(title for title, _ in differing.values()), "error, ratio", "time, ratio"], rows)


def report(summary: dict) -> str:
    text = []
    for n, (words, parts) in enumerate(summary.items()):
        text += [
            f"state {words}",
            lined([{"family": name} | one for name, one in parts.items()], {"family": "{family}"} | FIGURES),
        ]
        if n:
            text += [f"{words} less {next(iter(summary))}, +- two standard errors", against(parts)]
    return "\n".join(text)


def chosen(every: dict[str, Family], only: Sequence[str]) -> dict[str, Family]:
    """Families whose name or group holds one of these words; without words all."""
    families = {k: f for k, f in every.items() if not only or any(word in k or word in f.group for word in only)}
    if not families:
        raise SystemExit(f"--only {' '.join(only)}: no family; the names are {', '.join(every)}")
    return families


def run(
    _build: Path,
    runs: int = 200,
    state: Sequence[str] = (),
    data: Path | None = None,
    only: Sequence[str] = (),
    parent: str | None = None,
) -> None:
    states = [stated(words) for words in state or [str(store.ROOT)]]
    if data is None:
        store.leave_out("real runs", f"give --data DIR or {RECORDINGS}, the folder of the logs")
    families = chosen(all_families(data), only)
    commit = parent or parent_commit()
    print(f"draws of commit {commit}", flush=True)
    found = measure(families, runs, commit, states)
    summary = summed_up(families, found, states)
    print(report(summary))
    if not state and not only:
        every = {name: [[draw[0][key] for key in KEPT] for draw in draws] for name, draws in found.items()}
        result = {"draws_of": commit, "families": next(iter(summary.values())), "of_a_draw": KEPT, "draws": every}
        store.write_result("nav_families", result)


def draw_options(parser: argparse.ArgumentParser, runs: int) -> None:
    """Which draws a bench of filters makes."""
    parser.add_argument("--runs", type=int, default=runs, help="of all families together (default: %(default)s)")
    recordings_option(parser)
    parser.add_argument("--only", action="append", default=[], help="families or groups; may be repeated")
    parser.add_argument("--parent", metavar="COMMIT", help="whose draws; default: the parent of what is measured")


def options(parser: argparse.ArgumentParser) -> None:
    draw_options(parser, 200)
    parser.add_argument("--state", action="append", default=[], metavar="TREE[:FILTER[:KEY=VALUE,...]]")
