"""Single whiskers with real mechanics: contacts and sweeps that a study prescribes, counts out.

    whisker = Whisker.drawn(seed=1, number=3)
    whisk = contact(whisker, radius_m=0.11, speed_rad_s=pi / 24, angle_rad=0.15, seed=7)
    whisk.counts, whisk.tilt_rad, whisk.what           # arrays over ticks
    drag = sweep(whisker, ["VINYL", "ROUGH"], speed_m_s=0.1, length_m=1.0, step_m=0.001, seed=7)

Levels: see sim/mechanics/mech_whisker.h. Equal arguments give equal counts.
"""

import itertools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .border import ffi, lib, pointer
from .world import TICK_S

CLOSED, LARGE, VIBRATION = lib.MECH_CLOSED, lib.MECH_LARGE, lib.MECH_VIBRATION
WHOLE = LARGE | VIBRATION
STICKS, SLIPS, HOOKED, EDGE, LIFTED = lib.MECH_STICKS, lib.MECH_SLIPS, lib.MECH_HOOKED, lib.MECH_EDGE, 4
LEAD_S, TAIL_S = 0.1, 0.4  # free before and after a contact
_table = None


def _shared_table():
    global _table
    if _table is None:
        _table = ffi.gc(lib.mech_table_new(), lib.mech_table_free)
        if not _table:
            raise MemoryError("no memory for the table of large deflections")
    return _table


def _listed() -> Iterator:
    for i in itertools.count():
        floor = lib.sim_mechanics_floor(i)
        if not floor:
            return
        yield floor[0]


_TEXTURES = ffi.new("struct sim_floor_texture[]", list(_listed()))
FLOORS = tuple(ffi.string(floor.name).decode() for floor in _TEXTURES)


class Unknown(NamedTuple):
    """A parameter that no source fixes, and the range in which to vary it."""

    typical: float
    low: float
    high: float


def unknowns() -> dict[str, Unknown]:
    """What is assumed about whiskers, by the name of the parameter."""
    count = ffi.new("size_t *")
    listed = lib.mech_unknowns(count)
    return {
        ffi.string(listed[i].name).decode(): Unknown(listed[i].typical, listed[i].low, listed[i].high)
        for i in range(count[0])
    }


class Whisker:
    """Parameters of one whisker, SI (struct mech_whisker); others than the default's by keyword."""

    def __init__(self, **parameters: float):
        self._set(lib.mech_whisker_default(), parameters)

    @classmethod
    def drawn(cls, seed: int, number: int, **parameters: float) -> "Whisker":
        """One of a batch that differ as whiskers do."""
        made = cls()
        made._set(lib.mech_whisker_draw(seed, number), parameters)
        return made

    def _set(self, base, parameters: dict) -> None:
        self.c = ffi.new("struct mech_whisker *", base)
        for name, value in parameters.items():
            if not hasattr(self.c, name):
                raise ValueError(f"a whisker has no parameter {name!r}; it has {', '.join(sorted(dir(self.c)))}")
            if not value > 0 and not (value == 0 and name in ("friction", "creep")):
                raise ValueError(f"{name} is {value}; it must be above 0")
            setattr(self.c, name, value)
        if not self.c.length < self.c.cone:
            raise ValueError(f"length is {self.c.length}; it must be below cone, {self.c.cone}")
        if not self.c.damping < 1:
            raise ValueError(f"damping is {self.c.damping}; it must be below 1")

    def __getattr__(self, name: str) -> float:
        if name == "c":
            raise AttributeError(name)
        return getattr(self.c, name)


class Series(NamedTuple):
    """What a whisker does, tick by tick: counts (n, 2) uint16; tilt of the plug (n, 2) rad; touch or event (n,)."""

    counts: np.ndarray
    tilt_rad: np.ndarray
    what: np.ndarray


def _counts(whisker: Whisker, tilt: np.ndarray, tick_s: float, seed: int) -> np.ndarray:
    shape = (len(tilt), 2)
    counts = np.empty(shape, np.uint16)
    given = pointer("double[]", tilt, "tilt", shape), seed, pointer("uint16_t[]", counts, "counts", shape)
    lib.sim_mechanics_counts(whisker.c, len(tilt), tick_s, *given)
    return counts


def touch(
    whisker: Whisker,
    radius_m: ArrayLike,
    theta_rad: ArrayLike,
    base_rate_rad_s: ArrayLike = 0.0,
    *,
    seed: int,
    level: int = WHOLE,
    tick_s: float = TICK_S,
) -> Series:
    """A prescribed contact: for every tick the radius (0: none), imposed angle and the mount's rate of turn."""
    given = np.broadcast_arrays(radius_m, theta_rad, base_rate_rad_s)
    if given[1].ndim != 1:
        raise ValueError(f"angles have shape {given[1].shape}; give one value a tick")
    radius, theta, rate = (np.ascontiguousarray(values, np.float64) for values in given)
    shaft = ffi.new("struct mech_shaft *")
    lib.mech_shaft_start(shaft, whisker.c, _shared_table(), level, tick_s)
    each = theta.shape
    tilt, touches, bent = np.zeros((len(theta), 2)), np.empty(each, np.uint8), np.empty(each)
    columns = {"radius_m": radius, "theta_rad": theta, "base_rate_rad_s": rate, "bent": bent}
    given = [pointer("double[]", column, name, each) for name, column in columns.items()]
    lib.sim_mechanics_touch(shaft, len(theta), *given, pointer("unsigned char[]", touches, "touches", each))
    tilt[:, 0] = bent
    return Series(_counts(whisker, tilt, tick_s, seed), tilt, touches)


