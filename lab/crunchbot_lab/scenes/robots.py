"""Robots with different whiskers. Robot frame: x forward, y left."""

import math

from crunchbot.scene import Robot, Whisker

BODY_RADIUS_M = 0.165  # iRobot Create
LENGTH_M = 0.14
RIM = ((0.13, 0.05, 0.2), (0.13, -0.05, -0.2), (0.1, 0.1, 0.7), (0.1, -0.1, -0.7))  # base x, y in m, yaw in rad
SIDES = ((0.05, 0.2), (0.05, -0.2))


def tips(*places: tuple[float, float]) -> tuple[Whisker, ...]:
    """Texture whiskers with tips at these places."""
    return tuple(Whisker(f"floor{n + 1}", "texture", tip_m=place) for n, place in enumerate(places))


def rays(*places: tuple[float, float, float], length_m: float = LENGTH_M) -> tuple[Whisker, ...]:
    """Object whiskers with bases and yaws at these places."""
    return tuple(
        Whisker(f"object{n + 1}", "object", base_m=(x, y), yaw_rad=yaw, length_m=length_m)
        for n, (x, y, yaw) in enumerate(places)
    )


def robot(*whiskers: Whisker, odometry: float = 0.05, radial: float = 0.005, radius: float = BODY_RADIUS_M) -> Robot:
    return Robot(radius, odometry, radial, whiskers)


def anchor() -> Robot:
    """Two texture whiskers beside the body, four object whiskers before it."""
    return robot(*tips(*SIDES), *rays(*RIM))


def noisy() -> Robot:
    """The anchor's, of which twice the noise is known."""
    return robot(*tips(*SIDES), *rays(*RIM), odometry=0.1, radial=0.01)


def one_whisker() -> Robot:
    """One object whisker straight ahead, no texture."""
    return robot(*rays((0.15, 0.0, 0.0)))


def no_whisker() -> Robot:
    return robot()


def three_floor() -> Robot:
    """Three texture whiskers, two object whiskers."""
    return robot(*tips(*SIDES, (-0.2, 0.0)), *rays(*RIM[:2]))


def ring(count: int = 12, length_m: float = 0.1, radius: float = 0.1) -> Robot:
    """Object whiskers all round a smaller body, and one texture whisker."""
    angles = [2 * math.pi * n / count for n in range(count)]
    places = [(0.8 * radius * math.cos(a), 0.8 * radius * math.sin(a), math.remainder(a, 2 * math.pi)) for a in angles]
    return robot(*tips((0.0, 0.0)), *rays(*places, length_m=length_m), radius=radius)
