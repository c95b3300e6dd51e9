"""The file that a navigator leaves for the one that is begun after it: what its filters believed, and after which row.

A line with name, version and CRC-32 of all that follows; a line of JSON (FIELDS); then the components of each filter in the
order of `filters`, as COMPONENT has them, little-endian. Written beside its place and renamed, so that a process that reads
finds a whole one. It is not synced: it outlives a process that is killed, not a machine; after that it would be too
old, and what a power cut leaves of it has another CRC.
"""

import json
import math
import zlib
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np

from ..files import open_file
from ..nav.filters import COMPONENT, COMPONENTS_MOST
from ..outputs import put
from ..scene import Scene

MAGIC, VERSION = b"whisker-checkpoint", 1
LINE_MOST = 4096  # bytes of the JSON, which names filters and holds seven numbers
SIZE_MOST = 8 * COMPONENTS_MOST * COMPONENT.itemsize  # bytes of a file: nobody runs more than eight filters
# name: lowest and highest of a whole number
NUMBERS = {"stream": (0, 2**32 - 1), "seq": (0, 2**63 - 1), "stamp_ns": (0, 2**62), "sent_ns": (0, 2**62)}
FIELDS = {"scene", "pose", "filters", *NUMBERS}


class CheckpointError(ValueError):
    """Bytes that are no checkpoint of this release: which field, and what is wrong with it."""


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """scene: `identity` of it. stream, sent_ns: of the row's envelope; seq, pose, stamp_ns: the row's own."""

    scene: str
    stream: int
    seq: int
    pose: np.ndarray  # (3,) motion summed since the pilot's start
    stamp_ns: int
    sent_ns: int
    beliefs: dict[str, np.ndarray]  # by filter: (n,) of COMPONENT


def identity(scene: Scene) -> str:
    """A hash of what a belief is about: arena, robot and map frame. Priors may differ."""
    return sha256(repr((scene.arena, scene.robot, scene.origin)).encode()).hexdigest()


def encode(reported: Checkpoint) -> bytes:
    """The file's bytes."""
    head = {name: getattr(reported, name) for name in ("scene", *NUMBERS)}
    head |= {"pose": list(map(float, reported.pose)), "filters": {name: len(b) for name, b in reported.beliefs.items()}}
    rest = json.dumps(head).encode() + b"\n" + b"".join(b.tobytes() for b in reported.beliefs.values())
    return b"%s %d %08x\n" % (MAGIC, VERSION, zlib.crc32(rest)) + rest


def decode(data: bytes) -> Checkpoint:
    """CheckpointError when it is none."""
    first, _, rest = data.partition(b"\n")
    words = first.split(b" ")
    if len(words) != 3 or words[0] != MAGIC:
        raise CheckpointError("no checkpoint")
    if words[1] != b"%d" % VERSION:
        raise CheckpointError(f"version {words[1][:8].decode(errors='replace')}, this release has {VERSION}")
    if words[2] != b"%08x" % zlib.crc32(rest):
        raise CheckpointError("cut short or damaged (CRC)")
    line, _, components = rest.partition(b"\n")
    head = _head(line)
    beliefs = _beliefs(head["filters"], components)
    numbers = {name: head[name] for name in ("scene", *NUMBERS)}
    return Checkpoint(**numbers, pose=np.array(head["pose"], np.float64), beliefs=beliefs)


def _head(line: bytes) -> dict:
    try:
        head = json.loads(line) if len(line) <= LINE_MOST else None
    except (ValueError, RecursionError):
        head = None
    if not isinstance(head, dict) or set(head) != FIELDS:
        raise CheckpointError("its second line lacks fields, or is none")
    for name, (low, high) in NUMBERS.items():
        if type(head[name]) is not int or not low <= head[name] <= high:
            raise CheckpointError(f"field {name}: no whole number from {low} to {high}")
    if not isinstance(head["scene"], str):
        raise CheckpointError("field scene: no text")
    pose = head["pose"]
    if not isinstance(pose, list) or len(pose) != 3 or not all(type(v) is float and math.isfinite(v) for v in pose):
        raise CheckpointError("field pose: not three numbers")
    return head


def _beliefs(counts: object, data: bytes) -> dict[str, np.ndarray]:
    if not isinstance(counts, dict) or not counts:
        raise CheckpointError("field filters: no filter")
    if not all(type(count) is int and 0 < count <= COMPONENTS_MOST for count in counts.values()):
        raise CheckpointError(f"field filters: a number of components that is none from 1 to {COMPONENTS_MOST}")
    if sum(counts.values()) * COMPONENT.itemsize != len(data):
        raise CheckpointError(f"field filters: {len(data)} bytes of components do not fit their number")
    ends = np.cumsum(list(counts.values()))
    parts = np.split(np.frombuffer(data, COMPONENT), ends[:-1])
    return dict(zip(counts, parts, strict=True))


def save(path: Path, reported: Checkpoint) -> None:
    """Put it in its place, whole or not at all. OSError when that cannot be done."""
    put(path, encode(reported), sync=False)


def load(path: Path) -> Checkpoint | None:
    """None: there is no file. CheckpointError for one that cannot be used."""
    try:
        with open_file(path) as file:
            data = file.read(SIZE_MOST + 1)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise CheckpointError(f"cannot be read ({error.strerror})") from None
    if len(data) > SIZE_MOST:
        raise CheckpointError(f"longer than {SIZE_MOST} bytes")
    return decode(data)
