"""What comes over a link until it is taken: each message opened by its topic, counted by its stream, or refused with a reason."""

import math
import threading
import time
from collections import deque
from dataclasses import dataclass

from .messages import SCHEMAS, End, MessageError, decode, type_of
from .streams import Envelope, EnvelopeError, Tally

CDR = "application/cdr"


@dataclass(frozen=True)
class Received:
    """One message off a stream. `message` is of the topic's class, or an End."""

    topic: str
    message: object
    envelope: Envelope

    @property
    def over(self) -> bool:
        return isinstance(self.message, End)


class Inbox:
    """What has come on some topics, oldest first, until it is taken. Tallies are those of what has been taken."""

    def __init__(self, prefix: str, most: int | None):
        self._prefix, self._condition = prefix, threading.Condition()
        self._waiting: deque = deque(maxlen=most)
        self._overflown, self._closed = 0, False
        self.tallies: dict[str, Tally] = {}
        self.last_error = ""

    @property
    def refused(self) -> int:
        return sum(tally.refused for tally in self.tallies.values())

    @property
    def missed(self) -> int:
        """Messages that were sent and never taken, those left out because nobody took them in time included."""
        return sum(tally.missed for tally in self.tallies.values())

    @property
    def overflown(self) -> int:
        """How many of those missed had come and found no room."""
        return self._overflown

    def put(self, sample) -> None:
        """Called by zenoh's thread; keeps a zenoh.Sample as it came."""
        attachment = None if sample.attachment is None else sample.attachment.to_bytes()
        entry = (str(sample.key_expr), str(sample.encoding), sample.payload.to_bytes(), attachment)
        with self._condition:
            self._overflown += len(self._waiting) == self._waiting.maxlen
            self._waiting.append(entry)
            self._condition.notify_all()

    def close(self) -> None:
        with self._condition:
            self._closed = True
            self._condition.notify_all()

    def take(self, timeout_s: float | None = None) -> list[Received]:
        """All that has come, at least one message unless nothing comes within `timeout_s` (None: wait on) or at the end.

        What is no message of ours is left out and counted in the tally's `refused`, with the reason in `last_error`.
        """
        until = math.inf if timeout_s is None else time.monotonic() + timeout_s
        while True:
            entries = self._come(until)
            got = [received for entry in entries if (received := self._open(*entry))]
            if got or not entries:
                return got

    def _come(self, until: float) -> list[tuple]:
        """What waits to be taken, once there is something; nothing when that is not so until a monotonic time."""
        with self._condition:
            left = None if until == math.inf else max(until - time.monotonic(), 0.0)
            self._condition.wait_for(lambda: self._waiting or self._closed, left)
            entries = list(self._waiting)
            self._waiting.clear()
        return entries

    def _open(self, key: str, encoding: str, payload: bytes, attachment: bytes | None) -> Received | None:
        topic = key.removeprefix(self._prefix)
        tally = self.tallies.setdefault(topic, Tally())
        try:
            envelope = Envelope.unpack(attachment)
            if not tally.take(envelope):
                return None
            return Received(topic, decode(_kind(topic, encoding), payload, topic), envelope)
        except EnvelopeError as error:
            self.last_error = f"{topic}: field envelope: {error}; install one release of whisker on both sides"
        except MessageError as error:
            self.last_error = str(error)
        tally.refused += 1
        return None


def _kind(topic: str, encoding: str) -> type:
    """The class of a message by topic and encoding; MessageError when they do not go together."""
    if encoding == encoding_of(End):
        return End
    try:
        kind = type_of(topic)
    except KeyError:
        text = f"{topic}: no topic of this release; install one release of whisker on both sides"
        raise MessageError(text) from None
    if encoding != encoding_of(kind):
        text = f"{encoding} where {encoding_of(kind)} belongs; install one release of whisker on both sides"
        raise MessageError(f"{topic}: field encoding: {text}")
    return kind


def encoding_of(kind: type) -> str:
    """What zenoh tells of a payload of this class."""
    return f"{CDR};{SCHEMAS[kind]}"
