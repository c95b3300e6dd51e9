"""Calibration from a ring: rest and noise of every lane, and body whisks against a post at known distances."""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from whisker_protocol import LANES, LIMITS

from ..bridge.ring import FRAME, Reader
from ..errors import UserError
from ..files import UnreadableError, read_toml
from ..outputs import put
from .contact import ONSET_COUNTS, Contact
from .texture.spectral import SENSOR_STOPS

TICKS_PER_S = LIMITS["clock_hz"] / LIMITS["tick_period"]
BEFORE_TICKS = 500  # of a contact's recording that are before the touch: its rest is taken from them
AFTER_TICKS = 100
SHORTEST_TICKS = 100  # 50 ms: what is shorter is no whisk
KEPT_TICKS = 60 * 2000  # a contact longer than a minute is none
QUIET_S = 30.0  # without frames for so long, the bridge is taken to be gone


class CalibrationError(UserError):
    """A calibration that cannot be made; one line."""

    exit_code = 1


class RestError(UserError):
    """A rest.toml that is none; one line."""


@dataclass(frozen=True)
class Rest:
    """A lane untouched: mean and standard deviation of (alpha, beta), counts; samples good and bad."""

    lane: int
    mean: np.ndarray
    noise: np.ndarray
    good: int
    bad: int

    @property
    def trouble(self) -> str:
        """What speaks against using it, with remedy; empty: nothing."""
        if self.bad > self.good:
            return "most samples are bad; see whisker doctor"
        if np.isin(np.round(self.mean), SENSOR_STOPS).any():
            return "an axis is at its stop; check how magnet and sensor stand to each other"
        if (self.noise == 0.0).any():
            return "an axis never changes; see whisker doctor"
        if self.noise.max() > ONSET_COUNTS:
            return "it moves; leave it untouched and measure again"
        return ""


@dataclass(frozen=True)
class Whisk:
    """One contact: times (n,) in s of the bridge's clock and raw counts (n, 2), from before the touch to after it."""

    t_s: np.ndarray
    counts: np.ndarray


class Feed:
    """New frames of a ring, in order; CalibrationError when they cannot be used to measure with."""

    def __init__(self, reader: Reader):
        self._reader = reader
        self._left = np.empty(0, FRAME)  # taken but not asked for yet

    def skip(self) -> None:
        """Forget what came up to now."""
        self._reader.seek_latest(0)
        self._left = self._left[:0]

    def next(self) -> np.ndarray:
        """One or more frames; those lost before the ring are just not there."""
        if len(self._left):
            frames, self._left = self._left, self._left[:0]
            return frames
        frames = self._reader.take(QUIET_S)
        if frames is None:
            raise CalibrationError(f"ring {self._reader.name}: closed; start whiskerd again and calibrate again")
        if len(frames) == 0:
            raise CalibrationError(f"ring {self._reader.name}: no frames for {QUIET_S:g} s; see whisker doctor")
        return frames

    def frames(self, count: int) -> np.ndarray:
        """The next `count` frames."""
        parts = [self.next()]
        while sum(map(len, parts)) < count:
            parts.append(self.next())
        frames = np.concatenate(parts)
        self._left = frames[count:]
        return frames[:count]


def measure_rest(frames: np.ndarray) -> list[Rest]:
    """Rest of every lane in the mask, from frames (n,) during which nothing touched it."""
    mask = int(np.bitwise_and.reduce(frames["lane_mask"]))
    found = []
    for lane in (n for n in range(LANES) if mask >> n & 1):
        samples = frames["lane"][:, lane]
        good = samples[samples["status"] == 0]
        counts = counts_of(good)
        empty = np.full(2, np.nan)
        mean, noise = (counts.mean(axis=0), counts.std(axis=0)) if len(good) else (empty, empty)
        found.append(Rest(lane, mean, noise, len(good), len(samples) - len(good)))
    return found


def write_rest(path: Path, rests: list[Rest], names: list[str]) -> None:
    """rest.toml: a [[lane]] table per lane, counts."""
    lines = ["# Rest and noise of each lane, raw counts (alpha, beta); written by 'whisker calibrate'."]
    for rest in rests:
        pairs = [f"[{a:.2f}, {b:.2f}]" for a, b in (rest.mean, rest.noise)]
        lines += ["", "[[lane]]", f"lane = {rest.lane}", f'name = "{names[rest.lane]}"']
        lines += [f"rest = {pairs[0]}", f"noise = {pairs[1]}", f"good = {rest.good}", f"bad = {rest.bad}"]
    put(path, "\n".join(lines) + "\n")


