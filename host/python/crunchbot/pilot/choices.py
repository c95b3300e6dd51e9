"""What the behaviour leaves open: how far to turn and to drive, and whether a contact is worth a body whisk.

`Random` is the default. A planner (crunchbot.planning) is another.
"""

import math
from typing import Any, Protocol

import numpy as np

from .states import EXPLORE_M_S


class Choices(Protocol):
    """Asked by the behaviour `b` at a tick; `b` is read only. `remembers`: it keeps away from what it met by itself, so that the
    behaviour escapes from nothing."""

    remembers: bool

    def on(self, b: Any, tick: int) -> float:
        """At the end of a drive: how far to go on as now, m; 0: a turn comes first. May be asked more than once at a tick."""
        ...

    def turn(self, b: Any, tick: int, least_deg: float, most_deg: float) -> float:
        """Angle of the next turn, rad, anticlockwise; 0: no turn is worth it now, stand still and ask again. A random one has
        between `least_deg` and `most_deg`."""
        ...

    def distance(self, b: Any, tick: int) -> float:
        """Length of the next drive, m, at least 0."""
        ...

    def whisk(self, b: Any, tick: int) -> bool:
        """Whether to whisk at what was touched."""
        ...


class Random:
    """Random exploration: a drive of 3 to 8 s, then a turn to either side; every contact is whisked at."""

    remembers = False

    def __init__(self, rng: np.random.Generator):
        self._rng = rng

    def on(self, b: Any, tick: int) -> float:
        """As in `Choices`: never."""
        return 0.0

    def turn(self, b: Any, tick: int, least_deg: float, most_deg: float) -> float:
        """As in `Choices`."""
        turn = math.radians(self._rng.uniform(least_deg, most_deg))
        return turn if self._rng.random() < 0.5 else -turn

    def distance(self, b: Any, tick: int) -> float:
        """As in `Choices`."""
        return EXPLORE_M_S * self._rng.uniform(3.0, 8.0)

    def whisk(self, b: Any, tick: int) -> bool:
        """As in `Choices`: always."""
        return True
