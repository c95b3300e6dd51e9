"""Finds the records of an MCAP file one after the other, and goes on behind what is damaged.

Each record's length is held against the lengths inside of it. Where they disagree, or a chunk's checksum is wrong, the
bytes are searched for the next record that agrees with itself; a chunk is believed by its checksum alone.
"""

import os
import re
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from ..errors import UserError
from .mcaprecords import (
    ATTACHMENT,
    ATTACHMENT_INDEX,
    CHUNK,
    CHUNK_HEAD,
    CHUNK_INDEX,
    CHUNK_MOST,
    DATA_END,
    FOOTER,
    MAGIC,
    MESSAGE,
    MESSAGE_INDEX,
    METADATA,
    METADATA_INDEX,
    RECORD,
    RECORD_MOST,
    SHAPES,
    STATISTICS,
    SUMMARY_OFFSET,
    Damaged,
    shape_size,
    unpack_chunk,
    unpacked_size,
    with_length,
)

# A record's head, as a search for one sees it: a known opcode and a length of at most RECORD_MOST.
HEAD = re.compile(rb"(?=[\x02\x06-\x0f].{3}[\x00-\x04]\x00{4})", re.DOTALL)
# What may also stand inside a chunk that is not packed is no place to go on from.
LANDINGS = {
    FOOTER,
    CHUNK,
    MESSAGE_INDEX,
    CHUNK_INDEX,
    ATTACHMENT_INDEX,
    STATISTICS,
    METADATA,
    METADATA_INDEX,
    SUMMARY_OFFSET,
    DATA_END,
}
HEAD_BYTES = 80  # read at once: in them are the lengths of most records
WINDOW_FIRST, WINDOW_MOST = 1 << 12, 1 << 20  # bytes searched at a time
PIECE = 1 << 20  # bytes of a checksum at a time
VAIN_MOST = 1 << 30  # bytes unpacked in a search that turned out to be no chunk: more is a file made to cost time


class RecordingError(UserError, ValueError):
    """A file that is no recording, or cannot be read or written. Its text is one line: file, what, remedy."""


class InVain(Exception):
    """A search that is given up."""


@dataclass(frozen=True)
class Record:
    """Where a record stands, from its opcode to behind its last byte; `data`: what is in a chunk, where it was unpacked."""

    place: int
    end: int
    opcode: int
    data: memoryview | None = None

    @property
    def size(self) -> int:
        """Bytes of the body."""
        return self.end - self.place - RECORD.size


