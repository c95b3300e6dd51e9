"""A base for tests: the far end of whisker-base's serial line, scripted, and the daemon on it."""

import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import termios
import threading
import tty
from pathlib import Path

from crunchbot.pilot.base import Base
from crunchbot.programs import program

START, SAFE, FULL, DRIVE, STREAM, PAUSE = 128, 131, 132, 145, 148, 150
PASSIVE_MODE, SAFE_MODE, FULL_MODE = 1, 2, 3
MODES = {START: PASSIVE_MODE, SAFE: SAFE_MODE, FULL: FULL_MODE}
STOP = bytes([DRIVE, 0, 0, 0, 0])
FIRM_STOP = bytes(32) + STOP  # of a guard, or of a driver that starts
SIZES = {7: 1, 9: 1, 10: 1, 11: 1, 12: 1, 19: 2, 20: 2, 22: 2, 25: 2, 26: 2, 34: 1, 35: 1, 41: 2, 42: 2, 43: 2, 44: 2}
HEALTHY = {22: 14500, 25: 2500, 26: 2700, 35: SAFE_MODE}


def drive_order(left_mm_s: int, right_mm_s: int) -> bytes:
    return bytes([DRIVE]) + b"".join(speed.to_bytes(2, "big", signed=True) for speed in (right_mm_s, left_mm_s))


class Peer:
    """A pseudo terminal whose slave is linked at `link`; keeps what the driver has written, and says what it was asked for.

    A driver that has waited for too long asks anew, by way of passive: from then on frames are those, in the mode that was
    ordered last. Before that tests say in which mode it is.
    """

    PERIOD_S = 0.015

    def __init__(self, link: Path):
        self.link = link
        self.asked: list[int] = []  # packets of the stream
        self._lock, self._silent, self._teller = threading.RLock(), threading.Event(), None
        self._open()

    def _open(self) -> None:
        self.heard = b""
        self.reported = 0  # bytes written to the driver
        self._orders, self._requested = b"", (0, 0)  # heard and not yet read; speeds right and left
        self._requests, self._mode = 0, SAFE_MODE
        self.master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        self.link.symlink_to(os.ttyname(self._slave))

    def vanish(self) -> None:
        """As when the cable is pulled: the driver's end is hung up and its path is gone."""
        self.fall_silent()
        self.link.unlink()
        os.close(self._slave)
        os.close(self.master)

    def come_back(self) -> None:
        self._open()

    def close(self) -> None:
        self.fall_silent()
        os.close(self._slave)
        os.close(self.master)

    def free(self) -> None:
        """Lets others open it, as a serial port does when all that had it open are killed."""
        fcntl.ioctl(self._slave, termios.TIOCNXCL)

    def keep_telling(self, **values: int) -> None:
        """Tells a frame every 15 ms from now on, until fall_silent()."""
        self.fall_silent()
        self._silent.clear()
        self._teller = threading.Thread(target=self._tell_on, kwargs=values, daemon=True)
        self._teller.start()

    def _tell_on(self, **values: int) -> None:
        while not self._silent.wait(self.PERIOD_S):
            self.tell(self.frame(**values))

    def fall_silent(self) -> None:
        self._silent.set()
        if self._teller:
            self._teller.join()

    def _listen(self, wait_s: float = 0) -> None:
        """Takes what has come; meanwhile frames go on."""
        select.select([self.master], [], [], wait_s)
        with self._lock:
            while select.select([self.master], [], [], 0)[0]:
                data = os.read(self.master, 4096)
                self.heard += data
                self._obey(data)

    def _obey(self, data: bytes) -> None:
        """Reads whole orders for what they ask of the wheels."""
        self._orders += data
        while self._orders:
            order = self._orders[0]
            length = {DRIVE: 5, PAUSE: 2, STREAM: 2 + (self._orders[1:2] or b"\0")[0]}.get(order, 1)
            if len(self._orders) < length or (order == STREAM and len(self._orders) < 2):
                return
            if order == DRIVE:
                self._requested = struct.unpack(">hh", self._orders[1:5])
            elif order == STREAM:
                self._requests += 1
                self.asked = list(self._orders[2:length])
            elif self._requests > 0:
                self._mode = MODES.get(order, self._mode)
            self._orders = self._orders[length:]

    def await_order(self, order: bytes) -> bytes:
        """Waits until the driver has written these bytes; returns what came before them and forgets up to their end."""
        while True:
            with self._lock:
                if order in self.heard:
                    before, _, self.heard = self.heard.partition(order)
                    return before
            self._listen(self.PERIOD_S)

    def await_start(self) -> bytes:
        """Waits for stop, passive and the list of packets, which it remembers."""
        before = self.await_order(bytes([START, STREAM]))
        count = self.await_bytes(1)[0]
        self.asked = list(self.await_bytes(count))
        return before

    def await_bytes(self, count: int) -> bytes:
        while len(self.heard) < count:
            self._listen(self.PERIOD_S)
        with self._lock:
            data, self.heard = self.heard[:count], self.heard[count:]
        return data

    def enter(self, mode: int = SAFE) -> None:
        """Says that it rests, waits for the mode, and says that it is in it."""
        self.tell(self.frame(p35=PASSIVE_MODE))
        self.await_order(bytes([mode]))
        self.tell(self.frame(p35=SAFE_MODE if mode == SAFE else FULL_MODE))

    def frame(self, **values: int) -> bytes:
        """A frame of what was asked for; p35=2: packet 35 is 2. The rest is a healthy base that stands."""
        self._listen()
        requested = dict(zip((41, 42), self._requested, strict=True))
        value = {**HEALTHY, 35: self._mode, **requested, **{int(name[1:]): number for name, number in values.items()}}
        data = b"".join(
            bytes([packet]) + (value.get(packet, 0) & (256 ** SIZES[packet] - 1)).to_bytes(SIZES[packet], "big")
            for packet in self.asked
        )
        body = bytes([19, len(data)]) + data
        return body + bytes([-sum(body) & 255])

    def tell(self, data: bytes) -> int:
        """Writes to the driver; returns the bytes written in all."""
        with self._lock:
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
        self.peer.free()
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

    def enter(self, mode: int = SAFE) -> None:
        """The base enters its mode, and the driver knows."""
        self.peer.enter(mode)
        with self.client() as client:
            while client.health()["mode"] != ("safe" if mode == SAFE else "full"):
                pass

    def end(self, number: int = signal.SIGTERM) -> int:
        self.process.send_signal(number)
        return self.process.wait()

    def close(self) -> None:
        if self.process.poll() is None:
            self.end()
        self.peer.close()
        if self._heart:
            self._heart.close()
