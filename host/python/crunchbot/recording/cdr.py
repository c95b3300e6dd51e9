"""CDR, the encoding of ROS 2 messages (plain CDR, little-endian), as NumPy structures where the layout is fixed.

A value of n bytes begins at a multiple of n, counted from the end of the four-byte header; a sequence is its length
as uint32, then its elements (DDS-XTypes 1.3, 7.4.1; DDSI-RTPS 2.5, 10.2).
"""

import numpy as np
from numpy.typing import DTypeLike

HEADER = b"\x00\x01\x00\x00"  # CDR_LE, no options
LENGTH = np.dtype("<u4")


class Malformed(ValueError):
    """Bytes that are no such message; says what is wrong with them."""


class Layout:
    """Collects the fields of a message and makes a structured dtype of them, padding included."""

    def __init__(self, inner: bool = False):
        """`inner`: an element of a sequence, without header."""
        self._names: list[str] = []
        self._formats: list = []
        self._offsets: list[int] = []
        self._base = 0 if inner else len(HEADER)
        self._end = self._base
        if not inner:
            self._put("cdr_header", np.dtype("S4"), 1)

    def value(self, name: str, kind: DTypeLike) -> "Layout":
        """One number, or one inner structure (NumPy dtype `kind`)."""
        kind = np.dtype(kind)
        self._put(name, kind, _alignment(kind))
        return self

    def sequence(self, name: str, kind: DTypeLike, count: int) -> "Layout":
        """`count` elements (at least 1) behind their number, which is the field `<name>_count`."""
        kind = np.dtype(kind)
        self.value(f"{name}_count", LENGTH)
        self._put(name, np.dtype((kind, (count,))), _alignment(kind))
        return self

    def dtype(self, pad_to: int = 1) -> np.dtype:
        """The structure; its size is a multiple of `pad_to`."""
        size = self._end + -(self._end - self._base) % pad_to
        return np.dtype({"names": self._names, "formats": self._formats, "offsets": self._offsets, "itemsize": size})

    def _put(self, name: str, kind: np.dtype, alignment: int) -> None:
        first = name == "cdr_header"
        offset = 0 if first else self._end + -(self._end - self._base) % alignment
        self._names.append(name)
        self._formats.append(kind)
        self._offsets.append(offset)
        self._end = offset + kind.itemsize


def _alignment(kind: np.dtype) -> int:
    """Where a value may begin: numbers at their size, structures at that of their first field, which is their widest."""
    while kind.names:
        kind = kind.fields[kind.names[0]][0]
    return kind.base.itemsize
