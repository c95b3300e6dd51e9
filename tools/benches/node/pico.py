"""The Pico's image, executed: frames against the sensors' own logs, faults at random, each under its code.

Pieces add up, so a run that was cut short, or is to be longer, goes on where it stopped.
"""

import argparse
import hashlib
import json
import subprocess
from pathlib import Path

from .. import store
from . import pico_peers

ROOT = Path(__file__).resolve().parents[3]
IMAGE = ROOT / "firmware/images/pico/pico.bin"
SCRIPTS = ROOT / "sim/pico/tests"
# All that a piece follows from.
INPUTS = [f"sim/pico/{name}" for name in ("board.mjs", "host.mjs", "sensors.mjs", "package-lock.json")]
INPUTS += [f"sim/pico/tests/{name}.mjs" for name in ("bench", "soak", "faults")] + ["firmware/images/pico/pico.bin"]
FRAMES, FAULTS = 1_000_000, 10_000
FRAMES_A_PIECE, FAULTS_A_PIECE = 50_000, 500
BAD = ("lost", "altered", "doubled", "errors", "wrong")


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--frames", type=int, default=FRAMES, help="of 8 lanes at 2 kHz (%(default)s)")
    parser.add_argument("--faults", type=int, default=FAULTS, help="(%(default)s)")
    text = "folder with fetched sources of public drivers, to run beside this firmware: Adafruit_MLX90393.cpp, Zephyr's tmag5170.c"
    parser.add_argument("--peer", type=Path, metavar="DIR", help=text)


def piece(script: str, *words: int) -> dict:
    """The last line that a script prints."""
    command = ["node", str(SCRIPTS / script), str(IMAGE), *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def added(total: dict, found: dict) -> dict:
    """Counts add up, of worst cases the worst counts."""
    out = dict(total)
    for name, value in found.items():
        if name in ("off", "worst_us", "stack"):
            out[name] = max(total.get(name, 0), value)
        elif isinstance(value, dict):
            before = total.get(name, {})
            out[name] = {key: before.get(key, 0) + value.get(key, 0) for key in {*before, *value}}
        elif isinstance(value, int | list):
            out[name] = total.get(name, type(value)()) + value
    return out


def run(build: Path, frames: int = FRAMES, faults: int = FAULTS, peer: Path | None = None) -> None:
    """Goes on until so many are counted; SystemExit names what was not clean. `build` is not needed."""
    cache = store.kept("pico", *INPUTS)
    soak: dict = {}
    for number in range(-(-frames // FRAMES_A_PIECE)):
        found = store.once(
            cache / f"soak_{number}.json", lambda seed=number: piece("soak.mjs", FRAMES_A_PIECE, 8, 30000, seed)
        )
        soak = added(soak, {key: found[key] for key in (*BAD[:4], "frames", "compared", "off", "worst_us", "stack")})
        print(f"{soak['frames']} frames")
    campaign: dict = {}
    for seed in range(-(-faults // FAULTS_A_PIECE)):
        found = store.once(cache / f"faults_{seed}.json", lambda seed=seed: piece("faults.mjs", FAULTS_A_PIECE, seed))
        campaign = added(campaign, found)
        print(f"{campaign['faults']} faults")
    result = {"image": hashlib.sha256(IMAGE.read_bytes()).hexdigest(), "soak": soak, "faults": campaign}
    result["peers"] = pico_peers.rows(peer)
    store.write_result("pico", result)
    if bad := {name: part[name] for part in (soak, campaign) for name in BAD if part.get(name)}:
        raise SystemExit(f"not clean: {bad}")
