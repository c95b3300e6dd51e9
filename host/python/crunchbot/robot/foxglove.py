"""A running robot for Foxglove: its standard messages, and its own, on a WebSocket; a pose set there is obeyed."""

import json
from collections.abc import Callable
from typing import Any

import foxglove
import numpy as np
from foxglove.websocket import Capability, ServerListener

from ..errors import UserError
from ..fields import HUGE, Fields
from ..guard import Guard
from ..recording.messages import definition
from .door import Door, hidden_address
from .network.messages import Header, Point, Pose, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion, encode
from .standard import types
from .standard.outlet import Outlet
from .standard.view import KINDS, POSE_TOPIC, StandardView

ENCODINGS = ["cdr", "json"]  # of what Foxglove may publish
ORIGINS = ("https://app.foxglove.dev",)  # its page; the desktop's program, where it sends another, needs --allow-origin
COVARIANCE = 36  # numbers


class FoxgloveError(UserError):
    """The server cannot be started; one line."""

    exit_code = 1


class Listener(ServerListener):
    """Called by the server's threads."""

    def __init__(self, outlet: Outlet):
        self._outlet, self._advertised = outlet, {}

    def on_subscribe(self, client: Any, channel: Any) -> None:
        self._outlet.again(channel.topic)

    def on_client_advertise(self, client: Any, channel: Any) -> None:
        self._advertised[client.id, channel.id] = (channel.topic, channel.encoding)

    def on_client_unadvertise(self, client: Any, client_channel_id: int) -> None:
        self._advertised.pop((client.id, client_channel_id), None)

    def on_message_data(self, client: Any, client_channel_id: int, data: bytes) -> None:
        topic, encoding = self._advertised.get((client.id, client_channel_id), ("", ""))
        if topic == POSE_TOPIC:
            self._outlet.set_pose(lambda: _pose_of(encoding, data))


class FoxgloveServer(Outlet):
    """FoxgloveError: the address is taken, or is none. may_set_pose: clients may publish; refused: a line for each request that
    `guard` refuses."""

    def __init__(
        self,
        view: StandardView,
        name: str,
        guard: Guard,
        host: str,
        port: int,
        may_set_pose: bool,
        refused: Callable[[str], None],
    ):
        super().__init__(view, name)
        hidden = hidden_address()
        self._context = foxglove.Context()
        self._channels: dict[str, foxglove.Channel] = {}
        self.open_all()
        try:
            self.server = foxglove.start_server(
                name=f"crunchbot {name}",
                host=hidden,
                port=0,
                capabilities=[Capability.ClientPublish] if may_set_pose else [],
                server_listener=Listener(self),
                supported_encodings=ENCODINGS,
                context=self._context,
            )
        except Exception as error:  # the SDK has no class of its own for it
            text = " ".join(str(error).split())
            raise FoxgloveError(f"{hidden}: {text}; see that this machine's loopback is up") from None
        try:
            self._door = Door(guard, host, port, (hidden, self.server.port), refused)
        except OSError as error:
            self.server.stop()
            text = f"{host}:{port}: cannot be listened at ({error.strerror})"
            raise FoxgloveError(f"{text}; choose another --host or --port") from None
        self.port = self._door.port

    def open(self, topic: str, schema: str) -> None:
        text = types.definition(schema) if topic in KINDS else definition(schema)
        described = foxglove.Schema(name=schema, encoding="ros2msg", data=text.encode())
        self._channels[topic] = foxglove.Channel(topic, schema=described, message_encoding="cdr", context=self._context)

    def send(self, topic: str, data: Callable[[], bytes], wall_ns: int) -> bool:
        if not self._channels[topic].has_sinks():
            return False
        self._channels[topic].log(data(), log_time=wall_ns)
        return True

    def warn(self, text: str) -> None:
        self.server.publish_status(text, foxglove.StatusLevel.Warning)

    def close(self) -> None:
        self._door.close()
        self.server.stop()


def _pose_of(encoding: str, data: bytes) -> bytes:
    """CDR of a pose that Foxglove gave. ValueError: it is none."""
    if encoding == "cdr":
        return data
    if encoding != "json":
        raise ValueError(f"encoding '{encoding}' is not read; publish JSON or CDR")
    try:
        given = Fields(json.loads(data))
        place, belief = given.part("pose").part("pose"), given.part("pose")
        point = Point(*(place.part("position").number(axis) for axis in "xyz"))
        turn = Quaternion(*(place.part("orientation").number(axis) for axis in "xyzw"))
        covariance = np.array(belief.numbers("covariance", COVARIANCE, -HUGE, HUGE))
        frame = given.part("header").take("frame_id")
        if not isinstance(frame, str):
            raise given.part("header").fail("frame_id", "must be a string")
        return encode(
            PoseWithCovarianceStamped(Header(frame_id=frame), PoseWithCovariance(Pose(point, turn), covariance))
        )
    except (ValueError, RecursionError) as error:  # bytes that are no text, too
        raise ValueError(f"not a geometry_msgs/PoseWithCovarianceStamped as JSON ({error})") from None
