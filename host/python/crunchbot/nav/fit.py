"""How well rows fit map and motion at a filter's answers, and what would make them fit: units, signs, a map laid otherwise."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..native import ffi, lib, pointer
from ..occupancy import from_map
from ..scene import Arena, Box, Prior, Scene
from .faults import CHANCE
from .filters import ESTIMATE, ESTIMATES, Filter, pack, problem_of
from .observations import Observations, stretch

FIT = np.dtype([(name, "f8") for name in ("readings", "said", "due", "variance")])  # struct nav_fit
FITS = ffi.typeof("struct nav_fit[]")
assert FIT.itemsize == ffi.sizeof("struct nav_fit")
UNLIKELY = math.sqrt(-2.0 * math.log(CHANCE))  # standard deviations
NEAR_M, NEAR_RAD = 0.25, 0.5  # of a confidence (problem.h)
TRACKER = "ekf"
TRIED_ROWS = 600  # of which causes are tried: a minute
AHEAD = {"feet": 0.3048, "inches": 0.0254, "cm": 0.01, "mm": 0.001, "backwards": -1.0}
TURN = {"turns": math.tau, "degrees": math.radians(1.0), "turns to the right": -1.0}
LAID = ("turned by 90 degrees", "turned by 180 degrees", "turned by 270 degrees")


def fit_faults(scene: Scene, rows: Observations, table: np.ndarray) -> list[str]:
    """A line where readings fit the map worse than the model of the sensors allows; table: (n,) of ESTIMATE, the answers.

    A filter that looks for its place anew may find one that fits all the time: so the start is followed as well by one that
    does not, and where that fails and a change makes it fit, the change is named."""
    off = dict(zip(("textures", "contacts"), _off(scene, fitted(scene, rows, table)), strict=True))
    kind = min(off, key=off.__getitem__)
    head, cause = stretch(rows, 0, TRIED_ROWS), ""
    if _is_known(scene.prior) and min(_off(scene, _followed(scene, head))) < -UNLIKELY:
        cause = _cause(scene, head, fitted(scene, head, table[:TRIED_ROWS])["said"].sum())
    if off[kind] >= -UNLIKELY:
        return [cause] if cause else []
    text = f"{kind} fit the map {-off[kind]:.0f} standard deviations worse than they should where the pose is sure"
    return [f"{text}: {cause or 'look at the map, the units of the motion, and the places of the whiskers'}"]


def fitted(scene: Scene, rows: Observations, table: np.ndarray) -> np.ndarray:
    """(sensors,) of FIT: texture whiskers, then object whiskers."""
    problem, keep = problem_of(scene, {})
    texture, rays = (len(scene.robot.of_role("texture")), len(scene.arena.textures)), len(scene.robot.of_role("object"))
    packed, kept = pack(rows, texture, rays, 0 if rows.own is None else rows.own.shape[1])
    inside, out = table.copy(), np.zeros(texture[0] + rays, FIT)
    inside["pose"] = from_map(table["pose"], scene.origin)
    answered = pointer(ESTIMATES, ESTIMATE, inside, "table", (len(rows),))
    made = pointer(FITS, FIT, out, "out", (len(out),))
    if lib.nav_fit_add(problem, packed, answered, len(rows), made, len(out)) != 0:
        raise MemoryError
    del keep, kept
    return out


def _off(scene: Scene, fits: np.ndarray) -> tuple[float, float]:
    """Of textures and of contacts: how far below what is due, in standard deviations; 0 where they speak for the map."""
    tips = len(scene.robot.of_role("texture"))

    def off(said: float, due: float, variance: float) -> float:
        return (said - due) / math.sqrt(variance) if said < 0.0 < variance else 0.0

    return tuple(
        off(*(part[name].sum() for name in ("said", "due", "variance"))) for part in (fits[:tips], fits[tips:])
    )


def _is_known(start: Prior | None) -> bool:
    """Whether a start is known as well as an answer that is called sure."""
    return bool(start and start.sigma) and max(start.sigma[:2]) <= NEAR_M and start.sigma[2] <= NEAR_RAD


def _followed(scene: Scene, rows: Observations) -> np.ndarray:
    """As `fitted`, at the answers of a filter that never looks for its place."""
    table, _ = Filter(TRACKER, scene, normals=rows.normal is not None).replay(rows, 0, len(rows))
    return fitted(scene, rows, table)


def _cause(scene: Scene, rows: Observations, given: float) -> str:
    """Which of the changes makes the rows fit best, and far better than what they say as given; empty: none does."""
    best, text = given, ""
    for said, other, changed in _others(scene, rows):
        if other.fault_at(scene.prior.mean):
            continue
        fits = _followed(other, changed)
        total, spread = fits["said"].sum(), math.sqrt(fits["variance"].sum())
        if total > max(best, given + UNLIKELY * spread) and min(_off(other, fits)) >= -UNLIKELY:
            best, text = total, said
    return text


def _others(scene: Scene, rows: Observations) -> Iterator[tuple[str, Scene, Observations]]:
    for column, units, which in (("odo_x_m", AHEAD, (1, 1, 0)), ("odo_theta_rad", TURN, (0, 0, 1))):
        unit = "m" if which[0] else "rad"
        for name, value in units.items():
            what = f"look like {name}: 1 = {value:.6g} {unit}" if value > 0.0 else f"count {name}"
            changed = replace(rows, odometry=rows.odometry * np.where(which, value, 1.0))
            yield f"the values of '{column}' {what}; convert them", scene, changed
    for mirrored in (False, True):
        arena = _mirrored(scene.arena) if mirrored else scene.arena
        for turned in range(4):
            how = " and ".join(["mirrored"] * mirrored + [*LAID[turned - 1 : turned]] * (turned > 0))
            if how:
                yield f"the map looks {how}; mend it, or its origin", replace(scene, arena=arena), rows
            arena = _turned(arena)


def _mirrored(arena: Arena) -> Arena:
    """Left to right."""
    width = arena.size_m[0]
    return _laid(
        arena, arena.size_m, [row[::-1] for row in arena.floor], lambda b: (width - b[2], b[1], width - b[0], b[3])
    )


def _turned(arena: Arena) -> Arena:
    """By 90 degrees, to the left."""
    width, height = arena.size_m
    floor = ["".join(column) for column in zip(*arena.floor, strict=True)][::-1]
    return _laid(arena, (height, width), floor, lambda b: (height - b[3], b[0], height - b[1], b[2]))


def _laid(arena: Arena, size_m: tuple[float, float], floor: list[str], of) -> Arena:
    def boxes(given: tuple[Box, ...]) -> tuple[Box, ...]:
        return tuple(of(box) for box in given)

    return replace(
        arena, size_m=size_m, floor=tuple(floor), obstacles=boxes(arena.obstacles), unknown=boxes(arena.unknown)
    )
