"""Rows of a running robot, and where it is said to be, judged as those of a file are, a minute of them at a time."""

from collections.abc import Sequence

import numpy as np

from ..nav.faults import ground_faults, row_faults
from ..nav.observations import Observations, joined
from ..scene import Robot, Scene

ROWS = 600  # a minute: enough that five in a hundred are not one or two


class RowWatch:
    """`fault`: what the last whole minute's rows cannot be, the first line of it; empty: nothing, or not known yet.

    scene: whose map the answers are judged by; None: there is none yet.
    """

    def __init__(self, robot: Robot, scene: Scene | None = None):
        self._robot, self._scene, self._rows, self._count, self._poses = robot, scene, [], 0, []
        self.fault = ""

    def take(self, rows: Observations) -> None:
        """The next rows, one or more."""
        self._rows.append(rows)
        self._count += len(rows)
        if self._count >= ROWS:
            faults = row_faults(joined(self._rows), self._robot)
            if self._scene and self._poses:
                faults += ground_faults(np.array(self._poses), self._scene)
            self.fault = f"rows: {faults[0]}" if faults else ""
            self._rows, self._count, self._poses = [], 0, []

    def answer(self, pose: Sequence[float]) -> None:
        """Where the robot is said to be, in the map's frame."""
        self._poses.append(pose)
