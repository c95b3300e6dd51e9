"""The pilot's choices by name: at random, or by a map of the pilot's own, which follows the rows that are sent."""

import argparse
from dataclasses import replace

import numpy as np

from ..nav.mapper import PATCH_M, Mapper, TouchMap
from ..nav.mapping import textures_in
from ..nav.observations import observed
from ..observation import Row, has_normals
from ..pilot.choices import Choices
from ..pilot.states import CLEAR_M
from ..pilot.wheels import Wheels
from ..planning.coverage import Vehicle
from ..planning.mapping import Mapping
from ..scene import Arena, Robot, Scene

RANDOM, MAP = "random", "map"


def add_choices(parser: argparse.ArgumentParser) -> None:
    """--choose, for commands that start a pilot."""
    text = "turns and distances: at random, or map: to new floor, by a map of the pilot's own"
    parser.add_argument("--choose", choices=(RANDOM, MAP), default=RANDOM, help=text)


class OwnMap:
    """The pilot's own mapper: no other process is needed, and the same rows give the same map on any machine."""

    def __init__(self, robot: Robot):
        self._robot = replace(robot, sensors=())
        self._mapper: Mapper | None = None
        self._scene: Scene | None = None
        self._pose = np.zeros(3)

    def row(self, row: Row) -> None:
        """Takes a row that is sent."""
        if self._mapper is None:
            textures = textures_in(row.names, self._robot) or ("NONE",)
            self._scene = Scene(Arena((PATCH_M, PATCH_M), PATCH_M, textures, ("?",), ()), self._robot)
            self._mapper = Mapper(self._robot, textures, normals=has_normals(row.names))
        self._pose = self._mapper.replay(observed(row, self._scene), 0, 1)[0]["pose"][0].copy()

    def pose(self) -> np.ndarray | None:
        """(3,) after the newest row; None: there was none."""
        return None if self._mapper is None else self._pose

    def map(self) -> TouchMap:
        """The map after the newest row."""
        return self._mapper.map()


def vehicle_of(wheels: Wheels) -> Vehicle:
    """What a way costs a robot on these wheels."""
    return Vehicle(wheels.explore_m_s, wheels.turn_rad_s, CLEAR_M / wheels.explore_m_s, 0.25)


def choices_of(name: str, robot: Robot, wheels: Wheels, random: Choices) -> tuple[Choices, OwnMap | None]:
    """The choices of this name, and what must take every row that is sent; `random`: the behaviour's own."""
    if name == RANDOM:
        return random, None
    own = OwnMap(robot)
    return Mapping(robot, vehicle_of(wheels), own.pose, own.map, random), own


def expected(choices: Choices) -> dict[str, str]:
    """What a planner expects of what the robot does now, for its health; empty where none plans."""
    if not isinstance(choices, Mapping):
        return {}
    way = choices.way
    if way.refused:
        return {"expects": f"nothing: {way.refused}"}
    if not len(way.corners):
        return {"expects": "no pose yet"}
    return {"expects": f"{way.swept_m2:.2f} m2 of floor in {way.seconds:.1f} s"}
