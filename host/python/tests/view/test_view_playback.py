"""A robot's bag played in the page: at each moment the page knows what one that had listened until then would know."""

import asyncio
import json

import chromium
import pytest
from patience import PATIENCE_S
from viewkit import page
from viewpage import DRAWN
from viewrobot import SCENE, MadeUpRun

from crunchbot.errors import UserError
from crunchbot.recording.writing import TopicWriter
from crunchbot.robot.bags.played import RECORD, read_bag
from crunchbot.robot.bags.writing import Bag, metadata
from crunchbot.robot.network.inbox import Received
from crunchbot.robot.network.streams import Envelope
from crunchbot.scene import write
from crunchbot.view import command
from crunchbot.view.__main__ import main as whisker_view
from crunchbot.view.hub import Hub
from crunchbot.view.playback import Playback
from crunchbot.view.robot import RobotModel
from crunchbot.view.server import serving

ROWS = 255
TOPICS = [topic.removesuffix("/*") for topic in command.WANTED]
HAS_CHROMIUM = pytest.mark.skipif(chromium.PROGRAM is None, reason="chromium is not installed (apt install chromium)")


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    folder, run = tmp_path_factory.mktemp("bag"), MadeUpRun(skip={100, 101})
    write(folder / "scene", SCENE)
    with TopicWriter(folder / "run.mcap", RECORD, metadata("robot", folder / "scene"), False) as writer:
        taken = Bag(writer, "robot", SCENE)
        for row in range(ROWS):
            taken.take([Received(topic, message, Envelope(1, row, 0)) for topic, message in run.messages(row)])
        writer.finish({})
    return folder / "run.mcap"


class Stage:
    """A playback and what a hub knows of it, by a clock that is moved by hand."""

    def __init__(self, bag):
        played = read_bag(bag, TOPICS)
        self.now_s = 0.0
        self.source = Playback(played, lambda: self.now_s)
        self.hub = Hub([], self.source, played.scene)

    def pass_s(self, seconds: float = 0.0) -> None:
        """A round of the hub, so much later."""
        self.now_s += seconds
        if self.source.jumped():
            self.hub.robot.begin_anew()
        for topic, message in self.source.poll():
            self.hub.robot.take(topic, message)

    async def until_at(self, at_s: float) -> None:
        """Wait until a page's wish for this moment has come: the clock, moved earlier, would have been moved in vain."""
        async with asyncio.timeout(PATIENCE_S):
            while self.source.playback()["at_s"] != at_s:
                await asyncio.sleep(chromium.LOOK_S)

    def known(self) -> dict:
        model = self.hub.robot
        newest = {name: getattr(model, name) for name in ("now_s", "pose", "truth", "behaviour", "row", "contacts")}
        paths = {name: list(getattr(model, name).points) for name in ("path", "true_path")}
        processes = {name: (p.pid, p.state, p.counters) for name, p in model.processes.items()}
        return newest | paths | {"processes": processes, "belief": model.belief and model.belief.observation_seq}


def test_each_moment_is_as_it_was(bag):
    live, run = RobotModel(SCENE), MadeUpRun(skip={100, 101})
    stage = Stage(bag)
    stage.pass_s(5.0)
    assert len(stage.hub.robot.path.points) == 1, "nobody has looked yet"
    stage.source.look()
    for at_s in (3.05, 17.25):
        stage.pass_s(at_s - stage.source.playback()["at_s"])
    for row in range(173):
        for topic, message in run.messages(row):
            live.take(topic, message)
    other = Stage(bag)
    other.hub.robot = live
    assert stage.known() == other.known()
    there = stage.known()
    for at_s in (25.0, 2.0, 17.25):  # to and fro
        stage.source.play(at_s=at_s)
        stage.pass_s()
    assert stage.known() == there and stage.hub.robot.run == 3
    assert stage.hub.robot.age("localisation") == pytest.approx(0.05, abs=1e-6)


