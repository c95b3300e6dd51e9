"""Observation rows on their way: from cells to messages at the pilot, and from whatever came to filter steps at the desktop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ...observation import CARRIED, NOT_READ, RELEASE, Row, cell
from ...pilot.pilot import compose
from .inbox import Received
from .messages import Header, Observation
from .ros import BASE_FRAME
from .streams import Envelope

if TYPE_CHECKING:
    from .link import Link  # needs the network, which who reads a bag does without

ROW_NS = 10**8  # the paper's 0.1 s
# A filter takes up to 1 m and half a turn in one row (host/nav/measurement/intake.c); longer motions come in such pieces.
MOST_M, MOST_RAD = 0.5, math.pi / 2.0
PIECE_NS = 10**6  # between two pieces of a motion of which nobody knows how long it took
# A minute of rows, some 40 ms of a filter's time; before a longer gap's last minute a filter assumes the worst. It refuses
# pieces that are too long, of a motion of more than 600 m, and takes them for motion that is lost.
PIECES_MOST = 600
LEAP_NS = 24 * 3600 * 10**9  # a clock that goes on by more than a day has begun anew, like one that goes back


def between(start: Sequence[float], end: Sequence[float]) -> np.ndarray:
    """The motion that leads from one summed pose to another: compose(start, between(start, end)) is end."""
    c, s = math.cos(start[2]), math.sin(start[2])
    dx, dy = end[0] - start[0], end[1] - start[1]
    return np.array([c * dx + s * dy, -s * dx + c * dy, end[2] - start[2]])


def leaps(before_ns: int, stamp_ns: int) -> bool:
    """Whether a clock that read `before_ns` has begun anew to read `stamp_ns`."""
    return not 0 < stamp_ns - before_ns <= LEAP_NS


class RowPublisher:
    """The pilot's stream of rows. What it sends has the digits of observations.csv: the file replayed is the same run."""

    def __init__(self, link: Link):
        self._stream = link.publish("observation")
        self.pose = np.zeros(3)  # sum of the motion sent
        self.sent = 0
        self._last_ns = 0

    def send(self, row: Row) -> Observation:
        """Send a row; returns what was sent."""
        message = to_message(row, self.sent, self.pose)
        self._stream.send(message)
        self.pose, self._last_ns = message.pose, message.header.stamp.ns
        self.sent += 1
        return message

    def end(self, reason: str = "") -> None:
        """No more rows."""
        self._stream.end(self._last_ns, reason)


def to_message(row: Row, seq: int, pose: Sequence[float]) -> Observation:
    """The Observation of a row; `pose`: summed motion of those before."""
    carried = np.isinf(row.motion).any()
    motion = np.zeros(3) if carried else np.array([float(cell(value)) for value in row.motion])
    values = [float(cell(value)) for value in row.numbers]
    header = Header.at(round(row.t_s * 1e9), BASE_FRAME)
    kind = CARRIED if carried else row.kind
    return Observation(header, seq, kind, motion, compose(pose, motion), list(row.names), row.cells, values)


def to_row(message: Observation, motion: ArrayLike | None = None, t_ns: int | None = None) -> Row:
    """The row as it was sent; `motion` and `t_ns` in place of the message's own."""
    stamp = message.header.stamp.ns if t_ns is None else t_ns
    motion = message.motion if motion is None else motion
    cells, numbers = np.asarray(message.cells), np.asarray(message.values)
    return Row(message.kind, round(stamp / 1e9, 9), np.asarray(motion), tuple(message.names), cells, numbers)


