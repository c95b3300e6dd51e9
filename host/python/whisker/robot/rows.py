"""Observation rows on their way: from cells to messages at the pilot, and from whatever came to filter steps at the desktop."""

import math
from dataclasses import dataclass

import numpy as np

from ..observations import ODOMETRY, cell
from ..pilot import compose
from .link import Link, Received
from .messages import BASE_FRAME, EMPTY, NOT_READ, RELEASE, VALUE, Header, Observation

ROW_NS = 10**8  # the paper's 0.1 s


def between(start, end) -> np.ndarray:
    """The motion that leads from one summed pose to another: compose(start, between(start, end)) is end."""
    c, s = math.cos(start[2]), math.sin(start[2])
    dx, dy = end[0] - start[0], end[1] - start[1]
    return np.array([c * dx + s * dy, -s * dx + c * dy, end[2] - start[2]])


class RowPublisher:
    """The pilot's stream of rows. What it sends has the digits of observations.csv: the file replayed is the same run."""

    def __init__(self, link: Link):
        self._stream = link.publish("observation")
        self.pose = np.zeros(3)  # sum of the motion sent
        self.sent = 0
        self._last_ns = 0

    def send(self, row: dict[str, float | None], kind: int) -> Observation:
        """Send a row as Pilot.odometry gives it; returns what was sent."""
        message = to_message(row, kind, self.sent, self.pose)
        self._stream.send(message)
        self.pose, self._last_ns = message.pose, message.header.stamp.ns
        self.sent += 1
        return message

    def end(self, reason: str = "") -> None:
        """No more rows."""
        self._stream.end(self._last_ns, reason)


def to_message(row: dict[str, float | None], kind: int, seq: int, pose) -> Observation:
    """The Observation of a row; `pose`: summed motion of those before."""
    motion = np.array([float(cell(row[name])) for name in ODOMETRY])
    named = {name: value for name, value in row.items() if name != "t_s" and name not in ODOMETRY}
    kinds = [EMPTY if v is None else NOT_READ if math.isnan(v) else VALUE for v in named.values()]
    values = [float(cell(v)) if k == VALUE else 0.0 for v, k in zip(named.values(), kinds, strict=True)]
    header = Header.at(round(row["t_s"] * 1e9), BASE_FRAME)
    return Observation(header, seq, kind, motion, compose(pose, motion), list(named), np.array(kinds), values)


def to_row(message: Observation, motion=None, t_ns: int | None = None) -> dict[str, float | None]:
    """Cells as Pilot.odometry gave them; `motion` and `t_ns` in place of the message's own."""
    stamp = message.header.stamp.ns if t_ns is None else t_ns
    row = {"t_s": round(stamp / 1e9, 9)}
    row |= zip(ODOMETRY, map(float, message.motion if motion is None else motion), strict=True)
    cells = (None if k == EMPTY else math.nan if k == NOT_READ else float(v) for k, v in _pairs(message))
    return row | dict(zip(message.names, cells, strict=True))


def _pairs(message: Observation):
    return zip(message.cells, message.values, strict=True)


def time_text(row: dict[str, float | None]) -> str:
    """A row's time as the files tell it."""
    return f"{row['t_s']:.10g}"


@dataclass(frozen=True)
class Step:
    """What a filter takes: a row, and the motion since the row of the step before."""

    row: Observation
    motion: np.ndarray
    t_ns: int  # the row's stamp, but never going back when the bridge's clock begins anew
    rows: int  # whose motion it is: 1, or more when some were skipped or missed

    def cells(self) -> dict[str, float | None]:
        return to_row(self.row, self.motion, self.t_ns)


class Follower:
    """Turns what came since the last look into steps, so that no motion is lost whatever was skipped or missed.

    every_row: a step for each row. Else: one for the newest, as in the paper, and one for each row before it that
    tells a whisk's distance, for those are few and precious. A pilot that began anew tells motion from its own start
    only: what the robot moved in between is not known.
    """

    def __init__(self, every_row: bool):
        self._every_row = every_row
        self._stream: int | None = None
        self._first: Observation | None = None
        self._last: Observation | None = None
        self._last_ns: int | None = None
        self._ahead_ns = 0
        self.weighed = self.skipped = self.missed = self.restarts = 0  # rows, but for restarts: pilots after the first

    @property
    def first_seq(self) -> int:
        """Of the first row that came; 0 while none has."""
        return self._first.seq if self._first else 0

    def take(self, received: list[Received]) -> list[Step]:
        """Steps in order; ends among what was received are passed over."""
        rows = [r for r in received if not r.over]
        if rows and self._first is None:
            self._first, self._stream = rows[0].message, rows[0].envelope.stream
        chosen = [r for n, r in enumerate(rows) if self._every_row or _is_kept(rows, n)]
        steps = [self._step(r) for r in chosen]
        self.weighed += len(steps)
        self.skipped += len(rows) - len(chosen)
        self.missed += sum(step.rows for step in steps) - len(rows)
        return steps

    def _step(self, received: Received) -> Step:
        row, last = received.message, self._last
        if received.envelope.stream != self._stream:
            self.restarts += 1
            motion, rows = row.pose, row.seq + 1
        elif last is None:
            rows = row.seq - self._first.seq + 1
            motion = compose(self._first.motion, between(self._first.pose, row.pose)) if rows > 1 else row.motion
        else:
            rows = row.seq - last.seq
            motion = row.motion if rows == 1 else between(last.pose, row.pose)
        self._stream, self._last = received.envelope.stream, row
        return Step(row, np.asarray(motion), self._time(row.header.stamp.ns), rows)

    def _time(self, stamp_ns: int) -> int:
        if self._last_ns is not None and stamp_ns + self._ahead_ns <= self._last_ns:
            self._ahead_ns = self._last_ns + ROW_NS - stamp_ns
        self._last_ns = stamp_ns + self._ahead_ns
        return self._last_ns


def _is_kept(rows: list[Received], n: int) -> bool:
    """The newest, the last of a stream that another follows, and those with a measured distance."""
    last_of_stream = n == len(rows) - 1 or rows[n + 1].envelope.stream != rows[n].envelope.stream
    return last_of_stream or rows[n].message.kind == RELEASE
