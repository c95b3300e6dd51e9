"""docs/results.md: at most 20 figures for who asks what this can do, each with its origin; the studies; every chart's
command."""

import json
from collections.abc import Callable
from dataclasses import dataclass

from .markdown import table
from .store import CHARTS, COMMAND_OF_CHART, COMMAND_OF_RESULT, ORIGINS, RESULTS, read_result
from .studies import TRANSPORTS

MOST = 20


@dataclass(frozen=True)
class Headline:
    """A figure of one result: its value, and what stands beside it there."""

    title: str
    unit: str
    result: str  # in bench/results
    value: Callable[[dict], str]
    beside: Callable[[dict], str]


def mm(metres: float) -> str:
    return f"{1000 * metres:.0f}"


def percent(share: float) -> str:
    return f"{100 * share:.1f}"


def family(name: str, key: str, scale: float = 1.0, digits: int = 1) -> Callable[[dict], Callable[[str], str]]:
    """Of a family of nav_tracking: a filter's median of a figure."""

    def of(data: dict) -> Callable[[str], str]:
        return lambda title: f"{scale * data['families'][name][title][key]['median']:.{digits}f}"

    return of


ERROR, TIME = family("anchor", "error_median_m", 1000), family("anchor", "step_us_median", digits=0)
LONG = "bytes, seed 7301"


def long_run(data: dict, name: str) -> str:
    return mm(data[LONG]["filters"][name]["median_m"])


def ring_p50(data: dict) -> dict[str, float]:
    """By transport, one polling reader."""
    of = {"mode": "poll", "pace": "2khz", "readers": 1}
    rows = [row for row in data["rows"] if of.items() <= row.items()]
    return {row["peer"]: row["latency_us"]["p50"] for row in rows}


def next_best(data: dict) -> str:
    p50 = ring_p50(data)
    peer = min(p50.keys() - {"whisker", "memory"}, key=p50.get)
    return f"{TRANSPORTS[peer]}: {p50[peer]:.2f}; bare shared memory: {p50['memory']:.2f}"


def at_lanes(runs: list[dict], lanes: int) -> dict:
    return next(run for run in runs if run["lanes"] == lanes)


def unseen(data: dict) -> dict:
    return {key: sum(f[key] for f in data["families"].values()) for key in ("locked", "runs")}


