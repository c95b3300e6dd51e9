"""CDR, the encoding of ROS 2 messages (plain CDR, little-endian), as NumPy structures where the layout is fixed.

A value of n bytes begins at a multiple of n, counted from the end of the four-byte header; a sequence is its length
as uint32, then its elements (DDS-XTypes 1.3, 7.4.1; DDSI-RTPS 2.5, 10.2).
"""

import struct
from functools import cache

import numpy as np
from numpy.typing import DTypeLike

HEADER = b"\x00\x01\x00\x00"  # CDR_LE, no options
LENGTH = np.dtype("<u4")


class Malformed(ValueError):
    """Bytes that are no such message; says what is wrong with them."""


@cache
def _number(code: str) -> struct.Struct:
    return struct.Struct(f"<{code}")


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


class Decoder:
    """Reads a message's values off its bytes and believes no length: Malformed when there are too few bytes for it."""

    def __init__(self, data: bytes):
        if data[: len(HEADER)] != HEADER:
            raise Malformed("not little-endian CDR")
        self._data, self._at = memoryview(data)[len(HEADER) :], 0

    def number(self, code: str) -> float:
        """A number of the struct module's `code`."""
        kind = _number(code)
        return kind.unpack(self._take(1, kind.size))[0]

    def array(self, kind: DTypeLike, count: int) -> np.ndarray:
        """`count` numbers of the NumPy dtype `kind`, an array of their own."""
        kind = np.dtype(kind).newbyteorder("<")
        return np.frombuffer(self._take(count, kind.itemsize), kind).copy()

    def text(self) -> str:
        data = bytes(self._take(int(self.number("I")), 1))
        if not data.endswith(b"\x00"):
            raise Malformed("a string without its closing zero")
        try:
            return data[:-1].decode()
        except UnicodeDecodeError:
            raise Malformed("a string that is not UTF-8") from None

    def done(self) -> None:
        """Malformed unless all bytes have been read."""
        if self._at != len(self._data):
            raise Malformed(f"{len(self._data) - self._at} bytes too many")

    def _take(self, count: int, size: int) -> memoryview:
        """`count` elements of `size` bytes, which begin at a multiple of `size`."""
        start = self._at + (-self._at % size if count else 0)
        if count * size > len(self._data) - start:
            left = max(len(self._data) - start, 0)
            raise Malformed(f"{count} x {size} bytes wanted where {left} are left")
        self._at = start + count * size
        return self._data[start : self._at]
