"""Counts what the frames of one ring say of loss: bad records by lane and kind, gaps, frames dropped by the bridge."""

import numpy as np

from whisker_protocol import CODES, LANES, SENSOR_ERRORS, STATUS_CODE_SHIFT

ERROR_BITS = (1 << STATUS_CODE_SHIFT) - 1
CODE_KINDS = 64  # six bits
NAME_OF_CODE = {value: name for name, value in CODES.items()}
# Not loss: what a lane without a node delivers, and one that is switched off.
EMPTY = tuple(CODES[name] for name in ("absent", "lane_off"))


class Tally:
    """Since the view attached. `add` takes frames in order."""

    def __init__(self):
        self.frames = 0
        self.dropped = 0  # by the bridge, its buffer being full
        self._dropped_last: int | None = None
        self._codes = np.zeros((LANES, CODE_KINDS), np.int64)
        self._errors = np.zeros((LANES, len(SENSOR_ERRORS)), np.int64)
        self._good = np.zeros(LANES, np.int64)

    def add(self, frames: np.ndarray) -> None:
        """(n,) of ring.FRAME, n at least 1."""
        self.frames += len(frames)
        self._add_dropped(frames["dropped"])
        status = frames["lane"]["status"]
        self._good += (status == 0).sum(axis=0)
        tick, lane = np.nonzero(status)
        if len(lane) == 0:
            return
        found = status[tick, lane]
        kinds = lane * CODE_KINDS + (found >> STATUS_CODE_SHIFT)
        self._codes += np.bincount(kinds, minlength=self._codes.size).reshape(self._codes.shape)
        self._add_errors(lane, found & ERROR_BITS)

    def _add_errors(self, lane: np.ndarray, errors: np.ndarray) -> None:
        lane, errors = lane[errors != 0], errors[errors != 0]
        for bit in range(self._errors.shape[1]) if len(lane) else ():
            self._errors[:, bit] += np.bincount(lane[errors >> bit & 1 == 1], minlength=LANES)

    def _add_dropped(self, dropped: np.ndarray) -> None:
        """The frames' own count is since the bridge's start, and begins again with it."""
        dropped = dropped.astype(np.int64)
        before = dropped[0] if self._dropped_last is None else self._dropped_last
        steps = np.diff(dropped, prepend=before)
        self.dropped += int(np.where(steps < 0, dropped, steps).sum())
        self._dropped_last = int(dropped[-1])

    def good(self) -> list[int]:
        """Good records of each lane."""
        return self._good.tolist()

    def bad(self) -> dict[str, list[int]]:
        """Records that were not good, by kind and lane; kinds that never came are left out."""
        codes = {NAME_OF_CODE.get(code, f"code_{code}"): self._codes[:, code] for code in range(1, CODE_KINDS)}
        errors = {name: self._errors[:, entry["bit"]] for name, entry in SENSOR_ERRORS.items()}
        return {name: counts.tolist() for name, counts in (codes | errors).items() if counts.any()}

    def lost(self) -> list[int]:
        """Records of each lane that should have been good: all bad ones but those of empty and switched-off lanes."""
        lost = self._codes.sum(axis=1) - self._codes[:, list(EMPTY)].sum(axis=1)
        return lost.tolist()
