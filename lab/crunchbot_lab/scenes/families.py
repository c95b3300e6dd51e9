"""Families of scenes at level 0, by name and seed.

A name is a base and any number of modifiers: `anchor`, `anchor+global`, `free+kidnap+outliers`. `making` draws their
scenes.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from crunchbot.errors import UserError
from crunchbot.scene import Arena, Robot

from . import arenas, faults, robots, walk
from .faults import Fault
from .readings import World

KIDNAP_LEAST_M = 0.8
KIDNAP_ROW, KIDNAP_ROWS = 300, 1200
MAPPING_ROWS, CARRIED, CARRIED_TWICE = 3000, (1500,), (1000, 2000)
SLIPS, SLIP_ROWS = 4, 10
NORMAL_SD_DEG = 5.0
GYRO_DEG = 0.2
TURNED_DEG, TURNED_M, HEXAGON_M = 30, 0.45, 0.28


class FamilyError(UserError):
    """A name that is no family; one line."""


@dataclass(frozen=True)
class Recipe:
    """How scenes of a family come about."""

    text: str
    arena: arenas.Maker = field(default_factory=arenas.tiled)
    robot: Callable[[], Robot] = robots.anchor
    world: World = field(default_factory=World)
    pace: walk.Pace = field(default_factory=walk.Pace)
    body_whisks: bool = False  # the pilot's own behaviour, and rows as it makes them
    rows: int = 600
    uniform: bool = False  # the prior
    wrong_m: float = 0.0  # the prior's mean is off by so much
    wrong_rad: float = 0.0
    kidnap_rows: tuple[int, ...] = ()  # before which the robot is carried off
    moves: bool = False  # half-way a box is moved; the scene has it where it stands at the end
    slips: int = 0
    faults: tuple[Fault, ...] = ()
    map_fault: Callable[[Arena, np.random.Generator], Arena] | None = None


# As signal-level runs of the demo's robot: see tests/scenes/test_levels.py.
SIGNALS = World(
    odometry=0.02,
    odometry_memory_m=0.5,
    run_gain=0.01,
    accuracy=0.99,
    raw_nats=30.0,
    wrong_rows=1.2,
    radial_sigma_m=0.001,
    miss=0.0,
    ghost=0.0,
)
RAW = World(odometry_memory_m=0.3, drift_rad=0.02, accuracy=0.85, raw_nats=40.0, catch=0.3)
HARSH = World(
    odometry=0.1, odometry_memory_m=0.3, drift_rad=0.03, accuracy=0.7, radial_sigma_m=0.01, miss=0.1, ghost=0.03
)


def _demo_robot() -> Robot:
    from ..simulation.scenes import (
        make_robot,  # the demo needs this package's neighbours; most families do not need the demo
    )

    return make_robot()


BASES: dict[str, Recipe] = {
    "anchor": Recipe("2.5 m, 0.5 m tiles, 3 blocks; every whisker reads in every row, 2 cm a row"),
    "raw": Recipe("anchor with a naive Bayes's over-confident windows, wrong in runs, and lasting odometry", world=RAW),
    "small": Recipe("1.5 x 1.6 m or so, boxes anywhere", arenas.scattered((1.5, 1.5), (1.8, 1.6))),
    "free": Recipe("2 to 3.5 m, tiles that do not fit, boxes anywhere", arenas.scattered((2.0, 2.0), (3.5, 3.0))),
    "large": Recipe("5 to 6 m, boxes anywhere", arenas.scattered((5.0, 4.0), (6.0, 6.0), 0.4), rows=1200),
    "noisy": Recipe("twice the noise, 70 % windows", robot=robots.noisy, world=HARSH),
    "one-whisker": Recipe("one object whisker, no texture", robot=robots.one_whisker),
    "ring": Recipe(
        "12 short object whiskers round a small body, boxes anywhere",
        arenas.scattered((2.0, 1.5), (3.0, 2.5)),
        robots.ring,
    ),
    "three-floor": Recipe("three texture whiskers, two object whiskers", robot=robots.three_floor),
    "six-textures": Recipe("six textures", arenas.tiled(textures=arenas.MORE_TEXTURES)),
    "no-whisker": Recipe("no whisker at all", robot=robots.no_whisker),
    "symmetric2": Recipe("alike after 180 degrees", arenas.symmetric(2)),
    "symmetric4": Recipe("alike after 90 degrees", arenas.symmetric(4)),
    "one-texture": Recipe("one texture everywhere", arenas.one_texture),
    "no-obstacle": Recipe("no obstacle", arenas.empty),
    "robot": Recipe(
        "the demo's robot: body whisks, distances in few rows", robot=_demo_robot, world=SIGNALS, body_whisks=True
    ),
}


def _world(**changes) -> Callable[[Recipe], Recipe]:
    return lambda r: replace(r, world=replace(r.world, **changes))


def _fault(fault: Fault) -> Callable[[Recipe], Recipe]:
    return lambda r: replace(r, faults=(*r.faults, fault))


def _wrong(metres: float = 0.0, degrees: float = 0.0) -> Callable[[Recipe], Recipe]:
    return lambda r: replace(r, wrong_m=metres, wrong_rad=math.radians(degrees))


def _floor(change: Callable[[arenas.Maker], arenas.Maker]) -> Callable[[Recipe], Recipe]:
    return lambda r: replace(r, arena=change(r.arena))


def _gyroscope(r: Recipe) -> Recipe:
    """Turns are measured, and the robot says how well."""
    sigma = math.radians(GYRO_DEG)
    return replace(
        r,
        world=replace(r.world, gyro_sd_rad=sigma),
        robot=lambda: replace(r.robot(), odometry_turn_sigma_rad=sigma),
    )


MODIFIERS: dict[str, tuple[str, Callable[[Recipe], Recipe]]] = {
    "global": ("nothing is known of the start", lambda r: replace(r, uniform=True)),
    "kidnap": (
        f"carried at least {KIDNAP_LEAST_M:g} m after {KIDNAP_ROW} rows of {KIDNAP_ROWS}",
        lambda r: replace(r, kidnap_rows=(KIDNAP_ROW,), rows=KIDNAP_ROWS),
    ),
    **{
        name: (
            f"carried likewise {how} of {MAPPING_ROWS} rows",
            lambda r, at=at: replace(r, kidnap_rows=at, rows=MAPPING_ROWS),
        )
        for name, how, at in (
            ("carried", "half-way", CARRIED),
            ("carried-twice", "after a third and two", CARRIED_TWICE),
        )
    },
    **{f"wrong-{m:g}m": (f"prior wrong by {m:g} m", _wrong(metres=m)) for m in (0.2, 0.5, 1.0)},
    **{f"wrong-{d}deg": (f"prior wrong by {d} degrees", _wrong(degrees=d)) for d in (90, 180)},
    **{
        f"{kind}-{name}": (f"{kind} likelihoods for one {name}", _fault(faults.broken(kind, rows)))
        for name, rows in (("frame", 1), ("second", faults.SECOND_ROWS))
        for kind in faults.BROKEN
    },
    "catches": ("every other border catches a texture whisker for 0.1 to 1 s", _world(catch=0.5)),
    "dead": ("a dead whisker", _fault(faults.dead)),
    "swapped": ("two whiskers swapped", _fault(faults.swapped)),
    "flipped": ("a whisker with the wrong sign", _fault(faults.flipped)),
    "outliers": ("30 % of the readings are outliers", _fault(faults.outliers(0.3))),
    "missed": ("10 % of the contacts are missed", _fault(faults.missed(0.1))),
    **{f"scale-{s:g}": (f"odometry says {s:g} times the distance", _world(scale=s)) for s in (0.8, 0.9, 1.1, 1.2)},
    "turn-bias": ("odometry says 1.2 times the turn", _world(turn_scale=1.2)),
    "slip": (f"the wheels spin {SLIPS} times for {SLIP_ROWS} rows", lambda r: replace(r, slips=SLIPS)),
    "normals": (
        f"directions of the faces that object whiskers touch, to {NORMAL_SD_DEG:g} degrees",
        _world(normal_sd_rad=math.radians(NORMAL_SD_DEG)),
    ),
    "gyro": (f"turns from a gyroscope, to {GYRO_DEG:g} degrees a row", _gyroscope),
    **{
        f"pitch-{m:g}": (f"tiles of {m:g} m", _floor(lambda made, m=m: arenas.with_tiles(made, m))) for m in (0.3, 0.42)
    },
    "turned-tiles": (
        f"tiles of {TURNED_M:g} m, {TURNED_DEG} degrees against the walls",
        _floor(lambda made: arenas.with_cells(made, arenas.turned(TURNED_M, math.radians(TURNED_DEG)))),
    ),
    "hexagons": (
        f"a floor of hexagons, {HEXAGON_M:g} m a side",
        _floor(lambda made: arenas.with_cells(made, arenas.hexagons(HEXAGON_M))),
    ),
    "round": ("a round wall, no obstacle", _floor(arenas.with_round_wall)),
    "moving-box": ("a box is moved half-way", lambda r: replace(r, moves=True)),
    "silent-minute": ("no whisker reads anything for a minute", _fault(faults.silent(faults.MINUTE_ROWS))),
    "renamed": ("textures change their names half-way", _fault(faults.renamed)),
    "late": ("rows come late", _fault(faults.late)),
    "doubled": ("rows come twice", _fault(faults.doubled)),
    "reordered": ("rows change places", _fault(faults.reordered)),
    "dropped": ("rows never come", _fault(faults.dropped)),
    "map-tile": ("one tile of the map is wrong", lambda r: replace(r, map_fault=faults.wrong_tile)),
    "map-obstacle": ("the map lacks an obstacle", lambda r: replace(r, map_fault=faults.lost_obstacle)),
}


def recipe(name: str) -> Recipe:
    """The recipe of a base with its modifiers."""
    base, *modifiers = name.split("+")
    if base not in BASES:
        raise FamilyError(f"family '{base}' is unknown; the names are {', '.join(BASES)}")
    made = BASES[base]
    for modifier in modifiers:
        if modifier not in MODIFIERS:
            raise FamilyError(f"family '{name}': no modifier '{modifier}'; the names are {', '.join(MODIFIERS)}")
        made = MODIFIERS[modifier][1](made)
    return made
