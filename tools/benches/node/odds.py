"""How likely damage passes the checks on a whisker's sample: derivations for tools/benches node.

A class of damage is a key of the storm's `lines` (the sensor's frame: start byte 0xFF, four bytes of angles, a zero
error word, sum) or `links` (the record: tick, angles, status, CRC-8). Probabilities are per event; None: not derived.
"""

from math import comb, sqrt

import numpy as np

import whisker_protocol as protocol

BITS = 64
RECORD = protocol.RECORD
FLOATING = 2.0**-32  # start byte, error word and sum right by chance
GLITCH = (63 - 7 - 8) / 63 / 256  # before bit 1 to 63: the first 7 hurt the tick, the last 8 make a burst that is seen
REARMED = 1 / 256
CHANCES = {"FLOATING": FLOATING, "GLITCH": GLITCH, "REARMED": REARMED}
Z95 = 1.959964  # normal quantile of a two-sided 95 % interval


def interval(hits: int, events: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a binomial share."""
    if events == 0:
        return 0.0, 1.0
    share, spread = hits / events, Z95 * Z95 / events
    middle = (share + spread / 2) / (1 + spread)
    half = Z95 * sqrt(share * (1 - share) / events + spread / (4 * events)) / (1 + spread)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def _places(*names: str) -> list[int]:
    """Bits of these fields of a record, the first sent 0."""
    fields = (RECORD.fields[name] for name in names)
    return [8 * f.offset + bit for f in fields for bit in range(8 * f.size)]


def _syndromes() -> list[int]:
    """Of each single bit of a record: what it changes in the CRC that is worked out and the one that came."""
    zero = bytes(RECORD.fields["crc"].offset)
    syndromes = []
    for place in range(BITS):
        hurt = (1 << (BITS - 1 - place)).to_bytes(8, "big")
        syndromes.append(protocol.crc8(hurt[:-1]) ^ protocol.crc8(zero) ^ hurt[-1])
    return syndromes


def _undetected(places: list[int], weight: int) -> int:
    """Patterns of so many bits at these places that the CRC does not see."""
    syndromes = _syndromes()
    counts = np.zeros((weight + 1, 256), dtype=object)
    counts[0, 0] = 1
    for place in places:
        moved = counts[:-1, np.arange(256) ^ syndromes[place]]
        counts[1:] = counts[1:] + moved
    return int(counts[weight, 0])


def flips(weight: int) -> tuple[float, float]:
    """So many bits of a good record flipped: accepted (the tick must be whole); a good sample (the status, too)."""
    every = comb(BITS, weight)
    accepted = _undetected(_places("alpha", "beta", "status", "crc"), weight)
    good = _undetected(_places("alpha", "beta", "crc"), weight)
    return accepted / every, good / every


def slipped(ahead: bool, frames: int = 400_000) -> float:
    """Share of frames begun one bit late (or early) that pass the sum: 12-bit angles within 60 degrees of rest."""
    random = np.random.default_rng(1)
    angle = random.integers(-1365, 1366, (frames, 2)) * 16 + 0x8000
    data = np.stack([angle[:, 0] & 0xFF, angle[:, 0] >> 8, angle[:, 1] & 0xFF, angle[:, 1] >> 8], axis=1)
    zero = np.zeros(frames, int)
    sent = np.stack([zero + 0xFF, *data.T, zero, zero, data.sum(axis=1) & 0xFF], axis=1)
    bits = np.unpackbits(sent.astype(np.uint8), axis=1)
    edge = np.ones((frames, 1), np.uint8) if ahead else random.integers(0, 2, (frames, 1)).astype(np.uint8)
    came = np.hstack([bits[:, 1:], edge] if ahead else [edge, bits[:, :-1]])
    byte = np.packbits(came, axis=1).astype(int)
    passes = (byte[:, 0] == 0xFF) & (byte[:, 5] == 0) & (byte[:, 6] == 0)
    return float((passes & (byte[:, 1:7].sum(axis=1) % 256 == byte[:, 7])).mean())


def derived(name: str, totals: list) -> tuple[float | None, float | None]:
    """(passes, good sample), per event; `totals`: events, passed, good, expected passed, expected good."""
    events, _, _, passed, good = totals
    if name in ("FLIP_BIT", "DEAD", "STUCK_LOW", "ERROR_BITS"):
        return 0.0, 0.0
    if name in ("FLIP_TWO", "LOST_CLOCK", "EXTRA_CLOCK", "CUT"):
        return passed / events, good / events
    if name == "NOISY":
        return passed / events, None
    if name in CHANCES:
        return CHANCES[name], None
    if name in ("BEHIND", "AHEAD"):
        return slipped(name == "AHEAD"), None
    if name.startswith("FLIPS_"):
        return flips(int(name.removeprefix("FLIPS_")))
    return None, None
