"""When readings are taken and when they arrive: from SYNC to the end of the USB transfer, and between two bridges'
SYNC.

The mapping of ticks to the host's clock is judged on synthetic traces whose every delay is known (libwhisker's
clock_bench).

The bridge runs as on a board, on its own divider (tests/usb, bridge-free); two of them with clocks of their
own and a cable between (fpga/tb/pair). Both are the Verilog, cycle by cycle, so the figures are the same on every
machine.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

from .. import store
from ..markdown import wrap

ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs/timing.md"
BEGIN, END = "<!-- tools/benches timing writes from here -->", "<!-- to here -->"
TICKS = 200
LIMIT_US, HOST_FRAMES, PRIORITY = 600, 20000, "50"
TRACE_S, TRACES = 1800, 4
MAPPED = {
    "arrivals": "without",
    "sof": "in frames",
    "sof_report": "and in reports",
    "sof_report_other_crystal": "and in reports, controller on a crystal of its own",
}
SOURCES = {
    "even": "the bridge's divider",
    "restarts": "the same, started again every minute",
    "off": "0.3 % slower than the period that is set",
    "uneven": "each up to 0.2 periods early or late",
    "pauses": "none for up to 1 s, every 8 s",
}
SENT = {False: "two frames a packet", True: "every frame at once"}


def pair(out: Path) -> list[dict]:
    """Skew of two bridges by cable, measured by their bench."""
    out.unlink(missing_ok=True)
    environment = {**os.environ, "WHISKER_PAIR_OUT": str(out)}
    subprocess.run([sys.executable, "-m", "pytest", "-q", "fpga/tb/pair"], cwd=ROOT, env=environment, check=True)
    return json.loads(out.read_text())


def latency_rows(runs: list[dict]) -> list[str]:
    rows = ["| node link | ticks | sent | SYNC to the end of its packet | of its transfer, batch 2 | batch 4 |"]
    rows += ["|---|---|---|---|---|---|"]
    for run in runs:
        link = f"SCK/{run['sck_divider']}, gap {run['word_gap'] / 60:g} us"
        rate = f"{60e6 / run['tick_period']:.0f} Hz"
        times = (
            f"{run[name]['median_us']:.0f}, worst {run[name]['worst_us']:.0f} us"
            for name in ("packet", "batch_2", "batch_4")
        )
        rows.append(f"| {link} | {rate} | {SENT[run['every_frame']]} | {' | '.join(times)} |")
    return rows


def skew_rows(cables: list[dict]) -> list[str]:
    rows = [
        "| cable between tick_out and tick_in | buffers and pads | second bridge's SYNC after the first's |",
        "|---|---|---|",
    ]
    rows += [
        f"| {c['cable_m']:g} m | {c['beside_ns']:g} ns | {c['least_ns']:+.1f} to {c['most_ns']:+.1f} ns |"
        for c in cables
    ]
    return rows


def clock_rows(runs: list[dict]) -> list[str]:
    rows = ["| ticks | start-of-frame numbers | median error | 99 % | worst | within the stated uncertainty |"]
    rows += ["|---|---|---|---|---|---|"]
    for run in runs:
        errors = " | ".join(f"{run[name]:.0f} us" for name in ("median_us", "p99_us", "worst_us"))
        rows.append(f"| {SOURCES[run['ticks']]} | {MAPPED[run['dates']]} | {errors} | {100 * run['covered']:.2f} % |")
    return rows


def clock(build: Path) -> list[dict]:
    """Errors of the mapping to the host's clock, by what ticks and by what is known of them."""
    command = [build / "host/libwhisker/test/clock_bench", str(TRACE_S), str(TRACES)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def host(build: Path, latency: list[dict]) -> list[dict]:
    """The host's part, on this machine, by its way of scheduling: what is left of LIMIT_US after the packet's end."""
    left = LIMIT_US - max(run["packet"]["worst_us"] for run in every_frame_at_2_khz(latency))
    program = build / "host/libwhisker/test/ring_path"
    runs = [[program, str(HOST_FRAMES), f"{left:.1f}", *priority] for priority in ([], [PRIORITY])]
    found = [json.loads(subprocess.run(run, check=True, capture_output=True, text=True).stdout) for run in runs]
    return [run | {"load": os.getloadavg()[0]} for run in found]


def every_frame_at_2_khz(latency: list[dict]) -> list[dict]:
    return [run for run in latency if run["every_frame"] and run["tick_period"] == 30000 and run["sck_divider"] == 16]


def host_rows(found: dict) -> list[str]:
    worst = max(run["packet"]["worst_us"] for run in every_frame_at_2_khz(found["latency"]))
    rows = [
        "| scheduling of the process | interrupt to ring, median | 99 % | 99.9 % | worst | SYNC to ring, median | "
        "within 600 us |"
    ]
    rows += ["|---|---|---|---|---|---|---|"]
    for run in found["host"]:
        late = run["late"]
        times = (f"{late[name]:.0f} us" for name in ("median_us", "p99_us", "p999_us", "worst_us"))
        name = "real time (SCHED_FIFO)" if run["fifo"] else "usual"
        rows.append(
            f"| {name} | {' | '.join(times)} | {worst + late['median_us']:.0f} us | {100 * late['within_limit']:.2f} "
            f"% |"
        )
    return rows


def table(found: dict) -> str:
    """What the page says, made of the result."""
    fastest = max(60e6 / run["tick_period"] for run in found["latency"])
    lines = [*latency_rows(found["latency"]), "", *skew_rows(found["skew"]), ""]
    bad = sum(run["bad_records"] for run in found["latency"])
    uneven = max(run["sync_longest"] - run["sync_shortest"] for run in found["latency"])
    frames = sum(run["frames"] for run in found["latency"])
    lines += [
        f"Of {frames} frames {bad} held a bad record, and the longest distance of two SYNC pulses was {uneven} cycles "
        f"more than"
    ]
    lines += [f"the shortest. Highest rate that the settings allow, and reached here with 28 lanes: {fastest:.0f} Hz."]
    lines += ["", *host_rows(found), ""]
    run = found["host"][0]
    lines += [
        f"{run['frames']} frames each, on a virtual machine of two processors with a load of {run['load']:.0f}; the "
        f"thread itself works"
    ]
    lines += [f"{run['work']['median_us']:.0f} us a frame (median)."]
    lines += ["", *clock_rows(found["clock"]), ""]
    lines += [
        f"{TRACES} traces of {TRACE_S} s, a transfer every 8 ms, from the sixth second on; the first 20 us of each "
        f"error are the host's least delay,"
    ]
    lines += ["which no arrival shows and the stated uncertainty includes."]
    return "\n".join(lines)


def run(build: Path) -> None:
    """A few minutes; nothing is kept between runs."""
    reported = subprocess.run([build / "tests/usb/bridge-free", str(TICKS)], check=True, capture_output=True, text=True)
    found = {"latency": json.loads(reported.stdout), "skew": pair(build.resolve() / "pair.json"), "clock": clock(build)}
    found["host"] = host(build, found["latency"])
    store.write_result("bridge_timing", found)
    before, rest = PAGE.read_text().split(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}\n\n{wrap(table(found))}\n\n{END}{rest.split(END)[1]}")
