"""The socket that clients connect to, with a lock beside it, as whisker-base has them: one driver for each path."""

import contextlib
import errno
import fcntl
import os
import socket
import time
from collections.abc import Iterator
from pathlib import Path

from ...errors import UserError
from . import LOOK_S, REPEAT_S

BACKLOG = 512
VANISH_S = 2.0 * REPEAT_S  # for another driver to end: one whose guard was killed stops the wheels first


class SocketError(UserError):
    """The socket cannot be had; one line."""

    exit_code = 1


@contextlib.contextmanager
def listening(path: Path) -> Iterator[tuple[socket.socket, int]]:
    """The socket, and the lock's descriptor, which a driver keeps, too: one without its guard still stops the wheels.

    Removed at the end. A socket at which nobody listens is taken over, nothing else ever is.
    """
    lock_path = Path(f"{path}.lock")
    lock = _locked(path, lock_path)
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as made:
            _bind(made, path)
            own = os.lstat(path)
            made.listen(BACKLOG)
            yield made, lock
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.lstat(path), own):
                    path.unlink()
    finally:
        lock_path.unlink(missing_ok=True)
        os.close(lock)


def _locked(path: Path, lock_path: Path) -> int:
    end_s = time.monotonic() + VANISH_S
    while True:
        try:
            lock = os.open(lock_path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
        except OSError as error:
            text = f"{error.strerror}; choose a --socket in a folder that can be written"
            raise SocketError(f"{lock_path}: {text}") from None
        with contextlib.suppress(OSError):
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(os.fstat(lock), os.lstat(lock_path)):
                return lock
        os.close(lock)  # another has it, or has just removed it
        if time.monotonic() >= end_s:
            raise SocketError(f"{path}: another driver has it; stop that one first")
        time.sleep(LOOK_S)


def _bind(made: socket.socket, path: Path) -> None:
    if path.is_socket() and _is_left(path):
        path.unlink()
    try:
        made.bind(str(path))
    except OSError as error:
        text = f"{error.strerror or error}; choose a path where nothing is, in a folder that can be written"
        raise SocketError(f"{path}: {text}") from None


def _is_left(path: Path) -> bool:
    """Whether it is the socket of a process that has ended: one that is full, or another user's, is not."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET | socket.SOCK_NONBLOCK) as probe:
        return probe.connect_ex(str(path)) == errno.ECONNREFUSED
