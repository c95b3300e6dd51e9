"""A navigator's memory beyond its own death: what it writes down, and what a new one may believe of it.

The row that the new one begins with decides. From the same pilot the summed motion is what the robot did meanwhile,
as for any rows that were missed. Another pilot counts from its own start: for the time that nobody counted, each component
grows by what the robot could have done in it (`widen`). Of the rest of what a filter learns (odometry's gains, trust
in whiskers) nothing is kept.
"""

from pathlib import Path

import numpy as np

from ..nav import filters
from ..nav.filters import COMPONENT
from ..occupancy import from_map
from ..outputs import put_aside
from ..pilot.wheels import Wheels
from ..scene import Scene
from . import checkpoint
from .checkpoint import Checkpoint, CheckpointError
from .network.inbox import Received
from .network.rows import ROW_NS, Place, Step

AGE_MOST_S = 60.0  # what a uniform belief takes to find the place anyway
FINEST = 1e-3  # m and rad: nobody knows a pose better


class Memory:
    """`recall` once, with the first row; `keep` as often as it is worth it. path None: nothing is kept."""

    def __init__(self, path: Path | None, scene: Scene, names: tuple[str, ...]):
        self._path, self._scene, self._names = path, scene, names
        self._identity = checkpoint.identity(scene)
        self._checked = path is None
        self.note = ""  # why there is nothing to go on from, or why nothing could be kept; one line

    def recall(self, first: Received) -> tuple[Place, dict[str, np.ndarray]] | None:
        """The row to go on from, and components by filter; None: as if there had been no other navigator."""
        if self._checked:
            return None
        self._checked = True
        try:
            reported = self._readable()
            if reported is None:
                return None
            unknown_s = _unknown_s(reported, first)
        except CheckpointError as error:
            self.note = f"{self._path}: not used: {error}; it is written anew"
            return None
        beliefs = {
            name: widen(reported.beliefs[name], unknown_s, Wheels.of(self._scene.robot.base)) for name in self._names
        }
        return Place(reported.stream, reported.seq, reported.pose), beliefs

    def keep(self, step: Step, beliefs: dict[str, np.ndarray]) -> None:
        """Write down what is believed after a row: (n,) of COMPONENT by filter. What cannot be written is noted."""
        if self._path is None:
            return
        row, sent = step.row, step.envelope
        inside = {name: self._inside(components) for name, components in beliefs.items()}
        if not all(len(components) for components in inside.values()):
            return
        stamp = row.header.stamp.ns
        reported = Checkpoint(self._identity, sent.stream, row.seq, row.pose, stamp, sent.sent_ns, inside)
        try:
            checkpoint.save(self._path, reported)
        except OSError as error:
            self.note = f"{self._path}: cannot be written ({error.strerror}); a navigator begun anew will know nothing"

    def _inside(self, components: np.ndarray) -> np.ndarray:
        """Those within the arena, of widths that can be: all that a filter begins from."""
        x, y, _ = from_map(components["pose"], self._scene.origin).T
        size_x, size_y = self._scene.arena.size_m
        kept = components[(x >= 0.0) & (x <= size_x) & (y >= 0.0) & (y <= size_y) & (components["mass"] > 0.0)]
        for name in ("sigma_m", "sigma_rad"):
            kept[name] = np.maximum(kept[name], FINEST)
        return kept

    def _readable(self) -> Checkpoint | None:
        """The checkpoint; one that is none, or of another arena, robot or filter, makes way."""
        try:
            if reported := checkpoint.load(self._path):
                self._check(reported)
        except CheckpointError as error:
            try:
                raise CheckpointError(f"{error}; what it was is now {put_aside(self._path)}") from None
            except OSError as refused:
                raise CheckpointError(f"{error}; it cannot be kept ({refused.strerror})") from None
        return reported

    def _check(self, reported: Checkpoint) -> None:
        if reported.scene != self._identity:
            raise CheckpointError("field scene: of another arena or robot")
        for name in self._names:
            if name not in reported.beliefs:
                raise CheckpointError(f"field filters: nothing of {name}")
            if fault := filters.prior_fault(self._scene, reported.beliefs[name]):
                raise CheckpointError(f"{name}: {fault}")


def _unknown_s(reported: Checkpoint, first: Received) -> float:
    """For how long nobody counted the motion. CheckpointError when the checkpoint is too old, or from the future."""
    row, sent = first.message, first.envelope
    same = sent.stream == reported.stream
    age_ns = max(row.header.stamp.ns - reported.stamp_ns, sent.sent_ns - reported.sent_ns)
    if not same and row.header.stamp.ns < reported.stamp_ns:
        raise CheckpointError("of an earlier run: pilot and bridge have begun anew since")
    if sent.sent_ns < reported.sent_ns or (same and row.seq <= reported.seq):
        raise CheckpointError("of a later row than the first")
    if age_ns > AGE_MOST_S * 1e9:
        raise CheckpointError(f"{age_ns / 1e9:.0f} s old, {AGE_MOST_S:.0f} s are the most")
    return 0.0 if same else max(0.0, (age_ns - (row.seq + 1) * ROW_NS) / 1e9)


def widen(components: np.ndarray, unknown_s: float, wheels: Wheels) -> np.ndarray:
    """Components after a time in which the robot did what nobody knows, at no more than the pilot's speeds on these wheels.

    Even over a disc of radius v t (variance (v t)^2 / 4 on each axis) and over w t to either side ((w t)^2 / 3).
    """
    out = np.array(components, COMPONENT)
    out["sigma_m"] = np.hypot(out["sigma_m"], wheels.explore_m_s * unknown_s / 2.0)
    out["sigma_rad"] = np.hypot(out["sigma_rad"], min(wheels.turn_rad_s * unknown_s, np.pi) / np.sqrt(3.0))
    return out
