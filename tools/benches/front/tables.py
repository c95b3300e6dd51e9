"""Tables of docs/results.md: the figures for who asks what this can do, each with its origin; every chart's command."""

import json
from collections.abc import Callable
from dataclasses import dataclass

from ..host.ring import PEERS
from ..store import CHARTS, COMMAND_OF_CHART, COMMAND_OF_RESULT, ORIGINS, RESULTS, read_result
from ..tables import table


@dataclass(frozen=True)
class Headline:
    """A figure of one result: its value, and what stands beside it there."""

    title: str
    unit: str
    result: str  # in bench/results
    value: Callable[[dict], str]
    beside: Callable[[dict], str]


def text(pattern: str, *path: str) -> Callable[[dict], str]:
    """A pattern of str.format with what the keys on the path lead to."""

    def of(data: dict) -> str:
        for key in path:
            data = data[key]
        return pattern.format_map(data)

    return of


def mm(metres: float) -> str:
    return f"{1000 * metres:.0f}"


def percent(share: float) -> str:
    return f"{100 * share:.1f}"


def anchor(key: str, scale: float, digits: int, *names: str) -> Callable[[dict], str]:
    """Filters of the family `anchor`, at one size each."""

    def of(data: dict) -> str:
        found = [f"{scale * data['anchor'][name][key]:.{digits}f}" for name in names]
        return found[0] if len(names) == 1 else "; ".join(f"{n}: {f}" for n, f in zip(names, found, strict=True))

    return of


def long_run(data: dict, name: str) -> str:
    return mm(data["bytes, seed 7301"]["filters"][name]["median_m"])


def ring_p50(data: dict) -> dict[str, float]:
    """By transport, one polling reader."""
    of = {"mode": "poll", "pace": "2khz", "readers": 1}
    return {row["peer"]: row["latency_us"]["p50"] for row in data["rows"] if of.items() <= row.items()}


def next_best(data: dict) -> str:
    p50 = ring_p50(data)
    peer = min(p50.keys() - {"whisker", "memory"}, key=p50.get)
    return f"{PEERS[peer][0]}: {p50[peer]:.2f}; bare shared memory: {p50['memory']:.2f}"


def at_lanes(runs: list[dict], lanes: int, digits: int = 2) -> str:
    return f"{next(run for run in runs if run['lanes'] == lanes)['realtime_factor']:.{digits}f}"


def unseen(data: dict) -> str:
    locked, runs = (sum(f[key] for f in data["families"].values()) for key in ("locked", "runs"))
    return f"{locked} of {runs}"


COMPARED = ("particle 10000", "grid 5 cm", "odometry")
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
        text("{frames_lost}"),
        text(
            "sent: {frames_sent}; USB faults: {usb_faults_injected}; bad records put in / reported: "
            "{records_bad_injected} / {records_bad_reported}"
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
        "nav_pareto",
        anchor("error_m", 1000, 1, "adaptive"),
        anchor("error_m", 1000, 1, *COMPARED),
    ),
    Headline(
        "tracking, the same: CPU time of a row of 0.1 s",
        "us",
        "nav_pareto",
        anchor("us", 1, 0, "adaptive"),
        anchor("us", 1, 0, *COMPARED),
    ),
    Headline(
        "families drawn after the filter was made: runs that find the robot",
        "runs",
        "nav_unseen",
        unseen,
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
        text("{default:.2f}", "errors", "duration", "0.04"),
        text(
            "the paper's line: {paper:.2f}; an oracle that knows the angle: {oracle:.2f}", "errors", "duration", "0.04"
        ),
    ),
    Headline(
        "contact filter, a corner while the robot drives: RMS error of the place",
        "mm",
        "contact",
        text("{point_rms_mm:.2f}", "kinds", "unknown", "corner, drive"),
        text("Cramer-Rao bound: {bound_rms_mm:.2f}", "kinds", "unknown", "corner, drive"),
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
        text("{total:.0f}", "instructions_per_frame", "4"),
        text("share of the paper's netbook (0.8e9 a second): {atom_share:.1%}", "instructions_per_frame", "4"),
    ),
    Headline(
        "recording, 28 lanes: size of a sample",
        "bytes",
        "record",
        text("{bytes_per_sample:.2f}", "hour"),
        text("on the wire: 8; frames lost in an hour: {lost} of {frames}", "hour"),
    ),
    Headline(
        "simulation, whole chain at RTL level, 6 lanes",
        "times real time",
        "chain_speed",
        lambda d: at_lanes(d["whole_chain"], 6),
        lambda d: f"28 lanes: {at_lanes(d['whole_chain'], 28)}",
    ),
    Headline(
        "simulation, bridge and nodes at level `bytes`, 6 lanes",
        "times real time",
        "levels",
        lambda d: at_lanes(d["bytes"], 6, 1),
        lambda d: f"gateware at SCK/6: {at_lanes(d['rtl, SCK/6, gap 0.5 us'], 6)}",
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
        text("frames: {frames}; wire faults: {wire_faults}"),
    ),
    Headline(
        "fuzzing: crashes",
        "",
        "fuzz",
        text("{crashes}"),
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


def headlines() -> str:
    origins = json.loads((RESULTS / ORIGINS).read_text())
    rows = []
    for one in HEADLINES:
        data, origin = read_result(one.result), origins[one.result]
        commit = f"{origin['commit']}, stored by {origin['stored_by']}" if "stored_by" in origin else origin["commit"]
        made = f"`{COMMAND_OF_RESULT[one.result]}`"
        rows.append([one.title, one.value(data), one.unit, one.beside(data), made, commit, origin["machine"]])
    return table(["figure", "value", "unit", "compared with", "made by", "commit", "machine"], rows)


def charts() -> str:
    rows = [
        [f"[{name}](charts/{name}.svg)", f"`.venv/bin/python {command}`"]
        for name, command in sorted(COMMAND_OF_CHART.items())
        if (CHARTS / f"{name}.svg").exists()
    ]
    return table(["chart", "command"], rows)
