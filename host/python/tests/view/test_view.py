"""whisker-view over its WebSocket: what a page receives equals what the ring holds, whatever writer and page do."""

import asyncio
import getpass
import json
import logging
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from urllib.request import urlopen

import numpy as np
import pytest
from rings import ring_name
from viewkit import NODES, PATIENCE_S, Block, made_frames, nothing_logged, page, ring_of, spoil, view_of
from websockets.exceptions import ConnectionClosed

from crunchbot import __version__
from crunchbot.bridge.ring import Clock, Writer
from crunchbot.cli import main as whisker_main
from crunchbot.view.__main__ import main
from crunchbot.view.client import WINDOW, Client
from crunchbot.view.pyramid import BINS
from crunchbot.view.rings import find_rings
from crunchbot.view.server import MESSAGE_BYTES
from crunchbot.view.tap import Tap
from crunchbot.view.topics import BLOCK, BLOCK_BINS
from whisker_protocol import LANES

__all__ = ["nothing_logged"]  # a fixture that every test here uses


def test_traces_equal_the_ring():
    frames = made_frames(0, 3000)
    spoil(frames, "late", 1, slice(50, 60))

    async def scenario(name):
        async with view_of(name) as port, page(port) as p:
            await p.traces(name, width=1, bins=BINS, lanes=0b111)
            blocks = await p.bins_until(len(frames))
            assert blocks[0].flags == 1 and not any(block.flags for block in blocks[1:])
            assert {(b.topic, b.width, b.mask, b.subscription) for b in blocks} == {(1, 1, 0b111, 7)}
            assert [b.first for b in blocks[1:]] == [b.first + b.bins for b in blocks[:-1]]
            for axis, name_of_axis in enumerate(("alpha", "beta")):
                low, high = (np.concatenate([getattr(b, side)[axis] for b in blocks], -1) for side in ("low", "high"))
                counts = frames["lane"][name_of_axis][:, :NODES].T
                good = frames["lane"]["status"][:, :NODES].T == 0
                assert np.array_equal(low[good], counts[good]) and np.array_equal(high[good], counts[good])
                assert np.all(low[~good] > high[~good])
            assert np.array_equal(np.concatenate([b.bad for b in blocks], -1), ~good)

    with ring_of(frames) as writer:
        asyncio.run(scenario(writer.name))


def test_a_wide_bin_keeps_a_peak_of_one_tick():
    frames = made_frames(0, 4096)
    frames["lane"]["alpha"][:, 0] = 0x8000
    frames["lane"]["alpha"][1234, 0] = 0xF000

    async def scenario(name):
        async with view_of(name) as port, page(port) as p:
            await p.traces(name, width=512, lanes=1)
            block = (await p.bins_until(8))[0]
            assert block.high[0, 0].tolist() == [0x8000, 0x8000, 0xF000] + [0x8000] * 5
            assert block.low[0, 0].tolist() == [0x8000] * 8

    with ring_of(frames) as writer:
        asyncio.run(scenario(writer.name))


def test_new_frames_follow_without_gap_or_repeat():
    async def scenario(writer):
        async with view_of(writer.name) as port, page(port) as p:
            await p.traces(writer.name, width=2, lanes=1)
            await p.bins_until(50)
            writer.publish(made_frames(100, 101))
            (block,) = await p.bins_until(100)
            assert (block.first, block.bins, block.flags) == (50, 50, 0)  # tick 200 waits for its other half

    with ring_of(made_frames(0, 100)) as writer:
        asyncio.run(scenario(writer))


def test_status_counts_what_the_ring_counts():
    frames = made_frames(0, 2000)
    spoil(frames, "link_crc", 2, slice(10, 15))
    frames = np.delete(frames, slice(600, 607))
    frames["dropped"][1000:] = 3

    async def scenario(writer):
        async with view_of(writer.name) as port, page(port) as p:
            await p.ask(type="subscribe", topic="status", ring=writer.name)
            reported = await p.status_where(lambda s: s["frames"] == len(frames))
            assert (reported["ring"], reported["state"], reported["trouble"]) == (writer.name, "live", None)
            assert (reported["reader"]["frames_missing"], reported["dropped"], reported["reader"]["overruns"]) == (
                7,
                3,
                0,
            )
            assert reported["bad"]["link_crc"] == [0, 0, 5] + [0] * (LANES - 3)
            assert reported["lanes"]["lost"][:NODES] == [0, 0, 5]
            assert reported["lanes"]["state"] == ["good"] * NODES + ["absent"] * (LANES - NODES)
            assert reported["lanes"]["alpha"][0] == frames["lane"]["alpha"][-1, 0]
            assert reported["tick_s"] == pytest.approx(500e-6)
            assert reported["clock"] is None and reported["daemon"] is None
            writer.set_clock(Clock(0, time.monotonic_ns(), 2, 50 / 3, 1500.0))
            writer.set_stats(frames=9, started_ns=1, reconnects=2, wire_version=1, error=-40, serial=b"CB-7")
            reported = await p.status_where(lambda s: s["daemon"])
            assert reported["clock"]["uncertainty_ns"] == 1500.0
            assert (reported["daemon"]["reconnects"], reported["daemon"]["serial"]) == (2, "CB-7")
            assert "no bridge is connected" in reported["daemon"]["trouble"]

    with ring_of(frames) as writer:
        asyncio.run(scenario(writer))


