"""Mutated checkpoints: whatever a file holds, decoding it gives bumps of the number it says, or the one-line error.

python host/python/tests/fuzz_checkpoint.py --inputs 100000 --seed 1
"""

import argparse
import sys
import zlib

import numpy as np
from fuzz_recording import mutate

from whisker.nav.filters import BUMPS_MOST, COMPONENT
from whisker.robot.checkpoint import Checkpoint, CheckpointError, decode, encode


def seed_file() -> bytes:
    """A small checkpoint of two filters."""
    bumps = np.zeros(3, COMPONENT)
    bumps["pose"], bumps["sigma_m"], bumps["sigma_rad"], bumps["mass"] = [1.0, 2.0, 0.5], 0.1, 0.2, 1.0
    beliefs = {"grid": bumps, "adaptive": bumps[:2]}
    return encode(Checkpoint("arena", 7, 9, np.array([0.5, 0.25, 1.0]), 10**9, 10**18, beliefs))


def repaired(data: bytes) -> bytes:
    """The same with the CRC that it should have, so that what is behind the CRC is reached."""
    first, line, rest = data.partition(b"\n")
    words = first.split(b" ")
    return b" ".join([*words[:2], b"%08x" % zlib.crc32(rest)]) + line + rest


def tried(inputs: int, seed: int) -> int:
    """How many inputs were decoded or refused as they should be; any other error goes through."""
    rng, file, done = np.random.default_rng(seed), seed_file(), 0
    for _ in range(inputs):
        data = mutate(file, rng)
        data = repaired(data) if rng.integers(4) else data
        try:
            told = decode(data)
        except CheckpointError as error:
            assert "\n" not in str(error)
        else:
            assert all(0 < len(b) <= BUMPS_MOST and b.dtype == COMPONENT for b in told.beliefs.values())
            assert np.isfinite(told.pose).all() and encode(told)
        done += 1
    return done


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inputs", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print(f"{tried(options.inputs, options.seed)} inputs, 0 crashes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
