"""A running robot for Foxglove: its standard messages, and its own, on a WebSocket; a pose set there is obeyed."""

import json
import queue
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import foxglove
from foxglove.websocket import Capability, ServerListener

from ..errors import UserError
from ..recording.cdr import Malformed
from ..recording.messages import definition
from .network import initial_pose
from .network.health import ENDED, RUNNING, Health
from .network.link import Link
from .network.messages import SCHEMAS, MessageError, PoseWithCovarianceStamped, decode, encode
from .standard import types
from .standard.view import KINDS, LATCHED, POSE_TOPIC, Standard, StandardView

LOOK_S = 0.2
ENCODINGS = ["cdr", "json"]  # of what Foxglove may publish


class FoxgloveError(UserError):
    """The server cannot be started; one line."""

    exit_code = 1


class Listener(ServerListener):
    """Called by the server's threads; what is to be done goes to one queue."""

    def __init__(self, tasks: queue.SimpleQueue):
        self._tasks, self._advertised = tasks, {}

    def on_subscribe(self, client: Any, channel: Any) -> None:
        if channel.topic in LATCHED:
            self._tasks.put(("again", channel.topic))

    def on_client_advertise(self, client: Any, channel: Any) -> None:
        self._advertised[client.id, channel.id] = (channel.topic, channel.encoding)

    def on_client_unadvertise(self, client: Any, client_channel_id: int) -> None:
        self._advertised.pop((client.id, client_channel_id), None)

    def on_message_data(self, client: Any, client_channel_id: int, data: bytes) -> None:
        topic, encoding = self._advertised.get((client.id, client_channel_id), ("", ""))
        if topic == POSE_TOPIC:
            self._tasks.put((encoding, data))


class FoxgloveServer:
    """Publishes until stopped. FoxgloveError: the address is taken, or is none."""

    def __init__(self, view: StandardView, name: str, host: str, port: int):
        self._view, self._robot, self._context = view, name, foxglove.Context()
        self._channels: dict[str, foxglove.Channel] = {}
        self._latched: dict[str, Standard] = {}
        self._tasks: queue.SimpleQueue = queue.SimpleQueue()
        self.sent = self.poses_set = self.poses_refused = 0
        for topic, kind in KINDS.items():
            self._open(topic, kind.replace("/", "/msg/"), types.definition(kind))
        try:
            self.server = foxglove.start_server(
                name=f"crunchbot {name}",
                host=host,
                port=port,
                capabilities=[Capability.ClientPublish],
                server_listener=Listener(self._tasks),
                supported_encodings=ENCODINGS,
                context=self._context,
            )
        except Exception as error:  # the SDK has no class of its own for it
            text = " ".join(str(error).split())
            raise FoxgloveError(f"{host}:{port}: {text}; choose another --host or --port") from None

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
            self._do_tasks(link)
            health.report(0, RUNNING, inbox.last_error)
        health.report(0, ENDED, inbox.last_error)
        self.server.stop()

    def _take(self, topic: str, message) -> None:
        own = f"/{self._robot}/{topic}"
        wall_ns = None
        for standard in self._view.take(topic, message):
            wall_ns = standard.stamp_ns
            self._publish(standard)
        if own not in self._channels:
            schema = SCHEMAS[type(message)]
            self._open(own, schema, definition(schema))
        self._log(own, lambda: encode(message), wall_ns or self._view.latest_ns)

    def _open(self, topic: str, schema: str, text: str) -> None:
        described = foxglove.Schema(name=schema, encoding="ros2msg", data=text.encode())
        self._channels[topic] = foxglove.Channel(topic, schema=described, message_encoding="cdr", context=self._context)

    def _publish(self, standard: Standard) -> None:
        if standard.topic in LATCHED:
            self._latched[standard.topic] = standard
        self._log(standard.topic, lambda: types.encode(standard.message), standard.stamp_ns)

    def _log(self, topic: str, data: Callable[[], bytes], wall_ns: int) -> None:
        """Encoded only where somebody subscribes to it."""
        if self._channels[topic].has_sinks():
            self._channels[topic].log(data(), log_time=wall_ns)
            self.sent += 1

    def _do_tasks(self, link: Link) -> None:
        """What clients asked for since the last turn."""
        while not self._tasks.empty():
            what, value = self._tasks.get()
            if what == "again":
                if value in self._latched:
                    self._publish(self._latched[value])
                continue
            try:
                message = _pose_of(what, value)
                initial_pose.send_message(link, message)
                self.poses_set += 1
            except (MessageError, Malformed, ValueError) as error:
                self.poses_refused += 1
                self.server.publish_status(f"{POSE_TOPIC}: {error}", foxglove.StatusLevel.Warning)


def _pose_of(encoding: str, data: bytes) -> PoseWithCovarianceStamped:
    """MessageError or ValueError: it is none."""
    if encoding == "cdr":
        return decode(PoseWithCovarianceStamped, data, POSE_TOPIC)
    if encoding != "json":
        raise ValueError(f"encoding '{encoding}' is not read; publish JSON or CDR")
    try:
        given = json.loads(data, object_hook=lambda fields: SimpleNamespace(**fields))
        place, covariance = given.pose.pose, list(given.pose.covariance)
        made = types.make(
            "geometry_msgs/PoseWithCovarianceStamped",
            header=types.make("std_msgs/Header", frame_id=given.header.frame_id),
            pose=types.make(
                "geometry_msgs/PoseWithCovariance",
                pose=types.make(
                    "geometry_msgs/Pose",
                    position=types.make("geometry_msgs/Point", **vars(place.position)),
                    orientation=types.make("geometry_msgs/Quaternion", **vars(place.orientation)),
                ),
                covariance=types.doubles(covariance),
            ),
        )
        return decode(PoseWithCovarianceStamped, types.encode(made), POSE_TOPIC)
    except (AttributeError, TypeError, KeyError, json.JSONDecodeError) as error:
        raise ValueError(f"not a geometry_msgs/PoseWithCovarianceStamped as JSON ({error})") from None
