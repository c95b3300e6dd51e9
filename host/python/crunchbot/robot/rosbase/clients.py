"""Who is connected to the socket: one commander (the first that drives), and observers. Messages: docs/create.md."""

import contextlib
import math
import selectors
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from ...pilot import base
from .drive import MODES, Drive
from .motion import Way

CLIENTS_MOST, MESSAGE_MOST = 64, 255
PLACE_S = 1.0  # a commander without an order for so long loses the command, another client its place to a new one


@dataclass(eq=False)
class Client:
    socket: socket.socket
    heard_s: float  # when it was answered last without an error, or came
    way: Way = field(default_factory=Way)
    bits: int = 0
    known: bool = False  # it was answered
    nonsense: bool = False  # all that was heard of it was refused


class Refused(Exception):
    """A message that is not obeyed; its text is the answer."""


class Clients:
    """bits: what is touched now; health: its pairs; refusal: why nobody may drive at all, or nothing."""

    def __init__(
        self,
        listening: socket.socket,
        drive: Drive,
        bits: Callable[[], int],
        health: Callable[[], dict],
        refusal: str,
    ):
        self._drive, self._bits, self._health, self._refusal = drive, bits, health, refusal
        self._listening, self._commander, self._ordered_s = listening, None, float("-inf")
        self._all: list[Client] = []
        self._selector = selectors.DefaultSelector()
        self._selector.register(listening, selectors.EVENT_READ)

    def add(self, step: dict[str, float]) -> None:
        for client in self._all:
            client.way.add(step)

    def note(self, bits: int) -> None:
        for client in self._all:
            client.bits |= bits

    def serve(self, wait_s: float) -> None:
        """Answer what comes within this time."""
        for key, _ in self._selector.select(wait_s):
            if key.data is None:
                self._accept()
            elif key.data in self._all:  # it may have lost its place to one that came just now
                self._hear(key.data)

    def commanded(self) -> bool:
        """Whether there is a commander that has ordered something of late."""
        return self._commander is not None and time.monotonic() - self._ordered_s < PLACE_S

    def _accept(self) -> None:
        with contextlib.suppress(OSError):  # gone again, or no descriptor for it: it is tried again
            accepted, _ = self._listening.accept()
            accepted.setblocking(False)
            self._make_place()
            if len(self._all) >= CLIENTS_MOST:
                with contextlib.suppress(OSError):
                    accepted.send(f"error {CLIENTS_MOST} clients are connected; end one of them first".encode())
                accepted.close()
                return
            self._all.append(Client(accepted, time.monotonic(), bits=self._bits()))
            self._selector.register(accepted, selectors.EVENT_READ, self._all[-1])

    def _make_place(self) -> None:
        """Where all are taken, who has said nothing but nonsense loses its own, or who has been silent longest."""
        old_s = time.monotonic() - PLACE_S
        over = [client for client in self._all if client.nonsense or client.heard_s <= old_s]
        over = [client for client in over if client is not self._commander or not self.commanded()]
        if len(self._all) >= CLIENTS_MOST and over:
            self._drop(min(over, key=lambda client: (not client.nonsense, client.heard_s)))

    def _drop(self, client: Client) -> None:
        """A commander that goes leaves standing wheels behind."""
        self._selector.unregister(client.socket)
        client.socket.close()
        self._all.remove(client)
        if client is self._commander:
            self._commander = None
            self._drive.stop(time.monotonic())

    def _hear(self, client: Client) -> None:
        try:
            data = client.socket.recv(MESSAGE_MOST + 1)
            if data:
                client.socket.send(self._answer(client, data).encode())
            else:
                self._drop(client)
        except OSError:  # gone, or it does not read
            self._drop(client)

    def _answer(self, client: Client, data: bytes) -> str:
        try:
            if len(data) > MESSAGE_MOST:
                raise Refused(f"a message has at most {MESSAGE_MOST} letters")
            answer = self._obey(client, data.decode(errors="replace"))
        except Refused as refusal:
            client.nonsense = not client.known
            return f"error {refusal}"
        client.heard_s, client.known, client.nonsense = time.monotonic(), True, False
        return answer

    def _obey(self, client: Client, text: str) -> str:
        word, *rest = text.split(" ")
        if "after" in rest:
            raise Refused("after N is of a Create's serial line; leave it out")
        if word == "drive":
            return self._on_drive(client, rest)
        if word == "mode":
            return self._on_mode(client, rest)
        asked = {"stop": self._on_stop, "odometry": self._on_odometry, "health": self._on_health}.get(text)
        if asked is None:
            raise Refused("say: drive V OMEGA, stop, mode NAME, odometry or health")
        return asked(client)

    def _on_drive(self, client: Client, words: list[str]) -> str:
        try:
            v, omega = map(float, words)
        except ValueError:
            v = omega = math.nan
        if not math.isfinite(v + omega):
            raise Refused("say: drive V OMEGA, in m/s and rad/s")
        self._command(client)
        if self._refusal:
            raise Refused(self._refusal)
        self._drive.drive(v, omega, time.monotonic())
        return self._sent()

    def _on_mode(self, client: Client, words: list[str]) -> str:
        if len(words) != 1 or words[0] not in MODES:
            raise Refused("say: mode passive, mode safe or mode full")
        self._command(client)
        self._drive.set_mode(words[0], time.monotonic())
        return self._sent()

    def _on_stop(self, client: Client) -> str:
        """Anybody may."""
        if client is self._commander:
            self._ordered_s = time.monotonic()
        self._drive.stop(time.monotonic())
        return self._sent()

    def _on_odometry(self, client: Client) -> str:
        idle = base.IDLE if self._drive.held(time.monotonic()) != "no" else 0
        answer = f"odometry {' '.join(map(repr, client.way.take()))} {client.bits | idle}"
        client.bits = self._bits()
        return answer

    def _on_health(self, _: Client) -> str:
        pairs = {"commander": int(self.commanded())} | self._health()
        return "health " + " ".join(f"{key}={value}" for key, value in pairs.items())

    def _command(self, client: Client) -> None:
        """It is the commander from now on; the one before, if it was silent, leaves standing wheels and no mode behind."""
        if client is not self._commander and self.commanded():
            raise Refused("another client commands; end that one first")
        if client is not self._commander:
            self._commander = client
            if self._drive.mode != "safe":
                self._drive.set_mode("safe", time.monotonic())
        self._ordered_s = time.monotonic()

    def _sent(self) -> str:
        v, omega = self._drive.ordered
        return f"sent {self._drive.sent} {v!r} {omega!r}"
