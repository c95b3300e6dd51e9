"""Finds the records of an MCAP file (mcap.dev/spec) and goes on behind what is damaged; the package mcap reads each of them.

No length in a file is believed. A chunk is believed by its checksum; any other record if a record follows it, or if
nothing within it looks like one. In a search for the next record all of its bytes must be what the package would write.
"""

import re
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import BinaryIO

import lz4.frame
import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC as MAGIC

HEAD = struct.Struct("<BQ")  # opcode, bytes that follow
# A record's head, as a search for one sees it: a known opcode and a length of at most MOST.
HEADS = re.compile(rb"(?=[\x02-\x0f].{3}[\x00-\x04]\x00{4})", re.DOTALL)
MOST = (
    1 << 26
)  # bytes of a record, and of what is unpacked of a chunk; attachments, which are skipped unread, may have more
PARSED_MOST = 1 << 22  # bytes of a record that is neither a chunk nor a message
CHANNEL_MOST = 1 << 12
WINDOW = 1 << 20  # bytes searched at a time
PIECE = 1 << 20  # bytes of a checksum at a time
VAIN_MOST = 1 << 30  # bytes read in searches of what turned out to be no record: more is a file made to cost time
KINDS = {
    Opcode.SCHEMA: records.Schema,
    Opcode.CHANNEL: records.Channel,
    Opcode.MESSAGE_INDEX: records.MessageIndex,
    Opcode.CHUNK_INDEX: records.ChunkIndex,
    Opcode.ATTACHMENT_INDEX: records.AttachmentIndex,
    Opcode.STATISTICS: records.Statistics,
    Opcode.METADATA: records.Metadata,
    Opcode.METADATA_INDEX: records.MetadataIndex,
    Opcode.SUMMARY_OFFSET: records.SummaryOffset,
    Opcode.DATA_END: records.DataEnd,
    Opcode.FOOTER: records.Footer,
}
INNER = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)  # in a file of chunks they may stand in one that is damaged


class Damaged(ValueError):
    """A record that is not what it should be: it is left out, with a line of damage."""


@dataclass(frozen=True)
class Found:
    """A record from its opcode to behind its last byte. `inside`: the records in a chunk, where it was unpacked."""

    place: int
    end: int
    opcode: int
    inside: memoryview | None = None


def parsed(opcode: int, body: bytes | memoryview) -> records.McapRecord:
    """Damaged when the package cannot read it."""
    most = {Opcode.MESSAGE: MOST, Opcode.CHANNEL: CHANNEL_MOST}.get(opcode, PARSED_MOST)
    if len(body) > most:
        raise Damaged(f"a description of {len(body)} bytes")
    stream = ReadDataStream(BytesIO(body))
    try:
        return records.Message.read(stream, len(body)) if opcode == Opcode.MESSAGE else KINDS[opcode].read(stream)
    except (McapError, struct.error, UnicodeDecodeError, OverflowError) as error:
        raise Damaged("a record that does not fit its length") from error


def inner_records(data: memoryview) -> Iterator[records.McapRecord]:
    """Channels and messages of a chunk; Damaged where one is cut off."""
    at = 0
    while at < len(data):
        begin = at + HEAD.size
        opcode, size = HEAD.unpack_from(data, at) if begin <= len(data) else (0, len(data))
        at = begin + size
        if at > len(data):
            raise Damaged("a chunk whose last record is cut off")
        if opcode in (Opcode.CHANNEL, Opcode.MESSAGE):
            yield parsed(opcode, data[begin:at])


