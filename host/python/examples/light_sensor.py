"""A sensor of one's own as NumPy functions: a light sensor finds a robot whose start nobody knows, under lamps that
were measured before.

Prints where the filter puts the robot at the end, and where it is.
"""

import math

import numpy as np

from crunchbot.nav.filters import Filter
from crunchbot.nav.own import OwnSensor
from crunchbot.scene import Arena, Prior, Robot, Scene

SIZE_M = (2.0, 2.0)
NOISE = 0.05
ROWS = 200


def expected(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Brightness at places."""
    return 2.5 + np.sin(2.1 * x + 0.3) + np.cos(1.7 * y - 0.4) + 0.8 * np.sin(1.3 * x * y)


def loglik(reading: float, levels: np.ndarray) -> np.ndarray:
    """Log-likelihood of a reading where these levels are expected."""
    return -0.5 * ((reading - levels) / (2 * NOISE)) ** 2


def main() -> float:
    """Distance of the answer from the truth, m."""
    light = OwnSensor(SIZE_M, 0.02, expected, loglik, np.arange(0.0, 5.5, 0.05), spacing_m=0.02, detail_m=0.2)
    floor = Arena(SIZE_M, 2.0, ("FLOOR",), ("F",), ())
    scene = Scene(
        floor,
        Robot(body_radius_m=0.1, odometry_relative_sigma=0.05, radial_sigma_m=0.005, whiskers=()),
        Prior("uniform"),
    )
    filter, rng = Filter("adaptive", scene, sensors=[light.sensor]), np.random.default_rng(1)
    x, y, heading = 1.0, 0.4, 0.0
    for row in range(1, ROWS + 1):
        turn = 0.06 + 0.02 * math.sin(0.05 * row)
        x, y, heading = x + 0.03 * math.cos(heading), y + 0.03 * math.sin(heading), heading + turn
        reading = expected(x, y) + NOISE * rng.standard_normal()
        found = filter.step_values(0.1 * row, (0.03, 0.0, turn), np.zeros((0, 1)), [], light.read(reading))
    print(f"at ({x:.2f}, {y:.2f}), found at ({found.x_m:.2f}, {found.y_m:.2f}), confidence {found.confidence:.2f}")
    return math.dist((x, y), (found.x_m, found.y_m))


if __name__ == "__main__":
    main()
