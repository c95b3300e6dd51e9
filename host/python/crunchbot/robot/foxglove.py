"""A running robot for Foxglove: its standard messages, and its own, on a WebSocket; a pose set there is obeyed."""

import json
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import foxglove
import numpy as np
from foxglove.websocket import Capability, ServerListener

from ..errors import UserError
from ..recording.messages import definition
from .network.messages import Header, Point, Pose, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion, encode
from .standard import types
from .standard.outlet import Outlet
from .standard.view import KINDS, POSE_TOPIC, StandardView

ENCODINGS = ["cdr", "json"]  # of what Foxglove may publish


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
    """FoxgloveError: the address is taken, or is none."""

    def __init__(self, view: StandardView, name: str, host: str, port: int):
        super().__init__(view, name)
        self._context = foxglove.Context()
        self._channels: dict[str, foxglove.Channel] = {}
        self.open_all()
        try:
            self.server = foxglove.start_server(
                name=f"crunchbot {name}",
                host=host,
                port=port,
                capabilities=[Capability.ClientPublish],
                server_listener=Listener(self),
                supported_encodings=ENCODINGS,
                context=self._context,
            )
        except Exception as error:  # the SDK has no class of its own for it
            text = " ".join(str(error).split())
            raise FoxgloveError(f"{host}:{port}: {text}; choose another --host or --port") from None

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
        self.server.stop()


def _pose_of(encoding: str, data: bytes) -> bytes:
    """CDR of a pose that Foxglove gave. ValueError: it is none."""
    if encoding == "cdr":
        return data
    if encoding != "json":
        raise ValueError(f"encoding '{encoding}' is not read; publish JSON or CDR")
    try:
        given = json.loads(data, object_hook=lambda fields: SimpleNamespace(**fields))
        place, covariance = given.pose.pose, list(given.pose.covariance)
        pose = Pose(Point(**vars(place.position)), Quaternion(**vars(place.orientation)))
        belief = PoseWithCovariance(pose, np.array(covariance, float))
        return encode(PoseWithCovarianceStamped(Header(frame_id=given.header.frame_id), belief))
    except (AttributeError, TypeError, KeyError, json.JSONDecodeError) as error:
        raise ValueError(f"not a geometry_msgs/PoseWithCovarianceStamped as JSON ({error})") from None