def contact(
    whisker: Whisker,
    radius_m: float,
    speed_rad_s: float,
    angle_rad: float,
    *,
    seed: int,
    hold_s: float = 0.0,
    level: int = WHOLE,
    tick_s: float = TICK_S,
) -> Series:
    """A whisk against an edge: the mount turns at a speed until the whisker is pushed by an angle, waits, turns back."""
    lead, ramp, hold, tail = (round(t / tick_s) for t in (LEAD_S, abs(angle_rad) / speed_rad_s, hold_s, TAIL_S))
    up = np.arange(1, ramp + 1) / max(ramp, 1) * angle_rad
    theta = np.concatenate([np.zeros(lead), up, np.full(hold, angle_rad), up[::-1], np.zeros(tail)])
    radius = np.where(theta == 0, 0.0, radius_m)
    signed = math.copysign(speed_rad_s, angle_rad)
    rate = np.concatenate([np.full(lead + ramp, signed), np.zeros(hold), np.full(ramp + tail, -signed)])
    return touch(whisker, radius, theta, rate, seed=seed, level=level, tick_s=tick_s)


def drag(
    whisker: Whisker,
    travel_m: ArrayLike,
    floor: ArrayLike,
    height_m: ArrayLike = 0.0,
    *,
    seed: int,
    level: int = WHOLE,
    tick_s: float = TICK_S,
    textures: Any = _TEXTURES,
    **stance: float,
) -> Series:
    """A prescribed sweep: for every tick the mount's travel, number of the floor under the tip and its height.

    Keywords preload, height, behind say how the whisker stands (struct mech_stance); `textures` are the floors that
    the numbers mean (struct sim_floor_texture[]), if not FLOORS. `what` is STICKS, SLIPS, HOOKED or EDGE, LIFTED added.
    """
    travel, floors, height = np.broadcast_arrays(travel_m, floor, height_m)
    if travel.ndim != 1 or not len(travel):
        raise ValueError(f"travel has shape {travel.shape}; give one value a tick, at least one")
    if floors.min() < 0 or floors.max() >= len(textures):
        raise ValueError(f"floors are numbered 0..{len(textures) - 1}")
    stands = ffi.new("struct mech_stance *", lib.sim_drag_stance())
    for name, value in stance.items():
        if not hasattr(stands, name):
            raise ValueError(f"a stance has no {name!r}; it has {', '.join(sorted(dir(stands)))}")
        setattr(stands, name, value)
    start = textures + int(floors[0])
    whiskers = ffi.gc(lib.sim_drag_new(whisker.c, stands, start, seed, level, tick_s), lib.sim_drag_free)
    if not whiskers:
        raise MemoryError("no memory for a dragged whisker")
    travel, height = (np.ascontiguousarray(a, np.float64) for a in (travel, height))
    numbers = np.ascontiguousarray(floors, np.uint8)
    each = travel.shape
    tilt, event = np.empty((len(travel), 2)), np.empty(each, np.uint8)
    lib.sim_drag_run(
        whiskers,
        textures,
        len(travel),
        pointer("double[]", travel, "travel_m", each),
        pointer("unsigned char[]", numbers, "floor", each),
        pointer("double[]", height, "height_m", each),
        pointer("double[]", tilt, "tilt", (len(travel), 2)),
        pointer("unsigned char[]", event, "event", each),
    )
    return Series(_counts(whisker, tilt, tick_s, seed), tilt, event)


def sweep(
    whisker: Whisker,
    floors: list[str],
    speed_m_s: float,
    length_m: float,
    *,
    seed: int,
    step_m: float = 0.0,
    level: int = WHOLE,
    tick_s: float = TICK_S,
    **stance: float,
) -> Series:
    """A straight sweep over floors by name, each `length_m` long, each `step_m` higher than the one before."""
    unknown = [name for name in floors if name not in FLOORS]
    if unknown:
        raise ValueError(f"no floor is called {unknown[0]!r}; use {', '.join(FLOORS)}")
    each = round(length_m / speed_m_s / tick_s)
    number = np.repeat([FLOORS.index(name) for name in floors], each)
    height = np.repeat(np.arange(len(floors)) * step_m, each)
    travel = np.full(len(number), speed_m_s * tick_s)
    return drag(whisker, travel, number, height, seed=seed, level=level, tick_s=tick_s, **stance)
