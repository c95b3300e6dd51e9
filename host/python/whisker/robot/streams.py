"""Numbered streams: what every message carries besides its payload, and what is known of each stream from it.

A stream is what one publisher sends on one key from its start to its end. The envelope goes as zenoh's attachment, so
that the payload stays plain CDR of its schema.
"""

import itertools
import os
import struct
import time
from dataclasses import dataclass

VERSION = 1
LAST = 1  # flag: an End, no more of this stream
ENVELOPE = struct.Struct("<HHIQq")  # version, flags, stream, number, sent


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
        return cls(stream, number, sent_ns, bool(flags & LAST))


def envelopes():
    """Envelopes of a new stream, in order; `next(...)` when one is sent."""
    stream = int.from_bytes(os.urandom(4), "little")
    return (Envelope(stream, number, time.time_ns()) for number in itertools.count())


@dataclass
class Tally:
    """What has come on one key, in messages.

    joined_at: number of the first that came: those before it were sent before this side was there;
    missed: sent since then and never come; repeated: come again and left out; restarts: new streams after the first;
    refused: come, but not whole or of another release; ended: its sender said that it is over.
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

    def take(self, envelope: Envelope) -> bool:
        """Count a message that has come; False: it came before."""
        if self.stream is None:
            self.stream, self.next, self.joined_at = envelope.stream, envelope.number, envelope.number
        elif envelope.stream != self.stream:
            self.stream, self.next = envelope.stream, 0
            self.restarts += 1
        if envelope.number < self.next:
            self.repeated += 1
            return False
        self.missed += envelope.number - self.next
        self.next = envelope.number + 1
        self.received += 1
        self.ended = envelope.last
        return True
