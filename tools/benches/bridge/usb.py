"""Soak of the USB device at packet level: frames through Verilated gateware while ACKs get lost, tokens, data and
SETUPs are damaged, other devices talk, hosts babble, halt, configure and reset at any cycle. Target: ten million frames
without a gap, a copy or a wrong byte.

Seeds run one after the other and add up, so a run that was cut short, or is to be longer, goes on where it stopped.
"""

import argparse
import json
import subprocess
import time
from pathlib import Path

from .. import store

NAME = "usb_soak"
TARGET = 10_000_000  # frames
CHUNK = 25_000  # frames of one seed: some ten seconds
BAD = ("gaps", "duplicates", "wrong", "stale", "answered", "unexplained", "hangs")  # all must be 0


def soak(program: Path, frames: int, seed: int) -> dict[str, float]:
    """One seed's figures; a soak that is not clean says so in them and by its exit code 1."""
    began = time.monotonic()
    result = subprocess.run([program, str(frames), str(seed)], capture_output=True, text=True, check=False)
    if result.returncode not in (0, 1):
        raise RuntimeError(f"usb-soak ended with {result.returncode}: {result.stderr.strip()}")
    return {**json.loads(result.stdout), "wall_s": round(time.monotonic() - began, 1)}


def run(build: Path, frames: int = TARGET) -> None:
    """Soaks seed after seed until `frames` frames are counted; SystemExit names what was not clean."""
    total, seeds = {"seeds": 0, "wall_s": 0.0}, store.kept("usb")
    while total.get("frames", 0) < frames:
        total["seeds"] += 1
        path = seeds / f"{min(CHUNK, frames)}_{total['seeds']}.json"
        found = store.once(
            path, lambda seed=total["seeds"]: soak(build / "tests/usb/usb-soak", min(CHUNK, frames), seed)
        )
        total["wall_s"] = round(total["wall_s"] + found.pop("wall_s"), 1)
        total |= {name: total.get(name, 0) + count for name, count in found.items()}
        print(f"{total['frames']} frames, {total['wire_faults']} wire faults, {total['noise']} packets of noise")
        if bad := {name: found[name] for name in BAD if found[name]}:
            raise SystemExit(f"seed {total['seeds']} is not clean: {bad}")
    store.write_result(NAME, total)


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--frames", type=int, default=TARGET, help="frames in all")
