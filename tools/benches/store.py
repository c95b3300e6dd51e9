"""Where the benches leave what they measure: results with their origin, charts, and the command that makes each of
them.

A chart is an SVG file: it is text, the same data give the same file, and git stores it in a fifth of the size of a PNG.
"""

import json
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from crunchbot_lab.report.origin import commit, machine

from .markdown import wrap

ROOT = Path(__file__).resolve().parents[2]
RESULTS, CHARTS = ROOT / "bench/results", ROOT / "docs/charts"
ORIGINS = "origins.json"  # in the folder of the results: file -> commit and machine

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
    "tools/benches levels": (("levels",), ("levels_speed",)),
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
    "tools/benches nav_paper": (("nav_paper",), ("nav_banana", "nav_fig6a", "nav_fig6b", "nav_fig6c")),
    "tools/benches nav_peers": (("nav_peers",), ()),
    "tools/benches nav_size": (("nav_size",), ("nav_size",)),
    "tools/benches nav_unseen": (("nav_unseen",), ()),
    "tools/benches nav_unseen --leave": (("nav_left_out",), ()),
    "tools/benches node": (("node", "node_cuts", "node_faults"), ("node_age", "node_link", "node_skew")),
    "tools/benches normals": (("nav_normals",), ()),
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
    path.write_text(json.dumps(dict(sorted(origins.items())), indent=1) + "\n")


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


def write_page(path: Path, text: str) -> None:
    """A page whose lines are short enough."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(wrap(text))
