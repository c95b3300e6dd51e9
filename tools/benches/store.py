"""Where the benches leave what they measure: results with their origin, charts, and the command that makes each of
them; measurements that are done, kept for a run that goes on; and what a topic reports of itself.

A chart is an SVG file: it is text, the same data give the same file, and git stores it in a fifth of the size of a PNG.
"""

import hashlib
import json
import re
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from crunchbot_lab.report.origin import WRITTEN, commit, machine

ROOT = Path(__file__).resolve().parents[2]
RESULTS, CHARTS = ROOT / "bench/results", ROOT / "docs/charts"
ORIGINS = "origins.json"  # in the folder of the results: file -> commit and machine
BENCH = ROOT / "build/bench"  # peers' programs and environments, and by the state of the tree what is measured

# Command -> results in bench/results, charts in docs/charts.
MAKES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "tools/benches bridge": (("bridge",), ()),
    "tools/benches chain": (("chain_speed", "demo"), ("demo_arena", "demo_errors", "demo_radial", "demo_texture")),
    "tools/benches contact": (("contact",), ()),
    "tools/benches damage": (("damage",), ()),
    "tools/benches floors": (("floors",), ()),
    "tools/benches host": (("host",), ()),
    "tools/benches image": (("node_image",), ()),
    "tools/benches levels": (("levels",), ()),
    "tools/benches map": (("map",), ()),
    "tools/benches map_peers": (("map_peers",), ()),
    "tools/benches mechanics": (("mechanics",), ()),
    "tools/benches nav": (("nav_matrix", "nav_pareto"), ()),
    "tools/benches nav_families": (("nav_families",), ()),
    "tools/benches nav_filters": (("nav_filters",), ("nav_filters",)),
    "tools/benches nav_worth": (("nav_worth",), ()),
    "tools/benches nav_peers": (("nav_peers",), ()),
    "tools/benches node": (("node", "node_cuts", "node_faults"), ()),
    "tools/benches pico": (("pico",), ()),
    "tools/benches radial": (("radial",), ("radial_fig5",)),
    "tools/benches record": (("record",), ()),
    "tools/benches ring": (("ring",), ()),
    "tools/benches robot": (("robot_long",), ("robot_long",)),
    "tools/benches texture": (("texture",), ()),
    "tools/benches timing": (("bridge_timing",), ()),
    "tools/benches usb": (("usb_soak",), ()),
    "tools/fuzz.py": (("fuzz",), ()),
    "make mutants": (("mutants",), ()),
    "python -m drills": (("drills",), ()),
}
COMMAND_OF_RESULT = {name: command for command, (results, _) in MAKES.items() for name in results}
COMMAND_OF_CHART = {name: command for command, (_, charts) in MAKES.items() for name in charts}


WIDTH = 400  # of a line of a result, at most, where it has parts
ERROR, LINKER = re.compile(r"\berror\b|cannot find|not found", re.IGNORECASE), re.compile(r"\bl?ld: ")


@cache
def state(*parts: str) -> str:
    """Digest of the tracked files as they are, or of these folders and files alone."""
    names = tracked(*(parts or (".", *WRITTEN)))
    there = "".join(f"{name}\n" for name in names if (ROOT / name).is_file())
    return hashlib.sha256(f"{there}{_git('hash-object', '--stdin-paths', input=there)}".encode()).hexdigest()[:12]


def tracked(*parts: str) -> list[str]:
    """Names of the files that git has, or of those below these folders."""
    return _git("ls-files", "--", *parts).splitlines()


def _git(*words: str, **options) -> str:
    """What git says; nothing where it fails."""
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False, **options)
    return "" if done.returncode else done.stdout.strip()


def kept(topic: str, *inputs: str) -> Path:
    """The folder of a topic's measurements of this state of the tree. `inputs`: all that the measurement follows from, if
    it comes out the same whenever they are the same."""
    return BENCH / "kept" / state(*inputs) / topic


def once(path: Path, measure: Callable[[], object]):
    """A measurement, from its file if an earlier run has made it."""
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        made = path.with_suffix(".part")
        made.write_text(json.dumps(measure(), indent=1, default=float) + "\n")
        made.rename(path)  # whole, or not there
    return json.loads(path.read_text())


def failure(*commands: tuple | list, **options) -> str:
    """The error of the first of these commands that fails, one line; empty: none did. `options`: as subprocess.run's."""
    for command in commands:
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **options)
        if done.returncode != 0:
            lines = [line.strip() for line in (done.stdout + done.stderr).splitlines() if line.strip()]
            errors = [line for line in lines if ERROR.search(line)]
            # The linker's line says what is missing; the compiler's, that linking failed.
            return next(iter(sorted(errors, key=lambda line: not LINKER.search(line))), "") or (
                lines[-1] if lines else f"exit code {done.returncode}"
            )
    return ""


def leave_out(name: str, error: str) -> None:
    """Reports a peer, or a part whose data are not here, that is not measured."""
    print(f"left out: {name}: {error}", flush=True)


def read_result(name: str):
    return json.loads((RESULTS / f"{name}.json").read_text())


def text_of(value, indent: str = "") -> str:
    """JSON; what fits in a line stays in one."""
    short = json.dumps(value)
    if len(indent) + len(short) <= WIDTH or not isinstance(value, (dict, list)):
        return short
    inner = f"{indent} "
    if isinstance(value, list):
        parts, ends = [text_of(part, inner) for part in value], "[]"
    else:
        parts, ends = [f"{json.dumps(str(key))}: {text_of(part, inner)}" for key, part in value.items()], "{}"
    return ends[0] + ",".join(f"\n{inner}{part}" for part in parts) + f"\n{indent}{ends[1]}"


def write_result(name: str, data, folder: Path = RESULTS) -> None:
    """The file of a result, and where it comes from."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.json").write_text(text_of(data) + "\n")
    record_origin(name, folder)


def record_origin(name: str, folder: Path = RESULTS) -> None:
    """For a result whose file another program writes."""
    path = folder / ORIGINS
    origins = json.loads(path.read_text()) if path.exists() else {}
    origins[name] = {"commit": commit(), "machine": machine()}
    path.write_text(text_of(dict(sorted(origins.items()))) + "\n")


def write_chart(name: str, drawn: Figure | str, folder: Path = CHARTS) -> None:
    """A figure, or the text of one that is SVG already."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.svg"
    if isinstance(drawn, str):
        path.write_text(drawn)
        return
    salt = matplotlib.rcParams["svg.hashsalt"] or "whisker"
    with matplotlib.rc_context({"svg.hashsalt": salt}):
        drawn.savefig(path, metadata={"Date": None})
