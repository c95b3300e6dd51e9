"""Writes a recording's file: blocks as they come, sent to the disk every second, readable up to there whatever happens."""

import contextlib
import errno
import hashlib
import os
import socket
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mcap.well_known import MessageEncoding, Profile, SchemaEncoding
from mcap.writer import Writer

from whisker_protocol import LANES, LIMITS

from .. import __version__
from ..bridge.ring import DaemonStats
from . import messages
from .mcapfile import NUMBERED, RecordingError
from .reading import DIAGNOSTICS_TOPIC, EVENTS_TOPIC, FORMAT, FRAMES_TOPIC, HEALTH_TOPIC, METADATA
from .sink import Sink

TOPICS = {
    FRAMES_TOPIC: "whisker_msgs/msg/Block",
    EVENTS_TOPIC: "whisker_msgs/msg/Event",
    HEALTH_TOPIC: "whisker_msgs/msg/Health",
    DIAGNOSTICS_TOPIC: "diagnostic_msgs/msg/DiagnosticArray",
}
FLUSH_S = 0.9  # with a look each 0.1 s: once a second
APART = 1 << 14  # bytes to the repeated metadata: a page that is lost takes one of the two
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class WriteError(RecordingError):
    """A recording that cannot go on; what was written stays."""

    exit_code = 1


class ChunkWriter(Writer):
    """The package's writer, whose chunks describe the channels that they use: each can be read without the others."""

    def add_message(self, channel_id: int, *arguments: Any) -> None:
        """Works as the package's method. It has no public way to repeat a channel; the names are those of the pinned release."""
        if channel_id not in self._Writer__chunk_builder.message_indices:
            self._Writer__chunk_builder.add_channel(self._Writer__channels[channel_id])
        super().add_message(channel_id, *arguments)


def claim(path: str | Path) -> socket.socket:
    """One recorder a file: a name that the kernel holds until this is closed or the process ends, and that leaves no file.

    RecordingError when another has it."""
    held = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    name = hashlib.sha256(os.fsencode(Path(path).resolve())).hexdigest()
    try:
        held.bind(f"\0crunchbot-recording-{name}")
    except OSError as error:
        held.close()
        raise RecordingError(
            f"{path}: is being recorded by another process; stop it, or choose another name"
        ) from error
    return held


