"""The shared ring of frames as NumPy views, read where the frames lie (host/libwhisker/include/whisker/ring.h)."""

from collections.abc import Iterator

import numpy as np

from .errors import UserError
from .native import ffi, lib
from .protocol import LANES

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


class RingError(UserError, OSError):
    """A ring that cannot be read on. Its text is one line: ring, what, remedy."""

    exit_code = 1


class Reader:
    """One reader of one ring. Use as a context manager."""

    def __init__(self, name: str, wait_s: float = 0.0):
        """Attach at the ring's oldest frame, waiting so long for the ring to come up."""
        self.name = name
        handle = ffi.new("struct whisker_reader **")
        self._check(lib.whisker_reader_attach(name.encode(), int(1000 * wait_s), handle))
        self._reader = ffi.gc(handle[0], lib.whisker_reader_detach)

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        ffi.release(self._reader)

    def frames(self, wait_s: float = 10.0) -> Iterator[np.ndarray]:
        """Arrays of dtype FRAME, all that is new each time, until the writer closes the ring.

        An array is a view into the ring, read-only and valid until the next is asked for; copy what is to be kept.
        RingError when the writer died, when it overtook this reader, or when no frame comes for `wait_s` seconds.
        """
        view, count = ffi.new("const struct whisker_frame **"), ffi.new("size_t *")
        while True:
            state = lib.whisker_reader_wait(self._reader, int(1000 * wait_s))
            if state and ffi.string(lib.whisker_error_name(state)) == b"CLOSED":
                return
            self._check(state)
            self._check(lib.whisker_reader_peek(self._reader, view, count))
            yield np.frombuffer(ffi.buffer(view[0], count[0] * FRAME.itemsize), FRAME)
            self._check(lib.whisker_reader_advance(self._reader, count[0]))

    def _check(self, error: int) -> None:
        if error:
            text, remedy = (
                ffi.string(part(error)).decode() for part in (lib.whisker_error_text, lib.whisker_error_remedy)
            )
            raise RingError(f"ring {self.name}: {text}; {remedy}")
