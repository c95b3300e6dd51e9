"""One page's connection: takes its requests, and sends what its subscriptions have, as fast as it keeps up."""

import asyncio
import json
import time
from collections.abc import Callable

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode

from whisker_protocol import CODES, DEFINITION, LANES, SENSOR_ERRORS, WIRE_VERSION

from .hub import Hub, RequestError
from .pyramid import BINS, WIDTHS
from .topics import TOPICS

PROTOCOL = 1  # of docs/view.md
WINDOW = 4  # messages under way: a page that has not dealt with them gets no more
REQUESTS_PER_S = 200  # more is no page
IDLE_S = 5.0  # a page that has not sent anything for so long looks at nothing: each message is acknowledged
ERRORS_MAX = 16  # a page that asks nonsense so often is cut off
REST_COUNT = 0x8000  # protocol/whisker.toml, field alpha
DEGREES_PER_COUNT = 180 / 65536
KINDS = {name: DEFINITION["codes"][name] for name in CODES} | SENSOR_ERRORS


def hello(hub: Hub) -> dict:
    """The first message: what there is to subscribe to, and the numbers needed to understand it."""
    return {
        "topic": "hello",
        "protocol": PROTOCOL,
        "topics": {name: {"id": topic.id, "about": topic.about} for name, topic in TOPICS.items()},
        "rings": hub.rings(),
        "robot": hub.source.name,
        "may_set_pose": hub.may_set_pose,
        "may_record": hub.recorder is not None,
        "playback": bool(hub.source.playback()),
        "window": WINDOW,
        "widths": WIDTHS,
        "bins": BINS,
        "lanes": LANES,
        "lane_names": [whisker.name for whisker in hub.robot.scene.robot.whiskers] if hub.robot.scene else [],
        "degrees_per_count": DEGREES_PER_COUNT,
        "rest_count": REST_COUNT,
        "wire_version": WIRE_VERSION,
        "kinds": {name: {"cause": kind["cause"], "remedy": kind["remedy"]} for name, kind in KINDS.items()},
    }


class NoRoomError(Exception):
    """There are as many pages as can be served."""


class Client:
    """`run` it until the page goes. Holds no message but the one being sent.

    `enter` is asked once, before the first subscription, whether there is room for one more page."""

    def __init__(self, hub: Hub, socket: ServerConnection, enter: Callable[[], bool]):
        self._hub, self._socket, self._enter = hub, socket, enter
        self._feeds = {}
        self._sent = self._dealt_with = self._errors = 0
        self._may_send = asyncio.Event()
        self._second, self._requests = 0, 0
        self._is_page = False
        self._heard = time.monotonic()

    def idle_since(self) -> float | None:
        """When it last sent anything, s; None: it is not idle."""
        silent = time.monotonic() - self._heard > IDLE_S
        return self._heard if silent or not self._feeds else None

    async def run(self) -> None:
        try:
            async with asyncio.TaskGroup() as tasks:
                sender = tasks.create_task(self._send_for_ever())
                await self._receive()
                sender.cancel()
        except* ConnectionClosed:
            pass
        except* NoRoomError:
            await self._socket.close(CloseCode.TRY_AGAIN_LATER, "too many pages are connected; close one")
        finally:
            for feed in self._feeds.values():
                feed.close()

    async def _receive(self) -> None:
        async for message in self._socket:
            await self._answer(message)
            await asyncio.sleep(0)  # others too, however fast this one asks

    async def _send_for_ever(self) -> None:
        await self._send(json.dumps(hello(self._hub)))
        while True:
            await self._hub.next_round()
            for topic in list(self._feeds):
                await self._send_next(topic)

    async def _send_next(self, topic: str) -> None:
        """What the feed has, once the page has room for it; by then the page may have left the topic."""
        while self._sent - self._dealt_with >= WINDOW:
            self._may_send.clear()
            await self._may_send.wait()
        message = self._feeds[topic].take() if topic in self._feeds else None
        if message is not None:
            await self._send(message)

    async def _send(self, message: str | bytes) -> None:
        self._sent += 1
        await self._socket.send(message)

    async def _answer(self, message: str | bytes) -> None:
        self._heard = time.monotonic()
        try:
            self._count_request()
            self._do(parse(message))
        except RequestError as error:
            self._errors += 1
            if self._errors > ERRORS_MAX:
                await self._socket.close(CloseCode.POLICY_VIOLATION, "too many bad requests")
            else:
                await self._send(json.dumps({"topic": "error", "text": str(error)}))

    def _count_request(self) -> None:
        second = int(time.monotonic())
        self._requests = self._requests + 1 if second == self._second else 1
        self._second = second
        if self._requests > REQUESTS_PER_S:
            self._errors = ERRORS_MAX
            raise RequestError("too many requests")

    def _do(self, request: dict) -> None:
        match request.get("type"):
            case "ack":
                self._acknowledge(request.get("count"))
            case "subscribe":
                name = self._topic(request)
                self._become_page()
                feed = TOPICS[name].feed(self._hub, request)
                self._leave(name)
                self._feeds[name] = feed
            case "unsubscribe":
                self._leave(self._topic(request))
            case "set_pose":
                self._become_page()
                self._hub.set_pose(request)
            case "hold":
                self._become_page()
                self._hub.hold(request)
            case "record":
                self._become_page()
                self._hub.record(request)
            case "play":
                self._become_page()
                self._hub.play(request)
            case _:
                raise RequestError("type: not ack, subscribe, unsubscribe, set_pose, hold, record or play")

    def _become_page(self) -> None:
        if not self._is_page and not self._enter():
            raise NoRoomError
        self._is_page = True

    def _acknowledge(self, count: object) -> None:
        if type(count) is not int or not self._dealt_with <= count <= self._sent:
            raise RequestError("count: not the number of messages dealt with so far")
        self._dealt_with = count
        self._may_send.set()

    def _topic(self, request: dict) -> str:
        name = request.get("topic")
        if not isinstance(name, str) or name not in TOPICS:
            raise RequestError(f"topic: not one of {', '.join(TOPICS)}")
        return name

    def _leave(self, name: str) -> None:
        if name in self._feeds:
            self._feeds.pop(name).close()


def parse(message: str | bytes) -> dict:
    """The JSON object that a page sent. RequestError if it is something else."""
    try:
        request = json.loads(message) if isinstance(message, str) else None
    except (ValueError, RecursionError):
        request = None
    if not isinstance(request, dict):
        raise RequestError("message: not a JSON object")
    return request
