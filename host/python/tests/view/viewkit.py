"""For tests of whisker-view: rings of made-up frames, a server in the test's own process, and a page that is a script."""

import asyncio
import json
import logging
from collections import defaultdict, deque
from contextlib import asynccontextmanager, contextmanager
from itertools import count

import numpy as np
import pytest
from patience import PATIENCE_S
from rings import ring_name
from websockets.asyncio.client import connect

from crunchbot.bridge.ring import FRAME, Writer
from crunchbot.view.hub import Hub
from crunchbot.view.server import serving
from crunchbot.view.topics import BLOCK
from whisker_protocol import CODES, LANES, LIMITS, STATUS_CODE_SHIFT

NODES = 3


@pytest.fixture(autouse=True)
def nothing_logged(caplog):
    """An exception inside the server is a line in its log: there must be none."""
    caplog.set_level(logging.WARNING)
    yield
    assert [record.getMessage() for record in caplog.get_records("call")] == []


def made_frames(first: int, n: int, seed: int = 0) -> np.ndarray:
    """Ticks `first` to `first + n`: noise on NODES lanes, the others without a node."""
    rng = np.random.default_rng((seed, first))
    frames = np.zeros(n, FRAME)
    frames["tick"] = frames["sequence"] = np.arange(first, first + n)
    frames["time_cycles"] = frames["tick"] * LIMITS["tick_period"]
    frames["lane_mask"] = (1 << LANES) - 1
    frames["lane"]["alpha"][:, :NODES] = rng.integers(1, 0xFFFF, (n, NODES))
    frames["lane"]["beta"][:, :NODES] = rng.integers(1, 0xFFFF, (n, NODES))
    frames["lane"]["status"][:, NODES:] = CODES["absent"] << STATUS_CODE_SHIFT
    return frames


def spoil(frames: np.ndarray, code: str, lane: int, ticks: slice) -> None:
    """Make records of a lane bad."""
    frames["lane"]["status"][ticks, lane] = CODES[code] << STATUS_CODE_SHIFT


@contextmanager
def ring_of(frames: np.ndarray, name: str | None = None):
    """A ring that holds these frames and whose writer lives."""
    with Writer(name or ring_name()) as writer:
        writer.publish(frames)
        yield writer


@asynccontextmanager
async def flowing(writer: Writer, first: int):
    """While this lasts, frames come: ticks from `first` on."""

    async def publish_for_ever():
        for start in count(first, 64):
            writer.publish(made_frames(start, 64))
            await asyncio.sleep(0.032)

    task = asyncio.create_task(publish_for_ever())
    yield
    task.cancel()


@asynccontextmanager
async def view_of(*names: str):
    """A server for these rings; gives its port."""
    async with serving(Hub(list(names)), "127.0.0.1", 0, []) as port:
        yield port


class Block:
    """A binary message of topic traces, taken apart; low and high: (2, lanes, bins), bad: (lanes, bins)."""

    def __init__(self, message: bytes):
        self.topic, self.flags, self.width, bins, lanes, _, self.mask, self.subscription, self.first = (
            BLOCK.unpack_from(message)
        )
        self.bins = bins
        counts = np.frombuffer(message, "<u2", 4 * lanes * bins, BLOCK.size).reshape(2, 2, lanes, bins)
        self.low, self.high = counts
        self.bad = np.frombuffer(message, np.uint8, -1, BLOCK.size + counts.nbytes).reshape(lanes, bins)


class Script:
    """A page without a screen."""

    def __init__(self, socket):
        self.socket, self.count = socket, 0
        self.kept = defaultdict(deque)

    async def ask(self, **request) -> None:
        await self.socket.send(json.dumps(request))

    async def traces(self, ring: str, width: int = 1, bins: int = 4096, lanes: int = (1 << LANES) - 1, **more) -> None:
        options = {"ticks_per_bin": width, "bins": bins, "lanes": lanes, "subscription": 7} | more
        await self.ask(type="subscribe", topic="traces", ring=ring, **options)

    async def next(self, topic: str, acknowledge: bool = True):
        """The next message of a topic, a dict, or bytes for traces; those of other topics are kept for later."""
        while not self.kept[topic]:
            message = await asyncio.wait_for(self.socket.recv(), PATIENCE_S)
            self.count += 1
            if acknowledge:
                await self.ask(type="ack", count=self.count)
            reported = message if isinstance(message, bytes) else json.loads(message)
            self.kept["traces" if reported is message else reported["topic"]].append(reported)
        return self.kept[topic].popleft()

    async def status_where(self, condition) -> dict:
        """The first status for which the condition holds."""
        async with asyncio.timeout(PATIENCE_S):
            while not condition(reported := await self.next("status")):
                pass
        return reported

    async def bins_until(self, end: int) -> list[Block]:
        """Blocks of traces until bin `end` is there."""
        blocks = [Block(await self.next("traces"))]
        while blocks[-1].first + blocks[-1].bins < end:
            blocks.append(Block(await self.next("traces")))
        return blocks


@asynccontextmanager
async def page(port: int, **options):
    """A connection as the page makes it."""
    async with connect(f"ws://127.0.0.1:{port}/ws", origin=f"http://127.0.0.1:{port}", **options) as socket:
        yield Script(socket)
