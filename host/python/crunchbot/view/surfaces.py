"""How surfaces lie that whiskers touched: reported in a row, placed where the estimate of the same row has the robot."""

import math
from collections import deque

from ..observation import NORMAL, POINT, VALUE, Column

SURFACES_MOST = 60
SENSIBLE_M = 1e5  # beyond, a number is none of a robot's


class Surfaces:
    """`reported`: the newest, each with `x`, `y`, `normal` (direction in the arena), `normal_sd` and `point_sd`."""

    def __init__(self):
        self.reported: deque[dict] = deque(maxlen=SURFACES_MOST)
        self._seq, self._cells = -1, {}

    def take(self, seq: int, cells: list[tuple[Column, int, float]]) -> None:
        """Columns of NORMAL and POINT, their cells and values in a row."""
        self._seq, self._cells = seq, {}
        for column, cell, value in cells:
            if cell == VALUE and abs(value) <= SENSIBLE_M:
                self._cells.setdefault(column.whisker, {})[column.what] = value

    def place(self, seq: int, pose: dict) -> None:
        """Where the robot was at the end of row `seq`: surfaces of that row are placed, once."""
        if seq != self._seq:
            return
        c, s = math.cos(pose["theta"]), math.sin(pose["theta"])
        for cells in self._cells.values():
            if len(cells) < len(NORMAL) + len(POINT):
                continue
            (normal, normal_sd), (forward, left, point_sd) = (
                [cells[name] for name in names] for names in (NORMAL, POINT)
            )
            at = {"x": pose["x"] + c * forward - s * left, "y": pose["y"] + s * forward + c * left}
            at |= {"normal": math.remainder(pose["theta"] + normal, 2.0 * math.pi)}
            at |= {"normal_sd": normal_sd, "point_sd": point_sd}
            self.reported.append({name: round(value, 4) for name, value in at.items()})
        self._cells = {}
