"""The rows of a recording: a row a tick, angles in degrees."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from whisker_protocol import LANES

from ..errors import UserError
from .reading import Recording

REST_COUNT, DEGREES_PER_COUNT = 0x8000, 180.0 / 65536.0  # protocol/whisker.toml, fields alpha and beta
AXES = ("alpha", "beta")


class ExportError(UserError):
    """An export that cannot be; one line."""

    exit_code = 2


@dataclass(frozen=True)
class Rows:
    """Successive rows (n,): time_ns, tick, sequence; deg: (n, lanes, 2); status: (n, lanes)."""

    time_ns: np.ndarray
    tick: np.ndarray
    sequence: np.ndarray
    deg: np.ndarray
    status: np.ndarray

    def columns(self, names: list[str]) -> dict[str, np.ndarray]:
        """By name, in the order of a table."""
        found = {"time_ns": self.time_ns, "tick": self.tick, "sequence": self.sequence}
        for n, lane in enumerate(names):
            found |= {f"{lane}_{axis}_deg": self.deg[:, n, k] for k, axis in enumerate(AXES)}
            found[f"{lane}_status"] = self.status[:, n]
        return found


class Table:
    """The rows of a recording. lanes: which; None: those that the bridge had in use."""

    def __init__(self, recording: Recording, lanes: list[int] | None = None):
        self.recording = recording
        self.frames = self.first_ns = mask = 0
        for stamp_ns, frames in recording.stamped_blocks():
            self.first_ns = self.first_ns or stamp_ns
            mask |= int(np.bitwise_or.reduce(frames["lane_mask"]))
            self.frames += len(frames)
        self.lanes = [n for n in range(LANES) if mask >> n & 1] if lanes is None else lanes
        self.names = [self._name(n) for n in self.lanes]

    def _name(self, lane: int) -> str:
        """What the recorder knew of it, with no more than letters, digits, dash and underscore; "lane7" if nothing."""
        known = [re.sub(r"[^\w-]", "_", name, flags=re.ASCII) for name in self.recording.lane_names]
        return known[lane] if lane < len(known) and known.count(known[lane]) == 1 else f"lane{lane}"

    def rows(self, note: Callable[[int], None] = lambda frames: None) -> Iterator[Rows]:
        """All rows, in the order they were published; note: called with the number of frames that are done."""
        for stamp_ns, frames in self.recording.stamped_blocks():
            cycles = (frames["time_cycles"] - frames["time_cycles"][0]).astype(np.int64)
            time_ns = stamp_ns + np.rint(cycles * (1e9 / self.recording.clock_hz)).astype(np.int64)
            lane = frames["lane"][:, self.lanes]
            counts = np.stack([lane[axis] for axis in AXES], axis=-1).astype(np.float32)
            deg = (counts - REST_COUNT) * np.float32(DEGREES_PER_COUNT)
            deg[lane["status"] != 0] = np.nan
            yield Rows(time_ns, frames["tick"], frames["sequence"], deg, lane["status"])
            note(len(frames))
