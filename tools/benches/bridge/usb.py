"""Soak of the USB device at packet level: frames through Verilated gateware while ACKs get lost, tokens, data and
SETUPs are damaged, other devices talk, hosts babble, halt, configure and reset at any cycle. Target: ten million frames
without a gap, a copy or a wrong byte.

Seeds run one after the other and add up in bench/results/usb_soak.json, so a run that was cut short goes on where it
stopped.
"""

import argparse
import json
import subprocess
import time
from pathlib import Path

from matplotlib.figure import Figure

from .. import store

NAME = "usb_soak"  # of the results and the chart
TARGET = 10_000_000  # frames
CHUNK = 25_000  # frames of one seed: some ten seconds
DONE = {
    "frames": "frames read",
    "packets": "bulk packets read",
    "noise": "packets of noise",
    "wire_faults": "lost ACKs, damaged packets",
    "restarts": "configured or halted anew",
    "resets": "bus resets at any cycle",
}
BAD = ("gaps", "duplicates", "wrong", "stale", "answered", "unexplained", "hangs")  # all must be 0


def soak(program: Path, frames: int, seed: int) -> dict[str, int]:
    """One seed's figures; a soak that is not clean says so in them and by its exit code 1."""
    result = subprocess.run([program, str(frames), str(seed)], capture_output=True, text=True, check=False)
    if result.returncode not in (0, 1):
        raise RuntimeError(f"usb-soak ended with {result.returncode}: {result.stderr.strip()}")
    return json.loads(result.stdout)


def run(build: Path, fresh: bool, frames: int = TARGET) -> None:
    """Soaks seed after seed until `frames` frames are in the results; SystemExit names what was not clean."""
    total = {"seeds": 0, "wall_s": 0.0}
    if (store.RESULTS / f"{NAME}.json").exists() and not fresh:
        total = store.read_result(NAME)
    while total.get("frames", 0) < frames:
        began = time.monotonic()
        found = soak(build / "tests/usb/usb-soak", min(CHUNK, frames), total["seeds"] + 1)
        total["wall_s"] = round(total["wall_s"] + time.monotonic() - began, 1)
        total["seeds"] += 1
        total |= {name: total.get(name, 0) + count for name, count in found.items()}
        store.write_result(NAME, total)
        print(f"{total['frames']} frames, {total['wire_faults']} wire faults, {total['noise']} packets of noise")
        if bad := {name: found[name] for name in BAD if found[name]}:
            raise SystemExit(f"seed {total['seeds']} is not clean: {bad}")
    store.write_chart(NAME, draw(total))


def draw(total: dict) -> Figure:
    """What the device went through, and what came of it."""
    figure = Figure(figsize=(8, 3.4), layout="constrained")
    axes = figure.subplots()
    counts = [total[name] for name in DONE]
    axes.barh(list(DONE.values()), counts, color="0.6", edgecolor="0.2")
    for row, count in enumerate(counts):
        axes.text(count * 1.15, row, f"{count:,}".replace(",", " "), va="center", fontsize=9)
    axes.set_xscale("log")
    axes.set_xlim(1, 30 * max(counts))
    axes.set_xlabel("count since the first seed (logarithmic)")
    axes.invert_yaxis()
    axes.spines[["top", "right"]].set_visible(False)
    bad = ", ".join(f"{name} {total[name]}" for name in BAD)
    axes.set_title(f"USB device at packet level, {total['seeds']} seeds\n{bad}", fontsize=10, loc="left")
    return figure


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--frames", type=int, default=TARGET, help="frames in all")
