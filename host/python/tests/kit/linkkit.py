"""Ways into a link of the robot's processes: an endpoint of one's own, and messages as zenoh hands them to an inbox."""

import socket
from types import SimpleNamespace

from crunchbot.robot.network.inbox import encoding_of
from crunchbot.robot.network.messages import encode
from crunchbot.robot.network.streams import Envelope


def free_endpoint() -> str:
    """tcp/127.0.0.1:PORT with a port that was free a moment ago."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        return f"tcp/127.0.0.1:{server.getsockname()[1]}"


class Bytes(bytes):
    def to_bytes(self) -> bytes:
        return bytes(self)


def sample(key: str, message, envelope: Envelope, encoding: str | None = None, data: bytes | None = None):
    """What an inbox reads of a zenoh.Sample: a message, or in its place any `data` of any `encoding`."""
    return SimpleNamespace(
        key_expr=key,
        encoding=encoding or encoding_of(type(message)),
        payload=Bytes(encode(message) if data is None else data),
        attachment=Bytes(envelope.pack()),
    )
