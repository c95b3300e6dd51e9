"""Sensors of a user's own in a scene folder: a map of what is expected where, and a table of likelihoods of readings.

robot.toml names them as [[sensor]]: an image of grey levels over the whole arena, and a CSV file with a row for each bin of
readings and a column for each level.
"""

import io
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .files import UnreadableError
from .images import Grey, nearest_levels, read_grey
from .outputs import put
from .scene_table import LARGEST_M, SceneError, Table
from .tables import TableError, numbers, read_columns

SENSORS_MOST, LEVELS_MOST = 100, 255
NOT_KNOWN = 255  # code of a cell of which nothing is known
EDGES = ("from", "to")
SQUARE = 0.01  # cells of a map are square within such a share


@dataclass(frozen=True, eq=False)
class SensorTable:
    """spacing_m, detail_m: as those of nav.filters.Sensor. codes: (rows, columns) of uint8, row 0 has the smallest y, NOT_KNOWN where nothing is known; edges (bins + 1,) of
    readings; likelihood (bins, levels) of a reading in a bin where a level is expected."""

    name: str
    at_m: tuple[float, float]
    spacing_m: float
    detail_m: float
    codes: np.ndarray = field(repr=False)
    cell_m: float = 0.0
    edges: np.ndarray = field(default_factory=lambda: np.zeros(0), repr=False)
    likelihood: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)), repr=False)


def read_sensors(table: Table, size_m: tuple[float, float]) -> tuple[SensorTable, ...]:
    """The [[sensor]] tables of robot.toml in an arena of this size; SceneError or TableError."""
    return tuple(_read(entry, size_m) for entry in table.tables("sensor", SENSORS_MOST))


def _read(entry: Table, size_m: tuple[float, float]) -> SensorTable:
    name = entry.name()
    at_m = entry.numbers("at_m", 2, -LARGEST_M, LARGEST_M)
    reported = [entry.number(k, 0.0, LARGEST_M) if k in entry.content else 0.0 for k in ("spacing_m", "detail_m")]
    folder = entry.path.parent
    edges, likelihood = _read_table(folder / entry.text("table"))
    image = folder / entry.text("map")
    try:
        grey = read_grey(image)
    except UnreadableError as error:
        raise entry.fail("map", f"{image}: {error}; give an image of the whole arena") from error
    entry.done()
    cells = [side / count for side, count in zip(size_m, grey.level.shape[::-1], strict=True)]
    if abs(cells[0] - cells[1]) > SQUARE * cells[0]:
        raise SceneError(f"{image}: pixels of {cells[0]:.3g} x {cells[1]:.3g} m; give square ones over the whole arena")
    return SensorTable(name, at_m, *reported, _codes(grey, likelihood.shape[1]), cells[0], edges, likelihood)


def _codes(grey: Grey, levels: int) -> np.ndarray:
    """Nearest of evenly spaced grey levels, the first black; a pixel that can be looked through is not known."""
    steps = max(levels - 1, 1)
    codes = nearest_levels(grey.level, tuple(round(255 * n / steps) for n in range(levels)))
    if grey.opaque is not None:
        codes[~grey.opaque] = NOT_KNOWN
    return np.ascontiguousarray(codes[::-1])


def _read_table(path: Path) -> tuple[np.ndarray, np.ndarray]:
    columns = read_columns(path, [*EDGES])
    names = [name for name in columns if name not in EDGES]
    if not 1 <= len(names) <= LEVELS_MOST:
        raise TableError(path, 1, f"{len(names)} columns beside 'from' and 'to'; give 1 to {LEVELS_MOST}, one a level")
    low, high = (numbers(columns[name]) for name in EDGES)
    likelihood = np.column_stack([numbers(columns[name]) for name in names])
    if not len(low):
        raise TableError(path, None, "no rows; give one for each bin of readings")
    bins = np.isfinite(low + high) & (low < high)
    bins[1:] &= low[1:] == high[:-1]
    if not bins.all():
        line = int(np.argmin(bins)) + 2
        raise TableError(path, line, "'from' and 'to' are no bin that follows the one before; give bins without gaps")
    good = (np.isfinite(likelihood) & (likelihood >= 0.0)).all(axis=1)
    if not good.all():
        raise TableError(path, int(np.argmin(good)) + 2, "a likelihood is negative or no number; give p(bin | level)")
    return np.append(low, high[-1]), likelihood


def write_sensor(folder: Path, sensor: SensorTable) -> dict:
    """Its two files; the lines of its [[sensor]] table."""
    from PIL import Image

    levels = sensor.likelihood.shape[1]
    codes = sensor.codes[::-1]
    grey = np.round(255.0 * np.minimum(codes, levels - 1) / max(levels - 1, 1)).astype(np.uint8)
    alpha = np.where(codes == NOT_KNOWN, 0, 255).astype(np.uint8)
    image = io.BytesIO()
    Image.fromarray(np.dstack([grey, alpha]), "LA").save(image, "png")
    put(folder / f"{sensor.name}.png", image.getvalue())
    lines = [",".join([*EDGES, *(f"level{n}" for n in range(levels))])]
    rows = np.column_stack([sensor.edges[:-1], sensor.edges[1:], sensor.likelihood]).tolist()
    put(folder / f"{sensor.name}.csv", "\n".join([*lines, *(",".join(map(repr, row)) for row in rows)]) + "\n")
    places = {"map": f"{sensor.name}.png", "table": f"{sensor.name}.csv"}
    return {
        "name": sensor.name,
        "at_m": sensor.at_m,
        "spacing_m": sensor.spacing_m,
        "detail_m": sensor.detail_m,
    } | places