@dataclass(frozen=True)
class ChunkHead:
    """What stands before the packed records of a chunk: bytes unpacked, their CRC, how they are packed, how many bytes."""

    size: int
    crc: int
    compression: bytes
    packed: int

    @classmethod
    def read(cls, data: bytes) -> "ChunkHead":
        try:
            size, crc, name = struct.unpack_from("<16xQII", data)
            return cls(size, crc, data[32 : 32 + name], struct.unpack_from("<Q", data, 32 + name)[0])
        except struct.error as error:
            raise Damaged("a chunk without room for its head") from error

    @property
    def length(self) -> int:
        return 40 + len(self.compression)

    def unpacked(self, packed: memoryview) -> memoryview:
        """The records of the chunk. Damaged when they are not as they were written."""
        if self.size > MOST:
            raise Damaged(f"a chunk of {self.size} bytes")
        try:
            if self.compression == b"zstd":
                data = zstandard.ZstdDecompressor(max_window_size=MOST).stream_reader(packed).read(self.size + 1)
            elif self.compression == b"lz4":
                data = lz4.frame.LZ4FrameDecompressor().decompress(packed, self.size + 1)
            elif self.compression:
                raise Damaged("a chunk packed in an unknown way")
            else:
                data = packed
        except (zstandard.ZstdError, RuntimeError, EOFError) as error:
            raise Damaged(f"a chunk that cannot be unpacked ({error})") from error
        if len(data) != self.size or (self.crc and zlib.crc32(data) != self.crc):
            raise Damaged("a chunk that is not as it was written (its checksum is wrong)")
        return memoryview(data)


