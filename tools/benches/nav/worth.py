"""What each of several settings is worth: all of them are switched at once, each in half of the runs of every draw.

    tools/benches nav_worth --runs 430 --data DIR                                      the mechanisms of `adaptive`
    tools/benches nav_worth --switch worth.budget=0                                    one alone
    tools/benches nav_worth --filter grid --switch worth.trust=0                       of another filter

The filters have no such settings: the bench compiles a copy of this tree that has them, by the patch beside it.
On each draw as many states run as a Hadamard matrix has rows; a setting's worth is what the states that have it differ by
from those that do not, so that every run tells of every setting: for seven of them a quarter of the runs that one after
the other would take. The second half of the draws runs the opposite states: then no pair of settings that matter together
is taken for a third one. Draws, journal and --data: as of nav_families.
"""

import argparse
import math
import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .. import store
from .families import against, chosen, draw_options, measure, parent_commit
from .judge import COMPARED
from .states import stated
from .worlds import Family, all_families

MOST = 7  # settings: eight states a draw
SWITCHES = tuple(f"worth.{name}=0" for name in ("trust", "map", "repeat", "modes", "levels", "gains", "gaps"))
PATCH = Path(__file__).with_suffix(".patch")
COMPILE = (  # what a state's module is made of
    "cmake --preset release",
    "cmake --build build/release --target whisker_static nav create",
    ".venv/bin/python host/python/crunchbot/build_ffi.py --build-dir build/release",
)


def switchable() -> Path:
    """A copy of this tree whose filters have the switches, compiled."""
    tree = store.BENCH / "worth"
    for file in filter(Path.is_file, (store.ROOT / name for name in store.tracked())):
        copy = tree / file.relative_to(store.ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(file, copy)
    if not (tree / ".venv").exists():
        (tree / ".venv").symlink_to(store.ROOT / ".venv")
    alone = os.environ | {"GIT_CEILING_DIRECTORIES": str(tree.parent)}  # else git takes the paths for this tree's
    for words in (f"git apply {PATCH}", *COMPILE):
        subprocess.run(words.split(), cwd=tree, env=alone, check=True)
    return tree


def hadamard(settings: int) -> np.ndarray:
    """(states, settings) of +-1, a column a setting, each orthogonal to the others and to a constant; the first row is 1."""
    matrix = np.ones((1, 1), int)
    while matrix.shape[1] <= settings:
        matrix = np.block([[matrix, matrix], [matrix, -matrix]])
    return matrix[:, 1 : settings + 1]


def worth(draws: Sequence[list[dict]], has: Sequence[np.ndarray]) -> dict[str, list[float]]:
    """Of one setting: mean over draws of what states that have it differ by, standard error, and number of draws that tell.
    has[n]: (states,) +1 where the states of draw n have it."""
    out = {}
    for name, value in COMPARED.items():
        off = []
        for states, sign in zip(draws, has, strict=True):
            given = np.array([np.nan if (v := value(state)) is None else v for state in states])
            on, without = given[sign > 0], given[sign < 0]
            if np.isfinite(on).any() and np.isfinite(without).any():
                off.append(np.nanmean(on) - np.nanmean(without))
        error = float(np.std(off, ddof=1) / math.sqrt(len(off))) if len(off) > 1 else math.nan
        out[name] = [float(np.mean(off)) if off else math.nan, error, len(off)]
    return out


def by_part(
    families: dict[str, Family], found: Sequence[tuple[str, list[dict], np.ndarray]], settings: Sequence[str]
) -> dict:
    """By setting, then by group and over all. found: of each draw its family, its states' figures, and the matrix."""
    parts: dict[str, list] = {}
    for name, states, signs in found:
        for part in (f"all of '{families[name].group}'", "all"):
            parts.setdefault(part, []).append((states, signs))
    return {
        setting: {
            part: {"against": worth([states for states, _ in draws], [signs[:, n] for _, signs in draws])}
            for part, draws in parts.items()
        }
        for n, setting in enumerate(settings)
    }


def run(
    _build: Path,
    switch: Sequence[str],
    filter: str,
    runs: int,
    data: Path | None,
    only: Sequence[str],
    parent: str | None,
) -> None:
    switch = switch or SWITCHES
    if len(switch) > MOST:
        raise SystemExit(f"--switch: {len(switch)} settings; give {MOST} at most")
    families, commit, found, tree = chosen(all_families(data), only), parent or parent_commit(), [], switchable()
    for half, signs in enumerate((hadamard(len(switch)), -hadamard(len(switch)))):
        words = [",".join(key for key, sign in zip(switch, row, strict=True) if sign > 0) for row in signs]
        states = [stated(f"{tree}:{filter}:{one}") for one in words]
        draws = measure(families, runs // 2, f"{commit} {half}", states)
        found += [(name, one, signs) for name, each in draws.items() for one in each]
    summary = by_part(families, found, switch)
    for setting, parts in summary.items():
        print(f"with {setting} less without it, +- two standard errors\n{against(parts)}")
    if switch == SWITCHES and not only:
        store.write_result("nav_worth", {"draws_of": commit, "draws": len(found), "settings": summary})


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--switch", action="append", default=[], metavar="KEY=VALUE", help=f"up to {MOST} (default: {SWITCHES})"
    )
    parser.add_argument("--filter", default="adaptive", help="(default: %(default)s)")
    draw_options(parser, 430)
