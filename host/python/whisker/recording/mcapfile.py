"""Reads MCAP files from anywhere: cut off, damaged or hostile ones give what is whole, and never more memory than they say.

The format is public (mcap.dev/spec); writing is the package mcap's work. Reading is ours because a recording that a
crash cut off must still be of use, and because a length in a file must not be believed.
"""

import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

import lz4.frame
import zstandard

from ..errors import UserError

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, METADATA = 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x0C
RECORD = struct.Struct("<BQ")  # opcode, bytes that follow
MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
CHUNK_HEAD = struct.Struct("<QQQI")  # first time, last time, bytes unpacked, their CRC
CHUNK_MOST = 1 << 26  # bytes unpacked; recordings have 1 MiB
RECORD_MOST = 1 << 26  # bytes of a record that is read whole; index and attachment records are skipped unread
DAMAGE_MOST = 100  # lines kept
NUMBERED = "whisker_numbered"  # key of a channel's metadata: sequence numbers count its messages in the file, from 1 on


class RecordingError(UserError, ValueError):
    """A file that is no recording, or cannot be read or written. Its text is one line: file, what, remedy."""


class Damaged(ValueError):
    """A record that is not what it should be: it is left out, with a line in `damage`."""


@dataclass(frozen=True)
class Message:
    topic: str
    log_time: int
    data: memoryview


class McapFile:
    """One file, read from front to back. Use as a context manager.

    damage: what was left out, a line each, filled while reading; complete: the writer came to its end.
    """

    def __init__(self, path):
        """RecordingError when it cannot be opened or does not begin as MCAP does."""
        self.path = path
        self.damage: list[str] = []
        self.topics: dict[int, str] = {}
        self.metadata: dict[str, dict[str, str]] = {}  # records of one name together, what comes later counts
        try:
            self._file: BinaryIO = open(path, "rb")  # noqa: SIM115 - closed by close()
        except OSError as error:
            text = f"{path}: cannot be read ({error.strerror}); give a recording made by 'whisker record'"
            raise RecordingError(text) from error
        try:
            self._open()
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *exception) -> None:
        self.close()

    def close(self) -> None:
        self._file.close()

    def note(self, text: str) -> None:
        """Add a line to `damage`, unless there are enough."""
        if len(self.damage) < DAMAGE_MOST:
            self.damage.append(f"{self.path}: {text}")

    def messages(self) -> Iterator[Message]:
        """All messages of whole records, in the order of the file."""
        self.damage = []
        for place, opcode, size in self._records():
            if opcode not in (CHUNK, CHANNEL, MESSAGE):
                continue
            try:
                body = self._body(size)
                yield from self._parts(body) if opcode == CHUNK else self._part(opcode, body)
            except Damaged as error:
                self.note(f"byte {place}: {error}; left out")

    def _open(self) -> None:
        try:
            self._bytes = os.fstat(self._file.fileno()).st_size
            if self._file.read(len(MAGIC)) != MAGIC:
                raise RecordingError(f"{self.path}: not an MCAP file; give a recording made by 'whisker record'")
            self.complete = False
            for _, opcode, size in self._records():
                self.complete |= opcode == FOOTER
                if opcode == METADATA:
                    self._note_metadata(size)
        except OSError as error:
            raise RecordingError(
                f"{self.path}: cannot be read ({error.strerror}); copy it from its source again"
            ) from error

    def _note_metadata(self, size: int) -> None:
        try:
            cursor = Cursor(self._body(size))
            name = cursor.text()
            self.metadata[name] = self.metadata.get(name, {}) | cursor.text_map()
        except Damaged:
            return  # names and counts only; the frames do not depend on them

    def _records(self) -> Iterator[tuple[int, int, int]]:
        """(offset, opcode, size) of each whole record; the file stands at its body. Ends at the footer or the cut."""
        place = len(MAGIC)
        while place < self._bytes:
            self._file.seek(place)
            head = self._file.read(RECORD.size)
            opcode, size = RECORD.unpack(head) if len(head) == RECORD.size else (0, self._bytes)
            if size > self._bytes - place - RECORD.size:
                self.note(f"byte {place}: the file ends within a record; what is before it is whole")
                return
            yield place, opcode, size
            if opcode == FOOTER:
                return
            place += RECORD.size + size
        self.note(f"byte {place}: the file ends without its closing record; what is before it is whole")

    def _body(self, size: int) -> memoryview:
        if size > RECORD_MOST:
            raise Damaged(f"a record of {size} bytes")
        return memoryview(self._file.read(size))

    def _part(self, opcode: int, body: memoryview) -> Iterator[Message]:
        if opcode == CHANNEL:
            cursor = Cursor(body)
            number, _ = cursor.numbers("<HH")
            self.topics[number] = cursor.text()
        elif opcode == MESSAGE:
            cursor = Cursor(body)
            channel, _, log_time, _ = cursor.numbers(MESSAGE_HEAD.format)
            if channel not in self.topics:
                raise Damaged(f"a message on channel {channel}, which nothing describes")
            yield Message(self.topics[channel], log_time, cursor.rest())

    def _parts(self, body: memoryview) -> Iterator[Message]:
        cursor = Cursor(unpack_chunk(body))
        while cursor.left:
            opcode, size = cursor.numbers(RECORD.format)
            yield from self._part(opcode, cursor.take(size))


class Cursor:
    """Takes values off the front of bytes; Damaged when there are too few."""

    def __init__(self, data: memoryview):
        self._data, self._at = data, 0

    @property
    def left(self) -> int:
        return len(self._data) - self._at

    def take(self, count: int) -> memoryview:
        if count > self.left:
            raise Damaged(f"{count} bytes wanted where {self.left} are left")
        self._at += count
        return self._data[self._at - count : self._at]

    def rest(self) -> memoryview:
        return self.take(self.left)

    def numbers(self, layout: str) -> tuple[int, ...]:
        return struct.unpack(layout, self.take(struct.calcsize(layout)))

    def text(self) -> str:
        (count,) = self.numbers("<I")
        return bytes(self.take(count)).decode("utf-8", "replace")

    def text_map(self) -> dict[str, str]:
        (count,) = self.numbers("<I")
        inner, pairs = Cursor(self.take(count)), {}
        while inner.left:
            key = inner.text()
            pairs[key] = inner.text()
        return pairs


def unpack_chunk(body: memoryview) -> memoryview:
    """The records inside a chunk; Damaged when it is not what it says."""
    cursor = Cursor(body)
    _, _, size, crc = cursor.numbers(CHUNK_HEAD.format)
    compression = cursor.text()
    (count,) = cursor.numbers("<Q")
    packed = cursor.take(count)
    if size > CHUNK_MOST:
        raise Damaged(f"a chunk of {size} bytes")
    data = _unpack(compression, packed, size)
    if len(data) != size or (crc and zlib.crc32(data) != crc):
        raise Damaged("a chunk that is not as it was written (its checksum is wrong)")
    return memoryview(data)


def _unpack(compression: str, packed: memoryview, size: int) -> bytes | memoryview:
    """At most size + 1 bytes."""
    try:
        if compression == "zstd":
            return zstandard.ZstdDecompressor(max_window_size=CHUNK_MOST).stream_reader(packed).read(size + 1)
        if compression == "lz4":
            return lz4.frame.LZ4FrameDecompressor().decompress(packed, size + 1)
    except (zstandard.ZstdError, RuntimeError, EOFError) as error:
        raise Damaged(f"a chunk that cannot be unpacked ({error})") from error
    if compression == "":
        return packed
    raise Damaged("a chunk packed in an unknown way")
