"""The page of whisker-view in headless Chromium: what a person sees equals what the ring holds."""

import asyncio
import time
from contextlib import asynccontextmanager
from itertools import count

import chromium
import numpy as np
import pytest
from rings import ring_name
from viewkit import NODES, flowing, made_frames, ring_of, spoil, view_of
from viewrobot import SCENE, MadeUpRun, Post

from crunchbot.bridge.ring import Clock
from crunchbot.view.hub import Hub
from crunchbot.view.server import serving
from whisker_protocol import WIRE_VERSION

pytestmark = pytest.mark.skipif(chromium.PROGRAM is None, reason="chromium is not installed (apt install chromium)")

# The painted rows of each column of the traces, from the right: [] or [top, bottom] of what is not transparent.
COLUMNS = """(() => {
  const c = document.getElementById('curves'), n = NUMBER;
  const px = new Uint32Array(c.getContext('2d').getImageData(c.width - n, 0, n, c.height).data.buffer);
  return Array.from({ length: n }, (_, k) => {
    const rows = [];
    for (let y = 0; y < c.height; y++) if (px[y * n + n - 1 - k]) rows.push(y);
    return rows.length ? [rows[0], rows.at(-1)] : [];
  });
})()"""
STATE = "document.getElementById('state').dataset.state"
DRAWN = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))"


def columns(number: int) -> str:
    return COLUMNS.replace("NUMBER", str(number))


@asynccontextmanager
async def looking_at(name: str, options: str = ""):
    async with view_of(name) as port, chromium.browser() as b:
        await b.look(f"http://127.0.0.1:{port}/#{options}")
        yield b
        assert b.troubles == []
        assert set(b.requests) - {f"http://127.0.0.1:{port}/", f"ws://127.0.0.1:{port}/ws"} <= {
            url for url in b.requests if url.startswith("data:")
        }


async def number(b, tile: str) -> int:
    return int((await b.eval(f"document.querySelector('#tile-{tile} b').textContent")).replace("\u202f", ""))


def quiet(first: int, n: int) -> np.ndarray:
    """Lane 0 at rest, the others without a node."""
    frames = made_frames(first, n)
    frames["lane"]["status"][:, 1:] = frames["lane"]["status"][0, -1]
    frames["lane"]["alpha"][:, 0] = frames["lane"]["beta"][:, 0] = 0x8000
    return frames


def test_counters_health_and_lanes_are_those_of_the_ring():
    frames = made_frames(0, 2000)
    spoil(frames, "link_crc", 1, slice(100, 112))
    frames = np.delete(frames, slice(500, 507))
    frames["dropped"][900:] = 4

    async def scenario(writer):
        writer.set_clock(Clock(0, time.monotonic_ns(), 2, 50 / 3, 1500.0))
        writer.set_stats(started_ns=1, connected=1, wire_version=1, serial=b"CB-0007", reconnects=3)
        async with looking_at(writer.name) as b:
            await b.until("document.querySelector('#tile-frames b').textContent === '1\u202f993'")
            assert [await number(b, tile) for tile in ("missing", "dropped", "bad", "overruns", "reconnects")] == [
                7,
                4,
                12,
                0,
                3,
            ]
            assert await b.eval("[...document.querySelectorAll('.tile[data-loss=yes]')].map((t) => t.id)") == [
                "tile-missing",
                "tile-dropped",
                "tile-bad",
            ]
            health = await b.text("#health")
            assert "CB-0007" in health and f"1 (bridge), {WIRE_VERSION} (host)" in health and "± 1.5 µs" in health
            await b.click("#rest")
            rows = await b.eval("[...document.querySelectorAll('#lanes tbody tr')].map((r) => r.innerText.trim())")
            assert len(rows) == 28 and rows[1].split()[:2] == ["1", "good"] and rows[1].endswith("12 !")
            assert rows[NODES].split() == [str(NODES), "absent"]
            kinds = await b.text("#kinds")
            assert "link crc" in kinds and "lane 1: 12" in kinds and "check the lane's cable" in kinds

    with ring_of(frames) as writer:
        asyncio.run(scenario(writer))


