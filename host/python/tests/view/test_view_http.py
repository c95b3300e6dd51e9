"""What whisker-view answers to, and that nothing a stranger sends brings it down."""

import asyncio
import base64
import contextlib
import hashlib
import random
import re
import resource

import pytest
from viewkit import PATIENCE_S, Script, made_frames, nothing_logged, page, ring_of, view_of
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode

from crunchbot.guard import Guard
from crunchbot.view.page import Page
from crunchbot.view.places import Places, network_of
from crunchbot.view.server import PAGES_MAX

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


async def watching(port: int) -> Script:
    """A page that looks at something."""
    script = Script(await connect(f"ws://127.0.0.1:{port}/ws"))
    await script.ask(type="subscribe", topic="rings")
    await script.next("rings")
    return script


def with_all_pages_taken(scenario) -> None:
    async def run():
        async with view_of() as port:
            pages = await asyncio.gather(*(watching(port) for _ in range(PAGES_MAX)))
            await scenario(port, pages)
            for script in pages:
                await script.socket.close()

    asyncio.run(asyncio.wait_for(run(), PATIENCE_S))


def test_pages_are_limited_and_places_come_free_again(monkeypatch):
    monkeypatch.setattr("crunchbot.view.client.IDLE_S", PATIENCE_S)

    async def scenario(port, pages):
        with pytest.raises(ConnectionClosed) as refusal:
            await watching(port)
        assert refusal.value.rcvd.code == CloseCode.TRY_AGAIN_LATER and "close one" in refusal.value.rcvd.reason
        await pages.pop().socket.close()
        while len(pages) < PAGES_MAX:  # until the server has noticed
            with contextlib.suppress(ConnectionClosed):
                pages.append(await watching(port))

    with_all_pages_taken(scenario)


def test_a_page_that_is_silent_makes_way_for_a_new_one(monkeypatch):
    monkeypatch.setattr("crunchbot.view.client.IDLE_S", 0.0)

    async def scenario(port, pages):
        pages.append(await watching(port))
        ended = [asyncio.create_task(script.socket.wait_closed()) for script in pages]
        await asyncio.wait(ended, return_when=asyncio.FIRST_COMPLETED)
        assert not ended[-1].done() and sum(task.done() for task in ended) == 1

    with_all_pages_taken(scenario)


async def held(port: int, request: bytes) -> asyncio.StreamReader:
    """A connection that has sent so much and waits; of a WebSocket, until it is open."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    KEPT.append(writer)
    writer.write(request)
    if request.endswith(b"\r\n\r\n"):
        await reader.readuntil(b"\r\n\r\n")
    return reader


KEPT = []  # writers of connections that are held


@pytest.mark.parametrize("request_", [b"", b"GET / HTTP/1.1\r\nHost: loc", get("/ws", "Host: localhost", UPGRADE)])
def test_connections_that_ask_for_nothing_are_limited_and_make_way(monkeypatch, request_):
    """When all places are taken, the oldest ends and honest clients are served."""
    monkeypatch.setattr("crunchbot.view.server.OPEN_S", 2 * PATIENCE_S)
    monkeypatch.setattr("crunchbot.view.server.WAITING_MAX", places := 40)

    async def scenario():
        async with view_of() as port, page(port) as steady:
            await steady.ask(type="subscribe", topic="rings")
            await steady.next("rings")
            waiting = [await held(port, request_) for _ in range(places + 1)]
            await waiting[0].read()  # to its end
            assert (await ask(port, get("/", "Host: localhost"))).startswith(b"HTTP/1.1 200 ")
            async with page(port) as late:
                await late.ask(type="subscribe", topic="rings")
                await late.next("rings")
            assert not waiting[-1].at_eof()
            await steady.ask(type="subscribe", topic="scene")
            await steady.next("scene")
            for writer in KEPT:
                writer.transport.abort()
            KEPT.clear()

    asyncio.run(asyncio.wait_for(scenario(), PATIENCE_S))


def holders(places: Places) -> list[str]:
    return sorted(places._network_of)


def test_places_go_first_from_who_has_most_and_has_been_idle_longest():
    idle = {"a1": None, "a2": 7.0, "a3": 5.0, "b1": 1.0, "b2": None, "c1": None}
    places = Places(4, idle.get)
    assert [places.enter(name, name[0]) for name in ("a1", "a2", "a3", "b1")] == [None] * 4
    assert places.enter("b2", "b") == "a3"  # not b1, idle for longer: a has three places
    assert holders(places) == ["a1", "a2", "b1", "b2"]
    assert places.enter("c1", "c") == "a2"
    assert places.enter("a3", "a") == "a3", "a has as many as b, and none of its own is idle"
    assert holders(places) == ["a1", "b1", "b2", "c1"]
    places.leave("c1")
    assert places.enter("a3", "a") is None
    assert places.enter("c1", "c") == "a3"
    idle["b1"] = None
    assert places.enter("d1", "d") == "b1", "none is idle, but its network has most"


def test_a_network_is_an_address_or_the_part_of_one_that_a_host_can_choose_from():
    assert network_of(("192.0.2.7", 1)) == "192.0.2.7"
    assert network_of(("2001:db8::1", 1, 0, 0)) == network_of(("2001:db8::ffff:2", 9, 0, 0)) == "2001:db8::/64"
    assert network_of(("fe80::1%eth0", 1, 0, 2)) == "fe80::/64"
    assert network_of(None) == ""


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
