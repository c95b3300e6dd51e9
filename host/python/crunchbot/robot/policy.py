"""The pilot's choices by name, and what those that plan know: the navigator's belief, moved on by odometry; a map of the
pilot's own; what the rows say of the tiles of a known floor. Each follows the rows that are sent."""

import math
from collections import deque
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from ..nav.filters import COMPONENT
from ..nav.mapper import PATCH_M, Mapper, TouchMap
from ..nav.mapping import textures_in
from ..observation import Row, has_normals
from ..pilot.choices import Choices
from ..pilot.states import CLEAR_M, EXPLORE_M_S, TURN_RAD_S
from ..planning.actions import Vehicle
from ..planning.beside import Along, Lanes
from ..planning.choices import Planned
from ..planning.ground import ArenaMap, Ground
from ..planning.planner import Planner
from ..planning.tasks import Checking, Driver, Mapping
from ..planning.tiles import Tile, Tiles
from ..scene import Arena, Robot, Scene
from .network.link import Link
from .observed import observed

RANDOM, PLAN, MAP, CHECK = "random", "plan", "map", "check"
POLICIES = (RANDOM, PLAN, MAP, CHECK, "wall", "lanes")
KNOW_ARENA = (PLAN, CHECK)
AROUND_M = 0.3  # from a belief's heaviest component
SIGMAS = ("sigma_m", "sigma_m", "sigma_rad")  # of a component, per axis
AGE_ROWS = 30  # an older belief is none
WHISK_S, SETTLE_S = 4.0, 0.25  # of the behaviour's body whisk with its way back, and change of speed, about


class RowTaker(Protocol):
    """Takes every row that is sent: its number `seq`, and the motion summed up to it, `pose` (3,), m, m, rad."""

    def row(self, seq: int, pose: np.ndarray, row: Row) -> None: ...


class FollowedBelief:
    """The navigator's newest belief about the pose after the newest row. `row` after each row that is sent; called, it gives
    (n,) of COMPONENT, or None where no belief is as new as AGE_ROWS."""

    def __init__(self, link: Link):
        self._inbox = link.subscribe("belief")
        self._poses: deque[tuple[int, np.ndarray]] = deque(maxlen=AGE_ROWS)
        self._newest: Any = None

    def row(self, seq: int, pose: np.ndarray, row: Row) -> None:
        """As in `RowTaker`."""
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


class OwnMap:
    """The pilot's own mapper: no other process is needed, and the same rows give the same map on any machine."""

    def __init__(self, robot: Robot, seed: int):
        self._robot, self._seed = replace(robot, sensors=()), seed
        self._mapper: Mapper | None = None
        self._scene: Scene | None = None
        self._pose = np.zeros(3)

    def row(self, seq: int, pose: np.ndarray, row: Row) -> None:
        """As in `RowTaker`."""
        if self._mapper is None:
            textures = textures_in(row.names, self._robot) or ("NONE",)
            self._scene = Scene(Arena((PATCH_M, PATCH_M), PATCH_M, textures, ("?",), ()), self._robot)
            self._mapper = Mapper(self._robot, textures, self._seed, normals=has_normals(row.names))
        self._pose = self._mapper.replay(observed(row, self._scene), 0, 1)[0]["pose"][0].copy()

    def pose(self) -> np.ndarray | None:
        """(3,) after the newest row; None: there was none."""
        return None if self._mapper is None else self._pose

    def map(self) -> TouchMap:
        """The map after the newest row."""
        return self._mapper.map()


