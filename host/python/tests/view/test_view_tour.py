"""`whisker try`: the bag that is shipped plays at once, and a tour shows six marks of the page."""

import asyncio
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import chromium
import pytest

from crunchbot.robot.bags.played import read_bag
from crunchbot.view.command import WANTED
from crunchbot.view.hub import Hub
from crunchbot.view.playback import Playback
from crunchbot.view.server import serving

BAG = Path(str(files("crunchbot") / "data/first_minute.mcap"))
SHIPPED_MOST = 1_000_000  # bytes
MARKS = 6
HAS_CHROMIUM = pytest.mark.skipif(chromium.PROGRAM is None, reason="chromium is not installed (apt install chromium)")


def shipped():
    return read_bag(BAG, [topic.removesuffix("/*") for topic in WANTED])


def test_the_shipped_bag_is_small_and_a_whole_minute_with_all_that_the_tour_names():
    played = shipped()
    assert BAG.stat().st_size <= SHIPPED_MOST
    assert played.scene is not None and played.damage == []
    assert played.said[-1].at_s == pytest.approx(60.0, abs=0.2)
    topics = {said.topic for said in played.said}
    assert {"localisation", "belief", "contact", "truth", "observation", "behaviour"} <= topics


def test_try_serves_it_on_a_port_that_is_free_and_ends_when_asked():
    words = [sys.executable, "-m", "crunchbot.cli", "try", "--no-open"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        address = process.stdout.readline().strip()
        process.terminate()
    assert address.startswith("http://127.0.0.1:") and address.endswith("/#tour")
    assert process.returncode == 0


@HAS_CHROMIUM
def test_the_tour_goes_from_mark_to_mark_there_and_back():
    async def walk():
        played = shipped()
        hub = Hub([], Playback(played), played.scene)
        async with serving(hub, "127.0.0.1", 0, []) as port, chromium.browser() as b:
            await b.look(f"http://127.0.0.1:{port}/#tour")
            titles, framed = [], []
            for number in range(MARKS):
                await b.until(
                    f"!$('tour').hidden && $('tour-title').textContent.startsWith('{number + 1} of {MARKS}: ')"
                )
                titles.append(await b.text("#tour-title"))
                framed.append(
                    await b.eval("[...document.querySelectorAll('.toured')].map((card) => card.id + card.ariaLabel)")
                )
                await b.click("#tour-next")
            assert len(set(titles)) == MARKS and all(len(cards) == 1 for cards in framed)
            assert len({cards[0] for cards in framed}) == MARKS - 1  # the plan has two
            assert await b.eval("$('tour').hidden && !document.querySelector('.toured')")
            await b.click("#tour-start")
            await b.click("#tour-next")
            await b.click("#tour-back")
            assert (await b.text("#tour-title")) == titles[0]
            assert b.troubles == []

    asyncio.run(walk())


def test_the_minute_plays_with_what_the_extra_view_installs():
    """The network, Pyro, scene folders and pandas are others' extras."""
    program = """
import sys
for name in ("zenoh", "Pyro5", "yaml", "PIL", "tomli_w", "tqdm", "pandas"):
    sys.modules[name] = None
import importlib
from importlib.resources import as_file, files
tried = importlib.import_module("crunchbot.commands.try")
from crunchbot.view.command import WANTED, read_bag
with as_file(files("crunchbot") / tried.BAG) as bag:
    print(len(read_bag(bag, [topic.removesuffix("/*") for topic in WANTED]).said) > 100)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "True\n", done.stderr
