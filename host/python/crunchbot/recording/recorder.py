"""Writes a ring to a recording without loss. The file says what was lost before."""

import threading
import time
from dataclasses import dataclass, field

import numpy as np

from whisker_protocol import CODES, LANES, LIMITS, STATUS_CODE_SHIFT

from ..bridge.ring import Reader, RingError
from ..native import lib
from .messages import BLOCK_FRAMES, CLOCK_SET, MISSING, OVERRUN, RESTARTED, encode_block
from .timeline import Timeline
from .writing import RecordingWriter

GATHER_S = 0.1  # between two looks at the ring: a wake per block, not per tick
RATE_HZ = LIMITS["clock_hz"] / LIMITS["tick_period"]
SECOND_NS = 10**9
LANE_OFF = CODES["lane_off"]  # no bad sample: nobody asked for it


@dataclass
class Tally:
    """What was recorded, and what was not: frames, but for records_bad, which counts samples by lane of
    the first bridge."""

    frames: int = 0
    missing: int = 0  # never came into the ring
    overrun: int = 0  # not read in time
    restarts: int = 0
    records_bad: np.ndarray = field(default_factory=lambda: np.zeros(LANES, np.int64))

    def __sub__(self, other: "Tally") -> "Tally":
        return Tally(**{name: value - getattr(other, name) for name, value in vars(self).items()})

    def copy(self) -> "Tally":
        return Tally(**(vars(self) | {"records_bad": self.records_bad.copy()}))


