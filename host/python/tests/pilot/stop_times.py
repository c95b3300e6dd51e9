"""How long the wheels go on when a process that they depend on is stopped or killed.

    python host/python/tests/pilot/stop_times.py --times 3 --seed 1

Emulator, whisker-base, a commander that never stops to order, and a stand-in for the supervisor: a heartbeat every
100 ms, and a new whisker-base at once when the old one has ended or has not fed its watchdog for 300 ms. A tap on the
serial line notes when the order to stop goes by. Each process and each pair is stopped (SIGSTOP) or killed (SIGKILL) at
a time drawn at random. Exit code 1: the wheels went on for longer than 0.5 s.
"""

import argparse
import contextlib
import itertools
import os
import pty
import random
import re
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tty
from pathlib import Path

from createpeer import STOP, drive_order

from crunchbot.pilot.base import Base, BaseError
from crunchbot.programs import program

STOPPED_MOST_S = 0.5
BEAT_S, HANGS_S = 0.1, 0.3
GO = drive_order(200, 200)
ORDERS = re.compile(re.escape(GO) + b"|" + re.escape(STOP))

SUPERVISOR = """
import contextlib, os, signal, socket, subprocess, sys, time
folder, words = sys.argv[1], sys.argv[2:]
manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
manager.bind(folder + "/notify")
manager.settimeout(0.02)
while True:
    read, write = os.pipe()
    environment = {**os.environ, "WHISKER_HEARTBEAT_FD": str(read), "NOTIFY_SOCKET": folder + "/notify",
                   "WATCHDOG_USEC": "300000"}
    child = subprocess.Popen(words, pass_fds=(read,), env=environment, start_new_session=True)
    os.close(read)
    open(folder + "/guard", "w").write(str(child.pid))
    fed = time.monotonic() + 1.0
    beat = 0.0
    while child.poll() is None and time.monotonic() - fed < 0.3:
        try:
            if manager.recv(256) == b"WATCHDOG=1":
                fed = time.monotonic()
        except TimeoutError:
            pass
        if time.monotonic() - beat >= 0.1:
            beat = time.monotonic()
            with contextlib.suppress(BrokenPipeError):
                os.write(write, b".")
    try:
        os.killpg(child.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    child.wait()
    os.close(write)
"""


class Tap(threading.Thread):
    """Between driver and emulator: passes all bytes on, and notes when orders of the driver go by."""

    def __init__(self, link: Path, emulator: Path):
        super().__init__(daemon=True)
        self._master, slave = pty.openpty()
        tty.setraw(slave)
        link.symlink_to(os.ttyname(slave))
        self._emulator = os.open(emulator, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._emulator)
        self._orders = b""
        self.went_s = self.stopped_s = 0.0  # when the newest order of its kind went by
        self.stops: list[float] = []  # times of the first stop after a drive
        self.start()

    def run(self) -> None:
        with contextlib.suppress(OSError):  # one of the two ends has been closed: the case is over
            while True:
                for end in select.select([self._master, self._emulator], [], [])[0]:
                    data = os.read(end, 4096)
                    os.write(self._emulator if end == self._master else self._master, data)
                    if end == self._master:
                        self._note(data)

    def _note(self, data: bytes) -> None:
        self._orders += data
        now = time.monotonic()
        for order in ORDERS.finditer(self._orders):
            if order[0] == GO:
                self.went_s = now
            elif not self.stopped_s > self.went_s:
                self.stopped_s = now
                self.stops.append(now)
        self._orders = self._orders[-(len(GO) - 1) :]

    @property
    def going(self) -> bool:
        return self.went_s > self.stopped_s


class Commander(threading.Thread):
    """Drives all the time, and comes back."""

    def __init__(self, path: Path):
        super().__init__(daemon=True)
        self._path, self.driver_pid = str(path), 0
        self.start()

    def run(self) -> None:
        while True:
            with contextlib.suppress(BaseError), Base(self._path) as base:
                self.driver_pid = int(base.health()["driver_pid"])
                while True:
                    base.drive(0.2, 0)
                    time.sleep(0.02)
            time.sleep(0.005)