class FollowedTiles(FollowedBelief):
    """A belief that is followed, and what the rows say of the tiles of the scene's floor. `checking` looks after each row."""

    def __init__(self, link: Link, scene: Scene):
        super().__init__(link)
        self._scene, self.tiles = (
            replace(scene, robot=replace(scene.robot, sensors=())),
            Tiles(scene.arena, scene.robot),
        )
        self.checking: Checking | None = None

    def row(self, seq: int, pose: np.ndarray, row: Row) -> None:
        """As in `RowTaker`."""
        super().row(seq, pose, row)
        if (estimate := self.estimate()) is not None:
            self.tiles.take(*estimate, observed(row, self._scene).texture[0])
        if self.checking:
            self.checking.look()

    def estimate(self) -> tuple[np.ndarray, np.ndarray, float] | None:
        """Pose, covariance and mass of the belief around its heaviest component; None: there is no belief."""
        components = self()
        if components is None:
            return None
        at, mass = components["pose"], components["mass"]
        here = np.hypot(*(at[:, :2] - at[mass.argmax(), :2]).T) < AROUND_M
        off = at[here] - at[mass.argmax()]
        off[:, 2] = np.remainder(off[:, 2] + math.pi, 2.0 * math.pi) - math.pi
        held = float(mass[here].sum())
        mean = mass[here] @ off / held
        spread = (off - mean).T @ ((off - mean) * mass[here, None]) / held
        spread += np.diag([float(mass[here] @ components[name][here] ** 2) / held for name in SIGMAS])
        return at[mass.argmax()] + mean, spread, held / float(mass.sum())


def taker_of(name: str, scene: Scene, link: Link, seed: int) -> RowTaker | None:
    """What the choices of this name need to know of the rows; None: nothing."""
    if name == MAP:
        return OwnMap(scene.robot, seed)
    if name == CHECK:
        return FollowedTiles(link, scene)
    return FollowedBelief(link) if name == PLAN else None


def choices_of(name: str, scene: Scene, taker: Any, random: Choices, tile: Tile | None = None) -> Choices:
    """The choices of this name of POLICIES, with what `taker_of` gave; `random`: the behaviour's own; `tile`: that CHECK
    looks at. ValueError when the floor has no such tile."""
    vehicle = Vehicle(EXPLORE_M_S, TURN_RAD_S, CLEAR_M / EXPLORE_M_S, WHISK_S, SETTLE_S)
    if name == MAP:
        return Mapping(scene.robot, vehicle, taker.pose, taker.map, random)
    if name not in KNOW_ARENA:
        return {RANDOM: random, "wall": Along(), "lanes": Lanes()}[name]
    ground = Ground.of(ArenaMap(scene.arena), scene.robot)
    planned = Planned(Planner(ground, vehicle), taker, random)
    if name == PLAN:
        return planned
    taker.checking = Checking(ground, vehicle, taker.tiles, taker.estimate, planned, tile)
    return taker.checking


def expected(choices: Choices) -> dict[str, str]:
    """What a planner expects of what the robot does now, for its health; empty where none plans."""
    if isinstance(choices, Driver):
        return _expected_on(choices)
    if not isinstance(choices, Planned):
        return {}
    plan = choices.plan
    if plan.refused:
        return {"expects": f"0 bits: {plan.refused}"}
    if plan.seconds == 0.0:
        return {"expects": "no belief yet"}
    moves = ", ".join(f"turn {math.degrees(turn):.0f} degrees, drive {drive:.1f} m" for turn, drive in plan.moves)
    return {"expects": f"{plan.bits:.1f} bits in {plan.seconds:.1f} s: {moves}"}


def _expected_on(driver: Driver) -> dict[str, str]:
    """The same of a task; and what was found, where it looks for something."""
    found = (
        {"tile": f"{driver.tile[0]},{driver.tile[1]}: {driver.result or 'not known yet'}"} if _checks(driver) else {}
    )
    way = driver.way
    if way.refused:
        return found | {"expects": f"nothing: {way.refused}"}
    if not len(way.corners):
        return found | {"expects": "no pose yet"}
    return found | {"expects": f"{way.swept_m2:.2f} m2 of floor in {way.seconds:.1f} s"}


def _checks(driver: Driver) -> bool:
    return isinstance(driver, Checking) and driver.tile is not None
