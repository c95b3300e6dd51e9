"""Which streams have been announced, and whose messages a reader takes: those of one source at a time.

Every publisher announces its stream by a liveliness token, which goes when its process does. This keeps two pilots of one
name, or a program that was forgotten, from being taken for one robot. It is no guard against forgers, who can announce
what they like: against those zenoh has TLS and access control (docs/remote.md).
"""

import threading
from enum import Enum

from .messages import TOPICS

STREAMS_MOST = 32  # known of each topic; the oldest that are gone are forgotten first
TOPICS_MOST = 64  # those of all processes' health included


class Verdict(Enum):
    TAKEN = "taken"
    UNKNOWN = "of a source that has not been announced; start it with a link of this release"
    SECOND = "of a second source; end one of the two, or give it another --robot"


class Sources:
    """Streams by topic, in the order in which they were announced. Announced by zenoh's threads, read by readers."""

    def __init__(self):
        self._lock = threading.Lock()
        self._alive: dict[str, dict[int, bool]] = {topic: {} for topic in TOPICS}
        self.changes = 0

    def note(self, topic: str, stream: int, alive: bool) -> None:
        """A token has come or gone. More streams than anybody has are not noted."""
        with self._lock:
            if topic not in self._alive and len(self._alive) >= TOPICS_MOST:
                return
            known = self._alive.setdefault(topic, {})
            if alive and stream not in known and len(known) >= STREAMS_MOST:
                gone = next((number for number, here in known.items() if not here), None)
                if gone is None:
                    return
                del known[gone]
            known[stream] = alive
            self.changes += 1

    def judge(self, topic: str, present: int | None, stream: int) -> Verdict:
        """Judges a message of `stream` for a reader that takes those of the stream `present` (None: of none yet)."""
        with self._lock:
            known = self._alive.get(topic, {})
            if stream not in known:
                return Verdict.UNKNOWN
            return Verdict.SECOND if present != stream and known.get(present) else Verdict.TAKEN