def test_a_peak_of_one_tick_is_drawn_and_moves_left():
    async def scenario(writer):
        async with looking_at(writer.name, "ticks=16&lanes=0&axes=alpha&range=180") as b:
            await b.until(f"{columns(60)}.some((c) => c.length)")
            frames = quiet(640, 320)  # 20 columns
            frames["lane"]["alpha"][5, 0] = 0xFFFF  # in the oldest of them
            writer.publish(frames)
            peaks = f"{columns(60)}.flatMap((c, k) => (c[1] - c[0] > 20 ? [k] : []))"
            assert 19 in await b.until(f"(() => {{ const p = {peaks}; return p.length ? p : null; }})()")
            writer.publish(quiet(960, 160))
            await b.until(f"{peaks}.includes(29)")
            drawn = await b.eval(columns(10))
            assert all(column and column[1] - column[0] < 3 for column in drawn), "a lane at rest is a thin line"

    with ring_of(quiet(0, 640)) as writer:
        asyncio.run(scenario(writer))


def test_pause_holds_the_picture_and_going_on_catches_up():
    async def scenario(writer):
        async with looking_at(writer.name, "ticks=1") as b:
            await b.until(f"{columns(60)}.every((c) => c.length)")
            await b.press(" ", "Space")
            assert await b.text("#pause") == "Paused: go on"
            await b.eval(DRAWN)
            held = await b.eval(columns(60))
            writer.publish(made_frames(640, 640))
            await b.until("document.querySelector('#tile-frames b').textContent === '1\u202f280'")
            await b.eval(DRAWN)
            assert await b.eval(columns(60)) == held
            await b.press(" ", "Space")
            await b.until(f"JSON.stringify({columns(60)}) !== {str(held).replace(' ', '')!r}")

    with ring_of(made_frames(0, 640)) as writer:
        asyncio.run(scenario(writer))


def test_lanes_scale_and_theme_are_chosen_by_mouse_and_keys_and_kept_in_the_address():
    async def scenario(writer):
        async with looking_at(writer.name) as b:
            await b.until("location.hash.includes('ring=') && document.getElementById('lane-0').checked")
            chosen = "[...document.querySelectorAll('#lanes input:checked')].map((box) => Number(box.id.slice(5)))"
            assert await b.eval(chosen) == list(range(NODES)), "at first, the lanes with a node"
            await b.click("#lane-1")
            assert "lanes=0%2C2" in await b.eval("location.hash")
            height = await b.eval("document.getElementById('plot').clientHeight")
            await b.press("a")
            assert await b.eval(chosen) == list(range(28))
            assert await b.eval("document.getElementById('plot').clientHeight") > height
            await b.press("n")
            assert await b.eval(chosen) == list(range(NODES))
            span = await b.text("#span")
            await b.press("-")
            assert float((await b.text("#span")).split()[0]) == pytest.approx(2 * float(span.split()[0]), rel=0.02)
            assert "ticks=32" in await b.eval("location.hash")
            await b.press("d")
            assert "theme=" in await b.eval("location.hash")
            await b.eval("location.reload()")
            await b.until("location.hash.includes('ticks=32') && document.querySelector('#lanes tbody tr') !== null")

    with ring_of(made_frames(0, 640)) as writer:
        asyncio.run(scenario(writer))


def test_everything_is_reached_by_keyboard_and_named():
    async def scenario(writer):
        async with looking_at(writer.name) as b:
            await b.until("document.querySelectorAll('#lanes input').length === 28")
            nameless = "[...document.querySelectorAll('button, select, input')].filter((e) => !(e.innerText || e.labels?.[0]?.innerText || '').trim())"
            assert await b.eval(f"{nameless}.length") == 0
            seen = set()
            for _ in range(60):
                await b.press("Tab")
                seen.add(await b.eval("document.activeElement.id"))
            wanted = set(
                await b.eval(
                    "[...document.querySelectorAll('button, select, input, #plot')].filter((e) => e.checkVisibility()).map((e) => e.id)"
                )
            )
            disabled = set(await b.eval("[...document.querySelectorAll(':disabled')].map((e) => e.id)"))
            assert wanted - disabled <= seen
            await b.until(f"{columns(60)}.some((c) => c.length)")  # until then there is nothing to read out
            await b.eval("document.getElementById('plot').focus()")
            await b.press("ArrowLeft")
            assert "0α" in await b.text("#readout")

    with ring_of(made_frames(0, 640)) as writer:
        asyncio.run(scenario(writer))


