"""The robot's part of whisker-view in headless Chromium: what a person sees is what the messages reported, and no more."""

import asyncio
from dataclasses import replace

import chromium
import numpy as np
import pytest
from patience import PATIENCE_S
from viewkit import made_frames, ring_of
from viewpage import DRAWN, looking_at
from viewrobot import ARENA, SCENE, Clock, MadeUpRun, Post, belief_message, estimate, robot_view, route, touch_map

from crunchbot.occupancy import to_map
from crunchbot.robot.network.messages import (
    Behaviour,
    Header,
    KeyValue,
    MapMetaData,
    OccupancyGrid,
    Pose,
    ProcessHealth,
    Time,
)
from crunchbot.view.hub import Hub
from crunchbot.view.robot import SILENT_S
from crunchbot.view.server import serving

pytestmark = pytest.mark.skipif(chromium.PROGRAM is None, reason="chromium is not installed (apt install chromium)")

ROWS = 255  # of a run that has two contacts and a belief of two places
# Whether a line of this colour (#rrggbb) runs within 4 px of a place (m) of the plan.
SEEN = """(() => {
  const plan = robotPart.plan, n = 4, wanted = pixelOf('COLOUR') & 0xffffff;
  const pen = plan.live.getContext('2d');
  const px = new Uint32Array(pen.getImageData(Math.round(plan.x({X})) - n, Math.round(plan.y({Y})) - n, 2 * n + 1, 2 * n + 1).data.buffer);
  return px.some((p) => (p & 0xffffff) === wanted && p >>> 24 > 200);
})()"""
# How strong the belief's image is at a place, 0 to 255.
DENSITY = """(() => {
  const { image } = robotPart.world.belief, [x0, y0, x1, y1] = robotPart.plan.bounds;
  const at = [Math.floor(({X} - x0) / (x1 - x0) * image.width), Math.floor((y1 - {Y}) / (y1 - y0) * image.height)];
  return image.getContext('2d').getImageData(...at, 1, 1).data[3];
})()"""
# Mean and spread of the brightness of a tile's middle, as grey.
GREY = """(() => {
  const plan = robotPart.plan, n = 36;
  const d = plan.floor.getContext('2d').getImageData(Math.round(plan.x({X})), Math.round(plan.y({Y})), n, n).data;
  const rows = Array.from({ length: n }, (_, y) => Array.from({ length: n }, (_, x) => d[4 * (y * n + x) + 3] / 255));
  const sum = (list) => list.reduce((a, b) => a + b, 0);
  return [sum(rows.map(sum)) / n / n, Math.max(...rows.map(sum)) / n];
})()"""


# Whether a line of this colour runs within 4 px of a place of the floor, beneath all that moves.
FLOOR_SEEN = SEEN.replace("plan.live", "plan.floor")


def place(script: str, x: float, y: float, colour: str = "") -> str:
    """A script about a place."""
    return script.replace("{X}", str(x)).replace("{Y}", str(y)).replace("COLOUR", colour)


async def colour(b, name: str) -> str:
    return await b.eval(f"robotPart.plan.css('{name}')")


def test_what_is_not_known_is_said_to_be_not_known():
    async def scenario():
        async with looking_at(Post(), scene=None) as (b, _):
            said = await b.until("!$('robot-note').hidden && robotPart.world.word && $('robot-note').innerText")
            assert "Nothing has been heard of the robot “robot” yet" in said
            pose = await b.text("#pose")
            assert pose.count("not known") == 7 and "never" in pose and not any(c.isdigit() for c in pose.split("σ")[1])
            assert "arena not known" in await b.text("#scene")
            assert "not known: no word has come" in await b.text("#behaviour")
            rows = await b.text("#rows")
            assert "not known: no row has come" in rows and "not known" in rows.split("navigator")[1]
            assert "none has come" in await b.text("#contacts")
            assert (await b.text("#processes")).count("never heard") == 2
            assert (
                await b.eval(
                    "[...document.querySelectorAll('.keys label')].filter((l) => l.innerText.includes('not known')).length"
                )
                == 4
            )
            await b.until("robotPart.drawn")
            empty = "!new Uint32Array(robotPart.plan.live.getContext('2d').getImageData(0, 0, robotPart.plan.live.width, robotPart.plan.live.height).data.buffer).some((p) => p)"
            assert await b.eval(empty), "something is drawn that nobody reported"

    asyncio.run(scenario())


