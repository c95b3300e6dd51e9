"""The paper's server: a Pyro object that the netbook writes to every 0.1 s and that clients read. It speaks zenoh inside.

import Pyro5.api
results = Pyro5.api.Proxy("PYRO:whisker.results@127.0.0.1:7450")
seen = results.observation()
...
seen = results.observation(seen["number"])     # seen["motion"]: everything since, however much was left unread
"""

import math
import threading
from collections import deque
from collections.abc import Iterable
from typing import Any

import numpy as np
import Pyro5.api

from ..errors import UserError
from ..observation import ODOMETRY, Row
from ..pilot.pilot import compose
from .network.health import ENDED, RUNNING, Health
from .network.inbox import Received
from .network.link import Link
from .network.messages import (
    HEALTH,
    Header,
    Localisation,
    Observation,
    PoseWithCovariance,
    ProcessHealth,
    decode,
    encode,
)
from .network.messages import Odometry as OdometryMessage
from .network.ranges import RANGES
from .network.ros import BASE_FRAME, ODOMETRY_FRAME
from .network.row_checks import RowChecks
from .network.rows import Follower, RowPublisher, between, to_message
from .network.streams import Envelope
from .pyro_daemon import Daemon, configure

OBJECT, PORT = "whisker.results", 7450
HISTORY_ROWS = 18_000  # 30 minutes: how far back `observation(since)` reaches
LOOK_S = 0.5
TIME = RANGES["builtin_interfaces/msg/Time:sec"]
NAMES_MOST = 64  # of filters, and of processes
TOPICS = ("observation", "odometry", "localisation")


class ServerError(UserError):
    """A server that cannot start; one line."""

    exit_code = 1


class Results:
    """What clients see. Answers are plain dicts, lists and numbers; None until there is something to report."""

    def __init__(self, link: Link, may_write: bool):
        self._link, self._may_write = link, may_write
        self._lock = threading.Lock()
        self._follower, self._number, self._total = Follower(), 0, np.zeros(3)
        self._history: deque[tuple[int, np.ndarray]] = deque([(0, self._total)], maxlen=HISTORY_ROWS)
        self._row: Row | None = None
        self._odometry: OdometryMessage | None = None
        self._answers: dict[str, Localisation] = {}
        self._health: dict[str, ProcessHealth] = {}
        self._rows: RowPublisher | None = None
        self._written = RowChecks()
        self._odometries = None

    @Pyro5.api.expose
    def observation(self, since: int | None = None) -> dict | None:
        """The newest row: its cells by the names of observations.csv, `number` (rows reported so far) and `motion`.

        motion: [x m, y m, theta rad] since row number `since` (None: since the row before); None when that is further
        back than 30 minutes or not yet reported.
        """
        with self._lock:
            if self._row is None:
                return None
            since = self._number - 1 if since is None else since
            start = next((pose for number, pose in reversed(self._history) if number == since), None)
            motion = None if start is None else between(start, self._total).tolist()
            return {**self._row} | {"number": self._number, "motion": motion}

    @Pyro5.api.expose
    def odometry(self) -> dict | None:
        """`absolute`: [x, y, theta] since the robot's start; `differential`: motion of the newest row; `t_s`."""
        with self._lock:
            if self._odometry is None:
                return None
            absolute = list(self._odometry.pose.pose.xytheta)
            newest = [self._row[name] for name in ODOMETRY] if self._row else None
            return {"t_s": _seconds(self._odometry), "absolute": absolute, "differential": newest}

    @Pyro5.api.expose
    def pose(self, filter: str | None = None) -> dict | None:
        """What a filter (None: the first that answered) says: t_s, filter, pose, covariance, confidence, row counts."""
        with self._lock:
            answer = self._answers.get(filter) if filter else next(iter(self._answers.values()), None)
        if answer is None:
            return None
        counts = {name: getattr(answer, name) for name in ("observation_seq", "rows_skipped", "rows_missed", "prior")}
        covariance = answer.pose.planar_covariance.tolist()
        reported = {"t_s": _seconds(answer), "filter": answer.filter, "confidence": answer.confidence}
        return reported | {"pose": list(answer.pose.pose.xytheta), "covariance": covariance} | counts

    @Pyro5.api.expose
    def health(self) -> dict[str, dict]:
        """State, counters and last error of every process that has published any."""
        with self._lock:
            reported = self._health.items()
            return {name: {"state": h.state, "last_error": h.last_error} | h.counts for name, h in reported}

    @Pyro5.api.expose
    def write(self, row: dict) -> int:
        """The netbook's part: publish a row (cells of observations.csv, `t_s` and motion included); returns its number.

        PermissionError unless the server was started to be written to; ValueError when a cell is no number, or when the
        row cannot be: the same limits hold as for rows of a pilot.
        """
        if not self._may_write:
            raise PermissionError("this server is read-only; start it with --write, and no pilot beside it")
        if not isinstance(row, dict):
            raise ValueError("row: not cells by name; give a dict")
        checked = {str(name): _number(name, value) for name, value in row.items()}
        for name in ("t_s", *ODOMETRY):
            if checked.get(name) is None or math.isnan(checked[name]):
                raise ValueError(f"{name}: missing or no number; give every row its time and motion")
        if not 0.0 <= checked["t_s"] <= TIME.high:
            raise ValueError(
                f"t_s: {checked['t_s']:.6g} is not within 0 and {TIME.high:.6g}; give seconds since the start"
            )
        with self._lock:
            return self._publish(Row.of(checked))

    def take(self, received: Iterable[Any]) -> None:
        """What came on TOPICS and health."""
        with self._lock:
            for step in self._follower.take([r for r in received if r.topic == "observation"]):
                self._number += step.rows
                self._total = compose(self._total, step.motion)
                self._history.append((self._number, self._total))
                self._row = step.last()
            for message in (r.message for r in received if not r.over):
                self._note(message)

    def _note(self, message) -> None:
        if isinstance(message, OdometryMessage):
            self._odometry = message
        elif isinstance(message, Localisation):
            _keep(self._answers, message.filter, message)
        elif isinstance(message, ProcessHealth):
            _keep(self._health, message.process, message)

    def counters(self) -> dict[str, object]:
        """What has been counted so far."""
        follower = self._follower
        return {"rows": follower.weighed, "missed": follower.missed, "restarts": follower.restarts}

    def _publish(self, row: Row) -> int:
        if self._rows is None:
            self._rows, self._odometries = RowPublisher(self._link), self._link.publish("odometry")
        self._judge(to_message(row, self._rows.sent, self._rows.pose))
        message: Observation = self._rows.send(row)
        header = Header(message.header.stamp, ODOMETRY_FRAME)
        pose = PoseWithCovariance.planar(message.pose, np.zeros((3, 3)))
        self._odometries.send(OdometryMessage(header, BASE_FRAME, pose))
        return message.seq

    def _judge(self, row: Observation) -> None:
        """Judges a row as a receiver would, before it is sent. ValueError, which Pyro can hand to the client."""
        one = Received("observation", row, Envelope(0, row.seq, 0))
        try:
            decode(Observation, encode(row), "row")
        except ValueError as error:
            raise ValueError(str(error)) from None
        if fault := self._written(one):
            raise ValueError(f"row: {fault}")

    def end(self) -> None:
        """Ends the streams that were written here: their readers then know that no more comes."""
        if self._rows:
            self._rows.end("server stopped")


