"""observations.csv of a scene folder as arrays. Strict in structure, forgiving in values (docs/formats.md)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from ..observation import NORMAL, ODOMETRY, POINT, TIME, TRUTH, Quantity, Row
from ..scene import OBSERVATIONS, Scene
from ..tables import number, numbers, read_columns, require_columns


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
        """(n,) whether a row is later than all before it; one whose time is no number is not."""
        t_s = np.where(np.isfinite(self.t_s), self.t_s, np.nan)
        return t_s > np.fmax.accumulate(np.concatenate([[-np.inf], t_s]))[:-1]


def joined(parts: Sequence[Observations]) -> Observations:
    """The rows of all parts, one at least, in order; every part has the same columns."""

    def column(name: str) -> np.ndarray | None:
        values = [getattr(part, name) for part in parts]
        return None if values[0] is None else np.concatenate(values)

    text = [t for part in parts for t in part.t_text]
    names = (field.name for field in fields(Observations) if field.name != "t_text")
    return Observations(t_text=text, **{name: column(name) for name in names})


def stretch(rows: Observations, first: int, last: int) -> Observations:
    """Rows `first` to `last`, that one not among them; without a copy."""
    names = (field.name for field in fields(Observations))
    cut = {name: value if (value := getattr(rows, name)) is None else value[first:last] for name in names}
    return Observations(**cut)


def observed(row: Row, scene: Scene, own: int = 0) -> Observations:
    """A row as Observations of one, with so many values of own sensors, of which the scene's come first. KeyError when a column
    of the scene's textures or distances is missing."""
    tips, rays, layout = len(scene.robot.of_role("texture")), len(scene.robot.of_role("object")), scene.layout
    texture = row.read(layout.of(Quantity.TEXTURE)).reshape(1, tips, len(scene.arena.textures))
    radial = row.read(layout.of(Quantity.DISTANCE), empty=math.inf).reshape(1, rays) / 1000.0
    touched = ((Quantity.NORMAL, len(NORMAL)), (Quantity.POINT, len(POINT)))
    normal, point = (row.find(layout.of(quantity)).reshape(1, rays, width) for quantity, width in touched)
    readings = row.find(layout.of(Quantity.READING))[None]
    values = np.hstack([readings, np.full((1, max(own - readings.shape[1], 0)), math.nan)])
    motion, values = np.asarray(row.motion, np.float64)[None], values if values.size else None
    return Observations(np.array([row.t_s]), [row.t_text], motion, texture, radial, None, values, normal, point)


def observations_path(folder: str | Path) -> Path:
    return Path(folder) / OBSERVATIONS


def read_observations(path: str | Path, scene: Scene) -> Observations:
    """Read the file; TableError when a column of the scene's whiskers is missing or the structure is broken."""
    tips, rays, own = (scene.layout.of(q) for q in (Quantity.TEXTURE, Quantity.DISTANCE, Quantity.READING))
    text = read_columns(path, [TIME, *ODOMETRY, *tips, *rays, *own], (*TRUTH, *scene.layout.names))
    rows, shape = len(text[TIME]), (len(scene.robot.of_role("texture")), len(scene.arena.textures))
    texture = np.array([_column(text[key], _texture_cell) for key in tips]).reshape(*shape, rows)
    radial = np.array([_column(text[key], _radial_cell) for key in rays]).reshape(len(rays), rows)
    known = all(name in text for name in TRUTH)
    return Observations(
        numbers(text[TIME]),
        text[TIME],
        np.column_stack([numbers(text[key]) for key in ODOMETRY]),
        np.ascontiguousarray(texture.transpose(2, 0, 1)),
        np.ascontiguousarray(radial.T),
        np.column_stack([numbers(text[name]) for name in TRUTH]) if known else None,
        np.column_stack([_column(text[name], _own_cell) for name in own]) if own else None,
        _touched(path, text, scene, Quantity.NORMAL, len(NORMAL)),
        _touched(path, text, scene, Quantity.POINT, len(POINT)),
    )


def _touched(path, text: dict[str, list[str]], scene: Scene, quantity: Quantity, width: int) -> np.ndarray | None:
    """(n, whiskers, width); None where no whisker has such columns. TableError when one has some of them only."""
    whiskers = scene.robot.of_role("object")
    out = np.full((len(text[TIME]), len(whiskers), width), np.nan)
    columns = [scene.layout.of(quantity, whisker.name) for whisker in whiskers]
    given = [n for n, keys in enumerate(columns) if any(key in text for key in keys)]
    for n in given:
        require_columns(path, text, columns[n])
        out[:, n] = np.column_stack([_column(text[key], _own_cell) for key in columns[n]])
    return out if given else None


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
    """Empty or inf (as REP 117 has it): no contact; nan: not read; what is no number becomes -inf, a bad cell."""
    if cell == "":
        return math.inf
    if cell.lower() == "nan":
        return math.nan
    value = number(cell)
    return -math.inf if math.isnan(value) else value / 1000.0
