"""The messages of a recording (crunchbot/msgs): blocks of frames, events, health, diagnostics; to CDR and back."""

from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from types import SimpleNamespace

import numpy as np

from whisker_protocol import LANES

from ..bridge.ring import FRAME, SAMPLE, DaemonStats
from .cdr import HEADER, Layout
from .types import encode

BLOCK_FRAMES = 200  # 0.1 s: few enough messages to cost nothing, short enough to lose little
FRAMES_MOST = 65536  # of a block; more is a damaged length
TIME = np.dtype([("sec", "<i4"), ("nanosec", "<u4")])
HEAD = Layout().value("stamp", TIME).value("tick_count", "<u4").dtype()
EVENT = (
    Layout()
    .value("stamp", TIME)
    .value("kind", "u1")
    .value("tick", "<u8")
    .value("frames", "<u8")
    .value("step_ns", "<i8")
    .dtype()
)
DAEMON = ("frames", "frames_missing", "bytes_skipped", "records_bad", "reconnects", "usb_errors", "clock_restarts")
RECORDS_BAD = ("records_absent", "records_crc", "records_tick", "records_usb", "records_sensor")
MISSING, OVERRUN, RESTARTED, CLOCK_SET = range(1, 5)
KINDS = {MISSING: "missing", OVERRUN: "overrun", RESTARTED: "restarted", CLOCK_SET: "clock set"}
OK, WARN, ERROR = b"\x00", b"\x01", b"\x02"  # levels of a DiagnosticStatus
SEPARATOR = "=" * 80


class MessageError(ValueError):
    """Bytes that are no such message."""


@dataclass(frozen=True)
class Event:
    """An interruption: its kind (a value of KINDS) and what Event.msg says of it."""

    stamp_ns: int
    kind: str
    tick: int
    frames: int
    step_ns: int


def definition(name: str) -> str:
    """The .msg text of "package/msg/Type" with all it uses, as MCAP's ros2msg schemas and ROS 2 tools want it."""
    parts, wanted, seen = [], [name], {name}
    while wanted:
        package, _, kind = (current := wanted.pop(0)).split("/")
        text = files("crunchbot").joinpath("msgs", package, "msg", f"{kind}.msg").read_text()
        parts.append(text if not parts else f"{SEPARATOR}\nMSG: {package}/{kind}\n{text}")
        for line in text.splitlines():
            used = _message_type(line, package)
            if used and used not in seen:
                seen.add(used)
                wanted.append(used)
    return "".join(parts)


def _message_type(line: str, package: str) -> str | None:
    """The message a field of a .msg file holds; None when it is a plain one, a constant or a comment."""
    word = line.partition("#")[0].split("[")[0].split(" ")[0]
    if "/" in word:
        return "/msg/".join(word.split("/"))
    return f"{package}/msg/{word}" if word[:1].isupper() else None


@lru_cache(maxsize=64)
def block_layout(count: int) -> np.dtype:
    """Structure of a Block of `count` frames."""
    lane = Layout(inner=True)
    for field in SAMPLE.names:
        lane.sequence(field, SAMPLE[field], count)
    layout = Layout().value("stamp", TIME).sequence("tick", "<u8", count).sequence("time_cycles", "<u8", count)
    layout.sequence("lanes", lane.dtype(pad_to=4), LANES)
    for field in ("sequence", "dropped", "lane_mask", "flags"):
        layout.sequence(field, "<u4", count)
    return layout.dtype()


def encode_block(frames: np.ndarray) -> np.ndarray:
    """A Block without its stamp (one record of block_layout): the only time a recorder copies frames (n,), n > 0."""
    block = np.zeros((), block_layout(len(frames)))
    block["cdr_header"] = HEADER
    for field in FRAME.names[:-1]:
        block[f"{field}_count"] = len(frames)
        block[field] = frames[field]
    block["lanes_count"] = LANES
    lanes = block["lanes"]
    for field in SAMPLE.names:
        lanes[f"{field}_count"] = len(frames)
        lanes[field] = frames["lane"][field].T
    return block


