"""Reads MCAP files from anywhere: cut off, damaged or hostile ones give what is whole, and never more memory than they say.

The format is public (mcap.dev/spec); writing is the package mcap's work. Reading is ours because a recording that a
crash cut off must still be of use, because a damaged one must say what it lost, and because a length in a file must not
be believed.
"""

from collections.abc import Iterator
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import BinaryIO

from .mcapmessages import NUMBERED, Channel, Message, Reading, add_channel
from .mcaprecords import CHANNEL, DATA_END, FOOTER, FOOTER_BODY, MAGIC, METADATA, Cursor, Damaged
from .mcapwalk import Record, RecordingError, Walk

__all__ = ["MAGIC", "NUMBERED", "McapFile", "Message", "RecordingError"]

DAMAGE_MOST = 100  # lines of damaged places, and as many of what is lost by them
METADATA_MOST = 1 << 22  # bytes of all metadata records together
SEARCHED = 1 << 24  # bytes in which a file that does not begin as MCAP does must show a record of one


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
        self._ends = self._is_finished = self._is_index_whole = False
        self._channels: dict[int, Channel] = {}  # of the index
        try:
            self._file: BinaryIO = open(path, "rb")  # noqa: SIM115 - closed by close()
        except OSError as error:
            text = f"{path}: cannot be read ({error.strerror}); give a recording made by 'whisker record'"
            raise RecordingError(text) from error
        try:
            self._walk = Walk(path, self._file.fileno(), self.note)
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

    @property
    def complete(self) -> bool:
        """The writer came to its end, and nothing is damaged as far as is known: by all of it once `messages` has ended."""
        return self._ends and not self.damage

    @property
    def topics(self) -> set[str]:
        """The topics that are known by now."""
        return {channel.topic for channel in self._channels.values()}

    def note(self, text: str) -> None:
        """Add a line to `damage`, unless there are enough."""
        if len(self.damage) < DAMAGE_MOST:
            self.damage.append(f"{self.path}: {text}")
        elif len(self.damage) == DAMAGE_MOST:
            self.damage.append(f"{self.path}: more is damaged than is listed here")

    def messages(self) -> Iterator[Message]:
        """All messages of whole records, in the order of the file."""
        self.damage = []
        reading = Reading(self._walk, self._channels, self._is_index_whole, self.note)
        yield from reading.messages()
        self._check_end()
        if not self.damage:
            reading.check_rest()
        self.damage += [f"{self.path}: {line}" for line in islice(reading.losses(), DAMAGE_MOST)]

    def _open(self) -> None:
        if not self._is_mcap():
            raise RecordingError(f"{self.path}: not an MCAP file; give a recording made by 'whisker record'")
        summary = None
        for record in self._walk.records(unpack=False):
            if record.opcode == METADATA:
                self._note_metadata(record)
            elif record.opcode == DATA_END:
                summary, self._is_finished = record.end, True
            elif record.opcode == CHANNEL:
                with suppress(Damaged):  # then the index's checksum is wrong too
                    add_channel(self._channels, self._walk.body(record))
            elif record.opcode == FOOTER:
                self._ends = True
                self._check_index(summary, record)
        self._check_end()

    def _is_mcap(self) -> bool:
        """A file is recognised by its first or last bytes, or by anything else that only such files have."""
        ends = (self._walk.read(0, len(MAGIC)), self._walk.read(max(self._walk.size - len(MAGIC), 0), len(MAGIC)))
        return MAGIC in ends or self._walk.search(0, min(self._walk.size, SEARCHED)) is not None

    def _check_index(self, summary: int | None, footer: Record) -> None:
        """Believe the index at the end if its checksum is right."""
        start, _, crc = FOOTER_BODY.unpack(self._walk.body(footer))
        summary = start if summary is None else summary
        self._is_index_whole = not crc or self._walk.crc(summary, footer.end - 4) == crc
        if not self._is_index_whole:
            self._channels.clear()

    def _check_end(self) -> None:
        """What is wrong with index and metadata. A finished file may know more at its end; one cut off says things twice."""
        if self._ends and not self._is_index_whole:
            self.note("the index at its end is damaged")
        if not (self._ends or self._is_finished) and any(
            content != self.metadata[name] for name, content in self.versions
        ):
            self.note("its metadata records disagree; the later one counts")

    def _note_metadata(self, record: Record) -> None:
        self._metadata_room -= record.size
        if self._metadata_room < 0:
            return
        try:
            cursor = Cursor(self._walk.body(record))
            self.versions.append((cursor.text(), cursor.text_map()))
        except Damaged:
            return  # names and counts only; the messages do not depend on them
        name, content = self.versions[-1]
        self.metadata[name] = self.metadata.get(name, {}) | content