def test_without_a_robot_the_page_is_that_of_the_rings_and_says_how_to_get_one():
    async def scenario():
        async with serving(Hub(["whisker-test-none"]), "127.0.0.1", 0, []) as port, chromium.browser() as b:
            await b.look(f"http://127.0.0.1:{port}/")
            await b.until("linked")
            assert await b.eval("document.body.dataset.part") == "traces"
            await b.press("r")
            assert "whisker-view --robot NAME --scene SCENE" in await b.until(
                "robotPart.world.word && $('robot-note').innerText"
            )
            await b.press("w")
            assert await b.eval("!$('robot-part').checkVisibility() && $('plot').checkVisibility()")
            assert b.troubles == []

    asyncio.run(scenario())


def test_the_plan_shows_estimate_truth_and_belief_where_they_were_reported_to_be():
    run = MadeUpRun(skip={100, 101})

    async def scenario():
        async with looking_at(Post(), run=run, rows=ROWS) as (b, _):
            await b.until(DRAWN)
            blue, orange = await colour(b, "--alpha"), await colour(b, "--beta")
            for t_s in (5.0, 8.0, 16.0):
                assert await b.eval(place(SEEN, *estimate(t_s)[:2], blue)), f"no estimated path at {t_s} s"
            dashes = [await b.eval(place(SEEN, *route(t_s)[:2], orange)) for t_s in (2.0, 2.3, 2.6, 2.9, 3.2, 3.5)]
            assert any(dashes), "no true path"
            x, y, _ = estimate((ROWS - 1) / 10)
            assert await b.eval(place(SEEN, x, y - SCENE.robot.body_radius_m, blue)), "no outline of the robot"
            here, there = run.belief(ROWS - 5), (0.28 + 0.2 * y, 0.9 + 0.1 * x)
            assert here.weight.sum() == pytest.approx(1.0)
            strong, faint = await b.eval(place(DENSITY, x, y)), await b.eval(place(DENSITY, *there))
            assert strong > faint > 20, "both places must be seen"
            assert await b.eval(place(DENSITY, 2.3, 0.3)) == 0
            shares = await b.eval("robotPart.world.belief.modes.map((m) => m.share)")
            assert len(shares) == 2 and shares[0] > 0.65 and shares[1] > 0.1
            assert "in 2 places" in await b.text("#pose")
            await b.click("#layer-estimate")
            await b.until(f"!{place(SEEN, *estimate(5.0)[:2], blue)}")

    asyncio.run(scenario())


def test_textures_are_reported_apart_in_grey():
    async def scenario():
        async with looking_at(Post()) as (b, _):
            await b.until("robotPart.scene?.arena && robotPart.plan.scale")
            found = {}
            for name in ARENA.textures:
                row = next(n for n, letters in enumerate(ARENA.floor) if name[0] in letters)
                x, y = ARENA.floor[row].index(name[0]) * 0.5 + 0.15, 2.5 - row * 0.5 - 0.15
                found[name] = await b.eval(place(GREY, x, y))
            assert found["VINYL"][0] < 0.02 < found["SMOOTH"][0] < found["ROUGH"][0]
            assert found["SMOOTH"][1] > 1.5 * found["SMOOTH"][0], "dots stand in rows, lines do not"
            assert await b.text("#textures") == "V VINYL\nS SMOOTH\nR ROUGH"

    asyncio.run(scenario())


