"""What was read of an MCAP file against what its end says was written: no loss is silent."""

from collections import Counter
from collections.abc import Callable, Iterator

from .mcaprecords import Cursor

CHANNELS_MOST = 1 << 16  # ids have 16 bits


class Ledger:
    """Counts of one reading, from front to back."""

    def __init__(self):
        self._seen: dict[int, int] = {}  # messages by channel
        self._next: dict[int, int] = {}  # sequence number that comes next, of numbered channels
        self._lost: Counter[int] = Counter()  # by their sequence numbers
        self._astray: Counter[int] = Counter()  # whose sequence numbers go back
        self._chunks = self._listed = self._difference = 0
        self._written: dict[int, int] | None = None

    def message(self, channel: int, sequence: int, is_numbered: bool) -> None:
        self._seen[channel] = self._seen.get(channel, 0) + 1
        if is_numbered:
            if sequence != self._next.get(channel, 1):
                self._jump(channel, sequence)
            self._next[channel] = (sequence + 1) & 0xFFFFFFFF

    def _jump(self, channel: int, sequence: int) -> None:
        ahead = (sequence - self._next.get(channel, 1)) & 0xFFFFFFFF
        if ahead < 1 << 31:
            self._lost[channel] += ahead
        else:
            self._astray[channel] += 1

    def chunk(self, place: int, length: int) -> None:
        """A whole chunk that was read; bytes with its head."""
        self._chunks += 1
        self._difference += hash((place, length))

    def chunk_index(self, body: memoryview) -> None:
        """A record of the index that lists a chunk."""
        _, _, place, length = Cursor(body).numbers("<QQQQ")
        self._listed += 1
        self._difference -= hash((place, length))

    def statistics(self, body: memoryview) -> None:
        """The record that counts what was written."""
        cursor = Cursor(body)
        cursor.take(42)
        (size,) = cursor.numbers("<I")
        pairs = Cursor(cursor.take(size))
        self._written = dict(pairs.numbers("<HQ") for _ in range(min(size // 10, CHANNELS_MOST)))

    def differences(self, name: Callable[[int], str]) -> Iterator[str]:
        """A line for each that does not agree; name(channel) is what to call it."""
        if self._written is not None:
            yield from self._by_statistics(self._written, name)
            if self._difference or self._chunks != self._listed:
                yield f"the index at its end lists {self._listed} chunks; {self._chunks} are whole, or they moved"
        else:
            for channel, lost in self._lost.items():
                if lost:
                    yield f"{name(channel)}: at least {lost} messages are lost"
        for channel, astray in self._astray.items():
            yield f"{name(channel)}: {astray} messages out of order"

    def _by_statistics(self, written: dict[int, int], name: Callable[[int], str]) -> Iterator[str]:
        for channel in written.keys() | self._seen.keys():
            lost = written.get(channel, 0) - self._seen.get(channel, 0)
            if lost > 0:
                yield f"{name(channel)}: {lost} of {written[channel]} messages are lost"
            elif lost < 0:
                yield f"{name(channel)}: {-lost} messages more than were written"
