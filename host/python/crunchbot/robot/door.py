"""A guarded door before a WebSocket server that looks at no Host and no Origin, as Foxglove's SDK: a request that the guard
lets pass goes on to it, byte for byte, and so does all that follows.

The server listens where no web page can find it: at an address of 127.0.0.0/8 drawn at random.
"""

import asyncio
import contextlib
import secrets
import threading
from collections.abc import Callable
from http import HTTPStatus

from websockets.exceptions import WebSocketException
from websockets.http11 import Request
from websockets.streams import StreamReader

from ..guard import Guard, Refusal

HEAD_MOST, CHUNK = 1 << 14, 1 << 16  # bytes of a request, of a read
OPEN_S = 5.0  # for a request to come
CONNECTIONS_MOST = 64  # as the Pyro server has


def hidden_address() -> str:
    """An address of this machine that nobody guesses."""
    return ".".join(["127", *(str(1 + secrets.randbelow(254)) for _ in range(3))])


class Door:
    """Serves until closed. OSError when the address cannot be had. refused: a line for each request that is refused."""

    def __init__(self, guard: Guard, host: str, port: int, inner: tuple[str, int], refused: Callable[[str], None]):
        self._guard, self._inner, self._refused, self._open = guard, inner, refused, 0
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="door", daemon=True)
        self._thread.start()
        try:
            self.port: int = asyncio.run_coroutine_threadsafe(self._serve(host, port), self._loop).result()
        except OSError:
            self.close()
            raise

    def close(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()

    async def _serve(self, host: str, port: int) -> int:
        server = await asyncio.start_server(self._take, host, port, limit=HEAD_MOST)
        return server.sockets[0].getsockname()[1]

    async def _take(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._open += 1
        try:
            head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), OPEN_S)
            refusal = self._refusal(head)
            if refusal:
                self._refused(refusal[1])
                writer.write(_answer(*refusal))
            else:
                await self._through(head, reader, writer)
        except (OSError, EOFError, TimeoutError, asyncio.LimitOverrunError):
            pass  # it has gone, or never asked
        finally:
            self._open -= 1
            writer.close()

    def _refusal(self, head: bytes) -> Refusal | None:
        if self._open > CONNECTIONS_MOST:
            return HTTPStatus.SERVICE_UNAVAILABLE, "too many connections"
        stream = StreamReader()
        stream.feed_data(head)
        try:
            next(Request.parse(stream.read_line))
        except StopIteration as parsed:
            headers = parsed.value.headers
            plain = headers.get_all("Upgrade") != ["websocket"]
            return self._guard.refuse(headers) or ((HTTPStatus.NOT_FOUND, "a WebSocket is here") if plain else None)
        except (EOFError, ValueError, WebSocketException):
            pass
        return HTTPStatus.BAD_REQUEST, "not a request"

    async def _through(self, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        inner_reader, inner_writer = await asyncio.open_connection(*self._inner)
        inner_writer.write(head)
        ways = [asyncio.create_task(_pass_on(*way)) for way in ((reader, inner_writer), (inner_reader, writer))]
        await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        for way in ways:
            way.cancel()
        inner_writer.close()


async def _pass_on(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    with contextlib.suppress(OSError):
        while data := await reader.read(CHUNK):
            writer.write(data)
            await writer.drain()


def _answer(status: HTTPStatus, text: str) -> bytes:
    body = f"{text}\n"
    head = f"HTTP/1.1 {status.value} {status.phrase}\r\nContent-Type: text/plain; charset=utf-8\r\n"
    return f"{head}Content-Length: {len(body)}\r\nConnection: close\r\n\r\n{body}".encode()
