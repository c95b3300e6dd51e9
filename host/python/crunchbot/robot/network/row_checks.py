"""Whether a row can be: of this robot, and no more than a robot can have moved since the row before."""

import math

import numpy as np

from ...base_table import MOST_M_S, BaseTable
from ...nav.faults import ROW_MOST_RAD, SLACK_M, SLACK_RAD
from ...observation import NORMAL, Quantity, normal, parse
from ...scene import Scene
from .inbox import Received
from .messages import REMEDIES, Observation
from .rows import ROW_NS, between, leaps

# The fastest wheels that robot.toml takes, and so close together that the base turns as far in a row as a filter takes.
ANY = BaseTable(2.0 * MOST_M_S * ROW_NS / 1e9 / ROW_MOST_RAD, MOST_M_S)
ROUNDING = 1e-6  # m and rad, between a row's motion and the sums on both sides


class RowChecks:
    """Judges the rows of an inbox, in their order; other messages pass."""

    def __init__(self, scene: Scene | None = None):
        """scene: whose cells every row must have, and whose base moves; None: of any robot, on any base."""
        self._wanted, self._whiskers = (columns(scene), _whiskers(scene)) if scene else (frozenset(), ())
        self._base = scene.robot.base if scene else ANY
        self._last: Received | None = None
        self._moved_ns = 0  # stamp of the newest row with any motion

    def __call__(self, one: Received) -> str:
        """What is wrong with a row and what helps, in one line; empty: nothing, and it is the row before the next."""
        if not isinstance(one.message, Observation):
            return ""
        fault = self._fault(one)
        if not fault:
            self._note(one)
        return fault

    def _fault(self, one: Received) -> str:
        names = self._names_fault(one.message.names) if self._wanted else ""
        follows = self._last is not None and self._last.envelope.stream == one.envelope.stream
        return names or (self._motion_fault(self._last.message, one.message) if follows else "")

    def _note(self, one: Received) -> None:
        row, known = one.message, self._last is not None and self._last.envelope.stream == one.envelope.stream
        stamp_ns = row.header.stamp.ns
        if np.any(row.motion) or not known or leaps(self._last.message.header.stamp.ns, stamp_ns):
            self._moved_ns = stamp_ns
        self._last = one

    def _names_fault(self, names: list[str]) -> str:
        if missing := self._wanted.difference(names):
            return f"field names: cell {min(missing)} is missing; give both sides the scene of this robot"
        unknown = (name for name in names if name not in self._wanted and not name.startswith(self._whiskers))
        if alone := _alone(set(names)):
            return f"field names: cell {alone} is missing; {REMEDIES[1]}"
        if (stranger := next(unknown, None)) is not None:
            return f"field names: no whisker has the cell {stranger:.40}; give both sides the scene of this robot"
        return ""

    def _motion_fault(self, last: Observation, row: Observation) -> str:
        rows, moved = row.seq - last.seq, between(last.pose, row.pose)
        if rows < 1:
            return f"field seq: {row.seq} after {last.seq}; {REMEDIES[1]}"
        if rows == 1 and np.abs(moved - row.motion).max() > ROUNDING:
            return f"field motion: not what leads from the last row's pose to this one's; {REMEDIES[1]}"
        seconds = self._seconds(last, row)
        far, turned = math.hypot(*moved[:2]), abs(moved[2])
        most_m, most_rad = self._base.wheel_most_m_s * seconds, self._base.turn_most_rad_s * seconds
        if far > most_m + SLACK_M or turned > most_rad + SLACK_RAD:
            return f"field pose: {far:.3g} m and {turned:.3g} rad in {seconds:.3g} s; {REMEDIES[1]}"
        return ""

    def _seconds(self, last: Observation, row: Observation) -> float:
        """In which the motion between two rows was: since the row before that had any, for a whisk's is held back."""
        rows_ns, stamp_ns = (row.seq - last.seq) * ROW_NS, row.header.stamp.ns
        if leaps(last.header.stamp.ns, stamp_ns):
            return rows_ns / 1e9
        return max(rows_ns, stamp_ns - self._moved_ns) / 1e9


def columns(scene: Scene) -> frozenset[str]:
    """Cells that a row of this scene must have."""
    return frozenset(scene.layout.of(Quantity.TEXTURE) + scene.layout.of(Quantity.DISTANCE))


def _alone(names: set[str]) -> str:
    """The standard deviation's cell that a direction lacks; empty: none does."""
    directions = (column.whisker for column in map(parse, names) if column.what == NORMAL[0])
    wanted = (normal(whisker)[1].name for whisker in directions)
    return min((name for name in wanted if name not in names), default="")


def _whiskers(scene: Scene) -> tuple[str, ...]:
    """How the names of cells begin: models may know more textures than an arena has. A sensor of the user's own need not
    be in every row."""
    return (*(f"{whisker.name}_" for whisker in scene.robot.whiskers), *(sensor.name for sensor in scene.robot.sensors))
