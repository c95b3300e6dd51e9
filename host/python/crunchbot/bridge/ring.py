"""The shared ring of frames as NumPy views, read where the frames lie (host/libwhisker/include/whisker/ring.h)."""

from __future__ import annotations

import math
import pwd
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from whisker_protocol import LANES

from ..errors import UserError
from ..native import ffi, lib, pointer

SAMPLE = np.dtype([("alpha", "<u2"), ("beta", "<u2"), ("status", "<u2"), ("reserved", "<u2")])
FRAME = np.dtype(
    [
        ("tick", "<u8"),
        ("time_cycles", "<u8"),
        ("sequence", "<u4"),
        ("dropped", "<u4"),
        ("lane_mask", "<u4"),
        ("flags", "<u4"),
        ("lane", SAMPLE, LANES),
    ]
)
assert FRAME.itemsize == ffi.sizeof("struct whisker_frame")
FRAMES = ffi.typeof("struct whisker_frame[]")
CAPACITY: int = lib.WHISKER_RING_FRAMES
NODES_BYTES = 1 << 16  # more than whiskerd writes
COMING = ("RING_MISSING", "WRITER_DEAD")  # of a ring that may come up
STOP_S = 0.2  # how soon the wish to stop is noticed while a ring is waited for


class RingError(UserError, OSError):
    """A ring that cannot be read on. Its text is one line: ring, what, remedy; `name` is the error's in errors.h."""

    exit_code = 1

    def __init__(self, text: str, name: str = ""):
        super().__init__(text)
        self.name = name


def check(error: int, ring: str) -> None:
    """RingError for a code of errors.h other than 0; names the ring's file and its owner where they matter."""
    if error:
        line = ffi.new("char[]", lib.WHISKER_RING_LINE_BYTES)
        lib.whisker_ring_explain(ring.encode(), error, line, len(line))
        name = ffi.string(lib.whisker_error_name(error)).decode()
        raise RingError(f"ring {ring}: {ffi.string(line).decode(errors='replace')}", name)


def user_name(user: int) -> str:
    """The name of the user with this id, or its digits where there is none."""
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return str(user)


def milliseconds(seconds: float | None) -> int:
    """The library's timeout: None waits for ever."""
    return -1 if seconds is None else int(1000 * seconds)


def _in_pieces(
    call: Callable[[int], int],
    wait_s: float | None,
    going_on: tuple[str, ...],
    stop: threading.Event | None = None,
) -> int:
    """The error of a call of the library that waits, in pieces: between them signals are heard, and `stop`. going_on: the
    errors that are no end."""
    until = math.inf if wait_s is None else time.monotonic() + wait_s
    while True:
        left_s = max(0.0, until - time.monotonic())
        error = call(milliseconds(min(left_s, STOP_S)))
        if not error or left_s <= STOP_S or (stop and stop.is_set()):
            return error
        if ffi.string(lib.whisker_error_name(error)).decode() not in going_on:
            return error


@dataclass(frozen=True)
class ReaderInfo:
    """What a reader knows of its ring and of itself (struct whisker_reader_info)."""

    generation: int
    published: int
    position: int
    overruns: int
    frames_overrun: int
    frames_missing: int
    capacity: int
    writer_pid: int
    owner: str


@dataclass(frozen=True)
class FoundRing:
    """A ring of this machine (struct whisker_ring_entry). error: the name in errors.h, "OK" if a reader can attach."""

    name: str
    path: str
    owner: str
    error: str


def found_rings() -> list[FoundRing]:
    """All rings, those of the service first. RingError SYSTEM when their directories cannot be read."""
    room = 0
    count = lib.whisker_ring_list(ffi.NULL, room)
    while count > room:
        room = count
        entries = ffi.new("struct whisker_ring_entry[]", room)
        count = lib.whisker_ring_list(entries, room)
    check(min(count, 0), "*")
    return [_found(entries[index]) for index in range(count)]


