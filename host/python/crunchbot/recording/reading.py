"""What a recording holds: frames, events and what is known of where they came from."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from whisker_protocol import LANES, LIMITS

from .mcapfile import McapFile, RecordingError
from .messages import Event, MessageError, decode_block, decode_event

FRAMES_TOPIC, EVENTS_TOPIC = "/whisker/frames", "/whisker/events"
HEALTH_TOPIC, DIAGNOSTICS_TOPIC = "/whisker/health", "/diagnostics"
METADATA = "whisker"  # name of the metadata record
FORMAT = "1"


class Recording:
    """One recording. Use as a context manager.

    metadata: what the recorder knew (strings): format, ring, lanes, clock_hz, serial, firmware, wire_version, started.
    complete: the recorder came to its end and nothing is damaged or lost since; a file cut off is read up to its last
    whole chunk. damage: lines about what could not be read and how much that was. Both are known after `blocks` or
    `events` has come to its end.
    """

    def __init__(self, path: str | Path):
        """RecordingError when the file cannot be read, is no MCAP, or holds no frames of whiskers."""
        self._file = McapFile(path)
        self.path = path
        self.metadata: dict[str, str] = self._file.metadata.get(METADATA, {})
        try:
            self._check()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> "Recording":
        return self

    def __exit__(self, *exception) -> None:
        self.close()

    def close(self) -> None:
        self._file.close()

    @property
    def complete(self) -> bool:
        return self._file.complete

    @property
    def damage(self) -> list[str]:
        return self._file.damage

    @property
    def lane_names(self) -> tuple[str, ...]:
        """Of all lanes, lane 0 first; "lane0" and so on where the recorder got no names."""
        reported = [name for name in self.metadata.get("lanes", "").split(",") if name]
        return tuple(reported[:LANES]) + tuple(f"lane{n}" for n in range(len(reported), LANES))

    @property
    def clock_hz(self) -> float:
        """The bridge's clock: what one unit of time_cycles is."""
        try:
            clock_hz = float(self.metadata.get("clock_hz", ""))
        except ValueError:
            return float(LIMITS["clock_hz"])
        return clock_hz if 0.0 < clock_hz < float("inf") else float(LIMITS["clock_hz"])

    def blocks(self) -> Iterator[np.ndarray]:
        """Frames (n,) of dtype crunchbot.bridge.ring.FRAME, in the order they were published; arrays of their own."""
        for _, frames in self.stamped_blocks():
            yield frames

    def stamped_blocks(self) -> Iterator[tuple[int, np.ndarray]]:
        """(host time of the first frame in ns since 1970, frames)."""
        seen = 0
        for stamp_ns, frames in self._decoded(FRAMES_TOPIC, decode_block):
            seen += len(frames)
            yield stamp_ns, frames
        written = self.metadata.get("frames", "")
        if written.isdecimal() and seen < int(written[:20]):
            self._file.note(f"{int(written[:20]) - seen} of {written:.20} frames are lost")

    def events(self) -> Iterator[Event]:
        """Every interruption, in order."""
        yield from self._decoded(EVENTS_TOPIC, decode_event)

    def _decoded(self, topic: str, decode) -> Iterator:
        for message in self._file.messages():
            if message.topic == topic:
                try:
                    decoded = decode(message.data)
                except MessageError as error:
                    self._file.note(f"{error}; left out")
                    continue
                yield decoded

    def _check(self) -> None:
        reported = {content.get("format", FORMAT) for name, content in self._file.versions if name == METADATA}
        if reported and FORMAT not in reported:  # a bit that is wrong in one copy is no newer release
            text = f"format {reported.pop():.20}, this package reads {FORMAT}; install the newer release"
            raise RecordingError(f"{self.path}: {text}")
        if not any(message.topic == FRAMES_TOPIC for message in self._file.messages()):
            known = FRAMES_TOPIC in self._file.topics or not self.complete
            text = "holds no frames" if known else f"has no topic {FRAMES_TOPIC}"
            raise RecordingError(f"{self.path}: {text}{self._why()}; give a recording made by 'whisker record'")

    def _why(self) -> str:
        """The first damage, for a file of which nothing is left."""
        return f" ({self.damage[0].removeprefix(f'{self.path}: ')})" if self.damage else ""


def read(path: str | Path) -> Recording:
    """Open a recording; see Recording."""
    return Recording(path)
