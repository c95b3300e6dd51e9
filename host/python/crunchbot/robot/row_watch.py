"""Rows of a running robot judged as those of a file are, a minute of them at a time."""

from ..nav.faults import row_faults
from ..nav.observations import Observations, joined
from ..scene import Robot

ROWS = 600  # a minute: enough that five in a hundred are not one or two


class RowWatch:
    """`fault`: what the last whole minute's rows cannot be, the first line of it; empty: nothing, or not known yet."""

    def __init__(self, robot: Robot):
        self._robot, self._rows, self._count = robot, [], 0
        self.fault = ""

    def take(self, rows: Observations) -> None:
        """The next rows, one or more."""
        self._rows.append(rows)
        self._count += len(rows)
        if self._count >= ROWS:
            self.fault = next((f"rows: {fault}" for fault in row_faults(joined(self._rows), self._robot)), "")
            self._rows, self._count = [], 0