def _found(entry) -> FoundRing:
    name, path = (ffi.string(text).decode(errors="surrogateescape") for text in (entry.name, entry.path))
    return FoundRing(name, path, user_name(entry.owner), ffi.string(lib.whisker_error_name(entry.error)).decode())


def signal_writer(ring: str, number: int) -> None:
    """Send a signal to the process that writes the ring; RingError when there is none or it cannot be proved to be it."""
    check(lib.whisker_ring_signal_writer(ring.encode(), number), ring)


def read_nodes(ring: str, owner: int | None = None) -> tuple[str, int] | None:
    """What the nodes answered when whiskerd was last asked, and when, in ns of the wall's clock; None: it never was."""
    text, written_ns = ffi.new("char[]", NODES_BYTES), ffi.new("int64_t *")
    accepted = lib.WHISKER_RING_NO_OWNER if owner is None else owner
    try:
        check(lib.whisker_ring_nodes(ring.encode(), accepted, text, NODES_BYTES, written_ns), ring)
    except RingError as error:
        if error.name != "RING_MISSING":
            raise
        return None
    return ffi.string(text).decode(errors="replace"), written_ns[0]


@dataclass(frozen=True)
class Clock:
    """The conversion from the bridge's clock to the host's (struct whisker_clock)."""

    device_cycles: int
    monotonic_ns: int
    realtime_ns: int
    ns_per_cycle: float
    uncertainty_ns: float

    def monotonic(self, time_cycles: ArrayLike) -> np.ndarray:
        """CLOCK_MONOTONIC in ns at `time_cycles` (scalar or array of the bridge's cycles)."""
        return self.monotonic_ns + self._since(time_cycles)

    def realtime(self, time_cycles: ArrayLike) -> np.ndarray:
        """CLOCK_REALTIME in ns at `time_cycles`."""
        return self.realtime_ns + self._since(time_cycles)

    def _since(self, time_cycles) -> np.ndarray:
        cycles = np.asarray(time_cycles, dtype=np.uint64) - np.uint64(self.device_cycles)
        return np.rint(cycles.astype(np.int64) * self.ns_per_cycle).astype(np.int64)


@dataclass(frozen=True)
class DaemonStats:
    """What whiskerd reports of itself (struct whisker_daemon_stats: units and meanings are there)."""

    frames: int
    frames_damaged: int
    frames_dropped: int
    frames_missing: int
    bytes_skipped: int
    records_absent: int
    records_crc: int
    records_tick: int
    records_usb: int
    records_sensor: int
    reconnects: int
    usb_errors: int
    clock_restarts: int
    started_ns: int
    connected_ns: int
    lane_mask: int
    tick_period: int
    connected: int
    error: int
    wire_version: int
    gateware: int
    usb_mbit: int
    serial: str
    firmware: str


def error_line(error: int) -> str:
    """A code of errors.h as "text; remedy"."""
    return "; ".join(ffi.string(part(error)).decode() for part in (lib.whisker_error_text, lib.whisker_error_remedy))