def test_no_ring_then_one_then_its_end_then_a_new_one():
    name = ring_name()

    async def scenario():
        async with view_of(name) as port, page(port) as p:
            await p.ask(type="subscribe", topic="status", ring=name)
            reported = await p.status_where(lambda s: s["state"] == "waiting")
            assert "there is no ring of this name" in reported["trouble"]["text"]
            await p.traces(name, width=1, lanes=1)
            with ring_of(made_frames(0, 300), name):
                await p.status_where(lambda s: s["state"] == "live")
                await p.bins_until(300)
            reported = await p.status_where(lambda s: s["state"] == "ended")
            assert reported["trouble"]["name"] == "CLOSED"
            with ring_of(made_frames(0, 200, seed=1), name):
                reported = await p.status_where(lambda s: s["state"] == "live" and s["frames"] == 500)
                assert reported["restarts"] == 1
                again = made_frames(0, 200, seed=1)["lane"]["alpha"][:, 0].tolist()
                lows = np.concatenate([b.low[0, 0] for b in await p.bins_until(501)])
                while lows[-1] == 0xFFFF:  # the outage, as long as it was
                    lows = np.append(lows, Block(await p.next("traces")).low[0, 0])
                assert lows[-200:].tolist() == again
                assert np.all(lows[:-200] == 0xFFFF) and len(lows) > 200, "time goes on, with a gap"
            texts = [text for _, text in reported["events"]]
            assert texts[:2] == ["attached to the ring", "whiskerd closed the ring"]

    asyncio.run(scenario())


def test_a_slow_page_gets_the_newest_and_holds_up_nobody():
    async def scenario(writer):
        async with view_of(writer.name) as port, page(port) as slow, page(port) as quick:
            for p in (slow, quick):
                await p.next("hello")
                await p.traces(writer.name, width=1, bins=100, lanes=1)
            first = 1000
            while quick.count < 20:  # many more than the slow one may have under way
                writer.publish(made_frames(first, 100))
                first += 100
                await quick.bins_until(first)
            # What was sent before the page fell silent; had there been more, it would come next and not be the newest.
            for _ in range(WINDOW):
                await slow.socket.recv()
            await slow.ask(type="ack", count=1 + WINDOW)
            newest = Block(await slow.next("traces", acknowledge=False))
            assert newest.first + newest.bins == first and newest.bins == 100, "not the newest"

    with ring_of(made_frames(0, 1000)) as writer:
        asyncio.run(scenario(writer))


def test_rings_are_found_named_and_reported_when_they_change():
    async def scenario(writer):
        other = ring_name()
        async with view_of(writer.name) as port, page(port) as p:
            assert (await p.next("hello"))["rings"][0] == writer.name
            await p.ask(type="subscribe", topic="rings")
            assert other not in (await p.next("rings"))["rings"]
            with Writer(other) as second:
                reported = await p.next("rings")
                assert other in reported["rings"] and reported["owners"][other] == getpass.getuser()
                second.publish(made_frames(0, 64))
                await p.ask(type="subscribe", topic="status", ring=other)
                await p.status_where(lambda s: s["ring"] == other and s["frames"] == 64)

    with ring_of(made_frames(0, 10)) as writer:
        asyncio.run(scenario(writer))


def test_only_rings_with_a_writer_are_offered():
    with ring_of(made_frames(0, 10)) as writer:
        shared, odd = Path("/dev/shm"), [f"{writer.name}-{what}" for what in ("dead", "other", "short", "name\nline")]
        linked, folder = (shared / f"{writer.name}-{what}" for what in ("link", "folder"))
        try:
            for name, content in zip(odd, (b"WHSKRING" * 10, b"something", b"WHSK", b"WHSKRING" * 10), strict=True):
                (shared / name).write_bytes(content)
            linked.symlink_to(shared / writer.name)
            folder.mkdir()
            found = {name: owner for name, owner in find_rings().items() if name.startswith(writer.name)}
            assert found == {writer.name: getpass.getuser()}
        finally:
            for path in (*(shared / name for name in odd), linked):
                path.unlink(missing_ok=True)
            folder.rmdir()
    assert writer.name not in find_rings()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file to another user")