def read_noise(path: Path) -> dict[int, np.ndarray]:
    """Noise of (alpha, beta) by lane, from a rest.toml. RestError: file, what, remedy."""
    try:
        _, content = read_toml(path)
        lanes = {int(entry["lane"]): np.asarray(entry["noise"], float) for entry in content["lane"]}
        if any(noise.shape != (2,) or not (noise >= 0.0).all() for noise in lanes.values()):
            raise ValueError("noise is not two numbers")
    except (UnreadableError, LookupError, TypeError, ValueError, OverflowError) as error:
        raise RestError(f"{path}: {error}; give the rest.toml that whisker calibrate wrote") from error
    return lanes


class WhiskFinder:
    """Cuts one lane's samples into contacts."""

    def __init__(self, lane: int):
        self._lane = lane
        self._contact = Contact()
        self._ticks = np.empty(0, np.int64)
        self._times = np.empty(0)
        self._counts = np.empty((0, 2))
        self._reported = -1  # onset of the last contact given or thrown away

    def add(self, frames: np.ndarray) -> Iterator[Whisk]:
        """Contacts that these frames complete. CalibrationError when the bridge began anew meanwhile."""
        samples = frames["lane"][:, self._lane]
        good = samples["status"] == 0
        ticks = frames["tick"].astype(np.int64)
        if (np.diff(ticks, prepend=self._ticks[-1:]) <= 0).any():
            raise CalibrationError("the bridge was started anew meanwhile; calibrate again")
        for cut in range(0, len(ticks), AFTER_TICKS):  # short pieces: each holds the end of one contact at most
            piece = slice(cut, cut + AFTER_TICKS)
            self._contact.block(ticks[piece], counts_of(samples[piece]), good[piece])
            kept = good[piece]
            self._ticks = np.concatenate([self._ticks, ticks[piece][kept]])[-KEPT_TICKS:]
            seconds = frames["time_cycles"][piece][kept] / LIMITS["clock_hz"]
            self._times = np.concatenate([self._times, seconds])[-KEPT_TICKS:]
            self._counts = np.concatenate([self._counts, counts_of(samples[piece][kept])])[-KEPT_TICKS:]
            yield from self._completed()

    def _completed(self) -> Iterator[Whisk]:
        onset, release = self._contact.onset, self._contact.release
        if onset == self._reported or release < onset or self._ticks[-1] < release + AFTER_TICKS:
            return
        self._reported = onset
        if release - onset >= SHORTEST_TICKS:
            chosen = (self._ticks >= onset - BEFORE_TICKS) & (self._ticks < release + AFTER_TICKS)
            yield Whisk(self._times[chosen], self._counts[chosen])


def collect(feed: Feed, finder: WhiskFinder) -> Iterator[Whisk]:
    """Contacts as they come."""
    while True:
        yield from finder.add(feed.next())


def counts_of(samples: np.ndarray) -> np.ndarray:
    """(n, 2) float64 of samples (n,): alpha, beta."""
    return np.column_stack([samples["alpha"], samples["beta"]]).astype(np.float64)


class ContactsFile:
    """A recording of radial contacts (docs/formats.md): contact, radius_mm, t_s, x, y, and what more is known."""

    def __init__(self, path: Path, whisk_rad_s: float | None = None, node: int | None = None):
        """`node`: serial number of the node whose whisker it is."""
        self._file = open(path, "x", newline="")  # noqa: SIM115 - closed by close()
        self._rows = csv.writer(self._file)
        extra = {name: v for name, v in (("whisk_rad_s", whisk_rad_s), ("node", node)) if v is not None}
        self._extra = list(extra.values())
        self._contacts = 0
        self._rows.writerow(["contact", "radius_mm", "t_s", "x", "y", *extra])

    def add(self, radius_mm: float, whisk: Whisk) -> None:
        """One contact; on the disk when this returns."""
        self._contacts += 1
        for t_s, (x, y) in zip(whisk.t_s, whisk.counts.astype(int), strict=True):
            self._rows.writerow([self._contacts, f"{radius_mm:g}", f"{t_s:.4f}", x, y, *self._extra])
        self._file.flush()

    def close(self) -> None:
        self._file.close()
