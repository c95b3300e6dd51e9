"""After a contact with the shaft: which small move lets the next contact be at the tip (the paper's Fig. 2).

The object is a corner under the shaft at the distance that was measured. Backing off carries it outwards in the robot's
frame, until it is as far from the robot's centre as the aim near the tip; a turn then presses that part of the whisker on it.
"""

import math

from ..touch.mount import Mount
from .states import TipMove

TIP_MM = 10.0  # from the whisker's end: one step of the paper's calibration; further in it is the shaft
# Within the tip's part, but not nearer to the end: pushed by the whisk's 4.5 degrees a corner slips off the last millimetres,
# and the distance that was measured is good to a few.
AIM_MM = 8.0
RETREAT_MOST_M = 0.15


def contact_type(mount: Mount, distance_mm: float | None) -> str | None:
    """What touched, "tip" or "shaft", of a contact reported at this distance; None when it was not reported."""
    if distance_mm is None:
        return None
    return "tip" if distance_mm > mount.length_mm - TIP_MM else "shaft"


def move_for_tip(mount: Mount, distance_mm: float, aim_mm: float = AIM_MM) -> TipMove | None:
    """The move from the pose in which the unbent whisker just touches at `distance_mm`; None when no small move does it."""
    x, y = _point(mount, 1e-3 * distance_mm)
    aim_x, aim_y = _point(mount, 1e-3 * (mount.length_mm - aim_mm))
    reach = math.hypot(aim_x, aim_y)
    if abs(y) >= reach:
        return None
    ahead = math.sqrt(reach**2 - y**2)
    retreat = ahead - x
    turn = math.remainder(math.atan2(y, ahead) - math.atan2(aim_y, aim_x), 2.0 * math.pi)
    if not 0.0 < retreat <= RETREAT_MOST_M or turn * mount.corner_turn <= 0.0:
        return None
    return TipMove(retreat, turn)


def _point(mount: Mount, radius_m: float) -> tuple[float, float]:
    """The place of the shaft at this radius, robot frame, m."""
    along = (math.cos(mount.yaw_rad), math.sin(mount.yaw_rad))
    return mount.base_m[0] + radius_m * along[0], mount.base_m[1] + radius_m * along[1]
