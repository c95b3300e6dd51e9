"""What comes over a link until it is taken: each message opened by its topic, counted by its stream, or refused with a reason."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .messages import REMEDIES, SCHEMAS, TOPICS, End, MessageError, Observation, decode, type_of
from .sources import Sources, Verdict
from .streams import Envelope, EnvelopeError, Tally

CDR = "application/cdr"
SAME = REMEDIES[0]
HOLD_S = 5.0  # a message waits so long for its source to be announced
HELD_MOST = 1000
TOPICS_MOST = 64  # those of all processes' health included


@dataclass(frozen=True)
class Received:
    """One message off a stream. `message` is of the topic's class, or an End; `data`: its bytes as they came, if they did."""

    topic: str
    message: object
    envelope: Envelope
    data: bytes = b""

    @property
    def over(self) -> bool:
        return isinstance(self.message, End)


class Inbox:
    """What has come on some topics, oldest first, until it is taken. Tallies are those of what has been taken.

    Messages of a stream that nobody has announced yet wait a little, for a token may come later than the first message.
    """

    def __init__(
        self,
        prefix: str,
        most: int | None,
        sources: Sources | None = None,
        judge: Callable[[Received], str] = lambda received: "",
    ):
        """sources: streams that are announced; None: everything is taken, as from a file.

        judge: what is wrong with a message, and what helps, where its bytes alone do not show it; empty: it is taken.
        """
        self._prefix, self._condition, self._sources = prefix, threading.Condition(), sources
        self._waiting: deque = deque(maxlen=most)
        self._judge = judge
        self._held: list[tuple] = []
        self._held_streams: set[int] = set()
        self._changes_seen = 0
        self._overflown, self._closed = 0, False
        self._others_refused = 0  # on topics that have no tally
        self.tallies: dict[str, Tally] = {}
        self.last_error = ""

    @property
    def refused(self) -> int:
        return self._others_refused + sum(tally.refused for tally in self.tallies.values())

    @property
    def missed(self) -> int:
        """Messages that were sent and never taken, those left out because nobody took them in time included."""
        return sum(tally.missed for tally in self.tallies.values())

    @property
    def overflown(self) -> int:
        """How many of those missed had come and found no room."""
        return self._overflown

    def put(self, sample: Any) -> None:
        """Called by zenoh's thread; keeps a zenoh.Sample as it came."""
        attachment = None if sample.attachment is None else sample.attachment.to_bytes()
        entry = (str(sample.key_expr), str(sample.encoding), sample.payload.to_bytes(), attachment)
        with self._condition:
            self._overflown += len(self._waiting) == self._waiting.maxlen
            self._waiting.append(entry)
            self._condition.notify_all()

    def look_again(self) -> None:
        """A source has been announced: messages of it that wait can be taken."""
        with self._condition:
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
            again, entries, over = self._come(until)
            got = [one for entry in again if (one := self._open(*entry))]
            got += [one for entry in entries if (one := self._open(time.monotonic(), *entry))]
            if got or over:
                return got

    def _come(self, until: float) -> tuple[list[tuple], list[tuple], bool]:
        """What was held and may be taken now, what waits to be taken, and whether there is nothing more to wait for."""
        with self._condition:
            left = None if until == math.inf else max(until - time.monotonic(), 0.0)
            expiry = max(self._held[0][0] + HOLD_S - time.monotonic(), 0.0) if self._held else None
            wait = min((t for t in (left, expiry) if t is not None), default=None)
            self._condition.wait_for(lambda: self._waiting or self._closed or self._is_news(), wait)
            entries, again = list(self._waiting), self._held
            self._waiting.clear()
            self._held, self._held_streams = [], set()
            self._changes_seen = self._sources.changes if self._sources else 0
            over = self._closed or time.monotonic() >= until
        return again, entries, over and not entries

    def _is_news(self) -> bool:
        return bool(self._held) and self._sources.changes != self._changes_seen

    def _open(
        self, came_s: float, key: str, encoding: str, payload: bytes, attachment: bytes | None
    ) -> Received | None:
        """The message, counted; None when it is not taken, or not yet."""
        topic, envelope = key.removeprefix(self._prefix), None
        tally = self.tallies.get(topic) or Tally()
        try:
            kind = _kind(topic, encoding)
            envelope = Envelope.unpack(attachment)
            verdict = self._verdict(topic, tally, envelope)
            if verdict is Verdict.UNKNOWN and self._hold(came_s, envelope, (key, encoding, payload, attachment)):
                return None
            self._check_source(topic, verdict)
            if tally.is_repeated(envelope):
                return None
            received = Received(topic, decode(kind, payload, topic), envelope, payload)
            self._check(received)
        except (EnvelopeError, MessageError) as error:
            self.last_error = (
                str(error) if isinstance(error, MessageError) else f"{topic}: field envelope: {error}; {SAME}"
            )
            self._refuse(topic, tally, envelope)
            return None
        tally.take(envelope)
        self.tallies[topic] = tally
        return received

    def _verdict(self, topic: str, tally: Tally, envelope: Envelope) -> Verdict:
        if self._sources is None:
            return Verdict.TAKEN
        if envelope.stream in self._held_streams:
            return Verdict.UNKNOWN  # not before those of its stream that wait
        return self._sources.judge(topic, None if tally.ended else tally.stream, envelope.stream)

    def _hold(self, came_s: float, envelope: Envelope, entry: tuple) -> bool:
        """Keep a message until its source is announced; False: it has waited for that, or too many do."""
        if self._closed or len(self._held) >= HELD_MOST or time.monotonic() - came_s >= HOLD_S:
            return False
        self._held.append((came_s, *entry))
        self._held_streams.add(envelope.stream)
        return True

    def _check_source(self, topic: str, verdict: Verdict) -> None:
        """MessageError unless messages of it are taken."""
        if verdict is not Verdict.TAKEN:
            raise MessageError(f"{topic}: field stream: {verdict.value}")
        if topic not in TOPICS and topic not in self.tallies and len(self.tallies) >= TOPICS_MOST:
            raise MessageError(f"{topic}: more than {TOPICS_MOST} topics; stop what sends them")

    def _check(self, received: Received) -> None:
        """MessageError unless the message may follow those before it."""
        topic, message = received.topic, received.message
        number = received.envelope.number  # a pilot sends rows and nothing else on this key
        if self._sources and isinstance(message, Observation) and message.seq != number:
            raise MessageError(f"{topic}: field seq: {message.seq} in message {number}; {REMEDIES[1]}")
        if fault := self._judge(received):
            raise MessageError(f"{topic}: {fault}")

    def _refuse(self, topic: str, tally: Tally, envelope: Envelope | None) -> None:
        """Count it by its topic, if that is one of ours."""
        if topic in TOPICS:
            self.tallies[topic] = tally
        if topic in self.tallies:
            tally.refuse(envelope and envelope.stream)
        else:
            self._others_refused += 1


def _kind(topic: str, encoding: str) -> type:
    """The class of a message by topic and encoding; MessageError when they do not go together."""
    if encoding == encoding_of(End):
        return End
    try:
        kind = type_of(topic)
    except KeyError:
        text = f"{topic}: no topic of this release; install one release of crunchbot on both sides"
        raise MessageError(text) from None
    if encoding != encoding_of(kind):
        text = f"{encoding:.80} where {encoding_of(kind)} belongs; install one release of crunchbot on both sides"
        raise MessageError(f"{topic}: field encoding: {text}")
    return kind


def encoding_of(kind: type) -> str:
    """What zenoh reports of a payload of this class."""
    return f"{CDR};{SCHEMAS[kind]}"
