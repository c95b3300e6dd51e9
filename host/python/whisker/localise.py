"""Localisation: a scene's filters over rows of observations, with their errors and costs where the truth is known."""

import math
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .errors import UserError
from .native import doubles, ffi, lib, octets
from .scene import OBSERVATIONS, Prior, Scene
from .tables import TableError, number, numbers, read_columns

TRUTH = ("true_x_m", "true_y_m", "true_theta_rad")
ODOMETRY = ("odo_x_m", "odo_y_m", "odo_theta_rad")
ESTIMATE_HEADER = "t_s,x_m,y_m,theta_rad,confidence"
CHI2_90 = 4.605170185988092  # 90 % point of chi-square with two degrees of freedom


class SettingError(UserError, ValueError):
    """A --set that names no setting or leaves its range; one line."""


def filter_names() -> list[str]:
    names = []
    while (name := lib.nav_filter_name(len(names))) != ffi.NULL:
        names.append(ffi.string(name).decode())
    return names


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


class Filter:
    """One filter on one scene. Rows are dicts of cells as the pilot makes them: None is an empty cell, nan not read."""

    def __init__(self, name: str, scene: Scene, settings: dict[str, float] | None = None):
        if name not in filter_names():
            raise SettingError(f"filter '{name}' is unknown; choose one of {', '.join(filter_names())}")
        self.scene = scene
        problem, self._keep = _problem(scene, settings or {})
        made = lib.nav_filter_new(name.encode(), problem)
        if made == ffi.NULL:
            raise SettingError(f"filter '{name}' does not fit in memory; choose coarser cells with --set")
        self._filter = ffi.gc(made, lib.nav_filter_free)
        self._texture_keys = [[f"{w.name}_{t}" for t in scene.arena.textures] for w in scene.robot.of_role("texture")]
        self._radial_keys = [f"{w.name}_mm" for w in scene.robot.of_role("object")]
        self._texture = np.zeros((len(self._texture_keys), len(scene.arena.textures)))
        self._radial = np.zeros(len(self._radial_keys))
        self._row = ffi.new("struct nav_row *", {"texture": doubles(self._texture), "radial_m": doubles(self._radial)})
        self._out = ffi.new("struct nav_estimate *")

    def step(self, row: dict[str, float | None]) -> Estimate:
        """Take one row of cells."""
        texture = [[math.nan if row[k] is None else row[k] for k in keys] for keys in self._texture_keys]
        radial = [math.inf if row[k] is None else row[k] / 1000.0 for k in self._radial_keys]
        return self.step_values(row["t_s"], [row[k] for k in ODOMETRY], texture, radial)

    def step_values(self, t_s: float, odometry, texture, radial_m) -> Estimate:
        """Take one row of numbers: texture (tips, classes), nan not read; radial_m (rays), nan not read, inf no contact."""
        self._texture[:] = np.reshape(texture, self._texture.shape)
        self._radial[:] = radial_m
        self._row.t_s = t_s
        self._row.odometry = list(map(float, odometry))
        self.advance()
        return self.estimate()

    def advance(self) -> None:
        """The filter's own work on the row already in place: what is timed."""
        lib.nav_filter_step(self._filter, self._row, self._out)

    def estimate(self) -> Estimate:
        out = self._out
        covariance = np.array(list(out.covariance)).reshape(3, 3)
        pose = (out.pose.x, out.pose.y, out.pose.theta)
        return Estimate(*pose, covariance, out.confidence, out.evaluations, out.states, out.bytes)

    @property
    def bad_cells(self) -> int:
        return lib.nav_filter_bad_cells(self._filter)

    @property
    def bad_rows(self) -> int:
        return lib.nav_filter_bad_rows(self._filter)


