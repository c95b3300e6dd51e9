"""The HTTP and WebSocket server: `/` is the page, `/ws` the live connection, anything else does not exist."""

import asyncio
import errno
import logging
import os
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from http import HTTPStatus
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from ..errors import UserError
from ..guard import Guard
from .client import Client
from .hub import Hub
from .page import HEADERS, Page
from .places import Places, network_of

PAGE_PATH, LIVE_PATH = "/", "/ws"
MESSAGE_BYTES = 4096  # the longest request of a page; a longer one ends the connection
PAGES_MAX = 32
WAITING_MAX = 512  # connections that look at nothing: no request yet, an answer under way, nothing subscribed to
OPEN_S = 5  # for a request to come and its answer to go
BACKLOG = 128  # connections that are accepted at a time: fewer than wait, or a burst ends those before it unheard
SEND_BYTES = 1 << 17  # kernel's buffer per page: a slow one must be late by little
LOG = logging.getLogger(__name__)


class ViewError(UserError):
    """The server cannot be. Its text is one line with the remedy."""

    exit_code = 1


class Connection(ServerConnection):
    """A connection that the view knows of from its first moment to its last."""

    def __init__(self, view: "ViewServer", *arguments: Any, **options: Any):
        super().__init__(*arguments, **options)
        self._view = view
        self.client: Client | None = None  # once it is open
        self.network = ""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self.network = network_of(transport.get_extra_info("peername"))
        self._view.come(self)

    def connection_lost(self, exc: Exception | None) -> None:
        super().connection_lost(exc)
        self._view.gone(self)


class ViewServer:
    """Answers requests; `connection` is what websockets calls its handler.

    A connection is a page once it has subscribed to something. Of those that have not, the oldest makes way for a new one
    when there are too many; of pages, the one that has been silent for longest. A slow or idle one shuts nobody out.
    """

    def __init__(self, hub: Hub, guard: Guard):
        self._hub, self._guard, self._page = hub, guard, Page()
        self._waiting = Places(WAITING_MAX, lambda connection: 0)
        self._pages = Places(PAGES_MAX, lambda connection: connection.client.idle_since())

    def come(self, connection: Connection) -> None:
        """A new connection, whose request is still to come."""
        self._shut_out(self._waiting.enter(connection, connection.network))

    def gone(self, connection: Connection) -> None:
        self._waiting.leave(connection)
        self._pages.leave(connection)

    @staticmethod
    def _shut_out(connection: Connection | None) -> None:
        if connection is not None:
            connection.transport.abort()

    async def answer(self, connection: Connection, request: Request) -> Response | None:
        """The response to a plain request; None: it is a page's live connection, go on."""
        if connection.protocol.eof_sent:  # garbage came after the request and was answered with the end of the stream
            connection.transport.abort()
            await connection.wait_closed()
        refusal = self._guard.refuse(request.headers)
        if refusal:
            return _text(*refusal)
        path = request.path.partition("?")[0]
        if path == PAGE_PATH:
            return _response(HTTPStatus.OK, self._page.headers(request.headers["Host"]), self._page.body)
        if path != LIVE_PATH:
            return _text(HTTPStatus.NOT_FOUND, "there is only the page, at /")
        return None

    async def connection(self, connection: Connection) -> None:
        plug = connection.transport.get_extra_info("socket")
        plug.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BYTES)
        connection.client = Client(self._hub, connection, lambda: self._becomes_page(connection))
        await connection.client.run()

    def _becomes_page(self, connection: Connection) -> bool:
        """A connection subscribes for the first time; False: there is no place for one more page."""
        leaving = self._pages.enter(connection, connection.network)
        if leaving is connection:
            return False
        self._waiting.leave(connection)
        self._shut_out(leaving)
        return True


def _text(status: HTTPStatus, text: str) -> Response:
    return _response(status, HEADERS | {"Content-Type": "text/plain; charset=utf-8"}, f"{text}\n".encode())


def _response(status: HTTPStatus, headers: dict[str, str], body: bytes) -> Response:
    everything = headers | {"Content-Length": str(len(body)), "Connection": "close"}
    return Response(status.value, status.phrase, Headers(everything), body)


@asynccontextmanager
async def serving(hub: Hub, address: str, port: int, allowed: list[str]) -> AsyncIterator[int]:
    """Serve while the context lasts; gives the port (0 asks for a free one). ViewError: the address cannot be had."""
    view = ViewServer(hub, Guard(address, allowed))
    try:
        server = await serve(
            view.connection,
            address,
            port,
            process_request=view.answer,
            create_connection=partial(Connection, view),
            compression=None,
            server_header=None,
            max_size=MESSAGE_BYTES,
            open_timeout=OPEN_S,
            close_timeout=2,
            backlog=BACKLOG,
            logger=LOG,
        )
    except OSError as error:
        raise ViewError(_why_not(address, port, error)) from error
    async with asyncio.TaskGroup() as tasks:  # should the rounds fail, all fails: never a page that stands still
        rounds = tasks.create_task(hub.run())
        try:
            yield _port(server)
        finally:
            rounds.cancel()
            server.close()
            await server.wait_closed()


def _port(server: Server) -> int:
    return server.sockets[0].getsockname()[1]


def _why_not(address: str, port: int, error: OSError) -> str:
    place = f"{address}:{port}"
    match error.errno:
        case errno.EADDRINUSE:
            return f"{place}: port in use, perhaps by another whisker-view; choose another --port (0: a free one)"
        case errno.EACCES:
            return f"{place}: no permission for this port; choose a --port above 1023"
        case errno.EADDRNOTAVAIL | None:  # None: asyncio, from Python 3.13 on, when no address could be taken
            return f"{place}: not an address of this machine; choose another --host"
    return f"{place}: cannot be served ({os.strerror(error.errno)}); choose another --host or --port"
