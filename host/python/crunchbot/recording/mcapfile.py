"""Reads MCAP files from anywhere: cut off, damaged or hostile ones give what is whole, and never more memory than they say.

A recording that a crash cut off must still be of use, and a damaged one must say what it lost.
"""

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from mcap import records
from mcap.opcode import Opcode

from ..errors import UserError
from ..files import open_file
from .salvage import MAGIC, Damaged, Found, Salvage, inner_records

DAMAGE_MOST = 100  # lines of damaged places, and as many of what is lost by them
METADATA_MOST = 1 << 22  # bytes of all metadata records together
SEARCHED = 1 << 24  # bytes in which a file that does not begin as MCAP does must show a record of one
LFS = b"version https://git-lfs.github.com/"  # how what stands for a file in a clone without it begins
NUMBERED = "whisker_numbered"  # key of a channel's metadata: sequence numbers count its messages in the file, from 1 on
PARSED = {Opcode.CHANNEL, Opcode.MESSAGE, Opcode.METADATA, Opcode.STATISTICS, Opcode.DATA_END, Opcode.FOOTER}


class RecordingError(UserError, ValueError):
    """A file that is no recording, or cannot be read or written. Its text is one line: file, what, remedy."""


@dataclass(frozen=True)
class Message:
    topic: str
    log_time: int
    data: bytes


class Tally:
    """What was read in one pass, against what the file says was written: no loss is silent."""

    def __init__(self):
        self.chunks = 0
        self._seen: Counter[int] = Counter()
        self._next: dict[int, int] = {}  # sequence number that comes next, of numbered channels
        self._lost: Counter[int] = Counter()  # by their sequence numbers
        self._astray: Counter[int] = Counter()  # whose sequence numbers go back

    def add(self, channel: records.Channel, sequence: int) -> None:
        self._seen[channel.id] += 1
        if NUMBERED in channel.metadata:
            ahead = (sequence - self._next.get(channel.id, 1)) & 0xFFFFFFFF
            if ahead < 1 << 31:
                self._lost[channel.id] += ahead
            else:
                self._astray[channel.id] += 1
            self._next[channel.id] = (sequence + 1) & 0xFFFFFFFF

    def differences(self, written: records.Statistics | None, name: Callable[[int], str]) -> Iterator[str]:
        """A line for each that does not agree; `written`: what the file's end counts, name(channel): what to call it."""
        if written is None:
            for channel, lost in self._lost.items():
                if lost:
                    yield f"{name(channel)}: at least {lost} messages are lost"
        else:
            counts = written.channel_message_counts
            for channel in counts.keys() | self._seen.keys():
                count = counts.get(channel, 0)
                lost = count - self._seen[channel]
                if lost > 0:
                    yield f"{name(channel)}: {lost} of {count} messages are lost"
                elif lost < 0:
                    yield f"{name(channel)}: {-lost} messages more than were written"
            if written.chunk_count != self.chunks:
                yield f"the index at its end counts {written.chunk_count} chunks; {self.chunks} are whole"
        for channel, count in self._astray.items():
            yield f"{name(channel)}: {count} messages out of order"


