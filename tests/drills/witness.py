"""What is seen of the robot from outside: the simulation's truth, frames in the ring, messages on the network, files, the page.

Times are of the monotonic clock. Each thread below appends to lists of its own; nobody takes anything away.
"""

import http.client
import math
import socket
import threading
import time
from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Callable

import numpy as np

from crunchbot.bridge.ring import Reader, RingError
from crunchbot.robot.network.link import Link
from whisker_protocol import CODES, STATUS_CODE_SHIFT

from .machine import Machine

TICKS_PER_S = 2000
LOOK_S = 0.05
ASK_S = 0.5
TIMEOUT_S = 2.0
ALIVE_S = 3.0  # a process whose last word is older does not answer
NEAR_M = 0.25
KEPT_S = 3.0  # so long an estimate must stay near to count as found again
ABSENT = CODES["absent"]


class Round:
    """What the threads share: `stop` ends them, `news` is notified after each look."""

    def __init__(self):
        self.stop, self.news = threading.Event(), threading.Condition()


class Watch(threading.Thread):
    """Calls `look` until the end."""

    def __init__(self, shared: Round):
        super().__init__(daemon=True)
        self.stop, self._news = shared.stop, shared.news

    def run(self) -> None:
        while not self.stop.is_set():
            self.look()
            with self._news:
                self._news.notify_all()


class Truth(Watch):
    """True poses: `times` and `poses` (x, y, theta), `ticks` of the world."""

    def __init__(self, path, shared: Round):
        super().__init__(shared)
        self._path, self._socket = path, None
        self.times, self.poses, self.ticks = [], [], []

    def look(self) -> None:
        if self._socket is None:
            self._connect()
            return
        try:
            words = self._socket.recv(256).decode().split()
        except TimeoutError:
            return
        if not words or words[0] == "end":
            self.stop.wait(ASK_S)
        elif words[0] == "truth":
            self.poses.append(tuple(map(float, words[2:5])))
            self.ticks.append(int(words[1]) + 1)
            self.times.append(time.monotonic())

    def _connect(self) -> None:
        made = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        if made.connect_ex(str(self._path)) == 0:
            made.settimeout(ASK_S)
            made.send(b"watch")
            self._socket = made
        else:
            made.close()
            self.stop.wait(LOOK_S)

    @property
    def tick(self) -> int:
        return self.ticks[-1] if self.ticks else 0

    def moved_m(self, seconds: float) -> float:
        """Path of the last so many seconds, turns counted with the body's radius."""
        count = min(len(self.times), max(2, round(seconds * 10) + 1))
        if count < 2:
            return 0.0
        x, y, theta = np.array(self.poses[-count:]).T
        return float(np.hypot(np.diff(x), np.diff(y)).sum() + 0.165 * np.abs(np.diff(np.unwrap(theta))).sum())

    def simulated_s(self, begun: float, ended: float) -> float:
        """Simulated seconds between two times: on a machine too slow fewer than seconds."""
        first, last = (self.ticks[max(0, bisect_right(self.times, when) - 1)] for when in (begun, ended))
        return (last - first) / TICKS_PER_S

    def at(self, when: float) -> tuple[float, float] | None:
        """True place at a time."""
        n = bisect_right(self.times, when) - 1
        return None if n < 0 else self.poses[n][:2]


class Frames(Watch):
    """Frames that a reader of the ring gets: how many, and how many records of each lane were marked bad."""

    def __init__(self, ring: str, lanes: int, shared: Round):
        super().__init__(shared)
        self._ring, self._lanes, self._reader = ring, lanes, None
        self.count, self.times, self.bad, self.overruns = 0, [], np.zeros(lanes, int), 0

    def look(self) -> None:
        try:
            if self._reader is None:
                self._reader = Reader(self._ring, ASK_S)
            frames = self._reader.take(ASK_S)
        except RingError as error:
            self.overruns += error.name == "OVERRUN"
            self._let_go(error.name != "TIMEOUT")
            return
        if frames is None:
            self._let_go(True)
        elif len(frames):
            self.count += len(frames)
            self.bad += (frames["lane"]["status"][:, : self._lanes] >> STATUS_CODE_SHIFT != 0).sum(axis=0)
            self.times.append(time.monotonic())
            self.stop.wait(LOOK_S)

    def _let_go(self, gone: bool) -> None:
        if gone and self._reader:
            self._reader.close()
            self._reader = None
        self.stop.wait(LOOK_S)


