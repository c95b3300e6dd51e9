"""The robot's bag: every topic of a run in an MCAP file that ROS 2 tools open, whole up to its last second.

Topics are /<robot>/<topic>; with a scene also /tf and /map, by which ROS 2's tools place the rest. Log times follow the bridge's clock from the moment the bag began; the headers' stamps are
the bridge's own. With a scene, `whisker scene from BAG` makes a scene folder of what was observed.
"""

import tempfile
import threading
import time
from dataclasses import replace
from pathlib import Path

from ...recording.writing import TopicWriter
from ...scene import Scene, load, write
from ..network.health import ENDED, RUNNING, Health
from ..network.inbox import Inbox, Received
from ..network.link import Link
from ..network.messages import HEALTH, SCHEMAS, encode
from ..standard import types
from ..standard.view import KINDS, StandardView
from .log_clock import LogClock
from .played import FORMAT, SCENE_FILES

LOOK_S = 0.5
PLACING, PLACED_BY = ("/tf", "/map"), ("odometry", "pose", "map")  # of the standard topics, and what they follow from


def metadata(robot: str, scene: Path | None) -> dict[str, str]:
    """What a bag's first record holds: format, robot, when it began, and the scene's files as text, floors of images as
    letters. Sensors of the user's own are left out: rows on the network do not hold them."""
    reported = {"format": FORMAT, "robot": robot, "started": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())}
    if scene is None:
        return reported
    loaded = load(scene)
    with tempfile.TemporaryDirectory(prefix="whisker-") as place:
        write(place, replace(loaded, robot=replace(loaded.robot, sensors=())))
        files = [Path(place) / name for name in SCENE_FILES]
        return reported | {file.name: file.read_text() for file in files if file.exists()}


class Bag:
    """Writes what comes on a link until every stream has ended. `run`, or `take` what was received by another reader."""

    def __init__(self, writer: TopicWriter, robot: str, scene: Scene | None = None):
        self._writer, self._robot = writer, robot
        self._view = StandardView(scene, time.time_ns()) if scene else None
        self._known: set[str] = set()
        self._clock = LogClock(time.time_ns())
        self.messages = 0

    def take(self, received: list[Received]) -> None:
        """WriteError when the file cannot go on; ends are in the metadata, not among the messages."""
        for one in received:
            if one.over:
                continue
            topic = f"/{self._robot}/{one.topic}"
            if topic not in self._known:
                self._known.add(topic)
                self._writer.topic(topic, SCHEMAS[type(one.message)])
            self._writer.add(topic, self._time(one), one.data or encode(one.message))
            self.messages += 1
            self._place(one)

    def _place(self, one: Received) -> None:
        """The frames that follow from a message, and at the first row the map."""
        if self._view is None:
            return
        if one.topic not in PLACED_BY and (one.topic != "observation" or "/map" in self._known):
            self._view.note(one.topic, one.message)
            return
        standards = list(self._view.take(one.topic, one.message))
        if one.topic == "observation" and "/map" not in self._known:
            standards += self._view.first()
        for standard in standards:
            if standard.topic not in PLACING:
                continue
            if standard.topic not in self._known:
                self._known.add(standard.topic)
                kind = KINDS[standard.topic]
                self._writer.topic(standard.topic, kind.replace("/", "/msg/"), types.definition(kind))
            self._writer.add(standard.topic, standard.stamp_ns, types.encode(standard.message))

    def _time(self, one: Received) -> int:
        stamp_ns = one.message.header.stamp.ns
        return self._clock.row(stamp_ns) if one.topic == "observation" else self._clock.other(stamp_ns)

    def run(self, link: Link, stop: threading.Event, stay: bool = False) -> dict[str, int]:
        """Records until all streams but health have ended (unless `stay`), or until stopped. Returns the counters."""
        inbox = link.subscribe("**")
        health = Health(link, lambda: self.counters(inbox))
        link.announce()
        while not stop.is_set() and (stay or not _is_over(inbox)):
            self.take(inbox.take(LOOK_S))
            health.report(0, RUNNING, inbox.last_error)
            self._writer.flush_when_due()
        self._writer.finish({name: str(value) for name, value in self._reported(inbox).items()})
        health.report(0, ENDED, inbox.last_error)
        return self.counters(inbox)

    def counters(self, inbox: Inbox) -> dict[str, int]:
        """Messages written, sent but never come, and refused."""
        counted = {name: getattr(inbox, name) for name in ("missed", "refused", "overflown")}
        return {"messages": self.messages} | counted

    def _reported(self, inbox: Inbox) -> dict[str, int]:
        tallies = inbox.tallies.items()
        each = {
            f"{topic}.{name}": getattr(t, name) for topic, t in tallies for name in ("received", "missed", "refused")
        }
        return self.counters(inbox) | each


def _is_over(inbox: Inbox) -> bool:
    streams = [tally for topic, tally in inbox.tallies.items() if not topic.startswith(f"{HEALTH}/")]
    return bool(streams) and all(tally.ended for tally in streams)
