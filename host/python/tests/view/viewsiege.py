"""How fast whisker-view serves an honest client while hostile ones press on it.

    python host/python/tests/view/viewsiege.py --hostile 200 --seconds 10

For each kind of hostility: so many connections from a process of their own, each begun anew as soon as it ends. Prints the
times of an honest client, s: for the page and for a page's first message after it has subscribed.
"""

import argparse
import asyncio
import contextlib
import json
import multiprocessing
import socket
import struct
import subprocess
import sys
import time

import numpy as np
from websockets.asyncio.client import connect

GET = b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"
OPEN = (
    b"GET /ws HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
)
AT_ONCE = struct.pack("ii", 1, 0)  # SO_LINGER: a close that resets


async def half_open(reader, writer):
    await reader.read()


async def slow_headers(reader, writer):
    for byte in GET[:-2] + b"X: " + b"x" * 1000:
        writer.write(bytes([byte]))
        await writer.drain()
        await asyncio.sleep(0.05)


async def idle_websocket(reader, writer):
    writer.write(OPEN)
    await reader.read()


async def reset(reader, writer):
    writer.write(GET[:20])
    writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, AT_ONCE)


KINDS = {f.__name__: (f,) for f in (half_open, slow_headers, idle_websocket, reset)}
KINDS["all"] = tuple(f for (f,) in KINDS.values())


async def again_and_again(port: int, behaviour) -> None:
    while True:
        with contextlib.suppress(OSError):
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            try:
                await behaviour(reader, writer)
            finally:
                writer.transport.abort()
        await asyncio.sleep(0)


def press(port: int, kind: str, count: int) -> None:
    """So many hostile connections, for ever."""

    async def everything():
        await asyncio.gather(*(again_and_again(port, KINDS[kind][n % len(KINDS[kind])]) for n in range(count)))

    asyncio.run(everything())


async def page_s(port: int) -> float:
    began = time.monotonic()
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(GET)
    answer = await reader.read()
    writer.transport.abort()
    assert answer.startswith(b"HTTP/1.1 200 ") and answer.endswith(b"</html>\n"), answer[:40]
    return time.monotonic() - began


async def live_s(port: int) -> float:
    began = time.monotonic()
    async with connect(f"ws://127.0.0.1:{port}/ws") as socket_:
        await socket_.recv()
        await socket_.send(json.dumps({"type": "subscribe", "topic": "rings"}))
        await socket_.recv()
        took = time.monotonic() - began
    return took


async def honest(port: int, seconds: float) -> dict[str, list[float]]:
    """Times of one honest client, inf where it was not served."""
    times: dict[str, list[float]] = {"page": [], "live": []}
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for name, ask in (("page", page_s), ("live", live_s)):
            try:
                times[name].append(await asyncio.wait_for(ask(port), 10))
            except Exception:
                times[name].append(float("inf"))
        await asyncio.sleep(0.05)
    return times


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hostile", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=10.0)
    options = parser.parse_args()
    command = [sys.executable, "-m", "crunchbot.view", "--port", "0", "--ring", "no-such-ring"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as view:
        port = int(view.stdout.readline().rstrip("/\n").rpartition(":")[2])
        for kind in KINDS:
            hostile = multiprocessing.Process(target=press, args=(port, kind, options.hostile), daemon=True)
            hostile.start()
            time.sleep(1.0)
            for name, times in asyncio.run(honest(port, options.seconds)).items():
                middle, most = np.median(times), max(times)
                print(f"{kind:15} {name}: {len(times):4} served in {middle:.3f} s (median), {most:.3f} s (longest)")
            hostile.kill()
            hostile.join()
        view.terminate()
    return 0


if __name__ == "__main__":
    sys.exit(main())