HEADLINES = (
    Headline(
        "demo, 60 s, seed 1: median position error of the filter `adaptive`",
        "mm",
        "demo",
        lambda d: mm(d["adaptive_error_median_m"]),
        lambda d: (
            f"grid: {mm(d['pose_error_median_m'])}; the paper's foveal grid: {mm(d['foveal_error_median_m'])}; "
            f"odometry alone: {mm(d['odometry_error_median_m'])}"
        ),
    ),
    Headline(
        "whole robot, 30 minutes, seed 7301, level `bytes`: the same",
        "mm",
        "robot_long",
        lambda d: long_run(d, "adaptive"),
        lambda d: f"grid: {long_run(d, 'grid')}; odometry alone: {long_run(d, 'odometry')}",
    ),
    Headline(
        "demo: frames lost with USB faults put in",
        "frames",
        "demo",
        lambda d: str(d["frames_lost"]),
        lambda d: (
            f"sent: {d['frames_sent']}; USB faults: {d['usb_faults_injected']}; bad records put in / reported: "
            f"{d['records_bad_injected']} / {d['records_bad_reported']}"
        ),
    ),
    Headline(
        "demo: texture decisions right, 50 mm inside a tile",
        "%",
        "demo",
        lambda d: percent(d["texture_accuracy"]),
        lambda d: f"near borders too: {percent(d['texture_accuracy_all'])}",
    ),
    Headline(
        "tracking on drawn arenas (family `anchor`): median position error",
        "mm",
        "nav_tracking",
        lambda d: ERROR(d)("adaptive"),
        lambda d: (
            f"50 000 particles: {ERROR(d)('reference')}; grid: {ERROR(d)('grid')}; odometry: {ERROR(d)('odometry')}"
        ),
    ),
    Headline(
        "tracking, the same: CPU time of a row of 0.1 s",
        "us",
        "nav_tracking",
        lambda d: TIME(d)("adaptive"),
        lambda d: f"50 000 particles: {TIME(d)('reference')}; grid: {TIME(d)('grid')}",
    ),
    Headline(
        "start unknown (family `anchor`): runs that find the robot",
        "runs",
        "nav_locks",
        lambda d: "{locked} of {runs}".format_map(d["families"]["anchor+global"]["adaptive"]),
        lambda d: "grid: {locked} of {runs}".format_map(d["families"]["anchor+global"]["grid"]),
    ),
    Headline(
        "families drawn after the filter was made: runs that find the robot",
        "runs",
        "nav_unseen",
        lambda d: "{locked} of {runs}".format_map(unseen(d)),
        lambda d: f"families and starts: {len(d['families'])}",
    ),
    Headline(
        "texture: wrong decisions on drawn floors",
        "%",
        "texture",
        lambda d: percent(d["cost"]["default"]["error"]),
        lambda d: (
            f"the paper's naive Bayes: {percent(d['cost']['naive Bayes (paper)']['error'])}; gradient boosting: "
            f"{percent(d['cost']['gradient boosting']['error'])}"
        ),
    ),
    Headline(
        "radial distance, whisker with a spread of 4 %: standard error",
        "mm",
        "radial",
        lambda d: f"{d['errors']['duration']['0.04']['default']:.2f}",
        lambda d: (
            f"the paper's line: {d['errors']['duration']['0.04']['paper']:.2f}; an oracle that knows the angle: "
            f"{d['errors']['duration']['0.04']['oracle']:.2f}"
        ),
    ),
    Headline(
        "contact filter, a corner while the robot drives: RMS error of the place",
        "mm",
        "contact",
        lambda d: f"{d['kinds']['unknown']['corner, drive']['point_rms_mm']:.2f}",
        lambda d: f"Cramer-Rao bound: {d['kinds']['unknown']['corner, drive']['bound_rms_mm']:.2f}",
    ),
    Headline(
        "ring, publish to one polling reader: median",
        "us",
        "ring",
        lambda d: f"{ring_p50(d)['whisker']:.2f}",
        next_best,
    ),
    Headline(
        "`whiskerd`, 28 lanes at 2 kHz: instructions of a frame",
        "",
        "host",
        lambda d: f"{d['instructions_per_frame']['4']['total']:.0f}",
        lambda d: (
            f"share of the paper's netbook (0.8e9 a second): "
            f"{100 * d['instructions_per_frame']['4']['atom_share']:.1f} %"
        ),
    ),
    Headline(
        "recording, 28 lanes: size of a sample",
        "bytes",
        "record",
        lambda d: f"{d['hour']['bytes_per_sample']:.2f}",
        lambda d: f"on the wire: 8; frames lost in an hour: {d['hour']['lost']} of {d['hour']['frames']}",
    ),
    Headline(
        "simulation, whole chain at RTL level, 6 lanes",
        "times real time",
        "chain_speed",
        lambda d: f"{at_lanes(d['whole_chain'], 6)['realtime_factor']:.2f}",
        lambda d: f"28 lanes: {at_lanes(d['whole_chain'], 28)['realtime_factor']:.2f}",
    ),
    Headline(
        "simulation, bridge and nodes at level `bytes`, 6 lanes",
        "times real time",
        "levels",
        lambda d: f"{at_lanes(d['bytes'], 6)['realtime_factor']:.1f}",
        lambda d: f"gateware at SCK/6: {at_lanes(d['rtl, SCK/6, gap 0.5 us'], 6)['realtime_factor']:.2f}",
    ),
    Headline(
        "node, SYNC to armed record, clock 4 % slow: latest",
        "us",
        "node",
        lambda d: f"{d['armed_us_max']['clocks 4 % slow']:.0f}",
        lambda d: f"tick: 500; equal clocks: {d['armed_us_max']['clocks equal']:.0f}",
    ),
    Headline(
        "USB device under wire faults: frames lost, doubled or wrong",
        "frames",
        "usb_soak",
        lambda d: str(d["gaps"] + d["duplicates"] + d["wrong"] + d["stale"]),
        lambda d: f"frames: {d['frames']}; wire faults: {d['wire_faults']}",
    ),
    Headline(
        "fuzzing: crashes",
        "",
        "fuzz",
        lambda d: str(d["crashes"]),
        lambda d: f"inputs: {d['inputs']}; targets: {len(d['targets'])}",
    ),
    Headline(
        "tests: share of mutated lines that they notice",
        "%",
        "mutants",
        lambda d: percent(d["killed_share"]),
        lambda d: (
            f"{d['killed']} of {d['tried']}; 95 % interval: "
            + " to ".join(percent(bound) for bound in d["killed_share_interval"])
        ),
    ),
)
STUDIES = {  # page, what it holds
    "results/demo.md": "the demo: errors, texture, distances",
    "results/robot.md": "the whole robot: levels of simulation, half an hour, odometry, latency, instructions",
    "results/nav.md": "navigation: every filter, fault by fault; locks, bounds, cost",
    "results/nav_unseen.md": "families of scenes that no filter was made for",
    "results/map.md": "an unknown arena: a map by touch alone, and the pose in it",
    "results/map_peers.md": "other projects' SLAM on rows of touch, and on laser logs with beams cut short",
    "results/archive.md": "studies that are decided, a row each",
    "results/texture.md": "floor texture: faults, recordings, peers",
    "results/radial.md": "radial distance from whole whisks",
    "results/radial_real.md": "radial distance on a real whisker",
    "results/contact.md": "the contact filter",
    "results/mechanics.md": "whisker mechanics beside MuJoCo",
    "results/ring.md": "the ring beside other transports",
    "results/host.md": "host software: plugging in, cost, recording, fuzzing, USB soak",
    "results/simulation.md": "speed of the simulation",
    "results/node_faults.md": "the node's fault matrix",
    "results/node_image.md": "the node's image, executed",
}


