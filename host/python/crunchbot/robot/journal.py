"""The rows that a mapper has taken, in a file: one that is begun anew takes them again and holds the same map.

A line with name, version and the robot's digest; then a record a message: length of the payload and CRC-32 of all behind
it (little-endian), the envelope, the payload as CDR. A record is written whole before the row counts. A file with
more than whole records, as a process leaves it that was killed in the middle of one, is kept under another name.
"""

import struct
import zlib
from hashlib import sha256
from pathlib import Path

from ..outputs import put, put_aside
from ..scene import Robot
from .network.inbox import Received
from .network.messages import MessageError, Observation, decode, encode
from .network.streams import ENVELOPE, Envelope, EnvelopeError

MAGIC = b"whisker-journal 1 "
RECORD = struct.Struct("<II")
PAYLOAD_MOST = 1 << 20
TOPIC = "observation"


class Journal:
    """`taken`: what the file held when it was opened. `keep` each message that counts. `note`: what is wrong with the file;
    one line, empty: nothing."""

    def __init__(self, path: Path | None, robot: Robot):
        """path None: nothing is kept."""
        self._path, self.taken, self.note, self._file = path, [], "", None
        if path is None:
            return
        head = MAGIC + sha256(repr(robot).encode()).hexdigest().encode() + b"\n"
        try:
            data = path.read_bytes() if path.exists() else head
            self.taken, end = _read(data, len(head)) if data.startswith(head) else ([], 0)
            if end < len(data) and path.exists():
                what = "its end" if end else "no journal of this robot"
                self.note = f"{path}: not used: {what}; what it was is now {put_aside(path)}"
            if end < len(data) or not path.exists():
                put(path, data[:end] or head)
            self._file = path.open("ab", buffering=0)
        except OSError as error:
            self._fail(error)

    def keep(self, received: Received) -> None:
        """Write a message down; `note` says when it cannot be."""
        if self._file is None:
            return
        body = received.envelope.pack() + encode(received.message)
        try:
            self._file.write(RECORD.pack(len(body) - ENVELOPE.size, zlib.crc32(body)) + body)
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        self.close()
        self.note = f"{self._path}: cannot be written ({error.strerror}); a mapper begun anew will know nothing"

    def close(self) -> None:
        if self._file:
            self._file.close()
        self._file = None


def _read(data: bytes, at: int) -> tuple[list[Received], int]:
    """Messages from byte `at` on, and where the last whole one ends."""
    taken = []
    while at + RECORD.size + ENVELOPE.size <= len(data):
        length, crc = RECORD.unpack_from(data, at)
        body = data[at + RECORD.size : at + RECORD.size + ENVELOPE.size + min(length, PAYLOAD_MOST)]
        if len(body) != ENVELOPE.size + length or zlib.crc32(body) != crc:
            break
        try:
            envelope = Envelope.unpack(body[: ENVELOPE.size])
            taken.append(Received(TOPIC, decode(Observation, body[ENVELOPE.size :], TOPIC), envelope))
        except (EnvelopeError, MessageError):
            break
        at += RECORD.size + len(body)
    return taken, at