def test_without_a_ring_the_page_says_what_to_do_and_goes_on_by_itself():
    name = ring_name()

    async def scenario():
        async with looking_at(name) as b:
            said = await b.until(
                "!document.getElementById('banner').hidden && document.getElementById('banner').innerText"
            )
            assert f"There is no ring named “{name}” yet" in said and f"whiskerd --ring {name}" in said
            with ring_of(made_frames(0, 640), name) as writer:
                async with flowing(writer, 640):
                    await b.until(f"{STATE} === 'live' && document.getElementById('banner').hidden")
                    await b.until(f"{columns(20)}.every((c) => c.length)")
                said = await b.until(
                    "document.getElementById('state').dataset.state === 'stalled' && document.getElementById('banner').innerText"
                )
                assert "No frame for" in said and "whisker doctor" in said
            said = await b.until(
                "document.getElementById('state').dataset.state === 'ended' && document.getElementById('banner').innerText"
            )
            assert "The ring has ended" in said

    asyncio.run(scenario())


@asynccontextmanager
async def losing(writer):
    """While this lasts, the bridge drops as many frames as come."""

    async def drop_for_ever():
        for n in count(1):
            writer.set_stats(started_ns=1, connected=1, frames_missing=64 * n, frames_dropped=64 * n)
            await asyncio.sleep(0.032)

    task = asyncio.create_task(drop_for_ever())
    yield
    task.cancel()


@pytest.mark.parametrize("part", ["traces", "robot"])
def test_the_header_says_what_share_is_lost_and_what_helps(part):
    pill, note = ("state", "banner") if part == "traces" else ("robot-state", "robot-note")

    async def scenario(writer):
        post = Post()
        hub = Hub([writer.name], post.source, SCENE)
        hub.robot._clock = lambda: 0.0  # what it heard does not age
        post.play(MadeUpRun(), range(50), hub.robot)
        async with serving(hub, "127.0.0.1", 0, []) as port, chromium.browser() as b:
            async with flowing(writer, 640):
                await b.look(f"http://127.0.0.1:{port}/#part={part}")
                await b.until(f"$('{pill}').dataset.state === 'live'")
                async with losing(writer):
                    said = await b.until(f"$('{pill}').textContent.includes('lost') && $('{note}').innerText")
            assert "% of the samples lost" in said and "dropped them" in said and "--pace 0.3" in said

    with ring_of(made_frames(0, 640)) as writer:
        writer.set_stats(started_ns=1, connected=1)
        asyncio.run(scenario(writer))


def test_when_whisker_view_goes_the_page_says_so_and_finds_it_again():
    async def scenario(writer):
        async with chromium.browser() as b:
            async with view_of(writer.name) as port, flowing(writer, 640):
                await b.look(f"http://127.0.0.1:{port}/")
                await b.until(f"{STATE} === 'live'")
            said = await b.until(
                "document.getElementById('state').dataset.state === 'gone' && document.getElementById('banner').innerText"
            )
            assert "whisker-view does not answer" in said
            async with serving(Hub([writer.name]), "127.0.0.1", port, []), flowing(writer, 1 << 20):
                await b.until(
                    "document.getElementById('state').dataset.state === 'live' && document.getElementById('banner').hidden"
                )
                await b.until(f"{columns(20)}.every((c) => c.length)")

    with ring_of(made_frames(0, 640)) as writer:
        asyncio.run(scenario(writer))
