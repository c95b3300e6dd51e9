"""What a person orders from the page: to record, and that the robot stands; where it may, and what the page then shows."""

import asyncio
from pathlib import Path

import pytest
from patience import PATIENCE_S
from rings import ring_name
from viewkit import flowing, made_frames, page
from viewrobot import SCENE, Post

from crunchbot.bridge.ring import Writer
from crunchbot.cli import parser_of
from crunchbot.recording.reading import read
from crunchbot.robot.network import order
from crunchbot.robot.network.link import ROBOT, Link
from crunchbot.view import hub as hub_module
from crunchbot.view.command import _recording
from crunchbot.view.hub import Hub
from crunchbot.view.recorder import Recorder
from crunchbot.view.robot_source import join
from crunchbot.view.server import serving


def recorder_of(folder: Path, *words: str) -> Recorder:
    """As `whisker view` with these words makes it."""
    arguments = parser_of("view").parse_args(["view", *words])
    return Recorder(folder, lambda ring, file: _recording(arguments, ring, file))


async def controls_where(script, condition) -> dict:
    async with asyncio.timeout(PATIENCE_S):
        while not condition(message := await script.next("controls")):
            pass
    return message


def test_a_page_records_a_ring_into_a_new_file_that_is_whole(tmp_path):
    async def scenario(writer):
        recorder = recorder_of(tmp_path)
        hub = Hub([writer.name], recorder=recorder)
        async with serving(hub, "127.0.0.1", 0, []) as port, page(port) as script, flowing(writer, 0):
            assert (await script.next("hello"))["may_record"]
            await script.ask(type="subscribe", topic="controls")
            await script.ask(type="record", on=True, ring=writer.name)
            said = await controls_where(script, lambda message: message["recording"])
            file = Path(said["recording"]["file"])
            assert file.parent == tmp_path and file.name.startswith(writer.name)
            async with asyncio.timeout(PATIENCE_S):
                while not any(tmp_path.glob("*.mcap*")):
                    await asyncio.sleep(0.05)
            await script.ask(type="record", on=True, ring=writer.name)
            assert "is being recorded; stop that first" in (await script.next("error"))["text"]
            await script.ask(type="record", on=False)
            said = await controls_where(script, lambda message: not message["recording"])
            assert said["said"].startswith(f"{file}: ") and "frames" in said["said"]
        with read(file) as recording:
            assert recording.complete and sum(map(len, recording.blocks())) > 0

    with Writer(ring_name()) as writer:
        asyncio.run(scenario(writer))


def test_the_end_of_the_view_is_the_end_of_its_recording(tmp_path):
    with Writer(ring_name()) as writer:
        writer.publish(made_frames(0, 100))
        recorder = recorder_of(tmp_path)
        recorder.start(writer.name)
        recorder.close()
    assert recorder.state() is None and "started as process" in next(tmp_path.glob("*.log")).read_text()


@pytest.mark.parametrize(
    "may, request_, said",
    [
        (False, {"type": "record", "on": True}, "record: not allowed here; start whisker-view with --allow-pose"),
        (False, {"type": "hold", "on": True}, "hold: not allowed here"),
        (True, {"type": "record", "on": True}, "record: no robot is looked at; look at its whiskers, or start"),
        (True, {"type": "record", "on": 1}, "record: field 'on' must be"),
        (True, {"type": "record", "on": True, "ring": "../../x"}, "record: ring: not one of this machine"),
        (True, {"type": "record", "on": True, "ring": 7}, "record: ring: not one of this machine"),
        (True, {"type": "hold"}, "hold: field 'on' is missing"),
    ],
)
def test_what_may_not_be_is_refused_in_one_line(tmp_path, may, request_, said):
    async def scenario():
        post = Post()
        post.source.hold = lambda on: pytest.fail("it was ordered")
        hub = Hub([], post.source, SCENE, may_set_pose=may, recorder=recorder_of(tmp_path) if may else None)
        async with serving(hub, "127.0.0.1", 0, []) as port, page(port) as script:
            await script.ask(**request_)
            assert (await script.next("error"))["text"].startswith(said)
        assert list(tmp_path.iterdir()) == []

    asyncio.run(scenario())


def test_a_stop_is_repeated_until_the_robot_may_go_on(monkeypatch):
    monkeypatch.setattr(hub_module, "HOLD_S", 0.05)
    ordered = []

    async def scenario():
        post = Post()
        post.source.hold = ordered.append
        hub = Hub([], post.source, SCENE, may_set_pose=True)
        async with serving(hub, "127.0.0.1", 0, []) as port, page(port) as script:
            await script.ask(type="subscribe", topic="controls")
            await script.ask(type="hold", on=True)
            await controls_where(script, lambda message: message["held"])
            async with asyncio.timeout(PATIENCE_S):
                while len(ordered) < 3:
                    await asyncio.sleep(0.01)
            await script.ask(type="hold", on=False)
            await controls_where(script, lambda message: not message["held"])
            many = len(ordered)
            await asyncio.sleep(0.2)
            assert ordered == [True] * (many - 1) + [False]

    asyncio.run(scenario())


def test_an_order_reaches_a_pilot_over_a_network():
    pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed (make setup)")
    from linkkit import free_endpoint

    endpoint = free_endpoint()
    with Link("pilot", ROBOT, listen=[endpoint]) as pilot:
        inbox = pilot.subscribe(order.TOPIC)
        source = join(ROBOT, [endpoint])
        try:
            pilot.wait_for([], 0.0)
            for on in (True, False, True):
                source.hold(on)
            come = []
            while len(come) < 6:  # each with its end
                come += (more := inbox.take(PATIENCE_S))
                assert more
        finally:
            source.close()
    assert order.is_hold(come, False) and not order.is_hold(come[:4], False)
    assert order.is_hold([], True) and not order.is_hold([], False)