def test_a_ring_of_another_user_is_shown_only_if_that_user_is_named():
    stranger = 4242

    def seen(writer, owner):
        tap = Tap(writer.name, owner=owner)
        tap.poll()
        reported = tap.status()
        tap.close()
        return reported

    with ring_of(made_frames(0, 10)) as writer:
        os.chown(f"/dev/shm/{writer.name}", stranger, stranger)
        refused = seen(writer, None)
        assert refused["state"] == "refused" and refused["trouble"]["name"] == "RING_OWNER"
        assert f"user {stranger}'s" in refused["trouble"]["text"] and writer.name not in find_rings()
        shown = seen(writer, stranger)
        assert shown["frames"] == 10 and shown["reader"]["owner"] == str(stranger)


def test_shared_memory_that_is_no_ring_is_refused_with_the_reason(tmp_path):
    name = ring_name()
    path = f"/dev/shm/{name}"
    rng = np.random.default_rng(5)
    with open(path, "wb") as file:
        file.write(b"WHSKRING" + rng.bytes(4096 * 3))

    async def scenario():
        async with view_of(name) as port, page(port) as p:
            await p.ask(type="subscribe", topic="status", ring=name)
            assert (
                "another layout version" in (await p.status_where(lambda s: s["state"] == "refused"))["trouble"]["text"]
            )

    try:
        asyncio.run(scenario())
    finally:
        os.unlink(path)


@pytest.mark.parametrize(
    "request_text, complaint",
    [
        ("nonsense", "not a JSON object"),
        ("[]", "not a JSON object"),
        ("[" * 4000, "not a JSON object"),
        ('{"type": "delete"}', "type: not ack, subscribe, unsubscribe, set_pose, hold, record or play"),
        ('{"type": "subscribe", "topic": "arena"}', "topic: not one of traces, status, rings"),
        ('{"type": "subscribe", "topic": ["traces"]}', "topic: not one of"),
        ('{"type": "subscribe", "topic": "status", "ring": "../etc/passwd"}', "ring: not one of this machine"),
        ('{"type": "subscribe", "topic": "status", "ring": {}}', "ring: not one of this machine"),
        ('{"type": "ack", "count": 99}', "count: not the number"),
        ('{"type": "ack", "count": true}', "count: not the number"),
        ('{"type": "subscribe", "topic": "traces", "ticks_per_bin": 3}', "ticks_per_bin: 3 is not one of 1, 2"),
        ('{"type": "subscribe", "topic": "traces", "ticks_per_bin": 1e999}', "ticks_per_bin: not a whole number"),
        ('{"type": "subscribe", "topic": "traces", "ticks_per_bin": 1, "bins": 0}', "bins: not a whole number"),
        (
            '{"type": "subscribe", "topic": "traces", "ticks_per_bin": 1, "bins": 9, "lanes": 268435456}',
            "lanes: not a whole number from 1 to 268435455",
        ),
    ],
)
def test_a_bad_request_is_answered_with_one_line_and_changes_nothing(request_text, complaint):
    async def scenario(writer):
        async with view_of(writer.name) as port, page(port) as p:
            await p.socket.send(request_text)
            reported = await p.next("error")
            assert complaint in reported["text"] and "\n" not in reported["text"]
            await p.traces(writer.name, lanes=1)
            await p.bins_until(10)

    with ring_of(made_frames(0, 10)) as writer:
        asyncio.run(scenario(writer))


def test_a_page_that_asks_nonsense_or_too_much_or_too_long_is_cut_off():
    async def scenario(writer):
        async with view_of(writer.name) as port, page(port) as steady:
            for message, times in (("nonsense", 40), (json.dumps({"type": "ack", "count": 0}), 2000), ("x" * 5000, 1)):
                assert len(message) < MESSAGE_BYTES or times == 1
                with pytest.raises(ConnectionClosed):
                    async with page(port) as p:
                        for _ in range(times):
                            await p.socket.send(message)
                        async with asyncio.timeout(PATIENCE_S):
                            while True:
                                await p.socket.recv()
            await steady.traces(writer.name, lanes=1)
            await steady.bins_until(10)

    with ring_of(made_frames(0, 10)) as writer:
        asyncio.run(scenario(writer))


def test_a_connection_asks_for_a_pages_place_once(monkeypatch):
    asked = []

    class Counted(Client):
        def __init__(self, hub, socket, enter):
            super().__init__(hub, socket, lambda: asked.append(socket) or enter())

    monkeypatch.setattr("crunchbot.view.server.Client", Counted)

    async def scenario():
        async with view_of() as port, page(port) as p:
            await p.next("hello")
            assert not asked
            for _ in range(3):
                await p.ask(type="subscribe", topic="rings")
                await p.next("rings")
            assert len(asked) == 1

    asyncio.run(scenario())