def test_words_are_those_of_the_messages():
    async def scenario():
        post = Post()
        async with looking_at(post, run=MadeUpRun(skip={100, 101}), rows=ROWS) as (b, hub):
            hub.robot.take("behaviour", Behaviour(Header.at(0), "WHISK_IN", Time.of(20 * 10**9), "contact at <b>2</b>"))
            fault = ProcessHealth(Header.at(0), "bag", 99, "waiting", [KeyValue("bytes_written", "12")], "disk full")
            hub.robot.take("health/bag", fault)
            expects = KeyValue("expects", "0.12 m2 of floor in 2.7 s")
            hub.robot.take("health/pilot", ProcessHealth(Header.at(0), "pilot", 98, "running", [expects]))
            await b.until(DRAWN)
            await b.until("$('processes').innerText.includes('bag')")
            doing = await b.text("#behaviour")
            assert "Expects" in doing and "0.12 m2 of floor in 2.7 s" in doing
            assert "whisk in" in doing and "contact at <b>2</b>" in doing and "5.4 s" in doing
            assert "last error: disk full" in await b.text("#processes")
            await b.eval("document.querySelector('#processes details').open = true")
            processes = await b.text("#processes")
            assert "bytes written\n12" in processes and "process 99" in processes
            rows = await b.text("#rows")
            assert "254, exploring" in rows and [line for line in rows.splitlines() if line == "2"] == ["2", "2"]
            pose = await b.text("#pose")
            x, y, _ = estimate((ROWS - 1) / 10)
            assert f"x {x:.2f} m, y {y:.2f} m" in pose and "adaptive, from row 0, prior scene" in pose
            bars = await b.eval(
                "[...document.querySelectorAll('#cells .best')].map((e) => e.closest('li').querySelector('.what').innerText)"
            )
            tips = {tip["name"]: max(tip["loglik"], key=lambda pair: pair[1])[0] for tip in hub.robot.row["tips"]}
            assert bars == list(tips.values())
            contacts = (await b.text("#contacts")).splitlines()
            assert len(contacts) == len(hub.robot.contacts) and "face" in contacts[0] and "±" in contacts[0]

    asyncio.run(scenario())


def test_a_process_that_fell_silent_and_a_robot_that_is_gone_are_shown_as_such():
    async def scenario():
        post, clock = Post(), Clock()
        async with looking_at(post, rows=50, clock=clock) as (b, _):
            await b.until(DRAWN)
            assert await b.eval("$('robot-state').dataset.state") == "live"
            clock.now += SILENT_S + 2
            said = await b.until("!$('robot-note').hidden && $('robot-note').innerText")
            assert "Nothing heard of the robot" in said and "how it last was" in said
            assert (await b.text("#processes")).count("▲ silent for") == 2
            assert await b.eval("$('robot-state').dataset.state") == "stalled" and await b.eval("robotPart.world.stale")
            for topic, message in MadeUpRun().messages(50):
                post.put(topic, message)
            await b.until("$('robot-note').hidden && $('robot-state').dataset.state === 'live'")
            assert "▲" not in await b.text("#processes")

    asyncio.run(scenario())


def test_a_new_run_begins_with_a_clean_plan_and_whisker_view_may_go_and_come():
    async def scenario():
        post = Post()
        async with chromium.browser() as b:
            async with robot_view(post, rows=80) as (port, hub):
                await b.look(f"http://127.0.0.1:{port}/")
                await b.until("robotPart.world.path.length === 80")
                post.play(MadeUpRun(), range(3), hub.robot)
                await b.until("robotPart.world.path.length === 3 && robotPart.world.truth.length === 3")
            await b.until("$('robot-state').dataset.state === 'gone' && !$('banner').hidden")
            async with serving(hub, "127.0.0.1", port, []):
                await b.until("$('robot-state').dataset.state !== 'gone' && robotPart.world.path.length === 3")

    asyncio.run(scenario())


