"""Reads one ring for all pages that look at it: traces, counts, and what state the ring is in."""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import asdict

import numpy as np

from whisker_protocol import CODES, LANES, LIMITS, STATUS_CODE_SHIFT

from ..bridge.flow import Flow
from ..bridge.ring import Reader, RingError, error_line
from .pyramid import BINS, CHUNK, WIDTHS, Pyramid
from .tally import NAME_OF_CODE, Tally

CHUNKS = 8  # read at most in one poll: a ring written faster than we read must not hold up the pages
RETRY_S = 0.5  # between looks for a ring that is not there
STALL_S = 1.0  # without a frame
FRESH_S = 1.0  # a lane is good if it delivered a good record in this time before the newest frame
EVENTS = 20
GAP_MAX = BINS * WIDTHS[-1]  # slots; the longest outage that is drawn to scale
NEVER = -(1 << 62)


class Tap:
    """`poll` often enough that the ring does not wrap in between; then `pyramid`, `tally` and `status` are up to date."""

    def __init__(self, name: str, clock: Callable[[], float] = time.monotonic, owner: int | None = None):
        self.name, self._owner = name, owner
        self.pyramid, self.tally = Pyramid(), Tally()
        self.tick_s = LIMITS["tick_period"] / LIMITS["clock_hz"]
        self._clock = clock
        self._reader: Reader | None = None
        self._trouble: RingError | None = None  # why no frames come
        self._flowing = False  # attached, to a ring that is not known to have ended
        self._next_try = self._last_frame = self._since = clock()
        self._flow = Flow(clock)
        self._restarts = 0
        self._last: np.ndarray | None = None  # the newest frame, (1,)
        self._good_slot = np.full(LANES, NEVER, np.int64)
        self._events: deque[tuple[float, str]] = deque(maxlen=EVENTS)
        self._stalled = False

    def close(self) -> None:
        """Let go of the ring."""
        if self._reader:
            self._reader.close()
            self._reader, self._flowing = None, False

    def poll(self) -> None:
        """Take what is new. Never waits."""
        now = self._clock()
        if not self._flowing and now >= self._next_try:
            self._try_attach(now)
        if self._flowing:
            self._read(now)
        self._note_stall(now)
        if self._reader:
            self._flow.look(self._reader, self.tally.dropped)

    def _try_attach(self, now: float) -> None:
        self._next_try = now + RETRY_S
        try:
            if self._reader:
                self._reader.reattach()
                self._restarts += 1
                self._say("attached to the new ring of a restarted writer")
            else:
                self._reader, self._since = Reader(self.name, owner=self._owner), now
                self._say("attached to the ring")
        except RingError as error:
            self._trouble = self._trouble if self._reader else error
            return
        # Not the oldest frames: the writer would overtake us there while we begin.
        self._reader.seek_latest(min(CHUNKS * CHUNK, self._reader.info.capacity // 2))
        self._trouble, self._flowing = None, True

    def _read(self, now: float) -> None:
        for _ in range(CHUNKS):
            try:
                frames = self._reader.peek()[:CHUNK].copy()
                if len(frames) == 0:
                    self._reader.wait(0.0)
                    return
                self._reader.advance(len(frames))
            except RingError as error:
                if error.name == "TIMEOUT":
                    return
                if error.name != "OVERRUN":
                    self._end(error, now)
                    return
                self._say("the writer overtook this view: frames are missing here, but were in the ring")
            else:
                self._take(frames, now)

    def _end(self, error: RingError, now: float) -> None:
        """The ring gives nothing more: its writer closed it, or died, or has made a new one."""
        self._trouble, self._flowing = error, False
        self._next_try = now
        if error.name != "RESTARTED":
            self._say("whiskerd closed the ring" if error.name == "CLOSED" else "the writer died")

    def _take(self, frames: np.ndarray, now: float) -> None:
        slots = self._slots(frames["tick"].astype(np.int64), now)
        self._measure_tick(frames)
        self.tally.add(frames)
        self.pyramid.add(slots, frames["lane"])
        good = frames["lane"]["status"] == 0
        newest = len(frames) - 1 - np.argmax(good[::-1], axis=0)
        self._good_slot = np.where(good.any(axis=0), slots[newest], self._good_slot)
        waited_s = self._reader.age_s(int(frames["time_cycles"][-1])) or 0.0  # in the ring, before this view came
        self._last, self._last_frame = frames[-1:], now - waited_s

    def _slots(self, ticks: np.ndarray, now: float) -> np.ndarray:
        """Slots of frames: as ticks, but where the tick goes back (a new start) they go on after the time it took."""
        before = ticks[0] - 1 if self._last is None else self._last["tick"].astype(np.int64)[0]
        steps = np.diff(ticks, prepend=before)
        jumped = (steps < 1) | (steps > GAP_MAX)
        if jumped[0]:
            steps[0] = np.clip(round((now - self._last_frame) / self.tick_s), 1, GAP_MAX)
        if jumped.any():
            steps[1:][jumped[1:]] = 1
            self._say("the tick count began anew: the bridge was started again")
        return self.pyramid.end - 1 + np.cumsum(steps)

    def _measure_tick(self, frames: np.ndarray) -> None:
        """The length of a tick by the frames, if they hold a sensible one."""
        ticks = int(frames["tick"][-1]) - int(frames["tick"][0])
        cycles = int(frames["time_cycles"][-1]) - int(frames["time_cycles"][0])
        if ticks > 0 and LIMITS["tick_period_min"] <= cycles / ticks < 1 << 32:
            self.tick_s = cycles / ticks / LIMITS["clock_hz"]

    def _note_stall(self, now: float) -> None:
        stalled = self._flowing and now - self._last_frame > STALL_S
        if stalled != self._stalled and self.tally.frames:
            self._say("no frame for a second" if stalled else "frames come again")
        self._stalled = stalled

    def _say(self, text: str) -> None:
        """Note an event; one that repeats at once is noted once, with its newest time."""
        if self._events and self._events[-1][1] == text:
            self._events.pop()
        self._events.append((time.time(), text))

    @property
    def state(self) -> str:
        """live, stalled, waiting (no ring yet), ended (its writer is gone) or refused (no ring that we can read)."""
        if self._flowing:
            return "stalled" if self._stalled or not self.tally.frames else "live"
        if self._reader:
            return "ended"
        return "refused" if self._trouble and self._trouble.name not in ("RING_MISSING", "WRITER_DEAD") else "waiting"

    def status(self) -> dict:
        """Everything the status topic holds about this ring, ready for JSON; docs/view.md explains the fields."""
        now, reader = self._clock(), self._reader
        return {
            "ring": self.name,
            "state": self.state,
            "trouble": {"name": self._trouble.name, "text": str(self._trouble)} if self._trouble else None,
            "attached_s": round(now - self._since, 1) if reader else None,
            "age_s": round(now - self._last_frame, 3) if self.tally.frames else None,
            "tick_s": self.tick_s,
            "frames_per_s": round(self._flow.rate(), 1),
            "loss": self._flow.loss(),
            "frames": self.tally.frames,
            "dropped": self.tally.dropped,
            "restarts": self._restarts,
            "reader": asdict(reader.info) if reader else None,
            "clock": asdict(reader.clock) if reader and reader.clock else None,
            "daemon": self._daemon(),
            "lanes": self._lanes(),
            "bad": self.tally.bad(),
            "events": list(self._events),
        }

    def _daemon(self) -> dict | None:
        stats = self._reader.stats if self._reader else None
        if stats is None:
            return None
        return asdict(stats) | {"trouble": error_line(stats.error) if stats.error else None}

    def _lanes(self) -> dict | None:
        """Per lane: state ("good", or the kind of its newest record), last counts, good and lost records."""
        if self._last is None:
            return None
        records = self._last["lane"][0]
        fresh = self._good_slot >= self.pyramid.end - FRESH_S / self.tick_s
        codes = (records["status"] >> STATUS_CODE_SHIFT).tolist()
        states = [
            "good" if good else NAME_OF_CODE.get(code, f"code_{code}") if code else "sensor_error"
            for good, code in zip(fresh.tolist(), codes, strict=True)
        ]
        mask = int(self._last["lane_mask"][0])
        off = NAME_OF_CODE[CODES["lane_off"]]
        return {
            "state": [state if mask >> lane & 1 else off for lane, state in enumerate(states)],
            "alpha": records["alpha"].tolist(),
            "beta": records["beta"].tolist(),
            "good": self.tally.good(),
            "lost": self.tally.lost(),
        }