class Salvage:
    """The records of one file. channels: by number, those known so far, the caller's to fill; is_chunked: the file has
    chunks, so what stands beside them is no message."""

    def __init__(self, file: BinaryIO, note: Callable[[str], None]):
        """`note` takes a line for each damage. OSError comes from all methods."""
        self._file, self._note, self._vain = file, note, 0
        self.size = file.seek(0, 2)
        self.channels: dict[int, records.Channel] = {}
        self.is_chunked = False

    def read(self, place: int, count: int) -> bytes:
        """At most `count` bytes, fewer at the end of the file."""
        self._file.seek(place)
        return self._file.read(min(count, max(self.size - place, 0)))

    def content(self, found: Found) -> records.McapRecord:
        """Damaged when it is not what its opcode says."""
        return parsed(found.opcode, self.read(found.place + HEAD.size, found.end - found.place - HEAD.size))

    def crc(self, start: int, end: int) -> int:
        """CRC-32 of the bytes from `start` up to `end`."""
        crc = 0
        for place in range(start, end, PIECE):
            crc = zlib.crc32(self.read(place, min(PIECE, end - place)), crc)
        return crc

    def records(self, unpack: bool) -> Iterator[Found]:
        """Whole records up to the footer. `unpack`: chunks too, so that a wrong checksum is a damage."""
        self._vain, place = 0, len(MAGIC)
        if self.read(0, place) != MAGIC:
            self._note("byte 0: it does not begin as an MCAP file does; read on all the same")
        while place < self.size:
            found = self._at_or_behind(place, unpack)
            if found is None:
                return
            self.is_chunked |= found.opcode == Opcode.CHUNK
            yield found
            place = found.end
            if found.opcode == Opcode.FOOTER:
                if self.read(place, len(MAGIC) + 1) != MAGIC:
                    self._note(f"byte {place}: the file does not end as an MCAP file does; what is before it is whole")
                return
        self._note(f"byte {place}: the file ends without its closing record; what is before it is whole")

    def search(self, place: int, until: int) -> Found | None:
        """The first record at `place` or behind, before `until`, that is as the package writes it."""
        for start in range(place, until, WINDOW):
            data = self.read(start, min(WINDOW, until - start) + HEAD.size - 1)
            for match in HEADS.finditer(data):
                if self._vain > VAIN_MOST:
                    return None
                if found := self._landing(start + match.start()):
                    return found
        return None

    def _at_or_behind(self, place: int, unpack: bool) -> Found | None:
        try:
            return self._record(place, unpack)
        except Damaged as error:
            why = str(error)
        found = self.search(place + 1, self.size)
        end = found.place if found else self.size
        if self._vain > VAIN_MOST:
            why = f"{why}; too much that looks like records and is none"
        elif not found:
            why = f"the file ends within a record ({why})"
        self._note(f"byte {place}: {why}; {end - place} bytes left out")
        return found

    def _head(self, place: int) -> tuple[int, int]:
        """(opcode, end) of what may be a record; Damaged when it cannot be one."""
        head = self.read(place, HEAD.size)
        if len(head) < HEAD.size:
            raise Damaged("no room for a record")
        opcode, size = HEAD.unpack(head)
        if not opcode or (size > MOST and opcode != Opcode.ATTACHMENT):
            raise Damaged("no record")
        end = place + HEAD.size + size
        if end > self.size:
            raise Damaged(f"a record of {size} bytes where {self.size - place - HEAD.size} are left")
        if opcode == Opcode.FOOTER and not (end == self.size or self.read(end, len(MAGIC)) == MAGIC):
            raise Damaged("a closing record that closes nothing")
        return opcode, end

    def _begins(self, place: int) -> bool:
        """Whether a known record, or the end of the file, may stand here."""
        try:
            return place == self.size or self._head(place)[0] <= max(Opcode)
        except Damaged:
            return False

    def _is_followed(self, place: int) -> bool:
        """Whether a known record may stand behind the one at `place`."""
        try:
            return self._begins(self._head(place)[1])
        except Damaged:
            return False

    def _record(self, place: int, unpack: bool) -> Found:
        if self.read(place, 1) == bytes([Opcode.CHUNK]) and (unpack or not self._is_followed(place)):
            return self._chunk(place, is_known=True)
        opcode, end = self._head(place)
        if opcode != Opcode.FOOTER and not self._begins(end) and self.search(place + 1, end):
            raise Damaged("a record that does not fit its length")
        return Found(place, end, opcode)

    def _chunk(self, place: int, is_known: bool) -> Found:
        """A chunk of the length that stands before it or in it, whichever the checksum confirms. `is_known`: it is one,
        even without a checksum."""
        begin = place + HEAD.size
        head, outer = ChunkHead.read(self.read(begin, 80)), int.from_bytes(self.read(place + 1, 8), "little")
        lengths = {outer, head.length + head.packed}
        fault = Damaged(f"a chunk of {outer} bytes that does not fit its length, where {self.size - begin} are left")
        if not head.crc and (len(lengths) > 1 or not is_known):
            raise fault
        for length in sorted(
            lengths
        ):  # the shorter first: a program that unpacks does not mind bytes that are too many
            if length <= min(MOST, self.size - begin):
                try:
                    inside = head.unpacked(memoryview(self.read(begin, length))[head.length :])
                except Damaged as error:
                    fault = error
                    continue
                if len(lengths) > 1:
                    self._note(
                        f"byte {place}: a chunk whose length is damaged; its checksum is right, nothing is left out"
                    )
                return Found(place, begin + length, Opcode.CHUNK, inside)
        raise fault

    def _landing(self, place: int) -> Found | None:
        """The record at `place`, if its bytes say that it is one."""
        try:
            opcode, end = self._head(place)
            found = self._chunk(place, is_known=False) if opcode == Opcode.CHUNK else Found(place, end, opcode)
            if opcode == Opcode.CHUNK or self._is_as_written(found):
                return found
        except Damaged:
            end = place + MOST
        self._vain += min(end - place, self.size - place)
        return None

    def _is_as_written(self, found: Found) -> bool:
        """Whether the package would write just these bytes; of a message its channel and what follows tell."""
        if found.opcode not in {*KINDS, Opcode.MESSAGE} or (self.is_chunked and found.opcode in INNER):
            return False
        if found.opcode == Opcode.MESSAGE:
            channel = int.from_bytes(self.read(found.place + HEAD.size, 2), "little")
            return channel in self.channels and self._begins(found.end)
        builder = RecordBuilder()
        self.content(found).write(builder)
        return builder.end() == self.read(found.place, found.end - found.place)