def decode_block(data: bytes | memoryview) -> tuple[int, np.ndarray]:
    """(stamp in ns, frames (n,) of dtype FRAME) of a Block's bytes; MessageError when they are none."""
    head = _message(data[: HEAD.itemsize], HEAD)
    count = int(head["tick_count"])
    if not 0 < count <= FRAMES_MOST:
        raise MessageError(f"a block of {count} frames")
    block = _message(data, block_layout(count))
    lanes = block["lanes"]
    counts = [block[f"{field}_count"] for field in FRAME.names[:-1]]
    counts += [n for field in SAMPLE.names for n in lanes[f"{field}_count"]]
    if block["lanes_count"] != LANES or any(n != count for n in counts):
        raise MessageError("a block whose sequences differ in length")
    frames = np.empty(count, FRAME)
    for field in FRAME.names[:-1]:
        frames[field] = block[field]
    for field in SAMPLE.names:
        frames["lane"][field] = lanes[field].T
    return nanoseconds(block["stamp"]), frames


def encode_event(stamp_ns: int, kind: int, tick: int = 0, frames: int = 0, step_ns: int = 0) -> bytes:
    event = np.zeros((), EVENT)
    event["cdr_header"] = HEADER
    event["stamp"] = time_of(stamp_ns)
    event["kind"], event["tick"], event["frames"], event["step_ns"] = kind, tick, frames, step_ns
    return event.tobytes()


def decode_event(data: bytes | memoryview) -> Event:
    """MessageError when the bytes are no Event."""
    event = _message(data, EVENT)
    kind = KINDS.get(int(event["kind"]))
    if kind is None:
        raise MessageError(f"an event of kind {event['kind']}")
    values = (int(event[field]) for field in ("tick", "frames", "step_ns"))
    return Event(nanoseconds(event["stamp"]), kind, *values)


@lru_cache(maxsize=1)
def _health_layout() -> np.dtype:
    layout = Layout().value("stamp", TIME)
    for field in ("frames", "frames_missing", "frames_overrun"):
        layout.value(field, "<u4")
    layout.sequence("records_bad", "<u4", LANES)
    for field in DAEMON:
        layout.value(f"daemon_{field}", "<u8")
    return layout.dtype()


def encode_health(
    stamp_ns: int, frames: int, missing: int, overrun: int, bad: np.ndarray, stats: DaemonStats | None
) -> bytes:
    """A Health's bytes; bad: samples not good by lane (LANES,)."""
    health = np.zeros((), _health_layout())
    health["cdr_header"] = HEADER
    health["stamp"] = time_of(stamp_ns)
    health["frames"], health["frames_missing"], health["frames_overrun"] = frames, missing, overrun
    health["records_bad_count"], health["records_bad"] = LANES, bad
    if stats:
        reported = vars(stats) | {"records_bad": sum(getattr(stats, field) for field in RECORDS_BAD)}
        for field in DAEMON:
            health[f"daemon_{field}"] = reported[field]
    return health.tobytes()


def encode_diagnostics(stamp_ns: int, level: bytes, text: str, values: dict[str, object]) -> bytes:
    """A DiagnosticArray of one status."""
    stamp = SimpleNamespace(**dict(zip(("sec", "nanosec"), time_of(stamp_ns), strict=True)))
    status = SimpleNamespace(level=level[0], name="whisker: stream", message=text, hardware_id="whisker bridge")
    status.values = [SimpleNamespace(key=key, value=str(value)) for key, value in values.items()]
    array = SimpleNamespace(header=SimpleNamespace(stamp=stamp, frame_id=""), status=[status])
    return encode("diagnostic_msgs/msg/DiagnosticArray", array)


def time_of(stamp_ns: int) -> tuple[int, int]:
    """(sec, nanosec) of a Time."""
    return divmod(stamp_ns, 10**9)


def nanoseconds(stamp: np.void) -> int:
    return int(stamp["sec"]) * 10**9 + int(stamp["nanosec"])


def _message(data, layout: np.dtype) -> np.ndarray:
    if len(data) != layout.itemsize:
        raise MessageError(f"{len(data)} bytes where {layout.itemsize} belong")
    message = np.frombuffer(data, layout)[0]
    if data[: len(HEADER)] != HEADER:
        raise MessageError("not little-endian CDR")
    return message