class Recorder:
    """Takes what a reader has and gives it to a writer. `run` until the end, or `step` by step."""

    def __init__(self, reader: Reader, writer: RecordingWriter, timeline: Timeline | None = None):
        self._reader, self._writer = reader, writer
        self._timeline = timeline or Timeline()
        self._block = min(BLOCK_FRAMES, reader.info.capacity // 4)
        self._gather_s = min(GATHER_S, reader.info.capacity / 8 / RATE_HZ)
        self.tally = Tally()
        self._second = Tally()  # the tally when the last health message was written
        self._second_ns = self._timeline.now()
        self._last: tuple[int, int] | None = None  # tick and sequence number of the last frame
        self._overrun = reader.info.frames_overrun
        self._lost = 0  # frames overrun since the last block
        self._reattached = False
        self._waiting = 0  # frames seen at the last look, too few for a block

    def run(self, stop: threading.Event, frames: int | None = None, patience_s: float = 10.0) -> None:
        """Record until the ring is closed, `stop` is set, or `frames` are recorded.

        A writer that died or was replaced is waited for; RingError when none comes within `patience_s`.
        """
        while not stop.is_set() and (frames is None or self.tally.frames < frames):
            try:
                self._reader.wait(GATHER_S)
            except RingError as error:
                if error.name == "CLOSED":
                    return
                self._interrupted(error, patience_s, stop)
                continue
            self.step(False, frames)
            stop.wait(self._gather_s)
        self.step(True, frames)

    def step(self, all_frames: bool, frames: int | None = None) -> None:
        """Take whole blocks that are there, or all frames; at most so many that `frames` are recorded in all."""
        while frames is None or self.tally.frames < frames:
            room = self._block if frames is None else min(self._block, frames - self.tally.frames)
            if self._take(room, all_frames) == 0:
                break
        self._report_second()

    def finish(self) -> None:
        """Say what is still to be said, write the index, close the file."""
        self._say_lost(0)
        self._report_health()
        totals = {name: str(value) for name, value in vars(self.tally).items() if isinstance(value, int)}
        self._writer.finish(_of_bridge(self._reader) | totals)

    def _take(self, most: int, partial: bool) -> int:
        """Record one block; 0: there is none. One that is not whole waits for the next look, unless `partial`."""
        try:
            view = self._reader.peek()[:most]
            if len(view) < most and not partial and len(view) != self._waiting:
                self._waiting = len(view)
                return 0
            if len(view) == 0:
                return 0
            block = encode_block(view)
            self._reader.advance(len(view))
        except RingError as error:
            if error.name != "OVERRUN":
                raise
            overrun = self._reader.info.frames_overrun
            self._lost += overrun - self._overrun
            self._overrun = overrun
            return most  # there is more where the reader stands now
        self._record(block)
        return len(block["tick"])

    def _record(self, block: np.ndarray) -> None:
        time_ns = self._timeline.of(int(block["time_cycles"][0]), self._reader.clock)
        self._say_lost(int(block["tick"][0]))
        self._say_gaps(time_ns, block)
        self._writer.block(time_ns, block)
        self.tally.frames += len(block["tick"])
        status = block["lanes"]["status"]
        self.tally.records_bad += np.count_nonzero((status != 0) & (status >> STATUS_CODE_SHIFT != LANE_OFF), axis=1)

    def _say_lost(self, tick: int) -> None:
        """Tell of frames overrun and of a new ring, now that a frame stands behind them."""
        if self._lost:
            self.tally.overrun += self._lost
            self._writer.event(self._timeline.now(), OVERRUN, tick=tick, frames=self._lost)

    def _say_gaps(self, time_ns: int, block: np.ndarray) -> None:
        """Tell where ticks go back and sequence numbers jump; what is known as overrun is not missing too."""
        ticks, sequence = block["tick"], block["sequence"]
        before = self._last or (int(ticks[0]) - 1, int(sequence[0]) - 1)
        self._last = (int(ticks[-1]), int(sequence[-1]))
        back = np.diff(ticks.astype(np.int64), prepend=np.int64(before[0])) < 1
        back |= block["flags"] & lib.WHISKER_FRAME_GAP != 0
        back[0] |= self._reattached
        steps = np.diff(sequence, prepend=np.uint32(before[1] & 0xFFFFFFFF))
        known, self._lost, self._reattached = self._lost, 0, False
        for index in np.flatnonzero(back | (steps != 1)):
            missing = int(steps[index]) - 1 - (known if index == 0 else 0)
            if back[index] or missing >= 1 << 31:
                self.tally.restarts += 1
                self._writer.event(time_ns, RESTARTED, tick=int(ticks[index]))
            if 0 < missing < 1 << 31:
                self.tally.missing += missing
                self._writer.event(time_ns, MISSING, tick=int(ticks[index]), frames=missing)

    def _interrupted(self, error: RingError, patience_s: float, stop: threading.Event) -> None:
        if error.name == "TIMEOUT":
            self._report_second()
        elif error.name in ("WRITER_DEAD", "RESTARTED"):
            self._writer.flush()
            self._reader.reattach(patience_s, stop)
            self._overrun = self._reader.info.frames_overrun
            self._reattached = True
        else:
            raise error

    def _report_second(self) -> None:
        if step := self._timeline.wall_step_ns():
            self._writer.event(self._timeline.now(), CLOCK_SET, step_ns=step)
        if self._timeline.now() - self._second_ns >= SECOND_NS:
            self._report_health()
        self._writer.flush_when_due()

    def _report_health(self) -> None:
        now, second = self._timeline.now(), self.tally - self._second
        stats = self._reader.stats
        self._writer.health(now, second.frames, second.missing, second.overrun, second.records_bad, stats)
        self._second, self._second_ns = self.tally.copy(), now


def describe(reader: Reader) -> dict[str, str]:
    """What a recording's metadata holds about ring and bridge when it begins; at its end more may be known."""
    started = {"ring": reader.name, "started": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())}
    return started | _of_bridge(reader)


def _of_bridge(reader: Reader) -> dict[str, str]:
    reported = {}
    if stats := reader.stats:
        reported |= {name: str(getattr(stats, name)) for name in ("serial", "firmware", "wire_version", "lane_mask")}
        reported["tick_period"] = str(stats.tick_period)
    return reported


def record(reader: Reader, writer: RecordingWriter, stop: threading.Event, frames: int | None = None) -> Tally:
    """Record until the ring is closed, `stop` is set or `frames` are recorded.

    The file is finished, or, when it cannot be written on, whole up to its last second. Errors: as Recorder.run, and
    WriteError.
    """
    recorder = Recorder(reader, writer)
    try:
        recorder.run(stop, frames)
    except RingError:
        recorder.finish()
        raise
    except BaseException:
        writer.close()
        raise
    recorder.finish()
    return recorder.tally
