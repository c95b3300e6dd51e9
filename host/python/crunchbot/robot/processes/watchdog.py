"""A watchdog as systemd's (sd_notify(3)) for a program that feeds one: what is READY and then silent hangs."""

import contextlib
import os
import socket
import struct

TIMEOUT_S = 0.3
LOOK_MOST_S = 0.1  # time between two looks counts as no more: what passed while nobody looked is not the program's
MESSAGE_BYTES = 4096
CREDENTIALS = struct.Struct("3i")  # pid, uid, gid
VARIABLES = ("NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID")  # of another watchdog: not to be passed on


class Watchdog:
    """For one run of a program, started with `variables` in its environment."""

    def __init__(self):
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
        self._socket.bind("")  # a free name of the abstract namespace: nothing is left behind in any folder
        name = self._socket.getsockname()[1:].decode()
        self.variables = {"NOTIFY_SOCKET": f"@{name}", "WATCHDOG_USEC": str(round(TIMEOUT_S * 1e6))}
        self._armed, self._silent_s, self._looked_s = False, 0.0, 0.0

    def bites(self, now_s: float) -> bool:
        """Whether the program was ready and then silent for TIMEOUT_S. To be asked often."""
        self._silent_s += min(now_s - self._looked_s, LOOK_MOST_S)
        self._looked_s = now_s
        with contextlib.suppress(BlockingIOError):
            while True:
                self._hear(*self._socket.recvmsg(MESSAGE_BYTES, socket.CMSG_SPACE(CREDENTIALS.size))[:2])
        return self._armed and self._silent_s >= TIMEOUT_S

    def close(self) -> None:
        self._socket.close()

    def _hear(self, message: bytes, ancillary: list) -> None:
        """Other users can write to the name: what they say is left out."""
        senders = [CREDENTIALS.unpack(data)[1] for _, kind, data in ancillary if kind == socket.SCM_CREDENTIALS]
        if senders != [os.getuid()]:
            return
        lines = message.split(b"\n")
        self._armed = (self._armed or b"READY=1" in lines) and b"STOPPING=1" not in lines
        if {b"READY=1", b"WATCHDOG=1"}.intersection(lines):
            self._silent_s = 0.0
