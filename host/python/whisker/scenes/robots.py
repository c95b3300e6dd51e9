"""Robots with different whiskers. Robot frame: x forward, y left."""

from ..scene import Robot, Whisker

BODY_RADIUS_M = 0.165  # iRobot Create
LENGTH_M = 0.14
RIM = ((0.13, 0.05, 0.2), (0.13, -0.05, -0.2), (0.1, 0.1, 0.7), (0.1, -0.1, -0.7))  # base x, y in m, yaw in rad


def tips(*places: tuple[float, float]) -> tuple[Whisker, ...]:
    """Texture whiskers with tips at these places."""
    return tuple(Whisker(f"floor{n + 1}", "texture", tip_m=place) for n, place in enumerate(places))


def rays(*places: tuple[float, float, float], length_m: float = LENGTH_M) -> tuple[Whisker, ...]:
    """Object whiskers with bases and yaws at these places."""
    return tuple(
        Whisker(f"object{n + 1}", "object", base_m=(x, y), yaw_rad=yaw, length_m=length_m)
        for n, (x, y, yaw) in enumerate(places)
    )


def anchor() -> Robot:
    """Two texture whiskers beside the body, four object whiskers before it."""
    return Robot(BODY_RADIUS_M, 0.05, 0.005, (*tips((0.05, 0.2), (0.05, -0.2)), *rays(*RIM)))
