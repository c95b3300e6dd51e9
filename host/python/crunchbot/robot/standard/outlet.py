"""What shows a robot in other programs: its messages come in, standard ones go out, and a pose that is set there is obeyed."""

import queue
import threading
from collections.abc import Callable

from ...recording.cdr import Malformed
from ..network import initial_pose
from ..network.health import ENDED, RUNNING, Health
from ..network.link import Link
from ..network.messages import SCHEMAS, TOPICS, MessageError, PoseWithCovarianceStamped, decode, encode
from . import types
from .view import KINDS, LATCHED, POSE_TOPIC, Standard, StandardView

LOOK_S = 0.2
STAMP = slice(4, 12)  # of a header that begins a message, behind the four bytes that begin its CDR


class Outlet:
    """Runs until stopped. One that is made says how a topic is opened, a message goes out, and a person is warned."""

    def __init__(self, view: StandardView, robot: str):
        self._view, self._robot = view, robot
        self._opened: set[str] = set()
        self._latched: dict[str, Standard] = {}
        self._tasks: queue.SimpleQueue[Callable[[Link], None]] = queue.SimpleQueue()
        self.sent = self.poses_set = self.poses_refused = 0

    def open_all(self) -> None:
        """Every topic that is known before a message has come; others (health of each process) follow as they come."""
        for topic, kind in KINDS.items():
            self.open(topic, kind.replace("/", "/msg/"))
        for topic, kind in TOPICS.items():
            self._open_own(topic, kind)

    def open(self, topic: str, schema: str) -> None:
        """A topic that will be published, of type "package/msg/Type": a standard one, or one of crunchbot/msgs."""
        raise NotImplementedError

    def send(self, topic: str, data: Callable[[], bytes], wall_ns: int) -> bool:
        """Publishes CDR, which is made only where somebody takes it. False: nobody does."""
        raise NotImplementedError

    def look(self) -> None:
        """Between messages, at least every LOOK_S: for what does not come by a thread of its own."""

    def warn(self, text: str) -> None:
        """A line to the person who asked for something impossible."""

    def close(self) -> None:
        """After the last message."""

    def run(self, link: Link, stop: threading.Event) -> None:
        inbox = link.subscribe("**")
        counters = {
            "sent": lambda: self.sent,
            "poses_refused": lambda: self.poses_refused,
            "refused": lambda: inbox.refused,
        }
        health = Health(link, lambda: {name: value() for name, value in counters.items()})
        link.announce()
        for standard in self._view.first():
            self._publish(standard)
        while not stop.is_set():
            for received in inbox.take(LOOK_S):
                if not received.over:
                    self._take(received.topic, received.message)
            self.look()
            while not self._tasks.empty():
                self._tasks.get()(link)
            health.report(0, RUNNING, inbox.last_error)
        health.report(0, ENDED, inbox.last_error)
        self.close()

    def again(self, topic: str) -> None:
        """From any thread: somebody has come who wants the last message of a latched topic."""
        if topic in LATCHED:
            self._tasks.put(lambda link: self._publish(self._latched[topic]))

    def set_pose(self, read: Callable[[], bytes]) -> None:
        """From any thread: somebody gave a pose. read: makes CDR of it; ValueError when it is none."""
        self._tasks.put(lambda link: self._set_pose(link, read))

    def _set_pose(self, link: Link, read: Callable[[], bytes]) -> None:
        try:
            cdr = bytearray(read())
            cdr[STAMP] = bytes(8)  # it is of a clock that the navigator does not know; the pose is of now
            message = decode(PoseWithCovarianceStamped, bytes(cdr), POSE_TOPIC)
            initial_pose.prior_of(message, self._view.scene)
            initial_pose.send_message(link, message)
            self.poses_set += 1
        except (MessageError, Malformed, ValueError) as error:
            self.poses_refused += 1
            self.warn(f"{POSE_TOPIC}: {error}")

    def _take(self, topic: str, message) -> None:
        wall_ns = None
        for standard in self._view.take(topic, message):
            wall_ns = standard.stamp_ns
            self._publish(standard)
        own = self._open_own(topic, type(message))
        self._count(self.send(own, lambda: encode(message), wall_ns or self._view.latest_ns))

    def _open_own(self, topic: str, kind: type) -> str:
        own = f"/{self._robot}/{topic}"
        if own not in self._opened:
            self._opened.add(own)
            self.open(own, SCHEMAS[kind])
        return own

    def _publish(self, standard: Standard) -> None:
        if standard.topic in LATCHED:
            self._latched[standard.topic] = standard
        self._count(self.send(standard.topic, lambda: types.encode(standard.message), standard.stamp_ns))

    def _count(self, is_sent: bool) -> None:
        self.sent += is_sent