class Walk:
    """The records of one file."""

    def __init__(self, path: str | Path, number: int, note: Callable[[str], None]):
        """`number`: file descriptor, the caller's to close; `note` takes a line for each damage."""
        self._path, self._number, self._note = path, number, note
        self._unpacks, self._vain = False, 0
        self._looked_at = -1, b""
        try:
            self.size = os.fstat(number).st_size
        except OSError as error:
            raise self._unreadable(error) from error

    def read(self, place: int, count: int) -> bytes:
        """Reads at most `count` bytes, fewer at the end of the file. RecordingError when the file cannot be read."""
        try:
            return os.pread(self._number, count, place)
        except OSError as error:
            raise self._unreadable(error) from error

    def body(self, record: Record) -> memoryview:
        return memoryview(self.read(record.place + RECORD.size, record.size))

    def crc(self, start: int, end: int) -> int:
        """CRC-32 of the bytes from `start` up to `end`."""
        crc = 0
        while start < end and (piece := self.read(start, min(PIECE, end - start))):
            crc = zlib.crc32(piece, crc)
            start += len(piece)
        return crc

    def records(self, unpack: bool) -> Iterator[Record]:
        """Whole records up to the footer. `unpack`: chunks too, so that a wrong checksum is a damage."""
        self._unpacks, self._vain = unpack, 0
        place = len(MAGIC)
        if self.read(0, place) != MAGIC:
            self._note("byte 0: it does not begin as an MCAP file does; read on all the same")
        record = None
        while place < self.size:
            # A record without a checksum may have swallowed what is behind it, if that does not go on as it should.
            doubtful = record.place if record and record.data is None else place
            record = self._at_or_behind(place, doubtful)
            if record is None:
                return
            yield record
            place = record.end
            if record.opcode == FOOTER:
                self._end(place)
                return
        self._note(f"byte {place}: the file ends without its closing record; what is before it is whole")

    def search(self, place: int, until: int) -> Record | None:
        """The first record at `place` or behind, before `until`, that agrees with itself."""
        window = WINDOW_FIRST
        while place < until:
            data = self.read(place, window + RECORD.size - 1)
            for match in HEAD.finditer(data):
                if record := self._landing(place + match.start()):
                    return record
            place, window = place + window, min(2 * window, WINDOW_MOST)
        return None

    def _unreadable(self, error: OSError) -> RecordingError:
        return RecordingError(f"{self._path}: cannot be read ({error.strerror}); copy it from its source again")

    def _end(self, place: int) -> None:
        if self.read(place, len(MAGIC)) != MAGIC or self.size != place + len(MAGIC):
            self._note(f"byte {place}: the file does not end as an MCAP file does; what is before it is whole")

    def _at_or_behind(self, place: int, doubtful: int) -> Record | None:
        """The record at `place`; if there is none, the first behind `doubtful` that agrees with itself."""
        why = "no record"
        try:
            try:
                return self._record(place)
            except Damaged as error:
                why = str(error)
            record = self.search(doubtful + 1, self.size)
        except InVain:
            why = f"{why}; too much that looks like chunks and is none"
            record = None
        end = record.place if record else self.size
        begin = place if place < end else doubtful
        why = why if record else f"the file ends within a record ({why})"
        self._note(f"byte {begin}: {why}; {end - begin} bytes left out")
        return record

    def _record(self, place: int) -> Record:
        """The record at `place`. A chunk with a damaged head is one too, if its checksum says so."""
        head = self._head(place)
        if len(head) < RECORD.size:
            raise Damaged("no room for a record")
        opcode, size = RECORD.unpack_from(head)
        if opcode == CHUNK:
            return self._chunk(place, size)
        record = Record(place, place + RECORD.size + size, opcode)
        fault = Damaged("a record that does not fit its length")
        try:
            if self._fits(record):
                return record
            is_likely = self._begins(record.end)
        except Damaged as error:
            fault, is_likely = error, False
        if chunk := self._disguised_chunk(place, size):
            return chunk
        if not is_likely:
            raise fault
        return record

    def _fits(self, record: Record) -> bool:
        """Whether the fields of a record take just its bytes; of unknown ones and of messages that cannot be known.

        Damaged when they take more, or it is no record.
        """
        if record.end > self.size:
            left = self.size - record.place - RECORD.size
            raise Damaged(f"a record of {record.size} bytes where {left} are left")
        if record.opcode == 0 or (record.size > RECORD_MOST and record.opcode != ATTACHMENT):
            raise Damaged("no record")
        if record.opcode == FOOTER:
            self._check_footer(record.end, record.size)
        if record.opcode == MESSAGE or record.opcode not in SHAPES:
            return False
        return self._shape_size(record.place, record.opcode, record.size) == record.size

    def _check_footer(self, end: int, size: int) -> None:
        if size != SHAPES[FOOTER][0] or not (self.size == end + len(MAGIC) or self.read(end, len(MAGIC)) == MAGIC):
            raise Damaged("a closing record that closes nothing")

    def _head(self, place: int) -> bytes:
        """The first bytes of a record, once read for all that looks at them."""
        if self._looked_at[0] != place:
            self._looked_at = place, self.read(place, HEAD_BYTES)
        return self._looked_at[1]

    def _shape_size(self, place: int, opcode: int, most: int) -> int:
        head = self._head(place)

        def read(at: int, count: int) -> bytes:
            end = RECORD.size + at + count
            return head[end - count : end] if end <= len(head) else self.read(place + end - count, count)

        return shape_size(opcode, most, read)

    def _begins(self, place: int) -> bool:
        """Whether a known record may begin here."""
        head = self.read(place, RECORD.size)
        if len(head) < RECORD.size:
            return False
        opcode, size = RECORD.unpack(head)
        return opcode in SHAPES and size <= self.size - place - RECORD.size

    def _chunk(self, place: int, size: int) -> Record:
        """A chunk. Its end follows from its length, if the length inside agrees; else from the one that the checksum confirms."""
        left = self.size - place - RECORD.size
        inner = self._inner_size(place, left)
        if inner == size and size <= RECORD_MOST:
            return self._plain_chunk(Record(place, place + RECORD.size + size, CHUNK))
        # The shorter one first: a program that unpacks does not mind bytes that are too many.
        for length in sorted({size} if inner is None else {inner, size}):
            if length <= min(left, RECORD_MOST) and (record := self._confirmed(place, length)):
                self._note(f"byte {place}: a chunk whose length is damaged; its checksum is right, nothing is left out")
                return record
        raise Damaged(f"a chunk of {size} bytes that does not fit its length, where {left} are left")

    def _inner_size(self, place: int, most: int) -> int | None:
        """Bytes of a chunk's body by the length of what is packed in it; None when they are more than `most`."""
        try:
            return self._shape_size(place, CHUNK, most)
        except Damaged:
            return None

    def _plain_chunk(self, record: Record) -> Record:
        if not self._unpacks:
            return record
        return Record(record.place, record.end, CHUNK, unpack_chunk(self.body(record)))

    def _disguised_chunk(self, place: int, size: int) -> Record | None:
        """A chunk under another opcode."""
        left = self.size - place - RECORD.size
        if size > min(left, RECORD_MOST) or self._inner_size(place, left) != size:
            return None
        record = self._confirmed(place, size)
        if record:
            self._note(f"byte {place}: a chunk under another opcode; its checksum is right, nothing is left out")
        return record

    def _confirmed(self, place: int, size: int) -> Record | None:
        """A chunk of so many bytes, whatever the length inside says, if its checksum is there and right.

        InVain when too many of them were none.
        """
        if size < CHUNK_HEAD.size:
            return None
        record = Record(place, place + RECORD.size + size, CHUNK)
        body = self.body(record)
        try:
            return Record(place, record.end, CHUNK, unpack_chunk(with_length(body), checked=True))
        except Damaged:
            self._vain += size + min(unpacked_size(body), CHUNK_MOST)
            if self._vain > VAIN_MOST:
                raise InVain from None
            return None

    def _landing(self, place: int) -> Record | None:
        """The record at `place`, if there is one that agrees with itself."""
        opcode, size = RECORD.unpack_from(self._head(place))
        end = place + RECORD.size + size
        if opcode not in LANDINGS or end > self.size or size > RECORD_MOST:
            return None
        try:
            if self._shape_size(place, opcode, size) != size:
                return None
            if opcode == CHUNK:
                return self._confirmed(place, size)
            if opcode == FOOTER:
                self._check_footer(end, size)
        except Damaged:
            return None
        return Record(place, end, opcode)
