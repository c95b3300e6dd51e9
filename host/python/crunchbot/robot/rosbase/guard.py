"""The guard: owns the socket, starts the driver and starts it again, and orders zero when the driver is dead or hangs."""

import contextlib
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from ..processes.lifeline import Heartbeat
from . import ALIVE_S, DRIVING, LEASE, LEASE_S, LOOK_S, REPEAT_S

if TYPE_CHECKING:
    from .wire import Orders

REPLACED_S = 2.0  # a driver that hangs for so long is killed
START_S = 60.0  # for a driver to say its first word, on a slow machine
YOUNG_S, PAUSE_S = 1.0, 0.5  # one that dies so young is not started again at once


class Guard:
    """held: the socket, and its lock. publish: makes its own publisher, while the first driver starts; before there is one the driver has no lease."""

    def __init__(
        self,
        publish: "Callable[[], Orders]",
        held: tuple[socket.socket, int],
        words: list[str],
        tell: Callable[[str], None],
    ):
        (self._listening, self._lock), self._words, self._tell = held, words, tell
        self._heartbeat, self.restarts = Heartbeat.of_environment(), 0
        self._looked_s = self._sent_s = self._said_s = float("-inf")
        self._stop_until_s = float("-inf")
        self._start()
        self._orders = publish()

    def run(self, stop: Callable[[], bool]) -> int:
        """Until it is asked to end, the supervisor ends, or the driver cannot be started: the exit code."""
        while True:
            while self._process.poll() is None and not self._is_over(stop):
                self._turn()
            if self._is_over(stop):
                return self._end()
            died_s = time.monotonic()
            self._driver.close()
            if not self._spoke and self.restarts == 0:
                return self._process.returncode or 1
            self._tell(f"the driver has died ({self._process.returncode}); ordering zero; another is started")
            self.restarts += 1
            young = died_s - self._started_s < YOUNG_S
            self._stop_wheels(PAUSE_S if young else 0.0)
            self._start()

    def _is_over(self, stop: Callable[[], bool]) -> bool:
        return stop() or self._heartbeat.ended

    def _start(self) -> None:
        self._driver, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._driver.setblocking(False)
        descriptors = (theirs.fileno(), self._listening.fileno())
        command = [sys.executable, "-m", "crunchbot.robot.rosbase.driver", *self._words, *map(str, descriptors)]
        self._process = subprocess.Popen(command, pass_fds=(*descriptors, self._lock), stdin=subprocess.DEVNULL)
        theirs.close()
        self._started_s = self._heard_s = time.monotonic()
        self._spoke = self._hangs = False

    def _turn(self) -> None:
        now_s = time.monotonic()
        self._hear(now_s)
        self._watch(now_s)
        if now_s - self._looked_s >= REPEAT_S / 10.0:
            self._looked_s = now_s
            self._orders.look()
        if now_s < self._stop_until_s and now_s - self._sent_s >= ALIVE_S:
            self._sent_s = now_s
            self._orders.send(0.0, 0.0)
        if now_s - self._said_s >= ALIVE_S:
            self._said_s = now_s
            until_s = now_s + LEASE_S if self._heartbeat.beats else now_s
            with contextlib.suppress(OSError):
                self._driver.send(LEASE.pack(until_s))
        time.sleep(LOOK_S)

    def _hear(self, now_s: float) -> None:
        with contextlib.suppress(OSError):
            while word := self._driver.recv(1):
                self._heard_s, self._spoke, self._hangs = now_s, True, False
                if word == DRIVING:
                    self._stop_until_s = float("-inf")  # it drives again

    def _watch(self, now_s: float) -> None:
        silent_s = now_s - self._heard_s
        if self._spoke and silent_s >= LEASE_S:
            if not self._hangs:
                self._hangs = True
                self._tell("the driver hangs; ordering zero")
            self._stop_until_s = now_s + REPEAT_S
        if silent_s >= (REPLACED_S if self._spoke else START_S):
            self._process.kill()

    def _stop_wheels(self, pause_s: float) -> None:
        """Zero at once; _turn repeats it beside the next driver's start."""
        self._orders.send(0.0, 0.0)
        self._sent_s = time.monotonic()
        self._stop_until_s = self._sent_s + REPEAT_S
        while time.monotonic() < self._sent_s + pause_s:
            time.sleep(ALIVE_S)
            self._orders.send(0.0, 0.0)

    def _end(self) -> int:
        """The driver stops the wheels, and has a while to repeat it; what it does not is done here."""
        self._process.send_signal(signal.SIGTERM)
        try:
            code = self._process.wait(REPEAT_S + REPLACED_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = self._process.wait()
        if code == 0 or not self._spoke:  # before its first word it has ordered nothing
            return 0
        end_s = time.monotonic() + REPEAT_S
        while time.monotonic() < end_s:
            self._orders.send(0.0, 0.0)
            time.sleep(ALIVE_S)
        self._tell(f"the driver ended with {code}; zero was ordered for {REPEAT_S:.0f} s in its place")
        return 1
