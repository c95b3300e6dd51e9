"""Bytes gone wrong, for fuzzers."""

import struct

import numpy as np

EDGES = (0, 1, 0x7F, 0x80, 0xFF, 0xFFFF, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**63, 2**64 - 1)


def mutate(data: bytes, rng: np.random.Generator) -> bytes:
    """One to four changes: bits, bytes, numbers at their edges, pieces cut, doubled or moved."""
    out = bytearray(data)
    for _ in range(rng.integers(1, 5)):
        if len(out) < 2:
            break
        place, length = int(rng.integers(len(out))), int(rng.integers(1, 64))
        match rng.integers(7):
            case 0:
                out[place] ^= 1 << int(rng.integers(8))
            case 1:
                out[place] = int(rng.integers(256))
            case 2:
                edge, code = EDGES[rng.integers(len(EDGES))], "<Q" if rng.integers(2) else "<I"
                out[place : place + struct.calcsize(code)] = struct.pack(
                    code, edge & (2 ** (8 * struct.calcsize(code)) - 1)
                )
            case 3:
                del out[place:]
            case 4:
                del out[place : place + length]
            case 5:
                out[place:place] = out[place : place + length]
            case 6:
                out[place : place + length] = rng.bytes(length)
    return bytes(out)
