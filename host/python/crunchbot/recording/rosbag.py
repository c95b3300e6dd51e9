"""Bags of ROS 2 that others recorded: what `ros2 bag record` leaves, a folder or one of its files, by rosbags."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from .mcapfile import McapFile, Message, RecordingError


class RosBag:
    """Read and closed as McapFile is, but whole or not at all; it has no metadata. RecordingError: it cannot be read."""

    def __init__(self, path: str | Path):
        self.path, self.damage, self.metadata = _file(Path(path)), [], {}
        with self._readable("no bag"):
            self._reader = Reader(self.path)
            self._reader.open()
        self.topics = {connection.topic: connection for connection in self._reader.connections}
        self._store = get_typestore(Stores.ROS2_JAZZY)

    def __enter__(self) -> "RosBag":
        return self

    def __exit__(self, *exception) -> None:
        self._reader.close()

    def note(self, text: str) -> None:
        """Add a line to `damage`."""
        self.damage.append(f"{self.path}: {text}")

    def messages(self) -> Iterator[Message]:
        """In the order of time."""
        with self._readable("damaged"):
            for connection, at_ns, data in self._reader.messages():
                yield Message(connection.topic, at_ns, data)

    def decoded(self, message: Message) -> Any:
        """The message, by ROS 2's types and those in the bag; ValueError: its bytes are damaged."""
        kind, described = self.topics[message.topic].msgtype, self.topics[message.topic].msgdef
        if kind not in self._store.fielddefs:
            with self._readable(f"no {kind} on {message.topic}"):
                self._store.register(get_types_from_msg(described.data, kind))
        try:
            return self._store.deserialize_cdr(message.data, kind)
        except Exception as error:  # those of what unpacks it come as they are
            raise ValueError(f"no {kind} can be read") from error

    @contextmanager
    def _readable(self, fault: str) -> Iterator[None]:
        try:
            yield
        except Exception as error:  # those of its storages come as they are
            why = " ".join(str(error).split()) or type(error).__name__
            raise RecordingError(f"{self.path}: {fault} ({why}); mend it, as by 'ros2 bag reindex'") from error


def open_bag(path: str | Path) -> McapFile | RosBag:
    """RecordingError when it is no bag. An MCAP file is read even where it is damaged."""
    file = _file(Path(path))
    return RosBag(file) if file.is_dir() or file.suffix == ".db3" else McapFile(file)


def _file(path: Path) -> Path:
    """The one MCAP file of a folder whose recorder was killed before it wrote an index."""
    files = [] if (path / "metadata.yaml").exists() else list(path.glob("*.mcap"))
    return files[0] if len(files) == 1 else path
