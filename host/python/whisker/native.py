"""The compiled C libraries: `lib` (functions), `ffi` (types), and NumPy arrays as C pointers without copies."""

import numpy as np

try:
    from ._native import ffi, lib
except ImportError as error:  # a source tree that has not been built
    raise ImportError("whisker: the compiled module is missing or stale; run 'make build'") from error

__all__ = ["doubles", "ffi", "lib", "octets"]


def doubles(array: np.ndarray):
    """Pointer to a C-contiguous float64 array; the caller keeps the array alive."""
    assert array.dtype == np.float64 and array.flags.c_contiguous
    return ffi.cast("double *", array.ctypes.data)


def octets(array: np.ndarray):
    """Pointer to a C-contiguous uint8 array; the caller keeps the array alive."""
    assert array.dtype == np.uint8 and array.flags.c_contiguous
    return ffi.cast("uint8_t *", array.ctypes.data)
