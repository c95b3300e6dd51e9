"""The pilot's choices by name, and the navigator's belief, moved on by odometry, for those that plan."""

import math
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np

from ..nav.filters import COMPONENT
from ..pilot.choices import Choices
from ..pilot.states import CLEAR_M, EXPLORE_M_S, TURN_RAD_S
from ..planning.actions import Vehicle
from ..planning.beside import Along, Lanes
from ..planning.choices import Planned
from ..planning.ground import ArenaMap, Ground
from ..planning.planner import Planner
from ..scene import Scene
from .network.link import Link

RANDOM, PLAN = "random", "plan"
POLICIES = (RANDOM, PLAN, "wall", "lanes")
AGE_ROWS = 30  # an older belief is none
WHISK_S, SETTLE_S = 4.0, 0.25  # of the behaviour's body whisk with its way back, and change of speed, about


class FollowedBelief:
    """The navigator's newest belief about the pose after the newest row. `row` after each row that is sent; called, it gives
    (n,) of COMPONENT, or None where no belief is as new as AGE_ROWS."""

    def __init__(self, link: Link):
        self._inbox = link.subscribe("belief")
        self._poses: deque[tuple[int, np.ndarray]] = deque(maxlen=AGE_ROWS)
        self._newest: Any = None

    def row(self, seq: int, pose: np.ndarray) -> None:
        """Row `seq` was sent; pose (3,): motion summed up to it, m, m, rad."""
        self._poses.append((seq, np.array(pose, float)))

    def __call__(self) -> np.ndarray | None:
        """As said of the class."""
        for received in self._inbox.take(0.0):
            self._newest = None if received.over else received.message
        then = next((pose for seq, pose in self._poses if self._newest and seq == self._newest.observation_seq), None)
        if then is None or not len(self._newest.x):
            return None
        out = np.zeros(len(self._newest.x), COMPONENT)
        at = np.column_stack([self._newest.x, self._newest.y, self._newest.theta]).astype(float)
        out["pose"], out["mass"] = _moved(at, then, self._poses[-1][1]), self._newest.weight
        return out


def _moved(poses: np.ndarray, then: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Poses (n, 3) after the motion from odometry's pose `then` to `now`."""
    c, s = math.cos(then[2]), math.sin(then[2])
    x, y = now[:2] - then[:2]
    ahead, aside = c * x + s * y, c * y - s * x
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x, y = poses[:, 0] + cosine * ahead - sine * aside, poses[:, 1] + sine * ahead + cosine * aside
    return np.column_stack([x, y, poses[:, 2] + now[2] - then[2]])


def choices_of(name: str, scene: Scene, belief: Callable[[], np.ndarray | None], random: Choices) -> Choices:
    """The choices of this name of POLICIES; `random`: the behaviour's own."""
    if name == PLAN:
        vehicle = Vehicle(EXPLORE_M_S, TURN_RAD_S, CLEAR_M / EXPLORE_M_S, WHISK_S, SETTLE_S)
        return Planned(Planner(Ground.of(ArenaMap(scene.arena), scene.robot), vehicle), belief, random)
    return {RANDOM: random, "wall": Along(), "lanes": Lanes()}[name]


def expected(choices: Choices) -> dict[str, str]:
    """What a planner expects of what the robot does now, for its health; empty where none plans."""
    if not isinstance(choices, Planned):
        return {}
    plan = choices.plan
    if plan.refused:
        return {"expects": f"0 bits: {plan.refused}"}
    if plan.seconds == 0.0:
        return {"expects": "no belief yet"}
    moves = ", ".join(f"turn {math.degrees(turn):.0f} degrees, drive {drive:.1f} m" for turn, drive in plan.moves)
    return {"expects": f"{plan.bits:.1f} bits in {plan.seconds:.1f} s: {moves}"}
