"""Pictures of the robot's part of whisker-view: WHISKER_PICTURES=1 writes docs/pictures/robot*.png."""

import asyncio
import os
from pathlib import Path

import chromium
import pytest
from viewpage import DRAWN, going_on, looking_at
from viewrobot import Post
from viewscene import ALIKE, SceneRun

pytestmark = pytest.mark.skipif(chromium.PROGRAM is None, reason="chromium is not installed (apt install chromium)")

PICTURES = Path(__file__).resolve().parents[3] / "docs/pictures"
SEED, ROWS = 5, 425


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
    asked = os.environ.get("WHISKER_PICTURES")
    if not asked and name != "robot":
        pytest.skip("WHISKER_PICTURES=1 draws this one too")
    folder = PICTURES if asked else tmp_path

    async def scenario():
        post, run = Post(), SceneRun(ALIKE, SEED, ROWS + 600)
        shown = looking_at(post, theme, size, scene=run.scene, run=run, rows=ROWS)
        async with shown as (b, _), going_on(post, run, ROWS):
            if grey:
                await b.call("Emulation.setEmulatedVisionDeficiency", type="achromatopsia")
            await b.until(f"{DRAWN} && $('robot-note').hidden && $('robot-state').dataset.state === 'live'")
            await b.eval("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")
            await b.picture(folder / f"{name}.png")
            assert await b.eval("document.documentElement.scrollWidth") == size[0]
            assert await b.eval("document.documentElement.dataset.theme") == theme
            for place in ("#pose", "#behaviour", "#rows", "#processes", ".keys"):
                assert "not known" not in await b.text(place)
            assert await b.eval("robotPart.world.belief.modes.length") == 2, "half a turn changes nothing here"

    asyncio.run(scenario())
    assert (folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")
