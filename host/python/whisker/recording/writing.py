"""Writes a recording's file: blocks as they come, on the disk every second, readable up to there whatever happens."""

import os
from collections.abc import Sequence

import numpy as np
from mcap.well_known import MessageEncoding, Profile, SchemaEncoding
from mcap.writer import Writer

from .. import __version__
from ..bridge.ring import DaemonStats
from ..protocol import LANES, LIMITS
from . import messages
from .mcapfile import RecordingError
from .reading import DIAGNOSTICS_TOPIC, EVENTS_TOPIC, FORMAT, FRAMES_TOPIC, HEALTH_TOPIC, METADATA

TOPICS = {
    FRAMES_TOPIC: "whisker_msgs/msg/Block",
    EVENTS_TOPIC: "whisker_msgs/msg/Event",
    HEALTH_TOPIC: "whisker_msgs/msg/Health",
    DIAGNOSTICS_TOPIC: "diagnostic_msgs/msg/DiagnosticArray",
}


class WriteError(RecordingError):
    """A recording that cannot go on; what was written stays."""

    exit_code = 1


class Sink:
    """A file that remembers up to where it is whole, and goes back there when the disk is full."""

    def __init__(self, path, overwrite: bool):
        try:
            self._file = open(path, "wb" if overwrite else "xb", buffering=0)  # noqa: SIM115 - closed by close()
        except FileExistsError:
            raise RecordingError(f"{path}: exists; choose another name, or --overwrite") from None
        except OSError as error:
            raise RecordingError(f"{path}: cannot be written ({error.strerror}); choose another place") from error
        self._place = self._whole = 0

    def write(self, data) -> int:
        """All of data; OSError when there is no room."""
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) :]
        self._place += len(data)
        return len(data)

    def tell(self) -> int:
        return self._place

    def flush(self) -> None:
        """Called between records: all up to here is whole."""
        self._whole = self._place

    def cut(self) -> None:
        """Give up what came after the last flush."""
        if os.path.isfile(self._file.name):
            self._file.truncate(self._whole)

    def close(self) -> None:
        self._file.close()


class TopicWriter:
    """An MCAP file of typed topics that ROS 2 bag tools open. Times are in ns since 1970.

    After a WriteError (disk full, say) only `close` may be called; the file is whole up to the last `flush`.
    """

    def __init__(self, path, record: str, metadata: dict[str, str], overwrite: bool = False):
        """`record`: name of the metadata record, which `metadata` begins."""
        self.path, self._record = path, record
        self._sink = Sink(path, overwrite)
        self._writer = Writer(self._sink)
        self._channels: dict[str, int] = {}
        self._guarded(self._begin, metadata)

    def topic(self, topic: str, schema: str) -> None:
        """Make a topic known; `schema`: "package/msg/Type" of whisker/msgs."""
        text = messages.definition(schema).encode()
        number = self._writer.register_schema(schema, SchemaEncoding.ROS2, text)
        # The profile asks for the key; empty: the reader's default quality of service.
        extra = {"offered_qos_profiles": ""}
        self._channels[topic] = self._writer.register_channel(topic, MessageEncoding.CDR, number, extra)

    def add(self, topic: str, time_ns: int, number: int, data: bytes) -> None:
        """A message's CDR on a topic that is known; `number` counts the messages of its stream."""
        self._guarded(self._writer.add_message, self._channels[topic], time_ns, data, time_ns, number & 0xFFFFFFFF)

    def flush(self) -> None:
        """Write what has been gathered: from now on it is safe."""
        self._guarded(self._writer.flush)

    def finish(self, metadata: dict[str, str] | None = None) -> None:
        """Write what more is known by now and the index, and close."""
        if metadata:
            self._guarded(self._writer.add_metadata, self._record, metadata)
        self._guarded(self._writer.finish)
        self._sink.flush()
        self.close()

    def close(self) -> None:
        """Close without an index, as a crash would."""
        self._sink.close()

    def _begin(self, metadata: dict[str, str]) -> None:
        self._writer.start(profile=Profile.ROS2, library=f"whisker {__version__}")
        self._writer.add_metadata(self._record, metadata)

    def _guarded(self, action, *arguments) -> None:
        """OSError becomes one line, and the file ends where it is whole."""
        try:
            action(*arguments)
        except OSError as error:
            self._sink.cut()
            text = "what was recorded before is kept; free some space and record on into another file"
            raise WriteError(f"{self.path}: cannot be written on ({error.strerror}); {text}") from error


class RecordingWriter(TopicWriter):
    """An MCAP file with the topics of a recording. Times must not go backwards."""

    def __init__(self, path, metadata: dict[str, str], lane_names: Sequence[str] = (), overwrite: bool = False):
        """`metadata`: what is known of ring and bridge; `lane_names`: without commas, lane 0 first."""
        if len(lane_names) > LANES or any("," in name for name in lane_names):
            raise RecordingError(f"{path}: lane names: give at most {LANES}, without commas")
        told = {"format": FORMAT, "clock_hz": str(LIMITS["clock_hz"]), "lanes": ",".join(lane_names)}
        super().__init__(path, METADATA, told | metadata, overwrite)
        self._sequence = dict.fromkeys(TOPICS, 0)

    def block(self, time_ns: int, block: np.ndarray) -> None:
        """Frames as messages.encode_block gives them."""
        block["stamp"] = messages.time_of(time_ns)
        self._add(FRAMES_TOPIC, time_ns, block.tobytes())

    def event(self, time_ns: int, kind: int, **what: int) -> None:
        """An interruption: kind and fields of messages.encode_event."""
        self._add(EVENTS_TOPIC, time_ns, messages.encode_event(time_ns, kind, **what))

    def health(self, time_ns: int, frames: int, missing: int, overrun: int, bad: np.ndarray, stats: DaemonStats | None):
        """The counts of one second, typed and as diagnostics."""
        self._add(HEALTH_TOPIC, time_ns, messages.encode_health(time_ns, frames, missing, overrun, bad, stats))
        lost = missing + overrun
        level = messages.WARN if lost or not frames else messages.OK
        text = f"{lost} frames lost" if lost else "frames arrive" if frames else "no frames"
        values = {"frames": frames, "frames_missing": missing, "frames_overrun": overrun, "records_bad": int(bad.sum())}
        self._add(DIAGNOSTICS_TOPIC, time_ns, messages.encode_diagnostics(time_ns, level, text, values))

    def _begin(self, metadata: dict[str, str]) -> None:
        super()._begin(metadata)
        for topic, schema in TOPICS.items():
            self.topic(topic, schema)
        self._writer.flush()

    def _add(self, topic: str, time_ns: int, data: bytes) -> None:
        self._sequence[topic] += 1
        self.add(topic, time_ns, self._sequence[topic], data)
