"""Where the robot's messages come from: a crunchbot.robot.network.inbox, which the server's rounds empty."""

import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from ..errors import UserError

WANTED = ("observation", "contact", "behaviour", "localisation", "belief", "map", "touch_map", "truth", "health/*")
SPEED_LEAST, SPEED_MOST = 0.1, 100.0  # of a recording
TOLD_MOST = 200  # characters of what is wrong with a message


class NoRobot:
    """whisker-view was started for rings only. Also what every source answers to."""

    name = ""

    def link(self) -> dict:
        """`state`: off or open; `text`: one line for a person."""
        return {"state": "off", "text": "not asked for"}

    def refused(self) -> dict:
        """Messages that could not be read (`count`), what was wrong with the `last`, and those `missed` on the way."""
        return {"count": 0, "last": "", "missed": 0}

    def poll(self) -> Iterable[tuple]:
        """(topic, message) of what has come since the last call, in order. Never waits."""
        return []

    def jumped(self) -> bool:
        """Whether what `poll` gives next is of another time than before: all that was known is to be forgotten."""
        return False

    def clock(self) -> float:
        """By which the age of what has come is measured, s."""
        return time.monotonic()

    def look(self) -> None:
        """A page begins to look at the robot."""

    def playback(self) -> dict | None:
        """Of a recording: `at_s`, `length_s`, `playing`, `speed`. None: this is live."""
        return None

    def play(self, playing: bool | None = None, speed: float | None = None, at_s: float | None = None) -> None:
        """Go on or stand, so many times as fast, from this moment of the recording; None: as before."""
        raise UserError("no recording is played; start whisker-view with FILE.mcap")

    def set_pose(self, pose: tuple[float, float, float]) -> None:
        """Tell the navigator that the robot is here: x, y in m, heading in rad."""
        raise UserError("no robot is looked at; start whisker-view with --robot")

    def hold(self, on: bool) -> None:
        """Tell the pilot that the robot is to stand, or may go on."""
        raise UserError("no robot is looked at; start whisker-view with --robot")

    def close(self) -> None:
        return


class InboxSource(NoRobot):
    """Takes what an Inbox holds; `close` ends the link it belongs to, `set_pose` and `hold` send over it."""

    def __init__(
        self,
        name: str,
        inbox: Any,
        text: str = "",
        close: Callable[[], None] = lambda: None,
        set_pose: Callable | None = None,
        hold: Callable | None = None,
    ):
        self.name, self._inbox, self._text, self.close = name, inbox, text, close
        self.set_pose, self.hold = set_pose or super().set_pose, hold or super().hold

    def link(self) -> dict:
        return {"state": "open", "text": self._text}

    def refused(self) -> dict:
        last = " ".join(self._inbox.last_error[: 2 * TOLD_MOST].split())[:TOLD_MOST]
        return {"count": self._inbox.refused, "last": last, "missed": self._inbox.missed}

    def poll(self) -> list[tuple]:
        return [(received.topic, received.message) for received in self._inbox.take(timeout_s=0.0)]


def join(robot: str, connect: list[str], config: Path | None = None) -> InboxSource:
    """Listen to a robot's streams; nothing is published but poses and orders of a page. `connect`: its processes' endpoints,
    tcp/HOST:PORT or tls/HOST:PORT, which need not be there yet; none: those of this machine. `config`: a file of zenoh's
    own configuration. UserError: it cannot be."""
    try:
        from ..robot.network import initial_pose, order
        from ..robot.network.link import NAVIGATOR_ENDPOINT, PILOT_ENDPOINT, Link
    except ImportError as error:
        raise UserError(f"--robot needs {error.name}, which is not installed; make setup installs it") from error
    endpoints = connect or [PILOT_ENDPOINT, NAVIGATOR_ENDPOINT]
    link = Link("view", robot, connect=endpoints, config=config)
    text = f"Listening at {', '.join(endpoints)}"
    tell = (lambda pose: initial_pose.send(link, pose), lambda on: order.send(link, on, "a person at the page"))
    return InboxSource(robot, link.subscribe(*WANTED), text, link.close, *tell)
