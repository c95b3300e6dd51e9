"""Policies in the place of the pilot's random choices: planned ones, and those beside which they are measured."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..pilot.choices import Choices
from .planner import NOTHING_TOLD, Past, Plan, Planner

STRAIGHT_ON_RAD = 1e-3  # a turn that is over at once
Belief = Callable[[], np.ndarray | None]  # components about the present pose; None: not known yet
Truth = Callable[[], np.ndarray]  # (3,) the true pose, for a policy that may know


class Planned:
    """What a planner says; where it has nothing to say, or no belief has come yet, what `otherwise` says."""

    remembers = False

    def __init__(self, planner: Planner, belief: Belief, otherwise: Choices, truth: Truth | None = None):
        self._planner, self._belief, self._otherwise, self._truth = planner, belief, otherwise, truth
        self.plan = Plan()
        self._tick = -1  # of the plan
        self.plans = 0  # made so far
        self._drive: float | None = None  # that follows the turn that was asked for, m

    def on(self, b: Any, tick: int) -> float:
        """As in pilot.choices.Choices."""
        self._renew(b, tick)
        turn, drive = self.plan.moves[0] if self.plan.path else (0.0, 0.0)
        return drive if turn == 0.0 else 0.0

    def turn(self, b: Any, tick: int, least_deg: float, most_deg: float) -> float:
        """As in pilot.choices.Choices."""
        self._renew(b, tick)
        if self.plan.refused == NOTHING_TOLD:
            return 0.0
        if self.plan.path is None:
            return self._otherwise.turn(b, tick, least_deg, most_deg)
        turn, self._drive = self.plan.moves[0]
        return turn or STRAIGHT_ON_RAD

    def distance(self, b: Any, tick: int) -> float:
        """As in pilot.choices.Choices; none where no turn was asked for before, so that one is asked for at once. An escape is
        not cut short."""
        if tick == b.turned_away or (self.plan.path is None and self.plan.refused):
            return self._otherwise.distance(b, tick)
        drive, self._drive = self._drive, None
        return drive or 0.0

    def whisk(self, b: Any, tick: int) -> bool:
        """As in pilot.choices.Choices: whether it yields more per second than to go away and do what is best then."""
        components = self._belief()
        if components is None:
            return self._otherwise.whisk(b, tick)
        truth = None if self._truth is None else self._truth()
        return self._planner.whisk(components, truth).bits_per_s > self._planned(b).bits_per_s

    def _renew(self, b: Any, tick: int) -> None:
        """The plan becomes that of this tick."""
        if tick != self._tick:
            self.plan, self._tick, self._drive = self._planned(b), tick, None

    def _planned(self, b: Any) -> Plan:
        components = self._belief()
        if components is None:
            return Plan()
        truth = None if self._truth is None else self._truth()
        self.plans += 1
        return self._planner.plan(components, Past(b.whereabouts.things(), b.whereabouts.been()), truth)
