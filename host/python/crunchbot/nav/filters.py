"""Filters of host/nav on a scene: made, stepped, replayed over many rows, and asked for their belief."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import nearest
from ..errors import UserError
from ..native import as_doubles, doubles, ffi, lib, octets, pointer
from ..observation import Row
from ..occupancy import from_map, spread_on_map, to_map
from ..scene import Prior, Scene, in_arena
from ..sensor_tables import SensorTable
from .observations import Observations, observed

FAVOURITE, SPARE = "adaptive", "grid"
SENSOR_UNKNOWN = 255
SEED_MOST = 2**64 - 1
HEARD = (
    10  # rows of a call of the library, between which signals are heard: a second's, and a filter keeps pace with them
)
COMPONENTS_MOST = int(lib.NAV_COMPONENTS_MOST)  # of a belief to begin from

# struct nav_estimate and struct nav_component
ESTIMATE = np.dtype(
    [("pose", "f8", 3), ("covariance", "f8", (3, 3)), ("confidence", "f8")]
    + [(name, "i8") for name in ("evaluations", "distinct", "touched", "states", "bytes")]
)
COMPONENT = np.dtype([("pose", "f8", 3), ("sigma_m", "f8"), ("sigma_rad", "f8"), ("mass", "f8")])
ESTIMATES, COMPONENTS = ffi.typeof("struct nav_estimate[]"), ffi.typeof("struct nav_component[]")
assert ESTIMATE.itemsize == ffi.sizeof("struct nav_estimate") and COMPONENT.itemsize == ffi.sizeof(
    "struct nav_component"
)


class SettingError(UserError, ValueError):
    """A --set that names no setting or leaves its range; one line."""


def filter_names() -> list[str]:
    names = []
    while (name := lib.nav_filter_name(len(names))) != ffi.NULL:
        names.append(ffi.string(name).decode())
    return names


def default_filter() -> str:
    return FAVOURITE if FAVOURITE in filter_names() else SPARE


def settings_list() -> list[tuple[str, float, float, float]]:
    """(name, default, lowest, highest) of every setting."""
    name, numbers_ = ffi.new("const char **"), ffi.new("double[3]")
    out = []
    while lib.nav_settings_describe(len(out), name, numbers_, numbers_ + 1, numbers_ + 2) == 0:
        out.append((ffi.string(name[0]).decode(), *numbers_))
    return out


@dataclass
class Estimate:
    """What a filter believes after one row."""

    x_m: float
    y_m: float
    theta_rad: float
    covariance: np.ndarray  # (3, 3): x, y in m, theta in rad
    confidence: float
    evaluations: int
    states: int
    bytes: int

    @property
    def pose(self) -> tuple[float, float, float]:
        return self.x_m, self.y_m, self.theta_rad

    def line(self, t_s: str) -> str:
        """The row of est.csv."""
        return f"{t_s},{self.x_m:.6f},{self.y_m:.6f},{self.theta_rad:.6f},{self.confidence:.6f}"


def to_estimate(row: np.void) -> Estimate:
    """One row of a table of ESTIMATE."""
    pose = (float(value) for value in row["pose"])
    counts = (int(row[name]) for name in ("evaluations", "states", "bytes"))
    return Estimate(*pose, row["covariance"].copy(), float(row["confidence"]), *counts)


@dataclass(frozen=True)
class Sensor:
    """A sensor of the user's own: what it expects is a map of codes, what it reads the log-likelihood of each code.

    `codes`: (rows, columns) of uint8, row 0 the smallest y, 0 to 254; 255, and beyond the map, not known. `cell_m`: edge
    of a cell; the map's lower left corner is the world's origin. `at_m`: the sensor's place on the robot. A reading
    counts in full after `spacing_m` of travel since the last one. `detail_m`: over which the codes change; the default
    filter's cells are then at most half as wide; 0: not given. `levels`: how many codes there are; 0: one more than the
    largest of the map. With `edges` (bins + 1,) and `likelihood` (bins, levels) what it reads is one number."""

    codes: np.ndarray
    cell_m: float
    at_m: tuple[float, float] = (0.0, 0.0)
    spacing_m: float = 0.0
    detail_m: float = 0.0
    levels: int = 0
    edges: np.ndarray | None = None
    likelihood: np.ndarray | None = None

    @property
    def count(self) -> int:
        """The number of codes."""
        known = self.codes[self.codes < SENSOR_UNKNOWN]
        return self.levels or (int(known.max()) + 1 if len(known) else 1)

    @property
    def values(self) -> int:
        """Numbers in a reading."""
        return self.count if self.edges is None else 1


class Filter:
    """One filter on one scene. It takes rows as the pilot makes them, or their cells by column: None is an empty cell.
    What it is given and what it answers is on the map; host/nav alone has it in the arena's frame."""

    def __init__(
        self,
        name: str,
        scene: Scene,
        settings: dict[str, float] | None = None,
        seed: int = 0,
        components: np.ndarray | None = None,
        sensors: Sequence[Sensor] = (),
        normals: bool = False,
    ):
        """`components`: (n,) of COMPONENT, to begin from in place of the scene's prior; `sensors`: more than the scene's;
        `normals`: rows may carry directions of the surfaces that object whiskers touch."""
        if name not in filter_names():
            near = nearest(name, filter_names())
            raise SettingError(f"filter '{name}' is unknown{near}; choose one of {', '.join(filter_names())}")
        if not 0 <= seed <= SEED_MOST:
            raise SettingError(f"--seed {seed}: outside 0 to 2^64 - 1; choose a number inside")
        self.scene = scene
        if components is not None and (fault := prior_fault(scene, components)):
            raise SettingError(f"filter '{name}': {fault}; give what a filter listed")
        sensors = (*map(_of_table, scene.robot.sensors), *sensors)
        problem, self._keep = problem_of(scene, settings or {}, components, sensors)
        problem.seed, problem.robot.normals = seed, normals
        self._own = sum(sensor.values for sensor in sensors)
        made = lib.nav_filter_new(name.encode(), problem)
        if made == ffi.NULL:
            raise SettingError(f"filter '{name}' does not fit in memory; choose coarser cells with --set")
        self._filter = ffi.gc(made, lib.nav_filter_free)
        self._tips, self._rays = len(scene.robot.of_role("texture")), len(scene.robot.of_role("object"))
        self._classes = len(scene.arena.textures)
        self._components_room = 0  # enough for the latest list, mostly: to count costs as much as to list

    def step(self, row: Row | Mapping[str, float | None]) -> Estimate:
        """Take one row. KeyError when a column of the scene's layout is missing; readings and directions may be."""
        one = observed(row if isinstance(row, Row) else Row.of(row), self.scene, self._own)
        return to_estimate(self.replay(one, 0, 1)[0][0])

    def step_values(
        self,
        t_s: float,
        odometry: ArrayLike,
        texture: ArrayLike,
        radial_m: ArrayLike,
        own: ArrayLike = (),
        normal: ArrayLike | None = None,
    ) -> Estimate:
        """Take one row of numbers: odometry (3,): m, m, rad; texture (tips, classes), nan not read; radial_m (rays,) in m,
        nan not read, inf no contact; own (values,): log-likelihoods of the user's sensors, nan not read; normal (rays, 2)
        in rad with its standard deviation, nan not read. ValueError when one has another shape."""
        rows = Observations(
            as_doubles(t_s, "t_s", ()).reshape(1),
            [],
            as_doubles(odometry, "odometry", (3,))[None],
            as_doubles(texture, "texture", (self._tips, self._classes))[None],
            as_doubles(radial_m, "radial_m", (self._rays,))[None],
            None,
            as_doubles(own, "own", (self._own,))[None],
            None if normal is None else as_doubles(normal, "normal", (self._rays, 2))[None],
        )
        return to_estimate(self.replay(rows, 0, 1)[0][0])

    def replay(self, rows: Observations, first: int, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Rows first .. first + count - 1: estimates (count,) of ESTIMATE and the thread's CPU time (count,) in us.

        ValueError when the rows are not of this scene's robot, or not so many."""
        held = len(rows.t_s)
        if not 0 <= first <= first + count <= held:
            raise ValueError(f"rows {first} to {first + count}: outside the {held} rows given; choose rows inside")
        table, step_us = np.zeros(count, ESTIMATE), np.zeros(count)
        packed, keep = pack(rows, (self._tips, self._classes), self._rays, self._own)
        out = pointer(ESTIMATES, ESTIMATE, table, "table", (count,))
        took = doubles(step_us, "step_us", (count,))
        for at in range(0, count, HEARD):
            lib.nav_replay(self._filter, packed, first + at, min(HEARD, count - at), out + at, took + at)
        del keep  # until here
        table["pose"] = to_map(table["pose"], self.scene.origin)
        table["covariance"] = spread_on_map(table["covariance"], self.scene.origin)
        return table, step_us

    def set_prior(self, prior: Prior) -> None:
        """Begin again from this belief, while running. ValueError when it is none for this arena."""
        given = ffi.new("struct nav_prior *")
        _fill_prior(given, in_arena(prior, self.scene.origin))
        if (fault := lib.nav_filter_reset(self._filter, given)) != ffi.NULL:
            raise ValueError(f"prior: {ffi.string(fault).decode()}; give another one")

    @property
    def component_count(self) -> int:
        """How many components `components` gives."""
        return lib.nav_filter_components(self._filter, ffi.NULL, 0)

    def components(self) -> np.ndarray:
        """The belief after the last row as components, (n,) of COMPONENT."""
        while True:
            out = np.zeros(self._components_room, COMPONENT)
            count = lib.nav_filter_components(self._filter, _components(out), len(out))
            if count <= len(out):
                out["pose"] = to_map(out["pose"], self.scene.origin)
                return out[:count]
            self._components_room = count + count // 4

    def region(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Level of the highest-density region in (x, y) that holds this point, and the 90 % region's area in m^2."""
        components, out = self.components(), ffi.new("struct nav_region *")
        lib.nav_belief_region(_components(components), len(components), x_m, y_m, out)
        return out.level, out.area_m2

    @property
    def resolution(self) -> tuple[float, float, float, float] | None:
        """Edge of a cell in m, its extent in rad, the edge in m that the scene's detail asks for, and that of the cells in
        which an unknown place is looked for where they are too wide for the detail, else 0; None: no cells."""
        reported = lib.nav_filter_resolution(self._filter)
        return (reported.m, reported.rad, reported.wanted_m, reported.start_m) if reported.m > 0 else None

    @property
    def bad_cells(self) -> int:
        return lib.nav_filter_bad_cells(self._filter)

    @property
    def bad_rows(self) -> int:
        return lib.nav_filter_bad_rows(self._filter)


def pack(rows: Observations, texture: tuple[int, int], rays: int, own: int) -> tuple[Any, tuple]:
    """Rows as struct nav_rows and what it points into: texture (tips, classes), numbers of object whiskers and of values of
    own sensors. ValueError when the rows are not of such a robot."""
    held = len(rows.t_s)
    values = np.full((held, own), math.nan) if rows.own is None else rows.own
    packed = ffi.new(
        "struct nav_rows *",
        {
            "t_s": doubles(rows.t_s, "t_s", (held,)),
            "odometry": doubles(rows.odometry, "odometry", (held, 3)),
            "texture": doubles(rows.texture, "texture", (held, *texture)),
            "radial_m": doubles(rows.radial_m, "radial_m", (held, rays)),
            "normal": ffi.NULL if rows.normal is None else doubles(rows.normal, "normal", (held, rays, 2)),
            "own": doubles(values, "own", (held, own)),
            "own_width": own,
            "texture_width": texture[0] * texture[1],
            "radial_width": rays,
        },
    )
    return packed, (rows, values)


def _components(array: np.ndarray):
    return pointer(COMPONENTS, COMPONENT, array, "components", (None,))


def prior_fault(scene: Scene, components: np.ndarray) -> str:
    """Why these components, (n,) of COMPONENT, are no prior; empty: they are one."""
    problem, keep = problem_of(scene, {}, components)
    which = ffi.new("long *")
    fault = lib.nav_prior_fault(ffi.addressof(problem.arena), ffi.addressof(problem.prior), which)
    del keep  # until here
    if fault == ffi.NULL:
        return "" if len(components) else "no components"
    return f"{f'component {which[0]}: ' if which[0] >= 0 else ''}{ffi.string(fault).decode()}"


def _fill_prior(out, prior: Prior) -> None:
    out.uniform = prior.kind == "uniform"
    if prior.kind == "gaussian":
        out.mean = dict(zip(("x", "y", "theta"), prior.mean, strict=True))
        out.sigma = prior.sigma


def _sensors(sensors: Sequence[Sensor]):
    """The C sensors and what they point into."""
    tables, keep = ffi.new("struct nav_sensor_table[]", len(sensors)), []
    out = ffi.new("struct nav_sensor[]", len(sensors))
    for n, sensor in enumerate(sensors):
        codes = np.ascontiguousarray(sensor.codes)
        rows, columns = codes.shape if codes.ndim == 2 else (0, 0)
        if not codes.size or not sensor.cell_m > 0 or not sensor.spacing_m >= 0:
            raise SettingError(f"sensor {n}: no map of codes with cells above 0 m; give (rows, columns) of uint8")
        keep.append(codes)
        code = octets(codes, f"codes of sensor {n}", (None, None))
        reported = {"codes": sensor.count, "x": sensor.at_m[0], "y": sensor.at_m[1], "cell": sensor.cell_m}
        tables[n].map = reported | {"columns": columns, "rows": rows, "code": code}
        fill = "nav_sensor_map_fill" if sensor.edges is None else "nav_sensor_table_fill"
        if sensor.edges is not None:
            bins, width = len(sensor.edges) - 1, sensor.count
            edges, likelihood = (np.ascontiguousarray(a, np.float64) for a in (sensor.edges, sensor.likelihood))
            keep += [edges, likelihood]
            tables[n].bins, tables[n].edge = bins, doubles(edges, f"edges of sensor {n}", (bins + 1,))
            tables[n].likelihood = doubles(likelihood, f"likelihood of sensor {n}", (bins, width))
        expect, fill = (ffi.addressof(lib, name) for name in ("nav_sensor_map_expect", fill))
        out[n] = (sensor.values, sensor.count, sensor.spacing_m, sensor.detail_m, expect, fill, tables + n)
    return out, (tables, keep)


def _of_table(sensor: SensorTable) -> Sensor:
    levels = sensor.likelihood.shape[1]
    place = (sensor.codes, sensor.cell_m, sensor.at_m, sensor.spacing_m, sensor.detail_m)
    return Sensor(*place, levels, sensor.edges, sensor.likelihood)


def problem_of(
    scene: Scene, settings: dict[str, float], components: np.ndarray | None = None, sensors: Sequence[Sensor] = ()
) -> tuple[ffi.CData, Any]:
    """The C problem and the arrays it points into."""
    arena, robot = scene.arena, scene.robot
    floor = arena.floor_indices()
    boxes = ffi.new("struct nav_box[]", [*arena.obstacles, *arena.unknown])
    tips = ffi.new("struct nav_tip[]", [w.tip_m for w in robot.of_role("texture")])
    rays = ffi.new("struct nav_ray[]", [(*w.base_m, w.yaw_rad, w.length_m) for w in robot.of_role("object")])
    problem = ffi.new("struct nav_problem *")
    problem.arena = {
        "size_x": arena.size_m[0],
        "size_y": arena.size_m[1],
        "tile": arena.tile_m,
        "columns": floor.shape[1],
        "rows": floor.shape[0],
        "floor": octets(floor, "floor", (None, None)),
        "classes": len(arena.textures),
        "boxes": len(boxes),
        "box": boxes,
        "unknown": len(arena.unknown),
    }
    own, own_keep = _sensors(sensors)
    problem.robot = {
        "body_radius": robot.body_radius_m,
        "odometry_relative": robot.odometry_relative_sigma,
        "odometry_turn": robot.odometry_turn_sigma_rad or 0.0,
        "radial_sigma": robot.radial_sigma_m,
        "tips": len(tips),
        "tip": tips,
        "rays": len(rays),
        "ray": rays,
        "sensors": len(own),
        "sensor": own,
    }
    prior = in_arena(scene.prior or Prior("uniform"), scene.origin)
    if components is not None:
        components = components.copy()
        components["pose"] = from_map(components["pose"], scene.origin)
        problem.prior.component, problem.prior.components = _components(components), len(components)
    else:
        _fill_prior(ffi.addressof(problem.prior), prior)
    lib.nav_settings_default(ffi.addressof(problem.settings))
    for key, value in settings.items():
        _set(problem, key, value)
    return problem, (floor, boxes, tips, rays, components, own, own_keep)


def _set(problem, key: str, value: float) -> None:
    known = {name: (low, high) for name, _, low, high in settings_list()}
    if key not in known:
        near = nearest(key, list(known)) or "; see whisker localise --list-settings"
        raise SettingError(f"--set {key}: no such setting{near}")
    if lib.nav_settings_set(ffi.addressof(problem.settings), key.encode(), value) != 0:
        low, high = known[key]
        raise SettingError(f"--set {key}={value:g}: outside {low:g} to {high:g}; choose a value inside")