def _problem(scene: Scene, settings: dict[str, float]):
    """The C problem and the arrays it points into."""
    arena, robot = scene.arena, scene.robot
    floor = np.array(arena.floor_indices(), dtype=np.uint8)
    boxes = ffi.new("struct nav_box[]", [tuple(box) for box in arena.obstacles])
    tips = ffi.new("struct nav_tip[]", [w.tip_m for w in robot.of_role("texture")])
    rays = ffi.new("struct nav_ray[]", [(*w.base_m, w.yaw_rad, w.length_m) for w in robot.of_role("object")])
    problem = ffi.new("struct nav_problem *")
    problem.arena = {
        "size_x": arena.size_m[0],
        "size_y": arena.size_m[1],
        "tile": arena.tile_m,
        "columns": floor.shape[1],
        "rows": floor.shape[0],
        "floor": octets(floor),
        "classes": len(arena.textures),
        "boxes": len(boxes),
        "box": boxes,
    }
    problem.robot = {
        "body_radius": robot.body_radius_m,
        "odometry_relative": robot.odometry_relative_sigma,
        "radial_sigma": robot.radial_sigma_m,
        "tips": len(tips),
        "tip": tips,
        "rays": len(rays),
        "ray": rays,
    }
    prior = scene.prior or Prior("uniform")
    problem.prior.uniform = prior.kind == "uniform"
    if prior.kind == "gaussian":
        problem.prior.mean = dict(zip(("x", "y", "theta"), prior.mean, strict=True))
        problem.prior.sigma = prior.sigma
    lib.nav_settings_default(ffi.addressof(problem.settings))
    for key, value in settings.items():
        _set(problem, key, value)
    return problem, (floor, boxes, tips, rays)


def _set(problem, key: str, value: float) -> None:
    known = {name: (low, high) for name, _, low, high in settings_list()}
    if key not in known:
        raise SettingError(f"--set {key}: no such setting; the names are {', '.join(known)}")
    if lib.nav_settings_set(ffi.addressof(problem.settings), key.encode(), value) != 0:
        low, high = known[key]
        raise SettingError(f"--set {key}={value:g}: outside {low:g} to {high:g}; choose a value inside")


@dataclass
class Observations:
    """observations.csv as arrays. Cells that are no numbers are +-inf where the filter counts them as bad."""

    t_s: np.ndarray  # (n,)
    t_text: list[str]  # as written, for the output
    odometry: np.ndarray  # (n, 3)
    texture: np.ndarray  # (n, tips, classes), nan not read
    radial_m: np.ndarray  # (n, rays), nan not read, inf no contact
    truth: np.ndarray | None  # (n, 3)


def read_observations(path, scene: Scene) -> Observations:
    """Read strictly in structure, forgivingly in values (design contract)."""
    tips = [[f"{w.name}_{t}" for t in scene.arena.textures] for w in scene.robot.of_role("texture")]
    rays = [f"{w.name}_mm" for w in scene.robot.of_role("object")]
    text = read_columns(path, ["t_s", *ODOMETRY, *(key for keys in tips for key in keys), *rays])
    rows = len(text["t_s"])
    texture = np.array([[_column(text[key], _texture_cell) for key in keys] for keys in tips]).reshape(
        len(tips), len(scene.arena.textures), rows
    )
    radial = np.array([_column(text[key], _radial_cell) for key in rays]).reshape(len(rays), rows)
    known = all(name in text for name in TRUTH)
    return Observations(
        numbers(text["t_s"]),
        text["t_s"],
        np.column_stack([numbers(text[key]) for key in ODOMETRY]),
        np.ascontiguousarray(texture.transpose(2, 0, 1)),
        np.ascontiguousarray(radial.T),
        np.column_stack([numbers(text[name]) for name in TRUTH]) if known else None,
    )


def _column(cells: list[str], convert) -> list[float]:
    return [convert(cell) for cell in cells]


def _texture_cell(cell: str) -> float:
    """Empty: not read. Anything else that is not finite is a bad cell, which the filter knows by inf."""
    if cell == "":
        return math.nan
    value = number(cell)
    return value if math.isfinite(value) else math.inf


def _radial_cell(cell: str) -> float:
    """Empty: no contact; nan: not read; what is no distance becomes -inf, a bad cell."""
    if cell == "":
        return math.inf
    if cell.lower() == "nan":
        return math.nan
    value = number(cell)
    return value / 1000.0 if math.isfinite(value) else -math.inf


