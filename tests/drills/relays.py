"""What the drills hold between the robot's parts: the network and the base's serial line, each with a hand on it."""

import asyncio
import contextlib
import os
import random
import socket
import threading
import tty
from pathlib import Path

CHUNK = 65536
LOOK_S = 0.05
LOOPBACK = "127.0.0.1"


class Network:
    """Forwards TCP from ports to others. `hold`: nothing passes, nothing is lost; `reset`: connections break, and none is taken."""

    def __init__(self, routes: dict[int, int]):
        """routes: port listened at -> port forwarded to, all of loopback."""
        self._routes, self._links = routes, set()
        self._open, self._refusing = asyncio.Event(), False
        self._servers: list[asyncio.Server] = []

    async def start(self) -> None:
        self._open.set()
        for port, target in self._routes.items():
            server = await asyncio.start_server(lambda r, w, to=target: self._join(r, w, to), LOOPBACK, port)
            self._servers.append(server)

    def hold(self) -> None:
        self._open.clear()

    def reset(self) -> None:
        self._refusing = True
        for writer in list(self._links):
            writer.transport.abort()

    def mend(self) -> None:
        self._refusing = False
        self._open.set()

    async def _join(self, reader, writer, target: int) -> None:
        if self._refusing or not self._open.is_set():
            writer.transport.abort()
            return
        try:
            there_reader, there = await asyncio.open_connection(LOOPBACK, target)
        except OSError:
            writer.transport.abort()
            return
        self._links |= {writer, there}
        try:
            await asyncio.gather(self._pass(reader, there), self._pass(there_reader, writer))
        finally:
            for end in (writer, there):
                end.transport.abort()
                self._links.discard(end)

    async def _pass(self, reader, writer) -> None:
        with contextlib.suppress(OSError):
            while data := await reader.read(CHUNK):
                await self._open.wait()
                writer.write(data)
                await writer.drain()
        writer.transport.abort()


class Line:
    """The serial line between the base (a pseudo-terminal at `far`) and its driver (one made at `near`).

    What is lost on the way up is what `lose` says, by chance; `silent`: all of it. What goes down always arrives.
    """

    def __init__(self, far: Path, near: Path, seed: int):
        self._far_path, self._random = far, random.Random(seed)
        self._near, self._held = os.openpty()
        for end in (self._near, self._held):
            tty.setraw(end)
            os.set_blocking(end, False)
        near.unlink(missing_ok=True)
        near.symlink_to(os.ttyname(self._held))
        self._far = -1
        self._share = 0.0
        self.come = self.lost = 0  # bytes from the base; of these, lost by our hand

    async def start(self) -> None:
        while not self._far_path.exists():
            await asyncio.sleep(LOOK_S)
        self._far = os.open(self._far_path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self._far)
        loop = asyncio.get_running_loop()
        loop.add_reader(self._far, self._up)
        loop.add_reader(self._near, self._down)

    def lose(self, share: float) -> None:
        """This share of the base's bytes, from now on; 1: silence."""
        self._share = share

    def _up(self) -> None:
        try:
            data = os.read(self._far, CHUNK)
        except OSError:  # the simulation has ended
            asyncio.get_running_loop().remove_reader(self._far)
            return
        kept = data if self._share == 0 else bytes(b for b in data if self._random.random() >= self._share)
        self.come += len(data)
        self.lost += len(data) - len(kept)
        with contextlib.suppress(BlockingIOError):  # nobody reads: as on a wire
            os.write(self._near, kept)

    def _down(self) -> None:
        with contextlib.suppress(OSError):
            os.write(self._far, os.read(self._near, CHUNK))

    def close(self) -> None:
        for end in (self._near, self._held, self._far):
            if end >= 0:
                os.close(end)


class Hands(threading.Thread):
    """The loop on which network and line live, in a thread; `do` calls something there."""

    def __init__(self, network: Network, line: Line):
        super().__init__(daemon=True)
        self.network, self.line, self._loop = network, line, asyncio.new_event_loop()

    def run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.create_task(self.line.start())
        self._loop.run_until_complete(self.network.start())
        self._loop.run_forever()

    def do(self, action, *arguments) -> None:
        """Returns when it is done."""
        done = threading.Event()
        self._loop.call_soon_threadsafe(lambda: (action(*arguments), done.set()))
        done.wait()

    def end(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self.join()
        self.line.close()


def free_ports(count: int) -> int:
    """The first of `count` neighbours that nobody listened at a moment ago, below those that the system hands out."""
    low = int(Path("/proc/sys/net/ipv4/ip_local_port_range").read_text().split()[0])
    while True:
        first = random.SystemRandom().randrange(low // 2, low - count)
        try:
            for number in range(count):
                socket.create_server((LOOPBACK, first + number)).close()
        except OSError:
            continue
        return first
