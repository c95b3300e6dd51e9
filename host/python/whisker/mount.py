"""What a body whisk can tell of an object depends on how the whisker is mounted and on which way it was pressed.

Equation 3 holds for a corner under the shaft. A tip on a face is dragged along it as the robot turns, and bends by more
or less than the turn, so the line's answer is not its distance; but then the distance is known: the whisker's length.
Driving forward, a corner comes to lie on the side to which the shaft leans over the robot's path, and only a turn to
that side presses it further; a face ahead is pressed by a turn that brings the tip further forward.
"""

import math
from dataclasses import dataclass

from .scene import Whisker

NEAREST_MM = 60.0  # the line is fitted from 90 mm on; what reads much nearer was no plain contact


@dataclass(frozen=True)
class Mount:
    """An object whisker's signs of turn (+1 anticlockwise) and length."""

    corner_turn: float  # presses a corner that the shaft met while driving forward
    face_turn: float  # presses a face ahead that the tip met
    length_mm: float

    @classmethod
    def of(cls, whisker: Whisker) -> "Mount":
        """From the robot's description; lengths in m, robot frame x forward, y left."""
        tip_y = whisker.base_m[1] + whisker.length_m * math.sin(whisker.yaw_rad)
        corner_turn = math.copysign(1.0, -math.sin(whisker.yaw_rad))
        return cls(corner_turn, math.copysign(1.0, -tip_y), 1000.0 * whisker.length_m)

    def distance(self, line_mm: float, turn: float) -> float | None:
        """Distance of a contact pressed by this turn whose peak equation 3 places at `line_mm`; None when unsure."""
        if turn != self.corner_turn or line_mm >= self.length_mm:
            return self.length_mm
        if self.corner_turn == self.face_turn or line_mm < NEAREST_MM:
            return None
        return line_mm
