"""Ways into a link of the robot's processes: an endpoint of one's own, and messages as zenoh hands them to an inbox."""

import random
import socket
from pathlib import Path
from types import SimpleNamespace

from crunchbot.robot.network.inbox import encoding_of
from crunchbot.robot.network.messages import encode
from crunchbot.robot.network.streams import Envelope

HANDED_OUT = Path("/proc/sys/net/ipv4/ip_local_port_range")


def free_port(count: int = 1) -> int:
    """The first of `count` neighbours that nobody listened at a moment ago. It is below those that the system hands out to
    every connection: of many processes none gets it by chance meanwhile."""
    low = int(HANDED_OUT.read_text().split()[0])
    while True:
        first = random.SystemRandom().randrange(low // 2, low - count)
        try:
            for number in range(count):
                socket.create_server(("127.0.0.1", first + number)).close()
        except OSError:
            continue
        return first


def free_endpoint() -> str:
    """tcp/127.0.0.1:PORT with a free port."""
    return f"tcp/127.0.0.1:{free_port()}"


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
