"""Policies without a belief, beside which a planner is measured: along walls, and to and fro in lanes."""

import math
from typing import Any

LANE_M = 0.35  # between two lanes: what the texture whiskers sweep
HUG_M = 0.3  # along a wall, before it is turned to again
OUT_RAD, IN_RAD = math.radians(75.0), math.radians(45.0)


class Along:
    """Follows what it meets: out by OUT_RAD, HUG_M along it, in by IN_RAD until it is met again. It keeps the wall to its right;
    every contact is whisked at."""

    remembers = False

    def __init__(self) -> None:
        self._met = False

    def on(self, b: Any, tick: int) -> float:
        """As in pilot.choices.Choices."""
        return 0.0

    def turn(self, b: Any, tick: int, least_deg: float, most_deg: float) -> float:
        """As in pilot.choices.Choices."""
        self._met = least_deg >= 60.0  # the turn after something was in the way
        return OUT_RAD if self._met else -IN_RAD

    def distance(self, b: Any, tick: int) -> float:
        """As in pilot.choices.Choices."""
        return HUG_M if self._met else math.inf

    def whisk(self, b: Any, tick: int) -> bool:
        """As in pilot.choices.Choices."""
        return True


class Lanes:
    """Boustrophedon: straight on until something is met, a quarter turn, LANE_M, a quarter turn to the same side, and back."""

    remembers = False

    def __init__(self) -> None:
        self._side, self._across = 1.0, False

    def on(self, b: Any, tick: int) -> float:
        """As in pilot.choices.Choices."""
        return 0.0

    def turn(self, b: Any, tick: int, least_deg: float, most_deg: float) -> float:
        """As in pilot.choices.Choices."""
        if self._across:
            self._across, turned = False, self._side * math.pi / 2.0
            self._side = -self._side
            return turned
        self._across = True
        return self._side * math.pi / 2.0

    def distance(self, b: Any, tick: int) -> float:
        """As in pilot.choices.Choices."""
        return LANE_M if self._across else math.inf

    def whisk(self, b: Any, tick: int) -> bool:
        """As in pilot.choices.Choices."""
        return True
