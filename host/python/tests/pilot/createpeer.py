"""A base for tests: the far end of whisker-base's serial line, scripted, and the daemon on it. Nothing here sleeps."""

import os
import pty
import signal
import subprocess
import threading
import tty
from pathlib import Path

from crunchbot.pilot.base import Base
from crunchbot.programs import program

START, SAFE, FULL, DRIVE, STREAM, PAUSE = 128, 131, 132, 145, 148, 150
PASSIVE_MODE, SAFE_MODE, FULL_MODE = 1, 2, 3
STOP = bytes([DRIVE, 0, 0, 0, 0])
FIRM_STOP = bytes(32) + STOP  # of a guard, or of a driver that starts
SIZES = {7: 1, 9: 1, 10: 1, 11: 1, 12: 1, 19: 2, 20: 2, 22: 2, 25: 2, 26: 2, 34: 1, 35: 1, 41: 2, 42: 2, 43: 2, 44: 2}
HEALTHY = {22: 14500, 25: 2500, 26: 2700, 35: SAFE_MODE}


def drive_order(left_mm_s: int, right_mm_s: int) -> bytes:
    return bytes([DRIVE]) + b"".join(speed.to_bytes(2, "big", signed=True) for speed in (right_mm_s, left_mm_s))


class Peer:
    """A pseudo terminal whose slave is linked at `link`; keeps what the driver has written."""

    def __init__(self, link: Path):
        self.link = link
        self.heard = b""
        self.asked: list[int] = []  # packets of the stream
        self.reported = 0  # bytes written to the driver
        self._open()

    def _open(self) -> None:
        self.master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        self.link.symlink_to(os.ttyname(self._slave))

    def vanish(self) -> None:
        """As when the cable is pulled: the driver's end is hung up and its path is gone."""
        self.link.unlink()
        os.close(self._slave)
        os.close(self.master)
        self.heard = b""
        self.reported = 0

    def come_back(self) -> None:
        self._open()

    def close(self) -> None:
        os.close(self._slave)
        os.close(self.master)

    def await_order(self, order: bytes) -> bytes:
        """Waits until the driver has written these bytes; returns what came before them and forgets up to their end."""
        while order not in self.heard:
            self.heard += os.read(self.master, 4096)
        before, _, self.heard = self.heard.partition(order)
        return before

    def await_start(self, mode: int = SAFE) -> bytes:
        """Waits for stop, mode and the list of packets, which it remembers."""
        before = self.await_order(bytes([START, mode, STREAM]))
        while len(self.heard) < 1 or len(self.heard) < 1 + self.heard[0]:
            self.heard += os.read(self.master, 4096)
        count = self.heard[0]
        self.asked, self.heard = list(self.heard[1 : 1 + count]), self.heard[1 + count :]
        return before

    def frame(self, **values: int) -> bytes:
        """A frame of what was asked for; p35=2: packet 35 is 2. The rest is a healthy base that stands."""
        value = {**HEALTHY, **{int(name[1:]): number for name, number in values.items()}}
        data = b"".join(
            bytes([packet]) + (value.get(packet, 0) & (256 ** SIZES[packet] - 1)).to_bytes(SIZES[packet], "big")
            for packet in self.asked
        )
        body = bytes([19, len(data)]) + data
        return body + bytes([-sum(body) & 255])

    def tell(self, data: bytes) -> int:
        """Writes to the driver; returns the bytes written in all."""
        os.write(self.master, data)
        self.reported += len(data)
        return self.reported


class Heart:
    """The heartbeat of a supervisor, from a thread: `fd` is for the process that watches it."""

    PERIOD_S = 0.05

    def __init__(self):
        self.fd, self._write = os.pipe()
        self._beating, self._ended = threading.Event(), threading.Event()
        self._beating.set()
        self._thread = threading.Thread(target=self._beat, daemon=True)
        self._thread.start()

    def _beat(self) -> None:
        while not self._ended.wait(self.PERIOD_S):
            if self._beating.is_set():
                os.write(self._write, b".")

    def hang(self) -> None:
        self._beating.clear()

    def go_on(self) -> None:
        self._beating.set()

    def end(self) -> None:
        """As a supervisor that dies: the pipe has an end."""
        self._ended.set()
        self._thread.join()
        os.close(self._write)

    def close(self) -> None:
        if not self._ended.is_set():
            self.end()
        os.close(self.fd)


class Driver:
    """whisker-base on a peer; with a heart it has a supervisor."""

    def __init__(self, folder: Path, *options: str, heart: Heart | None = None, **environment: str):
        self.peer = Peer(folder / "port")
        self.socket = folder / "base.sock"
        self.log = folder / "log"
        self._options, self._heart, self._environment = options, heart, environment
        self.start()

    def start(self) -> None:
        words = [program("whisker-base"), "--port", self.peer.link, "--socket", self.socket, *self._options]
        with self.log.open("w") as log:
            self.process = subprocess.Popen(
                [str(word) for word in words],
                stderr=log,
                env={**os.environ, **self._environment}
                | ({"WHISKER_HEARTBEAT_FD": str(self._heart.fd)} if self._heart else {}),
                pass_fds=(self._heart.fd,) if self._heart else (),
            )

    def client(self) -> Base:
        return Base(str(self.socket))

    def end(self, number: int = signal.SIGTERM) -> int:
        self.process.send_signal(number)
        return self.process.wait()

    def close(self) -> None:
        if self.process.poll() is None:
            self.end()
        self.peer.close()
        if self._heart:
            self._heart.close()
