"""What whisker-view answers to, and that nothing a stranger sends brings it down."""

import asyncio
import base64
import hashlib
import random
import re
import resource

import pytest
from viewkit import PATIENCE_S, made_frames, nothing_logged, page, ring_of, view_of
from websockets.exceptions import InvalidStatus

from whisker.view.guard import Guard
from whisker.view.page import Page
from whisker.view.server import CLIENTS_MAX, CONNECTIONS_MAX

UPGRADE = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA=="
FUZZ_INPUTS = 20_000

__all__ = ["nothing_logged"]  # a fixture that every test here uses


async def ask(port: int, request: bytes, frames: bytes = b"") -> bytes:
    """All that the server answers before it closes. What waits for more is ended here: after a request that is not
    complete, after the frames, or, if there are none, once a WebSocket is open."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    answer = b""
    try:
        writer.write(request)
        if b"\r\n\r\n" not in request:
            writer.write_eof()
        async with asyncio.timeout(PATIENCE_S):
            while data := await reader.read(1 << 16):
                opening = not answer and data.startswith(b"HTTP/1.1 101 ")
                answer += data
                if opening and not frames:
                    break
                if opening:
                    writer.write(frames)
                    writer.write_eof()
    except ConnectionError:
        pass
    finally:
        writer.close()
    return answer


def get(path: str, *headers: str) -> bytes:
    return "\r\n".join([f"GET {path} HTTP/1.1", *headers, "", ""]).encode("latin-1")


def answer_to(path: str, *headers: str) -> bytes:
    async def scenario():
        async with view_of() as port:
            return await ask(port, get(path, *(header.replace("PORT", str(port)) for header in headers)))

    return asyncio.run(scenario())


def test_the_page_is_served_with_headers_that_allow_only_itself():
    head, _, body = answer_to("/", "Host: localhost:PORT").partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 200 ")
    headers = dict(line.split(": ", 1) for line in head.decode().split("\r\n")[1:])
    assert body == Page().body and headers["Content-Length"] == str(len(body))
    policy = headers["Content-Security-Policy"]
    for tag in ("script", "style"):
        (text,) = re.findall(rf"<{tag}>(.*?)</{tag}>", body.decode(), re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{digest}'" in policy
    assert policy.startswith("default-src 'none';") and "unsafe" not in policy and "frame-ancestors 'none'" in policy
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert "Server" not in headers


def test_the_page_names_no_other_place():
    text = Page().body.decode().replace("http://www.w3.org/2000/svg", "")
    assert not re.search(r"https?://", text) and not re.search(r"""\b(src|href)=["'](?!data:)""", text)
    assert "ws://${location.host}/ws" in text
    assert "innerHTML" not in text and "eval(" not in text
    assert not re.search(r"\s(on\w+|style)=", text.partition("<script>")[0])


@pytest.mark.parametrize(
    "path, headers, status",
    [
        ("/", ["Host: 127.0.0.1:PORT"], 200),
        ("/", ["Host: [::1]:PORT"], 200),
        ("/", ["Host: LOCALHOST"], 200),
        ("/?x=1", ["Host: localhost:PORT"], 200),
        ("/", ["Host: localhost:PORT", "Origin: http://localhost:PORT"], 200),
        ("/", ["Host: evil.example:PORT"], 403),
        ("/", ["Host: localhost.evil.example:PORT"], 403),
        ("/", ["Host: 127.0.0.1.evil.example"], 403),
        ("/", ["Host: 192.0.2.7:PORT"], 403),
        ("/", ["Host: localhost:PORT@evil.example"], 403),
        ("/", ["Host: "], 403),
        ("/", [], 403),
        ("/", ["Host: localhost:PORT", "Host: evil.example"], 400),
        ("/", ["Host: localhost:PORT", "Origin: http://evil.example"], 403),
        ("/ws", ["Host: localhost:PORT", "Origin: http://evil.example", UPGRADE], 403),
        ("/ws", ["Host: localhost:PORT", "Origin: null", UPGRADE], 403),
        ("/ws", ["Host: localhost:PORT", "Origin: https://localhost:PORT", UPGRADE], 403),
        ("/ws", ["Host: localhost:PORT", "Origin: http://localhost:1", UPGRADE], 403),
        ("/ws", ["Host: evil.example", "Origin: http://evil.example", UPGRADE], 403),
        ("/ws", ["Host: localhost:PORT"], 426),
        ("/ws", ["Host: localhost:PORT", "Origin: http://localhost:PORT", UPGRADE], 101),
        ("/ws", ["Host: localhost:PORT", UPGRADE], 101),
        ("/../../etc/passwd", ["Host: localhost:PORT"], 404),
        ("/page/", ["Host: localhost:PORT"], 404),
        ("//", ["Host: localhost:PORT"], 404),
        ("/favicon.ico", ["Host: localhost:PORT"], 404),
    ],
)
def test_who_is_answered(path, headers, status):
    answer = answer_to(path, *headers)
    assert answer.startswith(f"HTTP/1.1 {status} ".encode())
    if status not in (101, 200, 426):
        assert len(answer.partition(b"\r\n\r\n")[2].splitlines()) == 1
        assert b"Whisker" not in answer and b"<" not in answer