class Robot:
    """All of them, until close()."""

    def __init__(self, folder: Path):
        self.stack = contextlib.ExitStack()
        self._guard = folder / "guard"
        emulator = subprocess.Popen(
            [program("whisker-create-sim"), "--link", folder / "create"], stdout=subprocess.PIPE
        )
        self.stack.callback(emulator.kill)
        emulator.stdout.readline()
        self.tap = Tap(folder / "port", folder / "create")
        words = [program("whisker-base"), "--port", folder / "port", "--socket", folder / "sock", "--wait"]
        self._supervisor = subprocess.Popen(
            [sys.executable, "-c", SUPERVISOR, folder, *words], stderr=(folder / "log").open("w")
        )
        self.stack.callback(self._end)
        self.commander = Commander(folder / "sock")

    def pid(self, name: str) -> int:
        return {
            "supervisor": lambda: self._supervisor.pid,
            "guard": lambda: int(self._guard.read_text()),
            "driver": lambda: self.commander.driver_pid,
        }[name]()

    def await_going(self, for_s: float) -> None:
        """Until it has driven for so long, in one go."""
        since = time.monotonic()
        while time.monotonic() - since < for_s:
            time.sleep(0.002)
            if not self.tap.going:
                since = time.monotonic()

    def stopped_after(self, hits: list[tuple[str, signal.Signals]]) -> float:
        """Seconds from the first hit to the order to stop; infinite: none in 3 s."""
        pids = [(self.pid(name), sign) for name, sign in hits]
        begun = time.monotonic()
        for pid, sign in pids:
            os.kill(pid, sign)
        while not self.tap.stops or self.tap.stops[-1] < begun:
            if time.monotonic() - begun > 3.0:
                return float("inf")
            time.sleep(0.001)
        return next(stop for stop in self.tap.stops if stop >= begun) - begun

    def _end(self) -> None:
        for name in ("driver", "guard", "supervisor"):
            for sign in (signal.SIGKILL, signal.SIGCONT):
                with contextlib.suppress(ProcessLookupError, ValueError, FileNotFoundError):
                    os.kill(self.pid(name), sign)
        self._supervisor.wait()


def cases() -> list[list[tuple[str, signal.Signals]]]:
    names, signs = ("supervisor", "guard", "driver"), (signal.SIGSTOP, signal.SIGKILL)
    single = [[(name, sign)] for name in names for sign in signs]
    pairs = [
        list(zip(pair, both, strict=True))
        for pair in itertools.combinations(names, 2)
        for both in itertools.product(signs, signs)
    ]
    return single + pairs


def name_of(hits: list[tuple[str, signal.Signals]]) -> str:
    return " + ".join(f"{who} {sign.name}" for who, sign in hits)


def measure(hits: list[tuple[str, signal.Signals]], draw: random.Random) -> float:
    with tempfile.TemporaryDirectory() as folder:
        robot = Robot(Path(folder))
        with robot.stack:
            robot.await_going(0.5 + 0.2 * draw.random())
            return robot.stopped_after(hits)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", metavar="TEXT", help="cases whose name has this in it")
    words = parser.parse_args()
    chosen = [hits for hits in cases() if words.only in name_of(hits)]
    late = 0
    for hits in chosen:
        times = [measure(hits, random.Random(f"{words.seed} {hits} {i}")) for i in range(words.times)]
        late += max(times) > STOPPED_MOST_S
        print(
            f"{name_of(hits):45} "
            + " ".join(f"{time_s:6.3f}" for time_s in times)
            + (" LATE" if max(times) > STOPPED_MOST_S else ""),
            flush=True,
        )
    print(f"{late} of {len(chosen)} cases late")
    return int(late > 0)


if __name__ == "__main__":
    sys.exit(main())
