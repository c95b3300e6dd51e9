"""Pictures of whisker-view: WHISKER_PICTURES=1 writes docs/pictures/robot*.png and view*.png."""

import asyncio
import os
import time
from pathlib import Path

import chromium
import pytest
from rings import ring_name
from viewkit import view_of
from viewpage import DRAWN, going_on, looking_at
from viewrobot import Post
from viewscene import ALIKE, SceneRun
from viewsignals import driven_frames, in_time

from crunchbot.bridge.ring import Clock, Writer
from whisker_protocol import WIRE_VERSION

pytestmark = pytest.mark.skipif(chromium.PROGRAM is None, reason="chromium is not installed (apt install chromium)")

PICTURES = Path(__file__).resolve().parents[4] / "docs/pictures"
SEED, ROWS = 5, 425
RING, SHOWN, DRIVEN = 32768, 20000, 80000  # frames: of the ring, there at the beginning, of the drive
DRIVE_SEED = 19  # of an arena where whiskers meet something on the way
PAINTED = "document.getElementById('curves').toDataURL().length"
PACE = "parseFloat(document.querySelector('#tile-frames').innerText.split(', ').at(-1))"  # over the last 2 s
TWO_DRAWINGS = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))"


def folder_for(name: str, drawn_always: str, tmp_path: Path) -> Path:
    """Where this picture goes: to the documentation if that was asked for, else it is only tried, the first one."""
    if os.environ.get("WHISKER_PICTURES"):
        return PICTURES
    if name != drawn_always:
        pytest.skip("WHISKER_PICTURES=1 draws this one too")
    return tmp_path


@pytest.mark.parametrize(
    "name, theme, size, grey",
    [
        ("robot", "light", (1280, 1380), False),
        ("robot_dark", "dark", (1280, 1380), False),
        ("robot_grey", "light", (1280, 1380), True),
        ("robot_phone", "light", (390, 844), False),
    ],
)
def test_pictures(name, theme, size, grey, tmp_path):
    """Of a drawn scene that a filter really localises in, and in which it cannot tell two places apart; see above."""
    folder = folder_for(name, "robot", tmp_path)

    async def scenario():
        post, run = Post(), SceneRun(ALIKE, SEED, ROWS + 600)
        shown = looking_at(post, theme, size, scene=run.scene, run=run, rows=ROWS)
        async with shown as (b, _), going_on(post, run, ROWS):
            if grey:
                await b.call("Emulation.setEmulatedVisionDeficiency", type="achromatopsia")
            await b.until(f"{DRAWN} && $('robot-note').hidden && $('robot-state').dataset.state === 'live'")
            await b.eval(TWO_DRAWINGS)
            await b.picture(folder / f"{name}.png")
            assert await b.eval("document.documentElement.scrollWidth") == size[0]
            assert await b.eval("document.documentElement.dataset.theme") == theme
            for place in ("#pose", "#behaviour", "#rows", "#processes", ".keys"):
                assert "not known" not in await b.text(place)
            assert await b.eval("robotPart.world.belief.modes.length") == 2, "half a turn changes nothing here"

    asyncio.run(scenario())
    assert (folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name, theme", [("view", "light"), ("view_dark", "dark")])
def test_pictures_of_traces(name, theme, tmp_path):
    """Of the demo's whiskers at signal level while the robot drives, turns and meets a wall."""
    folder = folder_for(name, "view", tmp_path)
    frames = driven_frames(DRIVE_SEED, DRIVEN)

    async def scenario(writer):
        shown = view_of(writer.name)
        async with shown as port, chromium.browser() as b, in_time(writer, frames[SHOWN:]):
            await b.look(f"http://127.0.0.1:{port}/#theme={theme}", 1280, 860)
            await b.until(f"$('state').dataset.state === 'live' && {PAINTED} > 10000 && {PACE} > 0.9 && {PACE} < 1.1")
            await b.eval(TWO_DRAWINGS)
            await b.picture(folder / f"{name}.png")
            assert await b.eval("document.documentElement.dataset.theme") == theme
            assert await b.eval("document.documentElement.scrollWidth") == 1280
            rows = await b.eval("[...document.querySelectorAll('#lanes tbody tr')].map((r) => r.innerText.trim())")
            assert ["good" in row for row in rows[:7]] == [True] * 6 + [False]
            assert b.troubles == []

    with Writer("whisker" if folder == PICTURES else ring_name(), RING) as writer:
        writer.set_clock(Clock(0, time.monotonic_ns(), 2, 50 / 3, 1500.0))
        writer.set_stats(started_ns=time.time_ns(), connected=1, wire_version=WIRE_VERSION, serial=b"0001")
        writer.publish(frames[:SHOWN])
        asyncio.run(scenario(writer))
    assert (folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")