def test_speed_pause_and_the_end(bag):
    stage = Stage(bag)
    stage.source.look()
    stage.source.play(speed=4.0)
    stage.pass_s(2.0)
    assert stage.source.playback() == {"at_s": 8.0, "length_s": 25.4, "playing": True, "speed": 4.0}
    stage.source.play(playing=False)
    stage.pass_s(3.0)
    assert stage.source.playback()["at_s"] == 8.0 and stage.hub.robot.age("localisation") < 0.1
    stage.source.play(playing=True)
    stage.pass_s(10.0)
    assert stage.source.playback() == {"at_s": 25.4, "length_s": 25.4, "playing": False, "speed": 4.0}
    assert stage.hub.robot.row["seq"] == ROWS - 1
    stage.source.play(playing=True)
    stage.pass_s(0.11)
    assert stage.source.playback()["at_s"] == 0.4 and len(stage.hub.robot.path.points) == 5


def test_a_page_asks_and_is_refused_what_cannot_be(bag):
    async def scenario():
        stage = Stage(bag)
        async with serving(stage.hub, "127.0.0.1", 0, []) as port, page(port) as script:
            hello = await script.next("hello")
            assert hello["playback"] is True and hello["may_set_pose"] is False
            for wrong in ({"speed": 0}, {"speed": "2"}, {"at_s": -1}, {"at_s": 1e9}, {"playing": 1}):
                await script.ask(type="play", **wrong)
                assert (await script.next("error"))["text"].startswith("play: ")
            await script.ask(type="play", playing=False, speed=2, at_s=12.0)
            await script.ask(type="subscribe", topic="robot")
            while (message := await script.next("robot")).get("playback", {}).get("at_s") != 12.0:
                continue
            assert message["playback"]["speed"] == 2 and stage.hub.robot.row["seq"] == 120
        async with serving(Hub([]), "127.0.0.1", 0, []) as port, page(port) as script:
            await script.ask(type="play", playing=True)
            assert "start whisker-view with FILE.mcap" in (await script.next("error"))["text"]

    asyncio.run(scenario())


@HAS_CHROMIUM
@pytest.mark.parametrize(("theme", "size"), [("light", (1280, 900)), ("dark", (1280, 900)), ("light", (390, 844))])
def test_the_page_plays_pauses_and_goes_where_one_points(bag, theme, size):
    async def scenario():
        stage = Stage(bag)
        async with serving(stage.hub, "127.0.0.1", 0, []) as port, chromium.browser() as b:
            await b.look(f"http://127.0.0.1:{port}/#theme={theme}", *size)
            await b.until("robotPart.player.now?.playing && $('player').checkVisibility()")
            assert not await b.eval("$('parts').checkVisibility() || $('set-pose').checkVisibility()")
            set_time = "(() => { const s = $('seek'); s.value = 20; s.dispatchEvent(new Event('input')); s.dispatchEvent(new Event('change')); })()"
            await b.eval(set_time)
            await stage.until_at(20.0)
            stage.now_s += 0.25
            await b.until(f"{DRAWN} && robotPart.player.now.at_s > 20 && $('played').textContent.startsWith('0:20.2')")
            assert await b.eval("$('robot-note').hidden && $('robot-state').textContent") == "▶ recording"
            assert stage.hub.robot.row["seq"] == 202
            await b.press(" ")
            await b.until("$('play').textContent === 'Play' && $('robot-state').dataset.state === 'paused'")
            assert await b.eval("document.documentElement.scrollWidth") == size[0]
            await b.eval("$('speed').value = '8'; $('speed').dispatchEvent(new Event('change'))")
            await b.until("robotPart.player.now.speed === 8")
            assert b.troubles == []

    asyncio.run(scenario())


@pytest.mark.parametrize(
    ("words", "wanted"),
    [([], "rows (/NAME/observation) of no robot; give a bag of one"), (["--robot"], "played without --ring, --robot")],
)
def test_what_cannot_be_played_is_one_line(bag, tmp_path, capsys, words, wanted):
    with TopicWriter(tmp_path / "other.mcap", "whisker", {}, False) as writer:
        writer.finish({})
    assert whisker_view([str(tmp_path / "other.mcap"), *words]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and wanted in err


def test_a_bag_that_was_cut_off_is_played(bag, tmp_path):
    data = bag.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[:-100])
    played = read_bag(tmp_path / "cut.mcap", TOPICS)
    assert len(played.said) > 0 and played.damage
    assert json.dumps(Playback(played).refused())
    (tmp_path / "nothing.mcap").write_bytes(b"no")
    with pytest.raises(UserError, match="not an MCAP file"):
        read_bag(tmp_path / "nothing.mcap", TOPICS)
