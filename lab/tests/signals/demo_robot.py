"""The demo's robot in the paper's arena, as a scene's flat text."""

import math

ARENA = """\
size_m 2.5 2.5
tile_m 0.5
texture VINYL
texture SMOOTH
texture ROUGH
floor VRVSR
floor SVRRV
floor RSVVS
floor VRRSV
floor RSVRS
body_radius_m 0.165
"""
ARM_M, LENGTH_M = 0.16, 0.14


def _object_whisker(name: str, tip_deg: float, side: int) -> str:
    angle = math.radians(tip_deg) + side * math.atan(LENGTH_M / ARM_M)
    x, y, yaw = ARM_M * math.cos(angle), ARM_M * math.sin(angle), angle - side * math.pi / 2
    return f"object_whisker {name} {x!r} {y!r} {yaw!r} {LENGTH_M!r}\n"


def flat(start: tuple[float, float, float] = (0.75, 1.25, 0.0)) -> str:
    whiskers = [
        "texture_whisker left_floor -0.02 0.21\n",
        _object_whisker("left_outer", 60, 1),
        _object_whisker("left_inner", 20, 1),
        _object_whisker("right_inner", -20, -1),
        _object_whisker("right_outer", -60, -1),
        "texture_whisker right_floor -0.02 -0.21\n",
    ]
    return ARENA + "".join(whiskers) + "start {!r} {!r} {!r}\n".format(*start)
