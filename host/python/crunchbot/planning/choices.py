"""Policies in the place of the pilot's random choices: planned ones, and those beside which they are measured."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..pilot.choices import Choices
from ..pilot.whereabouts import Whereabouts
from .planner import DOUBT, DOUBT_MOST, NOTHING_TOLD, Past, Plan, Planner

STRAIGHT_ON_RAD = 1e-3  # a turn that is over at once
STOPPED_M = 0.05  # shorter than planned by so much: something was in the way
Belief = Callable[[], np.ndarray | None]  # components about the present pose; None: not known yet


class Planned:
    """What a planner says; where it has nothing to say, or no belief has come yet, what `otherwise` says."""

    def __init__(self, planner: Planner, belief: Belief, otherwise: Choices):
        self._planner, self._belief, self._otherwise = planner, belief, otherwise
        self.plan, self.doubt, self._from = Plan(), DOUBT, (0.0, 0.0)
        self._ready = self._planned = False  # the plan's turn is taken and its drive is not; the last turn was planned

    def turn(self, b: Any, tick: int, least_deg: float, most_deg: float) -> float:
        """As in pilot.choices.Choices."""
        components = self._belief()
        self._learn(b.whereabouts)
        self.plan = Plan() if components is None else self._planner.plan(components, _past(b), self.doubt)
        self._from = b.whereabouts.place
        self._ready = self._planned = self.plan.seconds > 0.0
        if self.plan.refused == NOTHING_TOLD:
            return 0.0
        if not self._planned:
            return self._otherwise.turn(b, tick, least_deg, most_deg)
        return self.plan.turn_rad or STRAIGHT_ON_RAD

    def distance(self, b: Any, tick: int) -> float:
        """As in pilot.choices.Choices; none where no turn was asked for before, so that one is asked for at once. An escape is
        not cut short."""
        if tick != b.turned_away and (self._planned or not self.plan.refused):
            self._ready, ready = False, self._ready
            return self.plan.distance_m if ready else 0.0
        return self._otherwise.distance(b, tick)

    def _learn(self, whereabouts: Whereabouts) -> None:
        """By Bayes's rule from whether the last drive came through: a belief that expected otherwise is in doubt."""
        if self.plan.distance_m > 0.0:
            x, y = whereabouts.place
            through = math.hypot(x - self._from[0], y - self._from[1]) > self.plan.distance_m - STOPPED_M
            right, wrong = (p if through else 1.0 - p for p in self.plan.passed)
            doubt = self.doubt * wrong / (self.doubt * wrong + (1.0 - self.doubt) * right)
            self.doubt = min(max(doubt, DOUBT), DOUBT_MOST)

    def whisk(self, b: Any, tick: int) -> bool:
        """As in pilot.choices.Choices: whether it tells more per second than to go away and do what is best then."""
        components = self._belief()
        if components is None:
            return self._otherwise.whisk(b, tick)
        rest = self._planner.plan(components, _past(b), self.doubt)
        return self._planner.whisk(components, self.doubt).bits_per_s > rest.bits_per_s


def _past(b: Any) -> Past:
    return Past(b.whereabouts.things(), b.whereabouts.been())
