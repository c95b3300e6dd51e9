"""What a process reports to its service manager: that it is ready, that it lives, that it stops (sd_notify(3)).

Without NOTIFY_SOCKET in the environment nothing is sent. Nothing here waits: a message that finds no room is lost.
"""

import contextlib
import os
import socket

READY, ALIVE, STOPPING = b"READY=1\nWATCHDOG=1", b"WATCHDOG=1", b"STOPPING=1"


class Notify:
    """Call `alive` as often as the main loop turns; the first call says that the process is ready."""

    def __init__(self):
        name = os.environ.get("NOTIFY_SOCKET", "")
        self._address = f"\0{name[1:]}" if name.startswith("@") else name
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) if name else None
        self._ready = False

    def alive(self) -> None:
        self._send(ALIVE if self._ready else READY)
        self._ready = True

    def stopping(self) -> None:
        """The process ends; it needs no watchdog any more."""
        self._send(STOPPING)

    def _send(self, message: bytes) -> None:
        if self._socket:
            with contextlib.suppress(OSError):
                self._socket.sendto(message, self._address)
