"""The records of MCAP (mcap.dev/spec): their shapes, and what is in those that matter here. No length is believed."""

import struct
import zlib
from collections.abc import Callable, Iterator

import lz4.frame
import zstandard

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(0x01, 0x09)
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = range(0x09, 0x10)
RECORD = struct.Struct("<BQ")  # opcode, bytes that follow
MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
CHUNK_HEAD = struct.Struct("<QQQI")  # first time, last time, bytes unpacked, their CRC
FOOTER_BODY = struct.Struct("<QQI")  # where the summary and its offsets begin, CRC of the summary
CHUNK_MOST = 1 << 26  # bytes unpacked; recordings have 1 MiB
RECORD_MOST = 1 << 26  # bytes of a record; attachments, which are skipped unread, may have more

# The fields of each record: a number stands for so many bytes, "I" and "Q" for bytes behind their number as uint32
# and uint64, "*" for all the rest.
SHAPES = {
    HEADER: ("I", "I"),
    FOOTER: (FOOTER_BODY.size,),
    SCHEMA: (2, "I", "I", "I"),
    CHANNEL: (4, "I", "I", "I"),
    MESSAGE: (MESSAGE_HEAD.size, "*"),
    CHUNK: (CHUNK_HEAD.size, "I", "Q"),
    MESSAGE_INDEX: (2, "I"),
    CHUNK_INDEX: (32, "I", 8, "I", 16),
    ATTACHMENT: (16, "I", "I", "Q", 4),
    ATTACHMENT_INDEX: (40, "I", "I"),
    STATISTICS: (42, "I"),
    METADATA: ("I", "I"),
    METADATA_INDEX: (16, "I"),
    SUMMARY_OFFSET: (17,),
    DATA_END: (4,),
}

PREFIXES = {"I": 4, "Q": 8}  # bytes of the number in front


class Damaged(ValueError):
    """A record that is not what it should be: it is left out, with a line in `damage`."""


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


def shape_size(opcode: int, size: int, read: Callable[[int, int], bytes]) -> int:
    """The bytes that a record's fields take, by the lengths inside of it; Damaged when they are more than `size`.

    read(at, count): bytes of the record's body.
    """
    at = 0
    for field in SHAPES[opcode]:
        if field == "*":
            return max(size, at)
        if field in PREFIXES:
            count = PREFIXES[field]
            at += count + int.from_bytes(read(at, count), "little")
        else:
            at += field
        if at > size:
            raise Damaged(f"a record of {size} bytes whose fields take more")
    return at


def inner_records(data: memoryview) -> Iterator[tuple[int, memoryview]]:
    """(opcode, body) of each record inside a chunk; Damaged where one is cut off."""
    at = 0
    while at < len(data):
        begin = at + RECORD.size
        opcode, size = RECORD.unpack_from(data, at) if begin <= len(data) else (0, len(data))
        at = begin + size
        if at > len(data):
            raise Damaged("a chunk whose last record is cut off")
        yield opcode, data[begin:at]


def unpack_chunk(body: memoryview, checked: bool = False) -> memoryview:
    """The records inside a chunk; Damaged when it is not what it says. `checked`: one without a checksum is refused."""
    cursor = Cursor(body)
    _, _, size, crc = cursor.numbers(CHUNK_HEAD.format)
    compression = cursor.text()
    (count,) = cursor.numbers("<Q")
    packed = cursor.take(count)
    if size > CHUNK_MOST:
        raise Damaged(f"a chunk of {size} bytes")
    if checked and not crc:
        raise Damaged("a chunk without a checksum where its length is wrong")
    data = _unpack(compression, packed, size)
    if len(data) != size or (crc and zlib.crc32(data) != crc):
        raise Damaged("a chunk that is not as it was written (its checksum is wrong)")
    return memoryview(data)


def unpacked_size(body: memoryview) -> int:
    """Bytes that a chunk says to hold."""
    return CHUNK_HEAD.unpack_from(body)[2]


def with_length(body: memoryview) -> memoryview:
    """A chunk's body whose packed bytes are said to be all that is there, whatever it said before; Damaged if it has none."""
    compression = int.from_bytes(body[CHUNK_HEAD.size : CHUNK_HEAD.size + 4], "little")
    end = CHUNK_HEAD.size + 4 + compression + 8
    if end > len(body):
        raise Damaged("a chunk without room for what is packed in it")
    mended = bytearray(body)
    mended[end - 8 : end] = (len(body) - end).to_bytes(8, "little")
    return memoryview(mended)


def _unpack(compression: str, packed: memoryview, size: int) -> bytes | memoryview:
    """Returns at most size + 1 bytes."""
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