def test_a_belief_that_knows_nothing_is_one_wide_place():
    async def scenario():
        async with looking_at(Post()) as (b, hub):
            everywhere = [(1 / 25, 0.25 + 0.5 * (n % 5), 0.25 + 0.5 * (n // 5), n, 0.15) for n in range(25)]
            hub.robot.take("belief", belief_message(0, everywhere, number=2000, mass=0.9))
            await b.until("robotPart.world.belief.poses")
            said = await b.eval("robotPart.world.belief.said()")
            assert said.startswith("2\u202f000 poses in") and "10 % too light to be sent" in said
            widest = await b.eval("Math.max(...robotPart.world.belief.modes.map((m) => m.spread), 0)")
            scattered = 1 - await b.eval("robotPart.world.belief.modes.reduce((a, m) => a + m.share, 0)")
            assert widest > 0.4 or scattered > 0.5, "must not look like a robot that knows where it is"

    asyncio.run(scenario())


def test_two_places_stay_two_in_a_haze():
    async def scenario():
        async with looking_at(Post()) as (b, hub):
            haze = [(0.04, 0.5 + 0.05 * n, 1.25, 0.0, 0.05) for n in range(5)]
            haze += [(0.005, 0.6 + 0.16 * n, 1.25, 0.0, 0.03) for n in range(9)]
            places = [(0.4, 0.4, 1.25, 0.0, 0.01), (0.35, 2.1, 1.25, 0.0, 0.01), *haze]
            hub.robot.take("belief", belief_message(0, places, number=2000))
            await b.until("robotPart.world.belief.poses")
            assert await b.eval("robotPart.world.belief.modes.filter((m) => m.share > 0.3).length") == 2

    asyncio.run(scenario())


def test_the_part_is_used_by_keyboard_and_fits_a_phone():
    async def scenario():
        async with looking_at(Post(), size=(390, 844), rows=60) as (b, _):
            await b.until(DRAWN)
            assert await b.eval("document.documentElement.scrollWidth") == 390
            wanted = set(
                await b.eval(
                    "[...document.querySelectorAll('button, select, input')].filter((e) => e.checkVisibility() && !e.disabled).map((e) => e.id)"
                )
            )
            seen = set()
            for _ in range(2 * len(wanted)):
                await b.press("Tab")
                seen.add(await b.eval("document.activeElement.id"))
            assert {"part-robot", "part-traces", "layer-belief"} <= wanted <= seen
            await b.press("w")
            assert "part=traces" in await b.eval("location.hash")

    asyncio.run(scenario())


def test_the_daemon_of_a_ring_on_this_machine_is_among_the_processes():
    async def scenario(writer):
        hub = Hub([writer.name], Post().source)
        async with serving(hub, "127.0.0.1", 0, []) as port, chromium.browser() as b:
            await b.look(f"http://127.0.0.1:{port}/")
            said = await b.until("$('processes').innerText.includes('ring ') && $('processes').innerText")
            assert f"ring {writer.name}" in said and "640" not in said, "one line a process"
            await b.eval("[...document.querySelectorAll('#processes details')].at(-1).open = true")
            said = (await b.text("#processes")).split()
            assert said[said.index("frames") + 1] == "640" and said[said.index("missing") + 1] == "0"
            await b.until("$('processes').innerText.includes('last word')")
            assert await b.eval("[...document.querySelectorAll('#processes details')].at(-1).open"), "it stays open"

    with ring_of(made_frames(0, 640)) as writer:
        asyncio.run(scenario(writer))


def test_a_pose_is_reported_by_a_drag_on_the_plan_or_by_numbers():
    async def scenario():
        post = Post()
        async with looking_at(post, rows=5) as (b, _):
            await b.until(DRAWN)
            await b.press("p")
            assert await b.eval("$('pose-tool').checkVisibility()")
            x, y, scale = await b.eval(
                "(() => { const p = robotPart.plan, box = p.live.getBoundingClientRect(); p.live.scrollIntoView();"
                " return [p.live.getBoundingClientRect().left + p.x(0.5) / p.ratio,"
                " p.live.getBoundingClientRect().top + p.y(1.0) / p.ratio, p.scale / p.ratio]; })()"
            )
            for kind, up in (("mousePressed", 0.0), ("mouseMoved", 0.4), ("mouseReleased", 0.4)):
                where = {"x": x, "y": y - up * scale, "button": "left", "clickCount": 1}
                await b.call("Input.dispatchMouseEvent", type=kind, **where)
            await b.until("$('pose-said').textContent")
            async with asyncio.timeout(PATIENCE_S):
                while not post.poses:
                    await asyncio.sleep(0.01)
            assert post.poses[0] == pytest.approx((0.5, 1.0, 1.571), abs=0.02)
            await b.eval(
                "[['x', 1.25], ['y', 0.75], ['heading', -90]].forEach(([n, v]) => { $(`pose-${n}`).value = v; })"
            )
            await b.click("#pose-send")
            await b.eval("$('pose-x').value = 99")
            await b.click("#pose-send")
            assert "outside the arena" in await b.until(
                "!$('pose-said').textContent.startsWith('Reported') && $('pose-said').textContent"
            )
            assert post.poses[1:] == [pytest.approx((1.25, 0.75, -1.5708), abs=1e-3)]
            await b.press("Escape")
            assert not await b.eval("$('pose-tool').checkVisibility()")
        async with looking_at(Post(), may_set_pose=False) as (b, _):
            await b.until("linked")
            assert not await b.eval("$('set-pose').checkVisibility()")

    asyncio.run(scenario())


def test_a_map_takes_the_arenas_place_with_what_was_felt():
    post = Post()
    cells = np.full((40, 60), -1, "i1")
    cells[10:30, 10:50] = 0
    info = MapMetaData(resolution=0.05, width=60, height=40, origin=Pose.planar(-1.0, -1.0, 0.0))
    face = (0.25, -0.5, 0.25, 0.75, np.pi, 0.01, 0.01)

    async def scenario():
        async with looking_at(post) as (b, _):
            await b.until("robotPart.drawn && robotPart.scene")
            assert await b.eval("$('map-card').hidden") and await b.text("#plan-title") == "Arena from above"
            post.put("map", OccupancyGrid(Header.at(0), info, cells.ravel()))
            post.put("touch_map", touch_map(tiles=[(0, 0, 1, 0.95), (1, 0, 0, 0.5)], faces=[face]))
            said = await b.until("!$('map-card').hidden && $('map').innerText")
            assert "1 stretches of faces" in said and "2 felt, 1 sure" in said and "2.0 m² free" in said
            assert "the first" in said
            assert await b.text("#plan-title") == "Map from above" and await b.eval("$('obstacle-legend').hidden")
            assert await b.eval("robotPart.plan.bounds") == [-1.0, -1.0, 2.0, 1.0]
            good = await colour(b, "--good")
            assert await b.eval(place(FLOOR_SEEN, 0.25, 0.0, good)) and not await b.eval(
                place(FLOOR_SEEN, 0.6, 0.0, good)
            )

    asyncio.run(scenario())


def test_an_arena_is_drawn_where_it_is_on_the_map():
    scene = replace(SCENE, origin=(-10.0, -3.0, 1.0))
    corners = to_map(np.array([(x, y, 0.0) for x in (0.0, 2.5) for y in (0.0, 2.5)]), scene.origin)[:, :2]
    x0, y0, x1, y1 = ARENA.obstacles[0]
    middles = np.array([((x0 + x1) / 2, (y0 + y1) / 2, 0.0), (0.25, 0.25, 0.0)])
    (block, free), reported = to_map(middles, scene.origin)[:, :2].tolist(), to_map(middles[1:], scene.origin)[0]

    async def scenario():
        post = Post()
        async with looking_at(post, scene=scene) as (b, _):
            await b.until("robotPart.scene?.arena && robotPart.plan.scale")
            bounds = [*corners.min(axis=0), *corners.max(axis=0)]
            assert await b.eval("robotPart.plan.bounds") == pytest.approx(bounds)
            fill = await colour(b, "--block")
            assert await b.eval(place(FLOOR_SEEN, *block, fill)) and not await b.eval(place(FLOOR_SEEN, *free, fill))
            await b.press("p")
            values = "[['x', {}], ['y', {}], ['heading', 0]].forEach(([n, v]) => {{ $(`pose-${{n}}`).value = v; }})"
            await b.eval(values.format(*reported[:2]))
            await b.click("#pose-send")
            async with asyncio.timeout(PATIENCE_S):
                while not post.poses:
                    await asyncio.sleep(0.01)
            assert post.poses == [pytest.approx((*reported[:2], 0.0))]

    asyncio.run(scenario())
