"""Makes plans, and nothing else: what `nav_active` counts the instructions of. Arguments: how many, and
first actions that are looked at with a second one."""

import sys

import numpy as np

from crunchbot.nav.filters import COMPONENT
from crunchbot.pilot.states import EXPLORE_M_S, TURN_RAD_S
from crunchbot.planning.actions import Vehicle
from crunchbot.planning.ground import ArenaMap, Ground
from crunchbot.planning.planner import Planner
from crunchbot_lab.simulation.scenes import make_scene


def plans(count: int, after: int) -> None:
    """`count` plans of the demo's robot, each for 500 components anywhere."""
    scene, rng = make_scene(1)[0], np.random.default_rng(1)
    planner = Planner(
        Ground.of(ArenaMap(scene.arena), scene.robot), Vehicle(EXPLORE_M_S, TURN_RAD_S, 0.5, 4.0, 0.25), after
    )
    for _ in range(count):
        belief = np.zeros(500, COMPONENT)
        belief["pose"], belief["mass"] = rng.uniform((0.3, 0.3, -3.1), (2.2, 2.2, 3.1), (500, 3)), 0.002
        planner.plan(belief)


if __name__ == "__main__":
    plans(int(sys.argv[1]), int(sys.argv[2]))