@dataclass
class Run:
    """One filter's answers over all rows."""

    name: str
    setup_s: float
    step_us: np.ndarray
    estimates: list[Estimate]
    bad_cells: int
    bad_rows: int


def run(name: str, scene: Scene, observations: Observations, settings: dict[str, float] | None = None) -> Run:
    """Run a filter over every row."""
    began = time.perf_counter()
    made = Filter(name, scene, settings)
    setup_s = time.perf_counter() - began
    step_us, estimates = np.zeros(len(observations.t_s)), []
    for k in range(len(observations.t_s)):
        made._texture[:] = observations.texture[k]
        made._radial[:] = observations.radial_m[k]
        made._row.t_s = observations.t_s[k]
        made._row.odometry = list(observations.odometry[k])
        start = time.perf_counter_ns()
        made.advance()
        step_us[k] = (time.perf_counter_ns() - start) / 1000.0
        estimates.append(made.estimate())
    return Run(name, setup_s, step_us, estimates, made.bad_cells, made.bad_rows)


def pose_errors(poses: np.ndarray, truth: np.ndarray) -> dict[str, float]:
    """Position and heading errors of poses (n, 3) over the rows whose truth (n, 3) is finite."""
    known = np.isfinite(truth).all(axis=1)
    off = poses[known] - truth[known]
    distance = np.hypot(off[:, 0], off[:, 1])
    heading = np.abs(np.remainder(off[:, 2] + math.pi, 2 * math.pi) - math.pi)
    return {
        "pose_error_median_m": float(np.median(distance)),
        "pose_error_p90_m": float(np.quantile(distance, 0.9)),
        "heading_error_median_rad": float(np.median(heading)),
    }


def errors(estimates: list[Estimate], truth: np.ndarray) -> dict[str, float]:
    """`pose_errors`, and how often the 90 % region holds the truth."""
    poses = np.array([e.pose for e in estimates])
    known = np.isfinite(truth).all(axis=1)
    off = (poses - truth)[known, :2]
    information = np.linalg.inv(np.array([e.covariance[:2, :2] for e in estimates])[known])
    square = np.einsum("ni,nij,nj->n", off, information, off)
    return pose_errors(poses, truth) | {"coverage_90": float(np.mean(square <= CHI2_90))}


def summary(result: Run, truth: np.ndarray | None) -> dict:
    """The object `whisker localise --json` prints."""
    us = result.step_us if len(result.step_us) else np.zeros(1)
    evaluations = [e.evaluations for e in result.estimates] or [0]
    out = {
        "filter": result.name,
        "steps": len(result.estimates),
        "setup_s": round(result.setup_s, 6),
        "step_us_mean": round(float(us.mean()), 3),
        "step_us_median": round(float(np.median(us)), 3),
        "step_us_p99": round(float(np.quantile(us, 0.99)), 3),
        "step_us_p999": round(float(np.quantile(us, 0.999)), 3),
        "evaluations_per_step": float(np.mean(evaluations)),
        "peak_states": max((e.states for e in result.estimates), default=0),
        "peak_bytes": max((e.bytes for e in result.estimates), default=0),
        "bad_cells": result.bad_cells,
        "bad_rows": result.bad_rows,
    }
    if truth is not None and np.isfinite(truth).all(axis=1).any():
        out |= errors(result.estimates, truth)
    return out


def write_estimates(path, result: Run, observations: Observations) -> None:
    """est.csv: one row per input row, in the same order."""
    lines = [e.line(t_s) for t_s, e in zip(observations.t_text, result.estimates, strict=True)]
    try:
        Path(path).write_text("\n".join([ESTIMATE_HEADER, *lines]) + "\n")
    except OSError as error:
        raise TableError(path, None, f"cannot be written ({error.strerror}); choose another --out") from error


def observations_path(folder) -> Path:
    return Path(folder) / OBSERVATIONS
