"""Numbered streams: what every message carries besides its payload, and what is known of each stream from it.

A stream is what one publisher sends on one key from its start to its end. The envelope goes as zenoh's attachment, so
that the payload stays plain CDR of its schema.
"""

import itertools
import os
import struct
import time
from collections.abc import Iterator
from dataclasses import dataclass

VERSION = 1
LAST = 1  # flag: an End, no more of this stream
ENVELOPE = struct.Struct("<HHIQq")  # version, flags, stream, number, sent
STEP_MOST = 2**31  # from one message of a stream to the next: years, at any pace of this robot
NUMBER_MOST, SENT_MOST = 2**53, 2**62


class EnvelopeError(ValueError):
    """Bytes that are no envelope of this version; says what is wrong."""


@dataclass(frozen=True)
class Envelope:
    """stream: drawn at random by each publisher; number: 0, 1, ... in it; sent_ns: the sender's wall clock, since 1970."""

    stream: int
    number: int
    sent_ns: int
    last: bool = False

    def pack(self) -> bytes:
        return ENVELOPE.pack(VERSION, LAST if self.last else 0, self.stream, self.number, self.sent_ns)

    @classmethod
    def unpack(cls, data: bytes | None) -> "Envelope":
        """EnvelopeError when it is none, or that of another version."""
        if data is None or len(data) != ENVELOPE.size:
            raise EnvelopeError(f"an envelope of {len(data or b'')} bytes where {ENVELOPE.size} belong")
        version, flags, stream, number, sent_ns = ENVELOPE.unpack(data)
        if version != VERSION:
            raise EnvelopeError(f"version {version} of the stream, this release has {VERSION}")
        if number > NUMBER_MOST or not 0 <= sent_ns <= SENT_MOST:
            raise EnvelopeError(f"number {number}, sent at {sent_ns} ns: neither can be")
        return cls(stream, number, sent_ns, bool(flags & LAST))


def new_stream() -> int:
    """A stream's number, drawn at random."""
    return int.from_bytes(os.urandom(4), "little")


def envelopes(stream: int | None = None) -> Iterator[Envelope]:
    """Envelopes of a stream (None: a new one), in order; `next(...)` when one is sent."""
    stream = new_stream() if stream is None else stream
    return (Envelope(stream, number, time.time_ns()) for number in itertools.count())


@dataclass
class Tally:
    """What has come on one key, in messages.

    joined_at: number of the first that came: those before it were sent before this side was there;
    missed: sent since then and never come; repeated: come again and left out; restarts: new streams after the first;
    refused: come, but not whole, not possible, of another release or of another source; ended: its sender said that it
    is over. What is refused leaves everything else as it was.
    """

    received: int = 0
    joined_at: int = 0
    missed: int = 0
    repeated: int = 0
    restarts: int = 0
    refused: int = 0
    ended: bool = False
    stream: int | None = None
    next: int = 0
    refused_since: int = 0  # of this stream, since the last that was taken

    def is_repeated(self, envelope: Envelope) -> bool:
        """Whether it came before; then that is counted.

        EnvelopeError when so many cannot have been sent since the last.
        """
        if envelope.stream != self.stream:
            return False
        if envelope.number - self.next > STEP_MOST:
            raise EnvelopeError(f"number {envelope.number} after {self.next - 1}: so many cannot have been sent")
        self.repeated += envelope.number < self.next
        return envelope.number < self.next

    def take(self, envelope: Envelope) -> None:
        """Count a message that has come and was not repeated."""
        if self.stream is None:
            self.joined_at = self.next = envelope.number
        elif envelope.stream != self.stream:
            self.next, self.refused_since = 0, 0
            self.restarts += 1
        self.stream = envelope.stream
        self.missed += max(0, envelope.number - self.next - self.refused_since)
        self.next, self.refused_since = envelope.number + 1, 0
        self.received += 1
        self.ended = envelope.last

    def refuse(self, stream: int | None = None) -> None:
        """Count a message that is not taken; `stream`: where it says that it belongs."""
        self.refused += 1
        self.refused_since += stream is not None and stream == self.stream
