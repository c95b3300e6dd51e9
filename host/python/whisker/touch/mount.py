"""What a body whisk can tell of an object depends on how the whisker is mounted and on which way it was pressed.

Equation 3 holds for a corner under the shaft. A tip on a face is dragged along it as the robot turns, and bends by more
or less than the turn, so the line's answer is not its distance; but then the distance is known: the whisker's length.
Driving forward, a corner comes to lie on the side to which the shaft leans over the robot's path, and only a turn to
that side presses it further; a face ahead is pressed by a turn that brings the tip further forward.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..native import ffi, lib
from ..scene import Whisker
from .radial.whisk import WhiskModel

LEAST_CONFIDENCE = 0.5  # a corner whose whisk is less surely one of those calibrated is not told
SURE = 0.9  # probability of face or corner; below, the bending by the turn alone decides
# Of a retreat, the part of the bending over which a line is laid: the start rings, the end is noise.
RETREAT_SHARES, RETREAT_TOP, RETREAT_LEAST = (0.2, 0.85), 40, 20  # the latter two in samples
SURFACE = ("face", "normal_rad", "normal_sigma_rad", "radius_mm", "radius_sigma_mm")
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
        """From the robot's description; lengths in m, robot frame x forward, y left."""
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

    def surface(self, model: WhiskModel, per_metre: float, share: float, turn: float) -> dict[str, float]:
        """Face or corner, and how it lies (host/nav/touch/contact_surface.h, struct nav_surface).

        Tilt of the plug (rad) per metre driven forward, and per radian pushed by this turn (`share_of`), both positive in
        the direction of calibration; face 0.5 and the widest deviations when one is nan or neither explains them.
        """
        mount = {"base_m": list(self.base_m), "yaw_rad": self.yaw_rad, "length_m": 1e-3 * self.length_mm}
        mount |= {name: getattr(model, name) for name in ("kappa", "cone_mm", "spread")}
        mount |= {"corner_low_mm": model.low_mm, "corner_high_mm": model.tip_mm}
        out = ffi.new("struct nav_surface *")
        # There positive is clockwise, as in calibration where that turned the robot anticlockwise.
        seen = {"per_metre": self.calibrated_turn * per_metre, "per_radian": self.calibrated_turn * share * turn}
        lib.nav_surface_of(
            ffi.new("struct nav_surface_mount *", mount), ffi.new("struct nav_surface_seen *", seen), out
        )
        return {name: getattr(out, name) for name in SURFACE}

    def whisked(self, model: WhiskModel, shape, turn: float, per_metre: float) -> float | None:
        """Distance of a contact pressed by this turn, mm, from its whole whisk; None when unsure.

        `per_metre` is the tilt of the plug per metre driven towards the contact (`retreat`), positive in the direction of
        calibration. A tip on a face bends by anything up to what the innermost corner would, to that side; what bends
        more is caught somewhere, and what bends to the other side is caught or a corner that was not calibrated.
        """
        share = model.share_of(shape)
        if not 0.0 < share <= model.share(model.low_mm):
            return None
        if turn != self.corner_turn:
            return self.length_mm
        face = self.surface(model, per_metre, share, turn)["face"]
        told = model.estimate(shape)
        if max(face, 1.0 - face) < SURE:
            face = float(share < model.share(model.tip_mm))
            if face < 0.5 and self.corner_turn == self.face_turn:
                return None
        if face > 0.5:
            return self.length_mm
        return told.radius_mm if told.confidence >= LEAST_CONFIDENCE else None


def retreat(metres, tilt) -> float:
    """Tilt per metre (rad/m) towards the contact while the robot backs off from it, by a line; nan when it cannot be laid.

    `metres` (n,) backed off, from where the robot has just begun; `tilt` (n,) of the plug there, rad.
    """
    if len(tilt) < RETREAT_TOP:
        return math.nan
    part = np.asarray(tilt) / np.median(tilt[:RETREAT_TOP])
    use = (part > RETREAT_SHARES[0]) & (part < RETREAT_SHARES[1])
    if np.count_nonzero(use) < RETREAT_LEAST:
        return math.nan
    return -float(np.polyfit(np.asarray(metres)[use], np.asarray(tilt)[use], 1)[0])
