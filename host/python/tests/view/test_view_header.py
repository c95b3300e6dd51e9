"""What the page says of the robot at a glance, in headless Chromium: how sure it is and why, its filters beside each other, its
whiskers by name, the plan from nearer, and the buttons in its header."""

import asyncio
from contextlib import asynccontextmanager
from dataclasses import replace

import chromium
import numpy as np
import pytest
from viewkit import made_frames, ring_of
from viewpage import DRAWN, looking_at
from viewrobot import SCENE, Clock, MadeUpRun, Post, estimate

from crunchbot import observation as o
from crunchbot.robot.network.messages import PoseWithCovariance
from crunchbot.view.hub import Hub
from crunchbot.view.recorder import Recorder
from crunchbot.view.server import serving

pytestmark = pytest.mark.skipif(chromium.PROGRAM is None, reason="chromium is not installed (apt install chromium)")

SURE = "!$('sure').hidden && [$('sure').dataset.state, $('sure').textContent]"


class ToldRun(MadeUpRun):
    """Confidence as `shares` has it, row by row, and from row `blind` on nothing is read; in one place."""

    def __init__(self, shares, blind=10**9):
        super().__init__()
        self.shares, self.blind = shares, blind

    def localisation(self, row):
        return replace(super().localisation(row), confidence=self.shares[min(row, len(self.shares) - 1)])

    def observation(self, row):
        reported = super().observation(row)
        cells = reported.cells if row < self.blind else np.full(len(reported.cells), o.NOT_READ, np.uint8)
        return replace(reported, cells=cells)


@pytest.mark.parametrize(
    "shares, blind, rows, state, said",
    [
        ([0.95], 10**9, 20, "sure", "● sure: ±"),
        ([0.3], 10**9, 20, "searching", "○ not found yet: "),
        ([0.95, 0.7], 10**9, 20, "losing", "▲ losing it: "),
        ([0.95, 0.3], 10**9, 20, "lost", "■ lost: "),
        ([0.95], 20, 101, "losing", "▲ losing it: nothing read for 8.0 s"),
        ([0.95, 0.3], 20, 101, "lost", "■ lost: nothing read for 8.0 s, "),
    ],
)
def test_the_header_says_how_sure_the_robot_is_and_why(shares, blind, rows, state, said):
    async def scenario():
        async with looking_at(Post(), run=ToldRun(shares, blind), rows=rows, clock=Clock()) as (b, _):
            await b.until(DRAWN)
            reported = await b.until(SURE)
            assert reported[0] == state and reported[1].startswith(said)
            assert await b.eval("$('sure').checkVisibility()")
            await b.press("w")
            assert not await b.eval("$('sure').checkVisibility()")

    asyncio.run(scenario())


def test_lost_samples_are_a_reason_and_a_robot_that_says_nothing_has_no_word():
    async def scenario():
        async with looking_at(Post(), run=ToldRun([0.95]), rows=20, clock=Clock()) as (b, _):
            await b.until(DRAWN)
            lost = "{ ring: 'x', state: 'live', loss: [0.77, 'too busy', 'slower'], frames: 1, age_s: 0 }"
            # In one step of the page, before what it hears of the ring comes again.
            assert (await b.eval(f"robotPart.takeRing({lost}), {SURE}"))[1] == "▲ losing it: 77 % of samples dropped"
        async with looking_at(Post()) as (b, _):
            await b.until("robotPart.world.word")
            assert await b.eval("$('sure').hidden")

    asyncio.run(scenario())


class ManyFilters(MadeUpRun):
    """Two filters beside the robot's."""

    def messages(self, row):
        x, y, theta = estimate(row / 10)
        first = self.localisation(row)
        others = [("grid", 0.25, 0.8), ("particle", -0.25, 0.4)]
        more = [
            replace(
                first,
                filter=name,
                confidence=share,
                pose=PoseWithCovariance.planar((x + off, y, theta), 0.01 * np.eye(3)),
            )
            for name, off, share in others
        ]
        return super().messages(row) + [("localisation", reported) for reported in more]


def test_filters_are_beside_each_other_in_words_and_on_the_plan():
    async def scenario():
        async with looking_at(Post(), run=ManyFilters(), rows=ROWS) as (b, _):
            await b.until(f"{DRAWN} && robotPart.world.word.filters.length === 3")
            lines = await b.eval("[...$('filters').rows].map((row) => [...row.cells].map((cell) => cell.textContent))")
            assert [line[0] for line in lines] == ["adaptive, the robot’s", "grid", "particle"]
            assert [line[1] for line in lines[1:]] == ["0.80", "0.40"] and lines[1][2] == "0.14"
            x, y, _ = estimate((ROWS - 1) / 10)
            errors = [float(line[3]) for line in lines]
            assert errors[0] < 0.1 < errors[1] < 0.35 and errors[2] > 0.15
            marks = await b.eval(
                "(() => { const at = []; robotPart.actors.other = (one) => at.push([one.name, one.x]); robotPart.actors.draw(robotPart.world, robotPart.layers); return at; })()"
            )
            assert marks == [
                ["grid", pytest.approx(x + 0.25, abs=2e-3)],
                ["particle", pytest.approx(x - 0.25, abs=2e-3)],
            ]
        async with looking_at(Post(), rows=20) as (b, _):
            await b.until(DRAWN)
            assert await b.eval("$('filters-card').hidden && $('others-legend').hidden")

    asyncio.run(scenario())


