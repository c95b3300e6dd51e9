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

from .markdown import wrap

ROOT = Path(__file__).resolve().parents[2]
RESULTS, CHARTS = ROOT / "bench/results", ROOT / "docs/charts"
ORIGINS = "origins.json"  # in the folder of the results: file -> commit and machine
BENCH = ROOT / "build/bench"  # peers' programs and environments, and by the state of the tree what is measured

# Command -> results in bench/results, charts in docs/charts.
MAKES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "tools/benches bridge": (("bridge",), ("bridge_lanes",)),
    "tools/benches chain": (
        ("chain_speed", "demo", "localisation"),
        ("chain_speed", "demo_arena", "demo_errors", "demo_radial", "demo_texture", "localisation"),
    ),
    "tools/benches contact": (("contact",), ("contact_errors",)),
    "tools/benches damage": (("damage",), ()),
    "tools/benches host": (("host",), ("host_cable", "host_clock")),
    "tools/benches image": (("node_image",), ()),
    "tools/benches levels": (("levels", "levels_shares"), ("levels_shares", "levels_speed")),
    "tools/benches map": (("map",), ("map", "map_growing")),
    "tools/benches map_peers": (("map_peers",), ("map_peers",)),
    "tools/benches mechanics": (
        ("mechanics", "mechanics_edges"),
        ("mechanics_edges", "mechanics_moment", "mechanics_speed"),
    ),
    "tools/benches nav": (
        (
            *("nav_pareto", "nav_cost", "nav_tracking", "nav_locks", "nav_budgets", "nav_balance", "nav_variation"),
            *("nav_matrix", "nav_soak", "nav_passes"),
        ),
        (
            *("nav_confidence", "nav_cost", "nav_honesty", "nav_locks", "nav_matrix", "nav_pareto", "nav_regions"),
            "nav_variation",
        ),
    ),
    "tools/benches nav_peers": (("nav_peers",), ()),
    "tools/benches nav_unseen": (("nav_unseen",), ()),
    "tools/benches nav_unseen --leave": (("nav_left_out",), ()),
    "tools/benches node": (("node", "node_cuts", "node_faults"), ("node_age", "node_link", "node_skew")),
    "tools/benches pace": (("pace",), ()),
    "tools/benches radial": (("radial",), ("radial_cost", "radial_fig5")),
    "tools/benches radial --whisker3d DIR": (("radial_real",), ()),
    "tools/benches record": (("record",), ("record_cost",)),
    "tools/benches restart": (("restart",), ()),
    "tools/benches ring": (("ring",), ("ring_latency", "ring_throughput", "ring_writer")),
    "tools/benches robot": (
        ("robot_instructions", "robot_latency", "robot_levels", "robot_long", "robot_odometry"),
        ("robot_latency", "robot_level_pairs", "robot_levels", "robot_long", "robot_odometry"),
    ),
    "tools/benches texture": (("texture",), ("texture_cost", "texture_course", "texture_time")),
    "tools/benches timing": (("bridge_timing",), ()),
    "tools/benches touch": (("touch",), ("touch",)),
    "tools/benches usb": (("usb_soak",), ("usb_soak",)),
    "tools/benches view": (("view",), ("view_cost",)),
    "tools/fuzz.py": (("fuzz",), ()),
    "no command: builds of their own": (("nav_ablations", "nav_designs"), ()),
    "make mutants": (("mutants",), ()),
    "python -m drills": (("drills",), ()),
}
COMMAND_OF_RESULT = {name: command for command, (results, _) in MAKES.items() for name in results}
COMMAND_OF_CHART = {name: command for command, (_, charts) in MAKES.items() for name in charts}


ERROR, LINKER = re.compile(r"\berror\b|cannot find|not found", re.IGNORECASE), re.compile(r"\bld: ")
WROTE: list[str] = []  # results of this process
LEFT_OUT: dict[str, str] = {}  # peers and parts of this process that could not be measured, each with its own error


@cache
def state(*parts: str) -> str:
    """Digest of the tracked files as they are, or of these folders and files alone."""
    names = _git("ls-files", "--", *(parts or (".", *WRITTEN))).splitlines()
    there = "".join(f"{name}\n" for name in names if (ROOT / name).is_file())
    return hashlib.sha256(f"{there}{_git('hash-object', '--stdin-paths', input=there)}".encode()).hexdigest()[:12]


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
    LEFT_OUT[name] = error
    print(f"left out: {name}: {error}", flush=True)


def read_result(name: str):
    return json.loads((RESULTS / f"{name}.json").read_text())


def write_result(name: str, data, folder: Path = RESULTS) -> None:
    """The file of a result, and where it comes from."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.json").write_text(json.dumps(data, indent=1) + "\n")
    record_origin(name, folder)


def record_origin(name: str, folder: Path = RESULTS) -> None:
    """For a result whose file another program writes."""
    path = folder / ORIGINS
    origins = json.loads(path.read_text()) if path.exists() else {}
    origins[name] = {"commit": commit(), "machine": machine()}
    WROTE.append(name)
    path.write_text(json.dumps(dict(sorted(origins.items())), indent=1) + "\n")


def adopt(names: list[str], folder: Path = RESULTS) -> None:
    """Results that were measured in the present state of the tree, maybe at an earlier commit, are of this one, too."""
    path = folder / ORIGINS
    origins = json.loads(path.read_text())
    now = commit()
    if any(origins[name]["commit"] != now for name in names):
        for name in names:
            origins[name]["commit"] = now
        path.write_text(json.dumps(origins, indent=1) + "\n")


def write_chart(name: str, drawn: Figure | str, folder: Path = CHARTS, *, letters: bool = False) -> None:
    """A figure, or the text of one that is SVG already. letters: its words are written as text, not as outlines."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.svg"
    if isinstance(drawn, str):
        path.write_text(drawn)
        return
    salt = matplotlib.rcParams["svg.hashsalt"] or "whisker"
    with matplotlib.rc_context({"svg.hashsalt": salt} | ({"svg.fonttype": "none"} if letters else {})):
        drawn.savefig(path, metadata={"Date": None})


def write_page(path: Path, text: str) -> None:
    """A page whose lines are short enough."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(wrap(text))