class TopicWriter:
    """An MCAP file of typed topics that ROS 2 bag tools open. Times are in ns since 1970. Use as a context manager.

    A message's sequence number counts the messages of its topic in this file, from 1 on: a gap is a loss in the file.
    After a WriteError (disk full, say) only `close` may be called; the file is whole up to the last `flush`.
    """

    def __init__(self, path: str | Path, record: str, metadata: dict[str, str], overwrite: bool = False):
        """`record`: name of the metadata record, which `metadata` begins."""
        self.path, self._record, self._metadata = path, record, metadata
        self._claim = claim(path)
        try:
            self._sink = Sink(path, overwrite)
        except BaseException:
            self._claim.close()
            raise
        self._writer = ChunkWriter(self._sink, enable_data_crcs=True)
        self._channels: dict[str, int] = {}
        self._counts: dict[str, int] = {}
        self._is_repeated = False
        self._flushed_s = time.monotonic()
        self._guarded(self._begin)

    def __enter__(self) -> "TopicWriter":
        return self

    def __exit__(self, *exception) -> None:
        self.close()

    def topic(self, topic: str, schema: str, definition: str | None = None) -> None:
        """Make a topic known; `schema`: "package/msg/Type". Its definition is that of crunchbot/msgs where none is given."""
        text = definition or messages.definition(schema)
        number = self._writer.register_schema(schema, SchemaEncoding.ROS2, text.encode())
        # The profile asks for the first key; empty: the reader's default quality of service.
        extra = {"offered_qos_profiles": "", NUMBERED: "1"}
        self._channels[topic] = self._writer.register_channel(topic, MessageEncoding.CDR, number, extra)
        self._counts[topic] = 0

    def add(self, topic: str, time_ns: int, data: bytes) -> None:
        """A message's CDR on a topic that is known."""
        self._counts[topic] += 1
        number = self._counts[topic] & 0xFFFFFFFF
        self._guarded(self._writer.add_message, self._channels[topic], time_ns, data, time_ns, number)

    def flush_when_due(self) -> None:
        """Flush, if the last time is FLUSH_S ago: what is added is on its way to the disk within a second of it."""
        if time.monotonic() - self._flushed_s >= FLUSH_S:
            self.flush()

    def flush(self) -> None:
        """Write what has been gathered and have it brought to the disk. A slow disk is not waited for."""
        self._flushed_s = time.monotonic()
        self._guarded(self._write_out)

    def finish(self, metadata: dict[str, str] | None = None) -> None:
        """Write what more is known by now and the index, wait until all is on the disk, and close."""
        self._guarded(self._writer.add_metadata, self._record, self._metadata | (metadata or {}))
        self._guarded(self._writer.finish)
        self._guarded(self._sink.flush)
        self._guarded(self._sink.settle)
        self.close()

    def close(self) -> None:
        """Close without an index, as a crash would."""
        self._sink.close()
        self._claim.close()

    def _begin(self) -> None:
        self._writer.start(profile=Profile.ROS2, library=f"whisker {__version__}")
        self._writer.add_metadata(self._record, self._metadata)

    def _write_out(self) -> None:
        if not self._is_repeated and self._sink.tell() >= APART:
            self._writer.add_metadata(self._record, self._metadata)
            self._is_repeated = True
        self._writer.flush()

    def _guarded(self, action, *arguments) -> None:
        """OSError becomes one line, and the file ends where it is whole."""
        try:
            action(*arguments)
        except OSError as error:
            with contextlib.suppress(OSError):
                self._sink.cut()
            remedy = "free some space" if error.errno in FULL else "look after the disk"
            text = f"what was recorded before is kept; {remedy} and record on into another file"
            raise WriteError(f"{self.path}: cannot be written on ({error.strerror}); {text}") from error


class RecordingWriter(TopicWriter):
    """An MCAP file with the topics of a recording. Times must not go backwards."""

    def __init__(
        self, path: str | Path, metadata: dict[str, str], lane_names: Sequence[str] = (), overwrite: bool = False
    ):
        """`metadata`: what is known of ring and bridge; `lane_names`: without commas, lane 0 first."""
        if len(lane_names) > LANES or any("," in name for name in lane_names):
            raise RecordingError(f"{path}: lane names: give at most {LANES}, without commas")
        reported = {"format": FORMAT, "clock_hz": str(LIMITS["clock_hz"]), "lanes": ",".join(lane_names)}
        super().__init__(path, METADATA, reported | metadata, overwrite)

    def block(self, time_ns: int, block: np.ndarray) -> None:
        """Frames as messages.encode_block gives them."""
        block["stamp"] = messages.time_of(time_ns)
        self.add(FRAMES_TOPIC, time_ns, block.tobytes())

    def event(self, time_ns: int, kind: int, **what: int) -> None:
        """An interruption: kind and fields of messages.encode_event."""
        self.add(EVENTS_TOPIC, time_ns, messages.encode_event(time_ns, kind, **what))

    def health(
        self, time_ns: int, frames: int, missing: int, overrun: int, bad: np.ndarray, stats: DaemonStats | None
    ) -> None:
        """The counts of one second, typed and as diagnostics."""
        self.add(HEALTH_TOPIC, time_ns, messages.encode_health(time_ns, frames, missing, overrun, bad, stats))
        lost = missing + overrun
        level = messages.WARN if lost or not frames else messages.OK
        text = f"{lost} frames lost" if lost else "frames arrive" if frames else "no frames"
        values = {"frames": frames, "frames_missing": missing, "frames_overrun": overrun, "records_bad": int(bad.sum())}
        self.add(DIAGNOSTICS_TOPIC, time_ns, messages.encode_diagnostics(time_ns, level, text, values))

    def _begin(self) -> None:
        super()._begin()
        for topic, schema in TOPICS.items():
            self.topic(topic, schema)
        self._writer.flush()