class Reader:
    """One reader of one ring. Use as a context manager, by one thread at a time."""

    def __init__(
        self,
        name: str,
        wait_s: float | None = 0.0,
        owner: int | None = None,
        stop: threading.Event | None = None,
    ):
        """Attach at the ring's oldest frame, waiting so long for the ring to come up (None: for ever), or until `stop` is set.

        A ring of root, of this user, of the service's user, or of the user with the id `owner` is read. Another user's is
        refused: RingError RING_OWNER.
        """
        self.name = name
        handle = ffi.new("struct whisker_reader **")
        accepted = lib.WHISKER_RING_NO_OWNER if owner is None else owner
        attach = partial(lib.whisker_reader_attach_owned, name.encode(), accepted)
        check(_in_pieces(lambda wait_ms: attach(wait_ms, handle), wait_s, COMING, stop), name)
        self._reader = ffi.gc(handle[0], lib.whisker_reader_detach)
        self._view, self._count = ffi.new("const struct whisker_frame **"), ffi.new("size_t *")
        self._attached()

    def __enter__(self) -> Reader:
        return self

    def __exit__(self, *exception) -> None:
        self.close()

    def _attached(self) -> None:
        """Look up whose ring it is: once, for a name may come from another machine."""
        info = ffi.new("struct whisker_reader_info *")
        lib.whisker_reader_info(self._reader, info)
        self.owner = user_name(info.owner)

    def close(self) -> None:
        """Let go of the ring; views into it must not be used any more."""
        ffi.release(self._reader)

    def frames(self, wait_s: float | None = 10.0) -> Iterator[np.ndarray]:
        """Arrays of dtype FRAME, all that is new each time, until the writer closes the ring.

        An array is a view into the ring, read-only and valid until the next is asked for; copy what is to be kept.
        RingError when the writer died, when it overtook this reader, or when no frame comes for `wait_s` seconds.
        """
        while True:
            try:
                self.wait(wait_s)
            except RingError as error:
                if error.name == "CLOSED":
                    return
                raise
            view = self.peek()
            yield view
            self.advance(len(view))

    def wait(self, wait_s: float | None = 10.0) -> None:
        """Return when there is a frame to peek. RingError TIMEOUT; when all is read, CLOSED, WRITER_DEAD, RESTARTED."""
        check(_in_pieces(partial(lib.whisker_reader_wait, self._reader), wait_s, ("TIMEOUT",)), self.name)

    def peek(self) -> np.ndarray:
        """All frames published and not yet left behind, oldest first: a read-only view into the ring, maybe empty.

        What is made of it counts only once `advance` has confirmed it. RingError OVERRUN when frames were lost.
        """
        check(lib.whisker_reader_peek(self._reader, self._view, self._count), self.name)
        return _view(self._view[0], self._count[0])

    def advance(self, count: int) -> None:
        """Leave `count` frames of the last peek behind; RingError OVERRUN if they may have changed while in use."""
        check(lib.whisker_reader_advance(self._reader, count), self.name)

    def take(self, wait_s: float | None = 10.0) -> np.ndarray | None:
        """Copies of all new frames, known to be whole; an empty array after `wait_s` without any, None once the ring
        is closed and read to its end. RingError as from `wait` and `peek`.
        """
        try:
            self.wait(wait_s)
        except RingError as error:
            if error.name in ("TIMEOUT", "CLOSED"):
                return np.empty(0, FRAME) if error.name == "TIMEOUT" else None
            raise
        frames = self.peek().copy()
        self.advance(len(frames))
        return frames

    @contextmanager
    def window(self, count: int) -> Iterator[np.ndarray]:
        """The newest `count` frames (fewer, when the ring has not had so many), wherever the reader stands.

        `with reader.window(2000) as frames:` gives a read-only view into the ring. When the block ends it is known
        whether the view was whole: RingError OVERRUN means that what was made of it must be thrown away.
        """
        got = lib.whisker_reader_window(self._reader, count, self._view)
        check(min(got, 0), self.name)
        yield _view(self._view[0], got)
        check(lib.whisker_reader_intact(self._reader), self.name)

    def seek_latest(self, count: int) -> None:
        """Go to where at most the newest `count` frames are still to be read. Never goes back."""
        lib.whisker_reader_seek_latest(self._reader, count)

    def reattach(self, wait_s: float | None = 0.0, stop: threading.Event | None = None) -> None:
        """Attach to the new ring of this name after WRITER_DEAD or RESTARTED; counters stay. `stop`: as for a new reader."""
        check(_in_pieces(partial(lib.whisker_reader_reattach, self._reader), wait_s, COMING, stop), self.name)
        self._attached()

    @property
    def info(self) -> ReaderInfo:
        """Counters of ring and reader, as of now."""
        info = ffi.new("struct whisker_reader_info *")
        lib.whisker_reader_info(self._reader, info)
        reported = {field: getattr(info, field) for field in ReaderInfo.__dataclass_fields__}
        return ReaderInfo(**reported | {"owner": self.owner})

    @property
    def clock(self) -> Clock | None:
        """The latest mapping of the bridge's clock; None before the first."""
        clock = ffi.new("struct whisker_clock *")
        known = lib.whisker_reader_clock(self._reader, clock) == 0 and clock.ns_per_cycle > 0.0
        return Clock(*(getattr(clock, field) for field in Clock.__dataclass_fields__)) if known else None

    def age_s(self, time_cycles: int) -> float | None:
        """How long ago the bridge's clock stood there, by the latest mapping; None before the first."""
        clock = self.clock
        return None if clock is None else max(0.0, (time.monotonic_ns() - int(clock.monotonic(time_cycles))) / 1e9)

    @property
    def stats(self) -> DaemonStats | None:
        """What the daemon last published of itself; None when the ring's writer is none (a replay, say)."""
        stats = ffi.new("struct whisker_daemon_stats *")
        if lib.whisker_reader_stats(self._reader, stats) != 0 or stats.started_ns == 0:
            return None
        return DaemonStats(*(_plain(getattr(stats, field)) for field in DaemonStats.__dataclass_fields__))


