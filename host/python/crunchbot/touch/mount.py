"""What a body whisk can measure of an object depends on how the whisker is mounted and on which way it was pressed.

Equation 3 holds for a corner under the shaft. A tip on a face is dragged along it as the robot turns, and bends by more
or less than the turn, so the line's answer is not its distance; but then the distance is known: the whisker's length.
Driving forward, a corner comes to lie on the side to which the shaft leans over the robot's path, and only a turn to
that side presses it further; a face ahead is pressed by a turn that brings the tip further forward.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..scene import Whisker
from .contact_filter import SURE

NEAREST_MM = 60.0  # the line is fitted from 90 mm on; what reads much nearer was no plain contact


@dataclass(frozen=True)
class Mount:
    """An object whisker's signs of turn (+1 anticlockwise) and length."""

    corner_turn: float  # presses a corner that the shaft met while driving forward
    calibrated_turn: float  # presses the post of calibration, which stands on the side away from the robot's centre
    face_turn: float  # presses a face ahead that the tip met
    length_mm: float
    base_m: tuple[float, float]
    yaw_rad: float

    @classmethod
    def of(cls, whisker: Whisker) -> "Mount":
        """Makes a mount from the robot's description; lengths in m, robot frame x forward, y left."""
        tip_y = whisker.base_m[1] + whisker.length_m * math.sin(whisker.yaw_rad)
        corner_turn = math.copysign(1.0, -math.sin(whisker.yaw_rad))
        face_turn = math.copysign(1.0, -tip_y)
        aside = whisker.base_m[1] * math.cos(whisker.yaw_rad) - whisker.base_m[0] * math.sin(whisker.yaw_rad)
        calibrated_turn = math.copysign(1.0, aside)
        return cls(corner_turn, calibrated_turn, face_turn, 1000.0 * whisker.length_m, whisker.base_m, whisker.yaw_rad)

    def distance(self, line_mm: float, turn: float) -> float | None:
        """Distance of a contact pressed by this turn whose peak equation 3 places at `line_mm`; None when unsure."""
        if turn != self.corner_turn or line_mm >= self.length_mm:
            return self.length_mm
        if self.corner_turn == self.face_turn or line_mm < NEAREST_MM:
            return None
        return line_mm

    def felt(
        self, faces: Sequence[float], point_m: tuple[float, float], sd_m: float, nearest_mm: float, sure_m: float
    ) -> float | None:
        """Distance, mm, of what the contact filter places in the robot's frame at the release; None when unsure.

        `faces`: probabilities that the tip is on a surface, at different times. A tip that a face holds may bend the
        whisker as an object near its base would: nearer than `nearest_mm` nothing was calibrated.
        """
        if min(faces) >= SURE:
            return self.length_mm
        distance = 1e3 * math.dist(self.base_m, point_m)
        return distance if max(faces) <= 1.0 - SURE and sd_m <= sure_m and distance >= nearest_mm else None
