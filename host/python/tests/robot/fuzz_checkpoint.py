"""Mutated checkpoints: whatever a file holds, decoding it gives components of the number it says, or the one-line error."""

import zlib

import numpy as np
from mutate import mutate

from crunchbot.nav.filters import COMPONENT, COMPONENTS_MOST
from crunchbot.robot.checkpoint import Checkpoint, CheckpointError, decode, encode


def seed_file() -> bytes:
    """A small checkpoint of two filters."""
    components = np.zeros(3, COMPONENT)
    components["pose"], components["sigma_m"], components["sigma_rad"], components["mass"] = (
        [1.0, 2.0, 0.5],
        0.1,
        0.2,
        1.0,
    )
    beliefs = {"grid": components, "adaptive": components[:2]}
    return encode(Checkpoint("arena", 7, 9, np.array([0.5, 0.25, 1.0]), 10**9, 10**18, beliefs))


def repaired(data: bytes) -> bytes:
    """The same with the CRC that it should have, so that what is behind the CRC is reached."""
    first, line, rest = data.partition(b"\n")
    words = first.split(b" ")
    return b" ".join([*words[:2], b"%08x" % zlib.crc32(rest)]) + line + rest


def fuzz(inputs: int, seed: int) -> dict[str, int]:
    rng, file, refused = np.random.default_rng(seed), seed_file(), 0
    for _ in range(inputs):
        data = mutate(file, rng)
        data = repaired(data) if rng.integers(4) else data
        try:
            reported = decode(data)
        except CheckpointError as error:
            assert "\n" not in str(error)
            refused += 1
        else:
            assert all(0 < len(b) <= COMPONENTS_MOST and b.dtype == COMPONENT for b in reported.beliefs.values())
            assert np.isfinite(reported.pose).all() and encode(reported)
    return {"refused in one line": refused}
