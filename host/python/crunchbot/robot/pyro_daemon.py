"""Pyro5's daemon for clients that are not trusted: small plain requests, one serializer, and no place held by silence.

Pyro gives every connection a thread out of a pool, for as long as it lasts. Here one connection too many takes the place of
the one that has been silent longest, of those that have not greeted first: a client that speaks gets its answer.
"""

import contextlib
import socket
import threading
import time
from typing import Any

import Pyro5.errors
import Pyro5.protocol
import Pyro5.serializers
import Pyro5.server

REQUEST_MOST = 1 << 16  # bytes: a row of as many cells as a message may have
GREETING_S = 2.0  # a connection that has not greeted by then is closed
SILENCE_S = 600.0  # a client that is silent for so long is closed
CONNECTIONS_MOST = 64
SERIALIZER = "serpent"  # Pyro's own; marshal must never read what strangers send, and nobody needs the others


class PlainMessage(Pyro5.protocol.ReceivingMessage):
    """A request that is no longer when it has been read: compressed ones are refused before they are."""

    def __init__(self, header: bytes, payload: bytes | None = None):
        super().__init__(header, payload)
        if self.flags & Pyro5.protocol.FLAGS_COMPRESSED:
            raise Pyro5.errors.ProtocolError("compressed requests are refused; set Pyro5.config.COMPRESSION to False")


def configure(poll_s: float) -> None:
    """Set what Pyro5 keeps for the whole process."""
    config = Pyro5.config
    config.SERVERTYPE, config.POLLTIMEOUT, config.COMMTIMEOUT = "thread", poll_s, SILENCE_S
    config.MAX_MESSAGE_SIZE, config.ITER_STREAMING = REQUEST_MOST, False
    config.THREADPOOL_SIZE = 4 * CONNECTIONS_MOST  # with those that are being closed
    Pyro5.protocol.ReceivingMessage = PlainMessage
    Pyro5.errors.format_traceback = lambda *_, **__: []  # what lies where on this machine is nobody else's business
    known = Pyro5.serializers.serializers
    for name in [name for name in known if name != SERIALIZER]:
        del Pyro5.serializers.serializers_by_id[known.pop(name).serializer_id]


class Daemon(Pyro5.server.Daemon):
    """Made like its parent, after `configure`."""

    def __init__(self, host: str, port: int):
        self._lock = threading.Lock()
        self._heard: dict[object, tuple[bool, float]] = {}  # by connection: it has greeted, and when it spoke last
        super().__init__(host, port)

    def _handshake(self, conn, denied_reason=None) -> bool:
        """Called by Pyro with every new connection, in a thread of its own unless it is denied."""
        if denied_reason:
            return False
        self._enter(conn)
        greeted = False
        try:
            conn.sock.settimeout(GREETING_S)
            greeted = super()._handshake(conn)
            conn.sock.settimeout(SILENCE_S)
        finally:
            self._note(conn, greeted)
        return greeted

    def handleRequest(self, conn: Any) -> None:  # noqa: N802 - Pyro's name
        """Waits for a request and answers it."""
        super().handleRequest(conn)
        self._note(conn, True)

    def clientDisconnect(self, conn: Any) -> None:  # noqa: N802 - Pyro's name
        """Called by Pyro at the end of a connection that had greeted."""
        self._note(conn, False)

    def _enter(self, conn) -> None:
        with self._lock:
            if len(self._heard) >= CONNECTIONS_MOST:
                silent = min(self._heard, key=self._heard.get)
                del self._heard[silent]
                with contextlib.suppress(OSError):
                    silent.sock.shutdown(socket.SHUT_RDWR)
            self._heard[conn] = (False, time.monotonic())

    def _note(self, conn, here: bool) -> None:
        """A connection has spoken, or is gone."""
        with self._lock:
            if not here:
                self._heard.pop(conn, None)
            elif conn in self._heard:
                self._heard[conn] = (True, time.monotonic())
