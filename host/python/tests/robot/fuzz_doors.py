"""Every place where bytes of others enter the robot's programs, and that has no fuzzer of its own: altered bytes are taken or
refused by the door's own error, in one line; nothing else comes out.

Of their own: messages, rows, checkpoints, recordings, what pages and robots say to the view, files of scenes and models.
"""

import json
import os
import socket
import struct
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import level0
import numpy as np
from mutate import mutate
from robotkit import examples

from crunchbot.base_table import BaseTable
from crunchbot.bridge.nodes import read_nodes
from crunchbot.errors import UserError
from crunchbot.guard import Guard
from crunchbot.pilot.base import Base
from crunchbot.robot import foxglove, journal
from crunchbot.robot.door import Door
from crunchbot.robot.network import messages as m
from crunchbot.robot.network.link import read_config
from crunchbot.robot.network.streams import Envelope, EnvelopeError, envelopes
from crunchbot.robot.processes.logs import last_line
from crunchbot.robot.processes.watchdog import Watchdog
from crunchbot.robot.rosbase.clients import Client, Clients
from crunchbot.robot.rosbase.drive import Drive
from crunchbot.robot.standard.outlet import Outlet

FOLDER = Path(tempfile.mkdtemp(prefix="whisker-"))
POSE = {
    "header": {"stamp": {"sec": 1, "nsec": 2}, "frame_id": "map"},
    "pose": {
        "pose": {"position": {"x": 1.5, "y": 0.5, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}},
        "covariance": [0.01, *[0.0] * 34, 0.01],
    },
}
REQUEST = (
    "GET / HTTP/1.1\r\nHost: 127.0.0.1:8765\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nOrigin: http://evil.example\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)
ROW = examples()["observation"]


class Warned(Outlet):
    def warn(self, text: str) -> None:
        assert "\n" not in text, text


OUTLET = Warned(SimpleNamespace(scene=level0.random_scene(np.random.default_rng(1))), "robot")
LINK = SimpleNamespace(publish=lambda topic: SimpleNamespace(send=m.encode, end=lambda *_: None))
DOOR = Door.__new__(Door)
DOOR._guard, DOOR._open = Guard("127.0.0.1", []), 1


def pose(encoding: str) -> Callable[[bytes], object]:
    return lambda data: OUTLET._set_pose(LINK, lambda: foxglove._pose_of(encoding, data))


def answered(ask: Callable[[Base], object]) -> Callable[[bytes], object]:
    """What a client of whisker-base makes of an answer."""

    def use(data: bytes) -> object:
        base = Base.__new__(Base)
        base._path = "base.sock"
        base._socket = SimpleNamespace(send=lambda message: None, recv=lambda size: data[:size])
        return ask(base)

    return use


def ordered() -> Callable[[bytes], object]:
    """What the driver of a base that speaks ROS 2 answers to a client."""
    drive = Drive(BaseTable(0.25, 0.5), lambda v, omega: True, lambda line: None)
    clients = Clients(socket.socketpair()[0], drive, lambda: 0, lambda: {"model": "ros2"}, "")
    client = Client(socket.socketpair()[0], 0.0)

    def use(data: bytes) -> None:
        answer = clients._answer(client, data)
        assert answer.split(" ")[0] in ("sent", "odometry", "health", "error") and "\n" not in answer, answer

    return use


def watched() -> Callable[[bytes], object]:
    credentials = (socket.SOL_SOCKET, socket.SCM_CREDENTIALS, struct.pack("3i", 1, os.getuid(), 1))
    watchdog = Watchdog()
    return lambda data: watchdog._hear(data, [credentials])


def of_file(read: Callable[[Path], object]) -> Callable[[bytes], object]:
    def use(data: bytes) -> object:
        (FOLDER / "file").write_bytes(data)
        return read(FOLDER / "file")

    return use


def record() -> bytes:
    body = next(envelopes()).pack() + m.encode(ROW)
    return journal.RECORD.pack(len(body) - journal.ENVELOPE.size, journal.zlib.crc32(body)) + body


# What enters: an example of it, the door, and the errors that it answers with
DOORS: dict[str, tuple[bytes, Callable[[bytes], object], tuple[type[Exception], ...]]] = {
    "pose of Foxglove, JSON": (json.dumps(POSE).encode(), pose("json"), ()),
    "pose of Foxglove, CDR": (foxglove._pose_of("json", json.dumps(POSE).encode()), pose("cdr"), ()),
    "request to Foxglove": (REQUEST.encode(), DOOR._refusal, ()),
    "envelope": (next(envelopes()).pack(), Envelope.unpack, (EnvelopeError,)),
    "journal": (record() * 3, lambda data: journal._read(data, 0), ()),
    "odometry of the base": (b"odometry 1 0 0 0 0 0 0 0 0 3", answered(Base.odometry), (UserError,)),
    "orders' answers of the base": (b"sent 12 0.2 0.1", answered(Base.stop), (UserError,)),
    "health of the base": (b"health mode=safe frames=12", answered(Base.health), (UserError,)),
    "list of nodes": (b"   3     17     1.0\nlane 4: serial 12,\n", of_file(read_nodes), (UserError,)),
    "configuration of zenoh": (b'{mode: "peer", connect: {endpoints: []}}', of_file(read_config), (UserError,)),
    "orders to a base of ROS 2": (b"drive 0.2 -0.5", ordered(), ()),
    "what is reported to a watchdog": (b"READY=1\nSTATUS=x\nWATCHDOG=1", watched(), ()),
    "log of a process": (b"2026-01-01 00:00:00.000 a line\nprogress 1 2\n", of_file(last_line), ()),
}


def fuzz(inputs: int, seed: int) -> dict[str, int]:
    rng = np.random.default_rng(seed)
    refused = 0
    doors = list(DOORS.items())
    for k in range(inputs):
        name, (example, use, errors) = doors[k % len(doors)]
        data = mutate(example, rng)
        try:
            use(data)
        except errors as error:
            assert "\n" not in str(error), (name, data)
            refused += 1
        except Exception as error:
            raise AssertionError(f"{name}: {data!r}") from error
    return {"refused in one line": refused, "poses refused": OUTLET.poses_refused, "poses taken": OUTLET.poses_set}