def test_names_that_were_allowed_are_answered_and_addresses_of_a_wide_open_server():
    narrow, wide = Guard("127.0.0.1", ["Robot.local"]), Guard("0.0.0.0", [])
    assert narrow.refuse({"Host": "robot.local:8028"}) is None
    assert narrow.refuse({"Host": "192.0.2.7:8028"})
    assert wide.refuse({"Host": "192.0.2.7:8028"}) is None
    assert wide.refuse({"Host": "[2001:db8::1]:8028"}) is None
    assert wide.refuse({"Host": "robot.local:8028"})
    assert Guard("192.0.2.7", []).refuse({"Host": "192.0.2.7:8028"}) is None


def test_pages_and_connections_are_limited_and_places_come_free_again():
    async def scenario():
        async with view_of() as port:
            pages = [page(port) for _ in range(CLIENTS_MAX)]
            for p in pages:
                await (await p.__aenter__()).next("hello")
            with pytest.raises(InvalidStatus) as refusal:
                await page(port).__aenter__()
            assert refusal.value.response.status_code == 503
            await pages[0].__aexit__(None, None, None)
            while True:  # until the server has noticed
                try:
                    async with page(port) as p:
                        await p.next("hello")
                    break
                except InvalidStatus:
                    continue
            silent = [await asyncio.open_connection("127.0.0.1", port) for _ in range(CONNECTIONS_MAX)]
            assert await silent[-1][0].read() == b"", "one connection too many must be closed"
            for _, writer in silent:
                writer.close()
            for p in pages[1:]:
                await p.__aexit__(None, None, None)

    asyncio.run(scenario())


SEEDS = [
    get("/", "Host: localhost"),
    get("/ws", "Host: localhost", "Origin: http://localhost", UPGRADE),
    get(
        "/ws",
        "Host: localhost",
        UPGRADE,
        "Sec-WebSocket-Extensions: permessage-deflate",
        "Sec-WebSocket-Protocol: a, b",
    ),
    b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 3\r\n\r\nabc",
    b"GET / HTTP/1.0\r\n\r\n",
    b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
]
TEXTS = [
    b'{"type":"subscribe","topic":"traces","ring":"RING","ticks_per_bin":16,"bins":100,"lanes":7,"subscription":1}',
    b'{"type":"subscribe","topic":"status","ring":"RING"}',
    b'{"type":"subscribe","topic":"rings"}',
    b'{"type":"unsubscribe","topic":"traces"}',
    b'{"type":"ack","count":1}',
]


def mutated(rng: random.Random, data: bytes) -> bytes:
    """Some bytes changed, taken out, doubled or put in."""
    out = bytearray(data)
    for _ in range(rng.choice([0, 1, 1, 2, 5, 20])):
        at = rng.randrange(len(out) + 1)
        match rng.randrange(5):
            case 0:
                out[at : at + 1] = bytes([rng.randrange(256)])
            case 1:
                del out[at : at + rng.randrange(1, 9)]
            case 2:
                out[at:at] = out[at : at + rng.randrange(1, 40)]
            case 3:
                out[at:at] = rng.randbytes(rng.randrange(1, 9))
            case 4:
                out[at:at] = rng.choice([b"\r\n", b"\r\n\r\n", b":", b"0", b"-1", b"9" * 30, b"[", b"{", b'"', b"\0"])
    return bytes(out)


def frame(rng: random.Random, data: bytes) -> bytes:
    """A masked WebSocket frame, now and then a wrong one."""
    first = 0x81 if rng.random() < 0.8 else rng.randrange(256)
    size = len(data) if rng.random() < 0.95 else rng.randrange(1 << 16)
    length = bytes([0x80 | size]) if size < 126 else b"\xfe" + size.to_bytes(2, "big")
    mask = rng.randbytes(4)
    return bytes([first]) + length + mask + bytes(byte ^ mask[n % 4] for n, byte in enumerate(data))


def conversation(rng: random.Random, ring: str) -> tuple[bytes, bytes, int]:
    """What a stranger sends over one connection: a request, frames after it, and how many inputs that is."""
    if rng.random() < 0.3:
        return mutated(rng, rng.choice(SEEDS)), b"", 1
    texts = [mutated(rng, rng.choice(TEXTS).replace(b"RING", ring.encode())) for _ in range(rng.randrange(1, 80))]
    return SEEDS[1], b"".join(frame(rng, text) for text in texts), len(texts)


def kilobytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def fuzz_pages(inputs: int, seed: int) -> None:
    """So many inputs at a running server; then it must still serve, with no more memory than a little."""
    rng = random.Random(seed)

    async def scenario(ring):
        async with view_of(ring) as port, page(port) as steady:
            sent, before = 0, None
            while sent < inputs:
                talks = [conversation(rng, ring) for _ in range(16)]
                await asyncio.gather(*(ask(port, request, frames) for request, frames, _ in talks))
                sent += sum(n for _, _, n in talks)
                before = before or (kilobytes() if sent > inputs // 4 else None)
            await steady.traces(ring, lanes=1)
            await steady.bins_until(100)
            assert kilobytes() - before < 64 * 1024, "memory grows with what strangers send"

    with ring_of(made_frames(0, 100)) as writer:
        asyncio.run(scenario(writer.name))


def test_nothing_that_strangers_send_brings_it_down():
    fuzz_pages(FUZZ_INPUTS, seed=1)