class McapFile:
    """One file, read from front to back. Use as a context manager.

    damage: what was left out and how much that was, a line each, filled while reading. metadata: by the record's name;
    records of one name together, what comes later counts.
    """

    def __init__(self, path: str | Path):
        """RecordingError when it cannot be opened, or is no MCAP file even in parts."""
        self.path = path
        self.damage: list[str] = []
        self.metadata: dict[str, dict[str, str]] = {}
        self.versions: list[tuple[str, dict[str, str]]] = []  # (name, content) of each metadata record
        self._metadata_room = METADATA_MOST
        self._plain: set[int] = set()  # channels that are described beside chunks, before the index
        self._ends = self._is_index_whole = False
        self._data_end: tuple[Found, int] | None = None  # with the checksum of all before it, 0 for none
        self._written: records.Statistics | None = None
        try:
            self._file = open_file(path)
        except OSError as error:
            raise self._unreadable(error, "give a recording made by 'whisker record'") from error
        try:
            self._salvage = Salvage(self._file, self.note)
            self._open()
        except OSError as error:
            self.close()
            raise self._unreadable(error) from error
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *exception) -> None:
        self.close()

    def close(self) -> None:
        self._file.close()

    @property
    def complete(self) -> bool:
        """The writer came to its end, and nothing is damaged as far as is known: by all of it once `messages` has ended."""
        return self._ends and not self.damage

    @property
    def topics(self) -> set[str]:
        """The topics that are known by now."""
        return {channel.topic for channel in self._salvage.channels.values()}

    def note(self, text: str) -> None:
        """Add a line to `damage`, unless there are enough."""
        if len(self.damage) < DAMAGE_MOST:
            self.damage.append(f"{self.path}: {text}")
        elif len(self.damage) == DAMAGE_MOST:
            self.damage.append(f"{self.path}: more is damaged than is listed here")

    def messages(self) -> Iterator[Message]:
        """All messages of whole records, in the order of the file."""
        self.damage = []
        tally, nameless = Tally(), Counter()
        try:
            for message in self._raw_messages(tally):
                channel = self._salvage.channels.get(message.channel_id)
                if channel is None:
                    nameless[message.channel_id] += 1
                    continue
                tally.add(channel, message.sequence)
                yield Message(channel.topic, message.log_time, message.data)
            self._check_end()
            lost = [
                f"{count} messages on channel {number}, which nothing describes; left out"
                for number, count in nameless.items()
            ]
            lost += tally.differences(self._written, self._name)
            self.damage += [f"{self.path}: {line}" for line in lost[:DAMAGE_MOST]]
            if not self.damage:
                self._check_all()
        except OSError as error:
            raise self._unreadable(error) from error

    def _unreadable(self, error: OSError, remedy: str = "copy it from its source again") -> RecordingError:
        return RecordingError(f"{self.path}: cannot be read ({error.strerror or error}); {remedy}")

    def _name(self, channel: int) -> str:
        known = self._salvage.channels.get(channel)
        topic = known.topic if known else f"channel {channel}"
        return "".join(letter if letter.isprintable() else "?" for letter in topic[:100])

    def _raw_messages(self, tally: Tally) -> Iterator[records.Message]:
        """Messages in chunks and beside them; a line for each damage."""
        for found in self._salvage.records(unpack=True):
            tally.chunks += found.inside is not None
            try:
                for record in self._contents(found):
                    if isinstance(record, records.Channel):
                        self._salvage.channels[record.id] = record
                    elif isinstance(record, records.Message):
                        yield record
            except Damaged as error:
                self.note(f"byte {found.place}: {error}; left out")

    def _contents(self, found: Found) -> Iterator[records.McapRecord]:
        if found.inside is not None:
            yield from inner_records(found.inside)
        elif found.opcode in PARSED:
            record = self._salvage.content(found)
            if isinstance(record, records.Message) and not self._is_of_file(record):
                raise Damaged("a message beside the chunks, whose channel nothing beside them describes")
            yield record

    def _is_of_file(self, message: records.Message) -> bool:
        """Whether a message may stand where it does, beside chunks."""
        return not self._salvage.is_chunked or message.channel_id in self._plain

    def _open(self) -> None:
        if not self._is_mcap():
            is_pointer = self._salvage.read(0, len(LFS)) == LFS
            remedy = "fetch it by 'git lfs pull'" if is_pointer else "give a file of 'whisker record' or 'whisker bag'"
            raise RecordingError(f"{self.path}: not an MCAP file{' but its Git LFS pointer' * is_pointer}; {remedy}")
        for found in self._salvage.records(unpack=False):
            if found.opcode in PARSED - {Opcode.MESSAGE}:
                with suppress(Damaged):  # `messages` says so
                    self._take(found, self._salvage.content(found))
        self._check_end()

    def _is_mcap(self) -> bool:
        """A file is recognised by its first or last bytes, or by anything else that only such files have."""
        file = self._salvage
        ends = file.read(0, len(MAGIC)), file.read(max(file.size - len(MAGIC), 0), len(MAGIC))
        return MAGIC in ends or file.search(0, min(file.size, SEARCHED)) is not None

    def _take(self, found: Found, record: records.McapRecord) -> None:
        match record:
            case records.Channel():
                self._salvage.channels[record.id] = record
                if not self._data_end:
                    self._plain.add(record.id)
            case records.Metadata():
                self._metadata_room -= found.end - found.place
                if self._metadata_room >= 0:
                    self.versions.append((record.name, record.metadata))
                    self.metadata[record.name] = self.metadata.get(record.name, {}) | record.metadata
            case records.DataEnd():
                self._data_end = found, record.data_section_crc
            case records.Statistics():
                self._written = record
            case records.Footer():
                self._ends = True
                self._check_index(found, record)

    def _check_index(self, found: Found, footer: records.Footer) -> None:
        """Believe the index at the end if its checksum is right."""
        start = self._data_end[0].end if self._data_end else footer.summary_start
        self._is_index_whole = not footer.summary_crc or self._salvage.crc(start, found.end - 4) == footer.summary_crc
        if not self._is_index_whole:
            self._written = None
            self._salvage.channels.clear()

    def _check_end(self) -> None:
        """What is wrong with index and metadata. A finished file may know more at its end; one cut off says things twice."""
        if self._ends and not (self._is_index_whole and self._data_end):
            self.note("the index at its end is damaged")
        is_finished = self._ends or self._data_end
        if not is_finished and any(content != self.metadata[name] for name, content in self.versions):
            self.note("its metadata records disagree; the later one counts")

    def _check_all(self) -> None:
        """Hold what no chunk's checksum covers against the checksum of everything."""
        if self._data_end:
            found, crc = self._data_end
            if crc and self._salvage.crc(0, found.place) != crc:
                chunked = "something beside the messages is not as it was written (names or index); no message is lost"
                loose = "the checksum of the whole is wrong; messages may be changed that no chunk's checksum covers"
                self.note(chunked if self._salvage.is_chunked else loose)