def await_reader(name: str, wait_s: float, stop: threading.Event, owner: int | None = None) -> Reader:
    """A Reader of a ring that is waited for until `wait_s` are over; RingError says why there is none. KeyboardInterrupt:
    `stop` is set."""
    try:
        return Reader(name, wait_s, owner, stop)
    except RingError:
        if stop.is_set():
            raise KeyboardInterrupt from None
        raise


class Writer:
    """The one writer of a ring: what whiskerd does, for replay and tests. Use as a context manager."""

    def __init__(self, name: str, capacity: int = CAPACITY):
        """Make the ring; `capacity` is a power of two, 64 to 2^20 frames. RingError RING_BUSY when it has a writer."""
        self.name, self.capacity = name, capacity
        handle = ffi.new("struct whisker_ring **")
        check(lib.whisker_ring_create(name.encode(), capacity, handle), name)
        self._ring = ffi.gc(handle[0], lib.whisker_ring_close)

    def __enter__(self) -> Writer:
        return self

    def __exit__(self, *exception) -> None:
        self.close()

    def close(self) -> None:
        """Tell the readers that the stream has ended; they can finish reading what they hold."""
        ffi.release(self._ring)

    def publish(self, frames: np.ndarray) -> None:
        """Publish frames (n,) of dtype FRAME, contiguous, in runs the ring takes; wakes readers once per run."""
        data = np.ascontiguousarray(frames)
        for start in range(0, len(data), self.capacity // 4):
            run = data[start : start + self.capacity // 4]
            given = pointer(FRAMES, FRAME, run, "frames", (None,))
            check(lib.whisker_ring_publish(self._ring, given, len(run)), self.name)

    def set_clock(self, clock: Clock) -> None:
        """Tell the readers the mapping of the bridge's clock."""
        lib.whisker_ring_set_clock(self._ring, ffi.new("struct whisker_clock *", vars(clock)))

    def set_stats(self, **fields: int | bytes) -> None:
        """Tell the readers fields of struct whisker_daemon_stats; those not named are zero."""
        lib.whisker_ring_set_stats(self._ring, ffi.new("struct whisker_daemon_stats *", fields))


def _plain(value) -> int | str:
    """A number as it is; bytes of the device as text, whatever they are."""
    return value if isinstance(value, int) else ffi.string(value).decode("utf-8", "replace")


def _view(frames, count: int) -> np.ndarray:
    if count == 0:
        return np.empty(0, FRAME)
    view = np.frombuffer(ffi.buffer(frames, count * FRAME.itemsize), FRAME)
    view.flags.writeable = False
    return view