def _number(name, value) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"{name!s:.40}: {value!r:.40} is no number; give a number, nan or None")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{name!s:.40}: a number of {value.bit_length()} bits; give one of 64") from None


def _keep(newest: dict, name: str, message) -> None:
    """In place of what was kept by this name; of more names than a robot has, nothing."""
    if name in newest or len(newest) < NAMES_MOST:
        newest[name] = message


def _seconds(message) -> float:
    return message.header.stamp.ns / 1e9


class Server:
    """Serves a robot's results until stopped; `uri` is what clients connect to."""

    def __init__(self, link: Link, host: str, port: int, may_write: bool = False):
        """ServerError when the port is taken."""
        configure(LOOK_S)
        self._link, self._results = link, Results(link, may_write)
        self._inbox = link.subscribe(*TOPICS, f"{HEALTH}/*", judge=RowChecks())
        try:
            self._daemon = Daemon(host, port)
        except OSError as error:
            text = f"{host}:{port}: cannot be listened on ({error.strerror}); choose another --port or --host"
            raise ServerError(text) from None
        self.uri = str(self._daemon.register(self._results, OBJECT))
        self._health = Health(link, self._counters)
        self._error: Exception | None = None

    def _counters(self) -> dict[str, object]:
        return self._results.counters() | {"refused": self._inbox.refused}

    def run(self, stop: threading.Event) -> None:
        """Serves until `stop` is set."""
        self._link.announce()
        listener = threading.Thread(target=self._listen, args=[stop])
        listener.start()
        try:
            self._daemon.requestLoop(lambda: not stop.is_set())
        finally:
            stop.set()
            listener.join()
            self._daemon.close()
            self._results.end()
        if self._error:
            raise self._error

    def _listen(self, stop: threading.Event) -> None:
        """A fault of this thread is one of the server, which would report old results for ever without it."""
        try:
            while not stop.is_set():
                self._results.take(self._inbox.take(LOOK_S))
                self._health.report(0, RUNNING, self._inbox.last_error)
            self._health.report(0, ENDED, self._inbox.last_error)
        except Exception as error:  # noqa: BLE001 - `run` raises it
            self._error = error
            stop.set()
