"""Clients of whisker-base that mean no good, and how long honest ones wait beside them.

    python host/python/tests/pilot/hostile_clients.py --count 200 --seconds 60 --seed 1

Starts emulator and driver, COUNT hostile clients in a process of their own, and for SECONDS two honest clients: one that
drives all the time, and one that connects anew each time. Prints their waits; exit code 1: one of them was longer than
1 s, or was turned away.
"""

import argparse
import contextlib
import random
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from crunchbot.pilot.base import Base, BaseError
from crunchbot.programs import program

WAIT_MOST_S = 1.0
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
    words = [sys.executable, __file__, "--attack", path, "--count", str(count), "--seed", str(seed)]
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


def describe(name: str, waits: list[float]) -> str:
    waits = sorted(waits)
    middle, late = waits[len(waits) // 2], waits[len(waits) * 99 // 100]
    return f"{name}: {len(waits)}, median {middle * 1e3:.2f} ms, 99 % {late * 1e3:.1f} ms, longest {waits[-1] * 1e3:.0f} ms"


def measure(count: int, seconds: float, seed: int) -> int:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        link, path, log = folder / "port", folder / "sock", folder / "log"
        with contextlib.ExitStack() as stack:
            emulator = stack.enter_context(subprocess.Popen([program("whisker-create-sim"), "--link", link], stdout=-1))
            stack.callback(emulator.terminate)
            emulator.stdout.readline()
            driver = stack.enter_context(
                subprocess.Popen(
                    [program("whisker-base"), "--port", link, "--socket", path],
                    stderr=stack.enter_context(log.open("w")),
                )
            )
            stack.callback(driver.terminate)
            while not path.exists():
                time.sleep(0.01)
            end = time.monotonic() + seconds
            try:
                with attacked(str(path), count, seed):
                    orders, visits = serve_honest(str(path), lambda: time.monotonic() < end)
            except BaseError as error:
                print(f"turned away: {error}")
                return 1
        print(describe("orders", orders), describe("visits", visits), f"log: {log.stat().st_size} bytes", sep="\n")
        return int(max(orders + visits) > WAIT_MOST_S)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--attack", metavar="SOCKET", help="be the hostile clients of a whisker-base that runs")
    words = parser.parse_args()
    if words.attack:
        attack(words.attack, words.count, words.seed)
    return measure(words.count, words.seconds, words.seed)


if __name__ == "__main__":
    sys.exit(main())