@dataclass(frozen=True)
class Step:
    """What a filter takes: a row, and the motion since the row of the step before."""

    row: Observation
    motion: np.ndarray
    t_ns: int  # the row's stamp, but never going back when the bridge's clock begins anew
    rows: int  # whose motion it is: 1, or more when some were skipped or missed
    envelope: Envelope  # the row's
    within_ns: int = 0  # the time in which the motion was; 0: not all of what was moved since the last step is reported

    def last(self) -> Row:
        """The row itself, with what `lead` leaves of the motion."""
        carried = self.row.kind == CARRIED
        return to_row(self.row, [math.inf] * 3 if carried else self._piece(self._count), self.t_ns)

    def lead(self) -> list[Row]:
        """Rows to be taken before, nothing read in them: the motion of many rows, in as many.

        In one, a filter would refuse it, or take the time between for rows whose motion is lost, and assume some more.
        """
        count = self._count
        if count == 1:
            return []
        apart_ns = min(self.within_ns // count, ROW_NS) or PIECE_NS
        last, read = self.last(), np.full(len(self.row.names), NOT_READ, np.uint8)
        times = (round((self.t_ns - (count - n) * apart_ns) / 1e9, 9) for n in range(1, count))
        return [replace(last, t_s=t_s, motion=self._piece(n), cells=read) for n, t_s in enumerate(times, 1)]

    @cached_property
    def _count(self) -> int:
        """How many pieces: one a row, and none that a filter refuses as long as there are not too many."""
        x, y, turn = self._way
        fitting = max(math.ceil(math.hypot(x, y) / MOST_M), math.ceil(abs(turn) / MOST_RAD))
        return max(1, min(max(round(self.within_ns / ROW_NS), fitting), PIECES_MOST))

    @cached_property
    def _way(self) -> np.ndarray:
        """The motion; of more turns than a minute's rows can have, only what is left beside whole ones."""
        x, y, turn = self.motion
        return self.motion if abs(turn) <= PIECES_MOST * MOST_RAD else np.array([x, y, math.remainder(turn, math.tau)])

    def _piece(self, n: int) -> np.ndarray:
        """The n-th, from 1, of a way straight to where the motion ends, turning evenly."""
        count, way = self._count, self._way
        return way if count == 1 else between((n - 1) / count * way, n / count * way)


@dataclass(frozen=True)
class Place:
    """A row that another process had taken last."""

    stream: int
    seq: int
    pose: np.ndarray


class Follower:
    """Turns what came since the last look into steps, so that no motion is lost whatever was skipped or missed.

    A step for each of the newest rows, as many as there is time for (the paper: one), and one for each row before them
    that carries a whisk's distance, or says that the robot was carried, because those are few. A pilot that began anew reports motion from its own
    start only: what the robot moved in between is not known.
    """

    def __init__(self):
        self._stream: int | None = None
        self._first: Observation | None = None
        self._last: Observation | Place | None = None
        self._last_ns: int | None = None
        self._ahead_ns = 0
        self.weighed = self.skipped = self.missed = self.restarts = 0  # rows, but for restarts: pilots after the first

    @property
    def first_seq(self) -> int:
        """The number of the first row that came; 0 while none has."""
        return self._first.seq if self._first else 0

    def resume(self, place: Place) -> None:
        """Go on from a row that was taken before this process was there; call it before any row comes."""
        self._last, self._stream = place, place.stream

    def take(self, received: list[Received], most: float = math.inf) -> list[Step]:
        """Steps in order, for the newest `most` at least; ends among what was received are passed over."""
        rows = [r for r in received if not r.over]
        if rows and self._first is None:
            self._join(rows[0])
        chosen = [r for n, r in enumerate(rows) if n >= len(rows) - most or _is_kept(rows, n)]
        steps = [self._step(r) for r in chosen]
        self.weighed += len(steps)
        self.skipped += len(rows) - len(chosen)
        self.missed += sum(step.rows for step in steps) - len(rows)
        return steps

    def _join(self, first: Received) -> None:
        """Rows before the first were nobody's to miss, though their motion comes with it."""
        self._first = first.message
        if self._last is None:
            self._stream = first.envelope.stream
        elif first.envelope.stream == self._stream:
            self.missed -= first.message.seq - self._last.seq - 1
        else:
            self.missed -= first.message.seq

    def _step(self, received: Received) -> Step:
        row, last, before_ns = received.message, self._last, self._last_ns
        known = received.envelope.stream == self._stream and before_ns is not None
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
        t_ns = self._time(row.header.stamp.ns)
        within_ns = t_ns - before_ns if known else 0
        return Step(row, np.asarray(motion), t_ns, rows, received.envelope, within_ns)

    def _time(self, stamp_ns: int) -> int:
        if self._last_ns is not None and leaps(self._last_ns, stamp_ns + self._ahead_ns):
            self._ahead_ns = self._last_ns + ROW_NS - stamp_ns
        self._last_ns = stamp_ns + self._ahead_ns
        return self._last_ns


def _is_kept(rows: list[Received], n: int) -> bool:
    """The last of a stream that another follows, those with a measured distance, and where the robot was carried."""
    last_of_stream = n + 1 < len(rows) and rows[n + 1].envelope.stream != rows[n].envelope.stream
    return last_of_stream or rows[n].message.kind in (RELEASE, CARRIED)
