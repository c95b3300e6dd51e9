#!/usr/bin/env python3
"""Soak of the USB device at packet level: frames through Verilated gateware while ACKs get lost, tokens, data and SETUPs are damaged, other devices talk,
hosts babble, halt, configure and reset at any cycle. Target: ten million frames without a gap, a copy or a wrong byte.

Seeds run one after the other and add up in bench/results/usb_soak.json, so a run that was cut short goes on where it stopped.
"""

import argparse
import json
import subprocess
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RESULT = ROOT / "bench/results/usb_soak.json"
TARGET = 10_000_000  # frames
CHUNK = 250_000  # frames of one seed
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
    if RESULT.exists() and not fresh:
        total = json.loads(RESULT.read_text())
    while total.get("frames", 0) < frames:
        began = time.monotonic()
        found = soak(build / "sim/bridge/usb_device/usb-soak", min(CHUNK, frames), total["seeds"] + 1)
        total["wall_s"] = round(total["wall_s"] + time.monotonic() - began, 1)
        total["seeds"] += 1
        total |= {name: total.get(name, 0) + count for name, count in found.items()}
        RESULT.write_text(json.dumps(total, indent=1) + "\n")
        print(f"{total['frames']} frames, {total['wire_faults']} wire faults, {total['noise']} packets of noise")
        if bad := {name: found[name] for name in BAD if found[name]}:
            raise SystemExit(f"seed {total['seeds']} is not clean: {bad}")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0], epilog="Example: tools/bench_usb.py --frames 500000"
    )
    parser.add_argument("--build", type=Path, default=ROOT / "build/release", help="build folder")
    parser.add_argument("--fresh", action="store_true", help="forget earlier seeds")
    parser.add_argument("--frames", type=int, default=TARGET, help="frames in all")
    arguments = parser.parse_args()
    run(arguments.build, arguments.fresh, arguments.frames)


if __name__ == "__main__":
    main()