def test_the_kernel_holds_a_whole_block_of_all_lanes_for_a_page_and_less_than_it_may_have_under_way(monkeypatch):
    """So the block comes at once, and a page that reads slowly is not late by many of them."""
    sockets = []

    class Seen(Client):
        def __init__(self, hub, socket, enter):
            super().__init__(hub, socket, enter)
            sockets.append(socket.transport.get_extra_info("socket"))

    monkeypatch.setattr("crunchbot.view.server.Client", Seen)

    async def scenario():
        async with view_of() as port, page(port) as p:
            await p.next("hello")
            (plug,) = sockets
            block = BLOCK.size + BLOCK_BINS * LANES * (2 * 4 + 1)  # low and high of two axes, and the bad ones
            assert block <= plug.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF) < WINDOW * block

    asyncio.run(scenario())


def test_leaving_a_topic_ends_it():
    async def scenario(writer):
        async with view_of(writer.name) as port, page(port) as p:
            await p.traces(writer.name, width=1, lanes=1)
            await p.bins_until(10)
            await p.ask(type="unsubscribe", topic="traces")
            await p.ask(type="unsubscribe", topic="rings")  # never had
            await p.ask(type="subscribe", topic="status", ring=writer.name)
            writer.publish(made_frames(10, 100))
            seen = []
            while len(seen) < 3:
                message = await p.socket.recv()
                seen += [message] if isinstance(message, str) else pytest.fail("traces still come")
                p.count += 1
                await p.ask(type="ack", count=p.count)

    with ring_of(made_frames(0, 10)) as writer:
        asyncio.run(scenario(writer))


def test_port_in_use_is_one_line(capfd):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["--port", str(port)]) == 1
    out, err = capfd.readouterr()
    assert out == "" and err.count("\n") == 1
    assert f"127.0.0.1:{port}: port in use" in err and "--port" in err


def test_what_its_server_logs_is_not_among_its_complaints(monkeypatch, capfd):
    """A connection that breaks in a new way is no line with a remedy; nobody at the terminal can mend it."""
    log = logging.getLogger("crunchbot.view")
    monkeypatch.setattr(log, "handlers", [])
    monkeypatch.setattr(log, "propagate", False)  # to pytest, which would take it
    assert main(["--ring", "a/b"]) != 0
    logging.getLogger("crunchbot.view.server").error("connection handler failed")
    assert "connection handler failed" not in capfd.readouterr().err


@pytest.mark.parametrize(
    "arguments, complaint",
    [
        (["--port", "70000"], "not a whole number from 0 to 65535"),
        (["--host", "example.org"], "example.org is not an address"),
        (["--host", "192.0.2.1", "--port", "0"], "not an address of this machine"),
        (["--ring", "a/b"], "not the name of a ring"),
        (["--ring", ""], "not the name of a ring"),
        (
            ["--zenoh-config", "/nosuch"],
            "/nosuch: no configuration of zenoh (cannot be read (No such file or directory)); give a JSON5",
        ),
    ],
)
def test_bad_arguments_are_one_line(capfd, arguments, complaint):
    code = main(arguments)
    err = capfd.readouterr().err
    assert code != 0 and complaint in err and err.count("\n") == 1


def test_help_is_the_same_for_both_commands_and_shows_an_example(capsys):
    texts = []
    for call, words in ((main, ["--help"]), (whisker_main, ["view", "--help"])):
        assert call(words) == 0
        texts.append(capsys.readouterr().out)
    for text in texts:
        for option in ("--ring", "--port", "--host", "--allow-host", "--open"):
            assert option in text
    assert "whisker-view --ring whisker --open" in texts[0] and "whisker view --ring whisker --open" in texts[1]


def test_the_program_serves_prints_its_address_and_ends_at_sigterm():
    with ring_of(made_frames(0, 64)) as writer:
        command = [sys.executable, "-m", "crunchbot.view", "--port", "0", "--ring", writer.name]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            url = process.stdout.readline().strip()
            with urlopen(url) as answer:
                assert answer.status == 200
            process.send_signal(signal.SIGTERM)
            assert process.wait(PATIENCE_S) == 0
            assert process.stderr.read() == ""


def test_the_program_states_its_version(capsys):
    assert main(["--version"]) == 0 and capsys.readouterr().out == f"whisker-view {__version__}\n"


@pytest.mark.parametrize(
    ("more", "what"), [([], "watch"), (["--allow-pose", "--robot", "r"], "watch, set the pose, stop the robot, record")]
)
def test_a_view_that_is_open_says_what_others_may(more, what):
    words = [sys.executable, "-m", "crunchbot.view", "--host", "0.0.0.0", "--port", "0", *more]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline().startswith("http://127.0.0.1:")
        process.terminate()
        given = process.stderr.read()
    assert given == f"whisker-view: 0.0.0.0: anyone who reaches this address can {what}\n"
