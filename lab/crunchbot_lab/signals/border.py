"""NumPy arrays as C pointers, as in crunchbot.native: with the shape that C will assume."""

import numpy as np

try:
    from ._sim import ffi, lib
except ImportError as error:
    raise ImportError("crunchbot_lab: the compiled module is missing or stale; run 'make build'") from error

__all__ = ["ffi", "lib", "pointer"]

TYPES = {"double[]": np.float64, "uint16_t[]": np.uint16, "unsigned char[]": np.uint8}


def pointer(kind: str, array: np.ndarray, name: str, shape: tuple[int, ...]) -> ffi.CData:
    """A contiguous array of this shape as a C array of TYPES; ValueError names the argument that is none."""
    dtype = np.dtype(TYPES[kind])
    if array.shape != shape or array.dtype != dtype or not array.flags.c_contiguous:
        raise ValueError(f"{name}: {array.dtype} of shape {array.shape}; give contiguous {dtype} of shape {shape}")
    return ffi.from_buffer(kind, array)