ROWS = 120


def test_the_plan_is_looked_at_from_nearer_and_the_robot_stays_in_it():
    async def scenario():
        async with looking_at(Post(), rows=ROWS) as (b, _):
            await b.until(DRAWN)
            bounds, scale = await b.eval("[robotPart.plan.bounds, robotPart.plan.scale]")
            for _ in range(3):
                await b.press("+")
            near = await b.eval("robotPart.plan.bounds")
            x, y, _ = estimate((ROWS - 1) / 10)
            assert near[0] <= x <= near[2] and near[1] <= y <= near[3]
            assert await b.eval("robotPart.plan.scale") == pytest.approx(scale * 1.5**3)
            assert near[2] - near[0] == pytest.approx((bounds[2] - bounds[0]) / 1.5**3)
            for _ in range(12):
                await b.press("+")
            assert await b.eval("$('closer').disabled") and await b.eval("robotPart.plan.zoom.factor") == 16
            start = await b.eval(
                "(() => { const p = robotPart.plan, box = p.live.getBoundingClientRect(); return [box.left + box.width / 2, box.top + box.height / 2]; })()"
            )
            before = await b.eval("robotPart.plan.zoom")
            for kind, right in (("mousePressed", 0), ("mouseMoved", 60), ("mouseReleased", 60)):
                await b.call(
                    "Input.dispatchMouseEvent", type=kind, x=start[0] + right, y=start[1], button="left", clickCount=1
                )
            after = await b.eval("robotPart.plan.zoom")
            assert after["x"] == pytest.approx(before["x"] - 60 / (scale * 16), abs=1e-3) and after[
                "y"
            ] == pytest.approx(before["y"])
            await b.press("0")
            assert await b.eval("robotPart.plan.bounds") == bounds and await b.eval("$('farther').disabled")

    asyncio.run(scenario())


@asynccontextmanager
async def page_of(hub: Hub):
    async with serving(hub, "127.0.0.1", 0, []) as port, chromium.browser() as b:
        await b.look(f"http://127.0.0.1:{port}/")
        yield b
        assert b.troubles == []


def test_lanes_have_the_whiskers_names_and_those_without_a_node_are_one_line(tmp_path):
    async def scenario(writer):
        async with page_of(Hub([writer.name], scene=SCENE)) as b:
            await b.until("last?.lanes && traces")
            rows = "[...document.querySelectorAll('#lanes tbody tr')].filter((row) => row.checkVisibility()).map((row) => row.innerText)"
            shown = await b.until(f"({rows}).length === 3 && {rows}")
            names = [whisker.name.replace("_", " ") for whisker in SCENE.robot.whiskers[:3]]
            assert [row.split("\t")[0].split(maxsplit=1)[1] for row in shown] == names
            assert await b.text("#rest") == "Show 25 lanes without a node"
            await b.click("#rest")
            assert len(await b.eval(rows)) == 28

    with ring_of(made_frames(0, 640)) as writer:
        asyncio.run(scenario(writer))


def test_the_headers_buttons_order_and_show_what_is_so(tmp_path):
    ordered = []

    async def scenario(writer):
        post = Post()
        post.source.hold = ordered.append
        recorder = Recorder(tmp_path, lambda ring, file: ["sh", "-c", f"echo of {ring}; exec sleep 600"])
        hub = Hub([writer.name], post.source, SCENE, may_set_pose=True, recorder=recorder)
        async with page_of(hub) as b:
            await b.until("linked")
            await b.click("#hold")
            await b.until(
                "$('hold').getAttribute('aria-pressed') === 'true' && $('hold').textContent.includes('Let it go on')"
            )
            await b.press("s")
            await b.until("$('hold').textContent.includes('Stop robot')")
            assert ordered == [True, False]
            await b.press("w")
            await b.press("c")
            assert str(tmp_path) in await b.until(
                "$('record').textContent.includes('Stop recording') && $('controls-said').textContent"
            )
            await b.until("$('controls-said').textContent && $('record').textContent.includes('1.0 s')")
            await b.click("#record")
            await b.until("$('record').textContent.includes('● Record')")
            assert f"of {writer.name}" in next(tmp_path.glob("*.log")).read_text()
        recorder.close()
        async with page_of(Hub([writer.name], post.source, SCENE)) as b:
            await b.until("linked")
            assert not await b.eval("$('record').checkVisibility() || $('hold').checkVisibility()")

    with ring_of(made_frames(0, 640)) as writer:
        asyncio.run(scenario(writer))
