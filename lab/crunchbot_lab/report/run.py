"""What a finished run left behind, read back from its folder.

summary.json            figures, as in docs/formats.md
origin.json             command, commit, version, machine, date
seeds.csv               seed, <filter>_m: median position errors at level 1 (absent: not replayed)
truth.csv               tick, x_m, y_m, theta_rad, <whisker>_tile, <whisker>_inside_mm, <whisker>_moved_mm
scene/observations.csv  what the filters read
est_<filter>.csv        t_s, x_m, y_m, theta_rad, confidence
covariance_<filter>.csv t_s, xx_m2, xy_m2, yy_m2 (absent: no ellipses)
radial_points.csv       whisker, set (fit or held out), radius_mm, peak_counts, predicted_mm
radial_lines.json       whisker -> [a1 mm per count, a0 mm]
pilot.json, navigator.json  counters of pilot, base and navigator
robot.mcap              every topic of the run, for ROS 2 tools
traces.csv              t_s, <whisker>_min_deg, <whisker>_max_deg: envelope of the texture whiskers' deflection
"""

import csv
import json
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

FILTERS = ("grid", "adaptive", "foveal", "odometry")


def read_columns(path: Path) -> dict[str, np.ndarray]:
    """Columns of a CSV file by name: floats where every cell is a number or empty (nan), text otherwise."""
    with open(path, newline="") as file:
        header, *rows = csv.reader(file)
    return {name: _column([row[n] for row in rows]) for n, name in enumerate(header)}


def _if_there(path: Path, read) -> dict:
    """Empty for a run at level 1, which has neither network nor traces."""
    return read(path) if path.exists() else {}


def _column(cells: list[str]) -> np.ndarray:
    try:
        return np.array([float(cell) if cell else np.nan for cell in cells])
    except ValueError:
        return np.array(cells)


@dataclass
class Run:
    """One run's data, ready to draw. Arrays share the length of their table."""

    summary: dict
    arena: dict  # as in arena.toml
    texture_names: list[str]  # of the two floor whiskers
    object_names: list[str]
    truth: dict[str, np.ndarray]
    observations: dict[str, np.ndarray]
    estimates: dict[str, dict[str, np.ndarray]]
    covariances: dict[str, dict[str, np.ndarray]]
    radial: dict[str, np.ndarray]
    radial_lines: dict[str, list[float]]
    traces: dict[str, np.ndarray]
    pilot: dict  # rows, whisks, base: what whisker-base reported of itself
    navigator: dict  # counters
    bag: Path
    origin: dict[str, str]
    seeds: dict[str, np.ndarray]  # seed, <filter>_m; empty: not replayed
    scene_folder: Path

    @classmethod
    def load(cls, folder: Path) -> "Run":
        scene = folder / "scene"
        whiskers = tomllib.loads((scene / "robot.toml").read_text())["whisker"]
        covariances = {name: folder / f"covariance_{name}.csv" for name in FILTERS}
        return cls(
            summary=json.loads((folder / "summary.json").read_text()),
            arena=tomllib.loads((scene / "arena.toml").read_text()),
            texture_names=[w["name"] for w in whiskers if w["role"] == "texture"],
            object_names=[w["name"] for w in whiskers if w["role"] == "object"],
            truth=read_columns(folder / "truth.csv"),
            observations=read_columns(scene / "observations.csv"),
            estimates={name: read_columns(folder / f"est_{name}.csv") for name in FILTERS},
            covariances={name: read_columns(path) for name, path in covariances.items() if path.exists()},
            radial=read_columns(folder / "radial_points.csv"),
            radial_lines=json.loads((folder / "radial_lines.json").read_text()),
            traces=_if_there(folder / "traces.csv", read_columns),
            pilot=json.loads((folder / "pilot.json").read_text()),
            navigator=_if_there(folder / "navigator.json", lambda path: json.loads(path.read_text())),
            bag=folder / "robot.mcap",
            origin=_if_there(folder / "origin.json", lambda path: json.loads(path.read_text())),
            seeds=_if_there(folder / "seeds.csv", read_columns),
            scene_folder=scene,
        )

    def position_error(self, name: str) -> np.ndarray:
        """Distance of an estimate from the truth, m, per row."""
        estimate = self.estimates[name]
        return np.hypot(estimate["x_m"] - self.truth["x_m"], estimate["y_m"] - self.truth["y_m"])

    def heading_error(self, name: str) -> np.ndarray:
        """Absolute heading error, rad, per row."""
        difference = self.estimates[name]["theta_rad"] - self.truth["theta_rad"]
        return np.abs(np.arctan2(np.sin(difference), np.cos(difference)))
