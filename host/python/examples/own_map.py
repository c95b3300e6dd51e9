"""A map and a sensor of one's own: a robot that does not know where it starts finds itself in a map server's map.

Usage: whisker examples; python own_map.py [FOLDER]   (default: examples, for its home.yaml)

The map brings walls and a cupboard, which a whisker on the left touches; the sensor is the strength of a radio beacon.
Prints where the filter puts the robot at the end, and where it is.
"""

import math
import sys
from pathlib import Path

import numpy as np

from crunchbot.nav.filters import Filter
from crunchbot.nav.own import OwnSensor
from crunchbot.occupancy import read_map
from crunchbot.scene import Arena, Prior, Robot, Scene, Whisker

ROWS, STEP_M, ROUND_M = 150, 0.03, 0.42  # of the drive: rows, way of one, radius of the circle
BEACON_M, NOISE_DB = (0.3, 0.5), 0.5
WHISKER = Whisker("left", "object", base_m=(0.0, 0.1), yaw_rad=math.pi / 2, length_m=0.14)
BODY_M = 0.1


def strength(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Decibels of the beacon at places in m: it fades with the square of the distance."""
    return -20.0 * np.log10(0.1 + np.hypot(x - BEACON_M[0], y - BEACON_M[1]))


def loglik(reading: float, levels: np.ndarray) -> np.ndarray:
    """Log-likelihood of a reading in decibels where these levels are expected."""
    return -0.5 * ((reading - levels) / NOISE_DB) ** 2


def touched_m(arena: Arena, pose: tuple[float, float, float]) -> float:
    """Distance along the whisker at which something touches it; infinite: nothing does."""
    x, y, heading = pose
    left = heading + WHISKER.yaw_rad
    for along in np.arange(0.0, WHISKER.length_m, 0.001):
        reach = WHISKER.base_m[1] + along
        if not arena.is_free(x + reach * math.cos(left), y + reach * math.sin(left), 0.0):
            return float(along)
    return math.inf


def main(folder: Path = Path("examples")) -> float:
    """Distance of the answer from the truth, m."""
    found = read_map(folder / "home.yaml")
    arena = Arena(found.size_m, max(found.size_m), ("FLOOR",), ("F",), found.solid, found.unknown)
    beacon = OwnSensor(found.size_m, 0.02, strength, loglik, np.arange(-12.0, 21.0, 0.25), spacing_m=0.02, detail_m=0.2)
    robot = Robot(BODY_M, odometry_relative_sigma=0.05, radial_sigma_m=0.005, whiskers=(WHISKER,))
    filter = Filter("adaptive", Scene(arena, robot, Prior("uniform")), sensors=[beacon.sensor])
    (left, low, right, high), rng = found.solid[0], np.random.default_rng(1)
    turn = STEP_M / ROUND_M  # anticlockwise about the cupboard, which so is on the left
    x, y, heading = (left + right) / 2 + ROUND_M, (low + high) / 2, math.pi / 2
    touches = 0
    for row in range(1, ROWS + 1):
        x, y = x + STEP_M * math.cos(heading + turn / 2), y + STEP_M * math.sin(heading + turn / 2)
        heading += turn
        radial = touched_m(arena, (x, y, heading))
        touches += math.isfinite(radial)
        own = beacon.read(float(strength(x, y)) + NOISE_DB * rng.standard_normal())
        answer = filter.step_values(0.1 * row, (STEP_M, 0.0, turn), np.zeros((0, 1)), [radial], own)
    print(f"{touches} rows with a contact; at ({x:.2f}, {y:.2f}), found at ({answer.x_m:.2f}, {answer.y_m:.2f})")
    return math.dist((x, y), (answer.x_m, answer.y_m))


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
