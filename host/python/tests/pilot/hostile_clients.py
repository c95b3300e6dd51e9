"""Clients of whisker-base that mean no good, in a process of their own; and how long honest ones wait beside them."""

import contextlib
import random
import socket
import subprocess
import sys
import time

from crunchbot.pilot.base import Base

WORDS = (
    b"drive 1",
    b"dri",
    b"mode",
    b"odometry after",
    b"health after x",
    b"drive nan nan",
    b"drive 1e999 0",
    b"stop\0",
)


def connect(path: str) -> socket.socket | None:
    """None: the queue of connections is full."""
    made = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    made.setblocking(False)
    with contextlib.suppress(OSError):
        made.connect(path)
        return made
    made.close()
    return None


class Idle:
    """Comes, says nothing, and comes again when it has been sent away."""

    def __init__(self, path: str, draw: random.Random):
        self.path, self.draw, self.socket = path, draw, None

    def act(self) -> None:
        if self.socket is None:
            self.socket = connect(self.path)
            return
        try:
            self.speak()
            if not self.socket.recv(4096):
                self.leave()
        except BlockingIOError:
            pass
        except OSError:
            self.leave()

    def leave(self) -> None:
        self.socket.close()
        self.socket = None

    def speak(self) -> None:
        pass


class Garbage(Idle):
    """Random bytes, of any length."""

    def speak(self) -> None:
        self.socket.send(self.draw.randbytes(self.draw.randrange(1, 600)))


class Half(Idle):
    """Messages that are not whole, or have no sense."""

    def speak(self) -> None:
        self.socket.send(self.draw.choice(WORDS))


class Fleeting(Idle):
    """Comes and goes."""

    def speak(self) -> None:
        self.leave()
        self.socket = connect(self.path)


def attack(path: str, count: int, seed: int) -> None:
    """Until it is killed."""
    draw = random.Random(seed)
    kinds = (Idle, Garbage, Half, Fleeting)
    clients = [kinds[i % len(kinds)](path, draw) for i in range(count)]
    while True:
        for client in clients:
            with contextlib.suppress(AttributeError):  # it has left
                client.act()


@contextlib.contextmanager
def attacked(path: str, count: int, seed: int):
    """While `count` hostile clients, in a process of their own, do what they can."""
    words = [sys.executable, __file__, path, str(count), str(seed)]
    with subprocess.Popen(words) as process:
        try:
            yield
        finally:
            process.kill()


def timed(ask) -> float:
    begun = time.monotonic()
    ask()
    return time.monotonic() - begun


def visit(path: str) -> None:
    """A client that comes for one question."""
    with Base(path) as base:
        base.health()


def serve_honest(path: str, go_on) -> tuple[list[float], list[float]]:
    """Seconds that the commander waited for each answer, and each visitor for its own, while go_on()."""
    orders, visits = [], []
    with Base(path) as commander:
        while go_on():
            orders.append(timed(lambda: commander.drive(0.1, 0)))
            visits.append(timed(lambda: visit(path)))
    return orders, visits


if __name__ == "__main__":
    attack(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
