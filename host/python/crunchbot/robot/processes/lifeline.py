"""What ties a process to the one that started it: it ends with it, and, where it can move wheels, stops them without it.

Two pipes, of which the starting process alone holds the writing ends, so that the kernel closes them however it ends.

Lifeline: nothing is ever written. When it closes, the kernel sends a signal to the child's process group (fcntl(2),
F_SETOWN, O_ASYNC). No code in the child is needed, and unlike with a parent-death signal grandchildren are included and
the thread that started the child may end.

Heartbeat: a byte every BEAT_S from the main loop of the starting process, for as long as that loop turns. The child
knows the pipe's number from VARIABLE. A child that has heard no byte for SILENT_S stops its wheels and refuses orders
until bytes come again; at the pipe's end it stops the wheels and ends.
"""

import contextlib
import fcntl
import os
import time
from collections.abc import Callable

from ...errors import UserError

VARIABLE = "WHISKER_HEARTBEAT_FD"
BEAT_S, SILENT_S = 0.1, 0.3
CHUNK = 4096


class Lifeline:
    """The silent pipe of one child: start it with `reading` inherited, then `tie` it."""

    def __init__(self):
        self.reading, self._writing = os.pipe2(os.O_CLOEXEC)

    def tie(self, group: int, sign: int) -> None:
        """Ties a process group to the pipe: it gets the signal when the pipe closes. The child alone holds the reading end."""
        fcntl.fcntl(self.reading, fcntl.F_SETSIG, sign)
        fcntl.fcntl(self.reading, fcntl.F_SETOWN, -group)
        fcntl.fcntl(self.reading, fcntl.F_SETFL, fcntl.fcntl(self.reading, fcntl.F_GETFL) | os.O_ASYNC)
        os.close(self.reading)
        self.reading = -1

    def close(self) -> None:
        """Whatever of the group is still there gets the signal."""
        _close(self.reading, self._writing)


class Pulse:
    """The heartbeat of one child: start it with `reading` inherited and `variables` in its environment."""

    def __init__(self):
        self.reading, self._writing = os.pipe2(os.O_CLOEXEC | os.O_NONBLOCK)
        self.variables = {VARIABLE: str(self.reading)}

    def started(self) -> None:
        """The child alone holds the reading end."""
        os.close(self.reading)
        self.reading = -1

    def beat(self) -> None:
        """A byte; none where the child has left many unread, or has ended."""
        with contextlib.suppress(BlockingIOError, BrokenPipeError):
            os.write(self._writing, b".")

    def close(self) -> None:
        """The child hears the end."""
        _close(self.reading, self._writing)


class Heartbeat:
    """The child's side. fd: the pipe's reading end; None: nobody watches over this process, and it always beats."""

    def __init__(self, fd: int | None, clock: Callable[[], float] = time.monotonic):
        self._fd, self._clock, self._heard_s, self._ended = fd, clock, clock(), False
        if fd is not None:
            os.set_blocking(fd, False)
            os.set_inheritable(fd, False)

    @classmethod
    def of_environment(cls) -> "Heartbeat":
        """UserError when VARIABLE names no open file."""
        text = os.environ.pop(VARIABLE, None)
        try:
            return cls(None if text is None else int(text))
        except (OSError, ValueError):
            raise UserError(f"{VARIABLE}={text}: not an open pipe; leave it to `whisker robot`") from None

    @property
    def beats(self) -> bool:
        """Whether a byte has come within SILENT_S."""
        self._hear()
        return self._fd is None or (not self._ended and self._clock() - self._heard_s < SILENT_S)

    @property
    def ended(self) -> bool:
        """Whether the other side has ended."""
        self._hear()
        return self._ended

    def _hear(self) -> None:
        """Read what has come."""
        while self._fd is not None and not self._ended:
            try:
                data = os.read(self._fd, CHUNK)
            except BlockingIOError:
                return
            self._ended = not data
            if data:
                self._heard_s = self._clock()


def _close(*ends: int) -> None:
    for end in ends:
        if end >= 0:
            os.close(end)
