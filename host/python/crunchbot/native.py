"""The compiled C libraries: `lib` (functions), `ffi` (types), and NumPy arrays as C pointers without copies.

C reads and writes as far as a length says, whatever the array holds. So every array goes through `pointer`, which knows
the shape that C will assume.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

try:
    from ._native import ffi, lib
except ImportError as error:  # a source tree that has not been built
    raise ImportError("whisker: the compiled module is missing or stale; run 'make build'") from error

__all__ = ["as_doubles", "doubles", "ffi", "floats", "lib", "octets", "pointer"]

Shape = tuple[int | None, ...]  # None: any length
DOUBLE, FLOAT, OCTET = np.dtype(np.float64), np.dtype(np.float32), np.dtype(np.uint8)
DOUBLES, FLOATS, OCTETS = ffi.typeof("double[]"), ffi.typeof("float[]"), ffi.typeof("uint8_t[]")


def doubles(array: np.ndarray, name: str, shape: Shape) -> ffi.CData:
    """`pointer` to float64."""
    return pointer(DOUBLES, DOUBLE, array, name, shape)


def floats(array: np.ndarray, name: str, shape: Shape) -> ffi.CData:
    """`pointer` to float32."""
    return pointer(FLOATS, FLOAT, array, name, shape)


def octets(array: np.ndarray, name: str, shape: Shape) -> ffi.CData:
    """`pointer` to uint8."""
    return pointer(OCTETS, OCTET, array, name, shape)


def pointer(ctype: Any, dtype: np.dtype, array: np.ndarray, name: str, shape: Shape) -> ffi.CData:
    """A C-contiguous array of `dtype` and `shape` as the C array `ctype`; ValueError names the argument that is none.

    What C keeps beyond the call, the caller keeps alive.
    """
    if not isinstance(array, np.ndarray):
        raise ValueError(f"{name}: {type(array).__name__}; give an array of {dtype} with shape {_text(shape)}")
    if array.shape != shape and not _fits(array.shape, shape):
        raise ValueError(f"{name}: shape {_text(array.shape)}; give shape {_text(shape)}")
    if array.dtype != dtype:
        raise ValueError(f"{name}: {array.dtype} with shape {_text(shape)}; give {dtype}")
    if not array.flags.c_contiguous:
        raise ValueError(f"{name}: shape {_text(shape)}, but not contiguous; give np.ascontiguousarray of it")
    return ffi.from_buffer(ctype, array)


def as_doubles(values: ArrayLike, name: str, shape: Shape) -> np.ndarray:
    """Numbers as a contiguous float64 array of this shape; ValueError names the argument. No numbers fit any empty shape."""
    try:
        array = np.asarray(values, DOUBLE, order="C")
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name}: no array of numbers; give shape {_text(shape)}") from None
    if array.shape == shape or _fits(array.shape, shape):
        return array
    if array.size == 0 and 0 in shape and None not in shape:
        return array.reshape(shape)
    raise ValueError(f"{name}: shape {_text(array.shape)}; give shape {_text(shape)}")


def _fits(given: tuple[int, ...], wanted: Shape) -> bool:
    return len(given) == len(wanted) and all(b is None or a == b for a, b in zip(given, wanted, strict=True))


def _text(shape: Shape) -> str:
    """A shape as NumPy prints it, n for any length."""
    return f"({', '.join('n' if length is None else str(length) for length in shape)}{',' * (len(shape) == 1)})"