def page() -> str:
    origins = json.loads((RESULTS / ORIGINS).read_text())
    rows = []
    for one in HEADLINES:
        data, origin = read_result(one.result), origins[one.result]
        made = f"`{COMMAND_OF_RESULT[one.result]}`"
        rows.append([one.title, one.value(data), one.unit, one.beside(data), made, commit(origin), origin["machine"]])
    return (
        "# Results\n\n"
        "Generated by `tools/benches page` from `bench/results`; all on simulated hardware. Where commit or machine "
        "is not "
        "recorded, the result is older than their recording. It was measured no later than the commit that stored "
        "it.\n\n"
        + table(["figure", "value", "unit", "compared with", "made by", "commit", "machine"], rows)
        + "\n## Studies\n\nEach study has a page with all its figures:\n\n"
        + table(["page", "what"], [[f"[{path}]({path})", what] for path, what in STUDIES.items()])
        + "\n## How to make a chart again\n\n"
        "`make bench` makes all of them; a command below makes one. It goes on where an interrupted run of the same tree ended.\n\n"
        + table(["chart", "command"], charts())
    )


def commit(origin: dict) -> str:
    return f"{origin['commit']}, stored by {origin['stored_by']}" if "stored_by" in origin else origin["commit"]


def charts() -> list[list[str]]:
    return [
        [f"[{name}](charts/{name}.svg)", f"`.venv/bin/python {command}`"]
        for name, command in sorted(COMMAND_OF_CHART.items())
        if (CHARTS / f"{name}.svg").exists()
    ]
