"""Drives a base that nobody else drives: moves in turn, so many times; prints what the base reports after each time.

Usage: python drive.py SOCKET TIMES V OMEGA SECONDS [V OMEGA SECONDS ...]   (m/s, rad/s; SOCKET of `whisker-base --socket`)
"""

import sys
import time

from crunchbot.pilot.base import Base

AGAIN_S = 0.05  # an order holds for 0.3 s


def main(path: str, times: int, moves: list[tuple[float, float, float]]) -> None:
    with Base(path) as base:
        for _ in range(times):
            for v, omega, seconds in moves:
                end = time.monotonic() + seconds
                while time.monotonic() < end:
                    base.drive(v, omega)
                    time.sleep(AGAIN_S)
            print(base.odometry())


if __name__ == "__main__":
    if len(sys.argv) < 6 or len(sys.argv) % 3:
        sys.exit(__doc__.splitlines()[2])
    main(sys.argv[1], int(sys.argv[2]), list(zip(*[map(float, sys.argv[3:])] * 3, strict=True)))
