"""observations.csv of a scene folder as arrays. Strict in structure, forgiving in values (docs/formats.md)."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..scene import NORMAL, OBSERVATIONS, POINT, Scene, Whisker
from ..tables import number, numbers, read_columns, require_columns

TRUTH = ("true_x_m", "true_y_m", "true_theta_rad")
ODOMETRY = ("odo_x_m", "odo_y_m", "odo_theta_rad")


@dataclass
class Observations:
    """Rows as columns. Cells that are no numbers are +-inf where the filter counts them as bad."""

    t_s: np.ndarray  # (n,)
    t_text: list[str]  # as written, for the output
    odometry: np.ndarray  # (n, 3)
    texture: np.ndarray  # (n, tips, classes), nan not read
    radial_m: np.ndarray  # (n, rays), nan not read, inf no contact
    truth: np.ndarray | None  # (n, 3)
    own: np.ndarray | None = None  # (n, values) readings of the user's own sensors one after another, nan not read
    normal: np.ndarray | None = None  # (n, rays, 2) as NORMAL, nan not read; None: no such columns
    point: np.ndarray | None = None  # (n, rays, 3) as POINT, likewise

    def __len__(self) -> int:
        return len(self.t_s)

    def in_order(self) -> np.ndarray:
        """(n,) whether a row is later than all before it."""
        latest = np.fmax.accumulate(np.concatenate([[-np.inf], self.t_s]))[:-1]
        return self.t_s > latest


def observations_path(folder) -> Path:
    return Path(folder) / OBSERVATIONS


def read_observations(path, scene: Scene) -> Observations:
    """Read the file; TableError when a column of the scene's whiskers is missing or the structure is broken."""
    tips = [[f"{w.name}_{t}" for t in scene.arena.textures] for w in scene.robot.of_role("texture")]
    rays = [f"{w.name}_mm" for w in scene.robot.of_role("object")]
    own = [sensor.name for sensor in scene.robot.sensors]
    text = read_columns(path, ["t_s", *ODOMETRY, *(key for keys in tips for key in keys), *rays, *own])
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
        np.column_stack([_column(text[name], _own_cell) for name in own]) if own else None,
        *(_touched(path, text, scene.robot.of_role("object"), names) for names in (NORMAL, POINT)),
    )


def tells_normals(names: Iterable[str]) -> bool:
    """Whether a row of these cells may hold the direction of a surface."""
    return any(name.endswith(f"_{NORMAL[0]}") for name in names)


def touch_keys(whisker: Whisker, names: tuple[str, ...]) -> list[str]:
    """Columns of NORMAL or POINT."""
    return [f"{whisker.name}_{name}" for name in names]


def _touched(path, text: dict[str, list[str]], whiskers: list[Whisker], names: tuple[str, ...]) -> np.ndarray | None:
    """(n, whiskers, names); None where no whisker has such columns. TableError when one has some of them only."""
    out = np.full((len(text["t_s"]), len(whiskers), len(names)), np.nan)
    given = [n for n, w in enumerate(whiskers) if any(key in text for key in touch_keys(w, names))]
    for n in given:
        keys = touch_keys(whiskers[n], names)
        require_columns(path, text, keys)
        out[:, n] = np.column_stack([_column(text[key], _own_cell) for key in keys])
    return out if given else None


def cell(value: float | None) -> str:
    """A cell as docs/formats.md has it: empty, nan, or a number."""
    return "" if value is None else f"{value:.6g}"


def _column(cells: list[str], convert) -> list[float]:
    return [convert(cell) for cell in cells]


def _texture_cell(cell: str) -> float:
    """Empty: not read. Anything else that is not finite is a bad cell, which the filter knows by inf."""
    if cell == "":
        return math.nan
    value = number(cell)
    return value if math.isfinite(value) else math.inf


_own_cell = _texture_cell  # of a sensor of the user's own


def _radial_cell(cell: str) -> float:
    """Empty: no contact; nan: not read; what is no distance becomes -inf, a bad cell."""
    if cell == "":
        return math.inf
    if cell.lower() == "nan":
        return math.nan
    value = number(cell)
    return value / 1000.0 if math.isfinite(value) else -math.inf
