"""One reading of an MCAP file's messages, and what it finds wrong."""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from .ledger import Ledger
from .mcaprecords import (
    CHANNEL,
    CHUNK,
    CHUNK_INDEX,
    DATA_END,
    MESSAGE,
    MESSAGE_HEAD,
    STATISTICS,
    Cursor,
    Damaged,
    inner_records,
)
from .mcapwalk import Record, Walk

DESCRIPTION_MOST = 1 << 12  # bytes of a channel's description
STATISTICS_MOST = 1 << 20
NUMBERED = "whisker_numbered"  # key of a channel's metadata: sequence numbers count its messages in the file, from 1 on


@dataclass(frozen=True)
class Message:
    topic: str
    log_time: int
    data: memoryview


@dataclass(frozen=True)
class Channel:
    topic: str
    is_numbered: bool


def add_channel(channels: dict[int, Channel], body: memoryview) -> None:
    """Put what a record describes among the others; Damaged when it is none."""
    if len(body) > DESCRIPTION_MOST:
        raise Damaged(f"a channel's description of {len(body)} bytes")
    cursor = Cursor(body)
    number, _ = cursor.numbers("<HH")
    topic, _ = cursor.text(), cursor.text()
    channels[number] = Channel(topic, NUMBERED in cursor.text_map())


class Reading:
    """Reads a file from front to back. Call `messages` first; then `check_rest` and `losses`."""

    def __init__(self, walk: Walk, channels: dict[int, Channel], is_index_whole: bool, note: Callable[[str], None]):
        """`channels`: of the index at the file's end, added to; what the index counts matters if it is whole."""
        self._walk, self._channels, self._note = walk, channels, note
        self._is_index_whole = is_index_whole
        self._plain: set[int] = set()  # channels that are described outside of chunks
        self._nameless: Counter[int] = Counter()
        self._ledger = Ledger()
        self._data_end: Record | None = None

    def messages(self) -> Iterator[Message]:
        """All messages of whole records, in the order of the file; a line for each damage."""
        for record in self._walk.records(unpack=True):
            try:
                if record.opcode == CHUNK:
                    self._ledger.chunk(record.place, record.end - record.place)
                    yield from self._of_chunk(record.data)
                elif record.opcode in (CHUNK_INDEX, STATISTICS):
                    self._count(record)
                else:
                    yield from self._beside_chunks(record)
            except Damaged as error:
                self._note(f"byte {record.place}: {error}; left out")

    def check_rest(self) -> None:
        """Hold what is no message against the checksum of everything."""
        if self._data_end:
            (crc,) = Cursor(self._walk.body(self._data_end)).numbers("<I")
            if crc and self._walk.crc(0, self._data_end.place) != crc:
                self._note(
                    "something beside the messages is not as it was written (names or index); no message is lost"
                )

    def losses(self) -> Iterator[str]:
        """A line for each topic of which messages are missing."""
        for channel, count in self._nameless.items():
            yield f"{count} messages on channel {channel}, which nothing describes; left out"
        yield from self._ledger.differences(self._name)

    def _name(self, channel: int) -> str:
        topic = self._channels[channel].topic if channel in self._channels else f"channel {channel}"
        return "".join(letter if letter.isprintable() else "?" for letter in topic[:100])

    def _of_chunk(self, data: memoryview) -> Iterator[Message]:
        for opcode, body in inner_records(data):
            if opcode == MESSAGE:
                yield from self._message(body)
            elif opcode == CHANNEL:
                add_channel(self._channels, body)

    def _beside_chunks(self, record: Record) -> Iterator[Message]:
        """Files without chunks describe each channel before its messages; in others nothing here is a message."""
        if record.opcode == CHANNEL:
            body = self._walk.body(record)
            add_channel(self._channels, body)
            if self._data_end is None:
                self._plain.add(int.from_bytes(body[:2], "little"))
        elif record.opcode == MESSAGE:
            body = self._walk.body(record)
            if int.from_bytes(body[:2], "little") not in self._plain:
                raise Damaged("a message on a channel that nothing describes")
            yield from self._message(body)
        elif record.opcode == DATA_END:
            self._data_end = record

    def _count(self, record: Record) -> None:
        """What the index counts, if it is as it was written."""
        if not self._is_index_whole:
            return
        if record.opcode == CHUNK_INDEX:
            self._ledger.chunk_index(self._walk.body(record))
        elif record.size <= STATISTICS_MOST:
            self._ledger.statistics(self._walk.body(record))

    def _message(self, body: memoryview) -> Iterator[Message]:
        if len(body) < MESSAGE_HEAD.size:
            raise Damaged(f"a message of {len(body)} bytes")
        number, sequence, log_time, _ = MESSAGE_HEAD.unpack_from(body)
        channel = self._channels.get(number)
        if channel is None:
            self._nameless[number] += 1
            return
        self._ledger.message(number, sequence, channel.is_numbered)
        yield Message(channel.topic, log_time, body[MESSAGE_HEAD.size :])
