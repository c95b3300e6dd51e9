"""The HTTP and WebSocket server: `/` is the page, `/ws` the live connection, anything else does not exist."""

import asyncio
import errno
import logging
import os
import socket
from contextlib import asynccontextmanager
from http import HTTPStatus

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from ..errors import UserError
from .client import Client
from .guard import Guard
from .hub import Hub
from .page import HEADERS, Page

PAGE_PATH, LIVE_PATH = "/", "/ws"
MESSAGE_BYTES = 4096  # the longest request of a page; a longer one ends the connection
CLIENTS_MAX = 32
CONNECTIONS_MAX = 128  # with those that have not said yet what they want
SEND_BYTES = 1 << 17  # kernel's buffer per page: a slow one must be late by little
LOG = logging.getLogger(__name__)


class ViewError(UserError):
    """The server cannot be. Its text is one line with the remedy."""

    exit_code = 1


class Connection(ServerConnection):
    """One connection too many is closed before it is heard."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        if len(self.server.handler_tasks) > CONNECTIONS_MAX:
            transport.abort()


class ViewServer:
    """Answers requests; `connection` is what websockets calls its handler."""

    def __init__(self, hub: Hub, guard: Guard):
        self._hub, self._guard, self._page = hub, guard, Page()
        self._clients = 0

    async def answer(self, connection: ServerConnection, request: Request) -> Response | None:
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
        if self._clients >= CLIENTS_MAX:
            return _text(HTTPStatus.SERVICE_UNAVAILABLE, f"{CLIENTS_MAX} pages are connected; close one")
        return None

    async def connection(self, connection: ServerConnection) -> None:
        self._clients += 1
        plug = connection.transport.get_extra_info("socket")
        plug.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BYTES)
        try:
            await Client(self._hub, connection).run()
        finally:
            self._clients -= 1


def _text(status: HTTPStatus, text: str) -> Response:
    return _response(status, HEADERS | {"Content-Type": "text/plain; charset=utf-8"}, f"{text}\n".encode())


def _response(status: HTTPStatus, headers: dict[str, str], body: bytes) -> Response:
    everything = headers | {"Content-Length": str(len(body)), "Connection": "close"}
    return Response(status.value, status.phrase, Headers(everything), body)


@asynccontextmanager
async def serving(hub: Hub, address: str, port: int, allowed: list[str]):
    """Serve while the context lasts; gives the port (0 asks for a free one). ViewError: the address cannot be had."""
    view = ViewServer(hub, Guard(address, allowed))
    try:
        server = await serve(
            view.connection,
            address,
            port,
            process_request=view.answer,
            create_connection=Connection,
            compression=None,
            server_header=None,
            max_size=MESSAGE_BYTES,
            open_timeout=5,
            close_timeout=2,
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
        case errno.EADDRNOTAVAIL:
            return f"{place}: not an address of this machine; choose another --host"
    return f"{place}: cannot be served ({os.strerror(error.errno or 0)}); choose another --host or --port"
