"""Localisation: a filter over all rows of a scene, with its errors and costs where the truth is known."""

import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..observation import ODOMETRY, TRUTH
from ..outputs import put
from ..scene import Scene
from .filters import ESTIMATE, Estimate, Filter, SettingError, default_filter, filter_names, settings_list, to_estimate
from .observations import Observations, observations_path, read_observations
from .scoring import pose_errors

__all__ = [
    "ODOMETRY",
    "TRUTH",
    "Estimate",
    "Filter",
    "Observations",
    "SettingError",
    "default_filter",
    "filter_names",
    "judged_rows",
    "observations_path",
    "pose_errors",
    "read_observations",
    "run",
    "settings_list",
    "spoken",
    "summary",
    "warnings",
    "write_estimates",
]

ESTIMATE_HEADER = "t_s,x_m,y_m,theta_rad,confidence"
JUDGED_MOST = 200_000  # components of beliefs that are judged, for each row of the run
REGION_ROWS = 200  # coverage is judged on at most so many rows, evenly spread: a region costs more than a step


@dataclass
class Run:
    """One filter's answers over all rows."""

    name: str
    setup_s: float
    step_us: np.ndarray  # (n,) CPU time of the thread
    table: np.ndarray  # (n,) of ESTIMATE
    bad_cells: int
    bad_rows: int
    resolution: tuple[float, float, float, float] | None = None  # as Filter.resolution
    levels: np.ndarray = field(default_factory=lambda: np.zeros(0))  # of the truth's region, at the judged rows
    areas_m2: np.ndarray = field(default_factory=lambda: np.zeros(0))  # of the 90 % regions there

    @property
    def poses(self) -> np.ndarray:
        """(n, 3)"""
        return self.table["pose"]

    @property
    def estimates(self) -> list[Estimate]:
        return [to_estimate(row) for row in self.table]


def run(
    name: str,
    scene: Scene,
    observations: Observations,
    settings: dict[str, float] | None = None,
    seed: int = 0,
    regions: int = 0,
) -> Run:
    """Run a filter over every row; judge its region against the truth at most at `regions` rows, evenly spread.

    A belief of so many components that this would take longer than the run is judged less often: nan at the others."""
    began = time.perf_counter()
    made = Filter(name, scene, settings, seed, normals=observations.normal is not None)
    setup_s = time.perf_counter() - began
    first, parts, judged, work = 0, [], [], 0
    for row in judged_rows(observations, regions):
        parts.append(made.replay(observations, first, row + 1 - first))
        first = row + 1
        if work <= JUDGED_MOST * row:
            work += made.component_count
            judged.append(made.region(*observations.truth[row, :2]))
        else:
            judged.append((np.nan, np.nan))
    parts.append(made.replay(observations, first, len(observations) - first))
    table, step_us = (np.concatenate(column) for column in zip(*parts, strict=True))
    levels, areas = np.array(judged).reshape(-1, 2).T
    return Run(name, setup_s, step_us, table, made.bad_cells, made.bad_rows, made.resolution, levels, areas)


def judged_rows(observations: Observations, most: int) -> list[int]:
    """At most so many rows whose truth is known, evenly spread, the first and the last among them."""
    if observations.truth is None or most <= 0:
        return []
    known = np.nonzero(np.isfinite(observations.truth).all(axis=1))[0]
    return known[np.unique(np.linspace(0, len(known) - 1, min(most, len(known))).astype(int))].tolist()


def summary(result: Run, truth: np.ndarray | None) -> dict:
    """The object `whisker localise --json` prints."""
    us, table = result.step_us, result.table
    if not len(us):
        us, table = np.zeros(1), np.zeros(1, ESTIMATE)
    out = {
        "filter": result.name,
        "steps": len(result.table),
        "setup_s": round(result.setup_s, 6),
        "step_us_mean": round(float(us.mean()), 3),
        "step_us_median": round(float(np.median(us)), 3),
        "step_us_p99": round(float(np.quantile(us, 0.99)), 3),
        "step_us_p999": round(float(np.quantile(us, 0.999)), 3),
        "evaluations_per_step": float(table["evaluations"].mean()),
        "distinct_per_step": float(table["distinct"].mean()),
        "touched_max": int(table["touched"].max()),
        "peak_states": int(table["states"].max()),
        "peak_bytes": int(table["bytes"].max()),
        "bad_cells": result.bad_cells,
        "bad_rows": result.bad_rows,
    }
    if result.resolution:
        out |= dict(zip(("resolution_m", "resolution_rad", "wanted_m", "start_m"), result.resolution, strict=True))
    if truth is not None and np.isfinite(truth).all(axis=1).any():
        out |= pose_errors(result.poses, truth)
    judged = np.isfinite(result.levels)
    if judged.any():
        covered, areas = result.levels[judged] <= 0.9, result.areas_m2[judged]
        out |= {"coverage_90": float(np.mean(covered)), "region_90_m2": float(np.median(areas))}
    return out


def spoken(result: Run, truth: np.ndarray | None) -> list[str]:
    """What `whisker localise` prints without --json: lines for a person."""
    out, rows = summary(result, truth), len(result.table)
    lines = [f"{result.name}: {rows} rows, {out['step_us_mean']:.0f} us each"]
    if rows:
        (x, y, theta), share = result.poses[-1], result.table["confidence"][-1]
        lines += [
            f"at the end: x {x:.3f} m, y {y:.3f} m, heading {np.degrees(theta):.1f} degrees, confidence {share:.2f}"
        ]
    if "pose_error_median_m" in out:
        errors = [1000 * out[f"pose_error_{part}_m"] for part in ("median", "p90")]
        heading = np.degrees(out["heading_error_median_rad"])
        lines += [f"error: {errors[0]:.0f} mm median, {errors[1]:.0f} mm at 90 %; heading {heading:.1f} degrees median"]
    if "coverage_90" in out:
        judged = int(np.isfinite(result.levels).sum())
        lines += [
            f"the 90 % region holds the truth in {100 * out['coverage_90']:.1f} % of {judged} rows; "
            f"half of them are below {1e4 * out['region_90_m2']:.0f} cm2"
        ]
    if result.bad_rows or result.bad_cells:
        lines += [f"not used: {result.bad_rows} rows, {result.bad_cells} cells"]
    return lines


def warnings(result: Run) -> list[str]:
    """What a user should know of how it ran, one line each."""
    cell, _, wanted, start = result.resolution or (0.0, 0.0, 0.0, 0.0)
    name, asked = result.name, f"where the scene's detail asks for {wanted:.3g} m"
    out = []
    if cell > 1.001 * wanted:
        out += [f"filter '{name}' has cells of {cell:.3g} m {asked}; set {name}.cell_m={wanted:.3g}"]
    if start > 0.0:
        out += [
            f"filter '{name}' looks for an unknown place in cells of {start:.3g} m {asked}; begin from a known pose"
        ]
    return out


def write_estimates(path: str | Path, result: Run, observations: Observations) -> None:
    """est.csv: one row per input row, in the same order."""
    answers = zip(observations.t_text, result.poses.tolist(), result.table["confidence"].tolist(), strict=True)
    lines = [f"{t_s},{x:.6f},{y:.6f},{theta:.6f},{share:.6f}" for t_s, (x, y, theta), share in answers]
    put(path, "\n".join([ESTIMATE_HEADER, *lines]) + "\n")
