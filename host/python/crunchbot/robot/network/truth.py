"""The true pose of a simulated robot, from the simulation's socket to the topic `truth`."""

import socket
import threading
from pathlib import Path

from ...pilot.behaviour import TICK_S
from .link import Link
from .messages import Header, Pose, PoseStamped
from .ros import MAP_FRAME

RETRY_S = 0.2
MESSAGE_BYTES = 256


class TruthWatcher(threading.Thread):
    """Publishes what the simulation reports until it ends or `stop` is set. The simulation does not wait for it."""

    def __init__(self, path: Path, link: Link, stop: threading.Event):
        super().__init__(daemon=True)
        self._path, self._stream, self._stop_event = path, link.publish("truth"), stop

    def run(self) -> None:
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as server:
            while server.connect_ex(str(self._path)) != 0:
                if self._stop_event.wait(RETRY_S):
                    return
            server.settimeout(RETRY_S)
            server.send(b"watch")
            self._watch(server)
        self._stream.end(0, "the simulation has ended")

    def _watch(self, server: socket.socket) -> None:
        while not self._stop_event.is_set():
            try:
                words = server.recv(MESSAGE_BYTES).decode().split()
            except TimeoutError:
                continue
            except OSError:
                return
            if not words or words[0] == "end":
                return
            tick, *pose = words[1:]
            header = Header.at(round((int(tick) + 1) * TICK_S * 1e9), MAP_FRAME)
            self._stream.send(PoseStamped(header, Pose.planar(*map(float, pose))))