class Messages(Watch):
    """Rows and answers as pilot and navigator send them, past the relays; their health as they report it."""

    def __init__(self, link: Link, truth: Truth, shared: Round):
        super().__init__(shared)
        self._inbox, self._truth = link.subscribe("observation", "localisation", "health/*"), truth
        self.rows, self.answers, self.health = [], [], {}  # (time, received), (time, received, error in m)
        self.reported = Counter()  # messages of health, by process

    def look(self) -> None:
        for received in self._inbox.take(ASK_S):
            now = time.monotonic()
            if received.over:
                continue
            if received.topic == "observation":
                self.rows.append((now, received))
            elif received.topic == "localisation":
                self.answers.append((now, received, self._error(received.message, now)))
            else:
                self.health[received.message.process] = (now, received.message)
                self.reported[received.message.process] += 1

    def _error(self, answer, now: float) -> float:
        x, y = self._truth.at(now) or (math.inf, math.inf)
        at = answer.pose.pose.xytheta
        return math.hypot(at[0] - x, at[1] - y)


class Page(Watch):
    """Times at which the view answered a browser."""

    def __init__(self, port: int, shared: Round):
        super().__init__(shared)
        self._port, self.times = port, []

    def look(self) -> None:
        connection = http.client.HTTPConnection("127.0.0.1", self._port, timeout=TIMEOUT_S)
        try:
            connection.request("GET", "/")
            if connection.getresponse().status == 200:
                self.times.append(time.monotonic())
        except OSError:
            pass
        finally:
            connection.close()
        self.stop.wait(ASK_S)


class Files(Watch):
    """Times since which a bag was seen to grow, and whisker-base to take frames."""

    def __init__(self, machine: Machine, shared: Round):
        super().__init__(shared)
        self._machine = machine
        self._bytes = self._frames = -1
        self._looked = 0.0
        self.bag_times, self.base_times = [], []

    def look(self) -> None:
        size = sum(path.stat().st_size for path in self._machine.bags.iterdir())
        frames = int(self._machine.base_health().get("frames", -1))
        if size > self._bytes >= 0:
            self.bag_times.append(self._looked)
        if frames >= 0 and frames != self._frames:
            self.base_times.append(self._looked)
        self._bytes, self._frames, self._looked = size, frames, time.monotonic()
        self.stop.wait(ASK_S)


class Witness:
    """All of these together."""

    def __init__(self, machine: Machine, link: Link, lanes: int):
        self._round = Round()
        self.truth = Truth(machine.simulation, self._round)
        self.frames = Frames(machine.ring, lanes, self._round)
        self.messages = Messages(link, self.truth, self._round)
        self.page, self.files = Page(machine.view_port, self._round), Files(machine, self._round)
        self._all = [self.truth, self.frames, self.messages, self.page, self.files]
        for watch in self._all:
            watch.start()

    def end(self) -> None:
        self._round.stop.set()
        for watch in self._all:
            watch.join()

    def await_true(self, wanted: Callable[[], bool], patience_s: float) -> bool:
        """Until it is so, looked at again when there is news; False: it did not come to be."""
        until = time.monotonic() + patience_s
        while not wanted():
            left = until - time.monotonic()
            if left <= 0.0:
                return False
            with self._round.news:
                self._round.news.wait(left)
        return True

    def heard(self) -> dict[str, list]:
        """By process: the times at which it was seen to do its work."""
        messages = self.messages
        return {
            "whiskerd": self.frames.times,
            "base": self.files.base_times,
            "pilot": [entry[0] for entry in messages.rows],
            "navigator": [entry[0] for entry in messages.answers],
            "bag": self.files.bag_times,
            "view": self.page.times,
        }

    def silent(self, since: float = -math.inf) -> list[str]:
        """Processes that do not answer now, or have not since then."""
        now = time.monotonic()
        return [name for name, times in self.heard().items() if not times or times[-1] < max(since, now - ALIVE_S)]

    def found_again(self, since: float) -> float | None:
        """When the estimate had come near for KEPT_S, counted from then; None: not yet. `since` itself: it never left."""
        begun = since
        last = since
        answers = self.messages.answers
        for when, _, error in answers[bisect_left(answers, since, key=lambda entry: entry[0]) :]:
            if error > NEAR_M or when - last > 1.0:
                begun = when if error <= NEAR_M else math.inf
            elif math.isinf(begun):
                begun = when
            last = when
        return begun if last - begun >= KEPT_S else None
