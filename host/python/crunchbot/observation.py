"""The observation row of 0.1 s: names, units and quantities of its columns, and the row itself (docs/formats.md).

A whisker's column has the whisker's name, "_", and what is read. Names and textures may hold "_" themselves: a column is
looked up in the layout of its robot. A name is taken apart only where the robot is not known (`parse`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike

TIME = "t_s"
ODOMETRY = ("odo_x_m", "odo_y_m", "odo_theta_rad")
TRUTH = ("true_x_m", "true_y_m", "true_theta_rad")
DISTANCE = "mm"
# What an object whisker touches, in the robot's frame at the row's end. A file may leave these columns out.
NORMAL = ("normal_rad", "normal_sd_rad")
POINT = ("point_x_m", "point_y_m", "point_sd_m")
SURFACE = "surface_"  # before a texture: its log-likelihood for the face that the whisker sweeps along

EXPLORING, WHISK, RELEASE, CARRIED = range(4)  # Row.kind
EMPTY, NOT_READ, VALUE = range(3)  # of a cell; an empty distance is "no contact", any other empty cell "not read"


class Quantity(Enum):
    """What the columns of a row hold, with the unit that their names end with or imply."""

    TEXTURE = "log-likelihood of a floor texture, nats"
    SURFACE = "log-likelihood of a face's texture, nats"
    DISTANCE = "distance of a contact along the whisker, mm"
    NORMAL = "direction of a face and its standard deviation, rad"
    POINT = "point that is touched and its standard deviation, m"
    READING = "reading of a sensor of the user's own"


@dataclass(frozen=True)
class Column:
    """`what`: the texture, the name's part behind the whisker's, or the sensor, which has no whisker."""

    quantity: Quantity
    whisker: str
    what: str

    @property
    def name(self) -> str:
        before = SURFACE if self.quantity is Quantity.SURFACE else ""
        return f"{self.whisker}_{before}{self.what}" if self.whisker else self.what


def textures(whisker: str, names: Iterable[str], quantity: Quantity = Quantity.TEXTURE) -> list[Column]:
    """Columns of a whisker's textures: TEXTURE or SURFACE."""
    return [Column(quantity, whisker, name) for name in names]


def distance(whisker: str) -> Column:
    return Column(Quantity.DISTANCE, whisker, DISTANCE)


def normal(whisker: str) -> list[Column]:
    return [Column(Quantity.NORMAL, whisker, name) for name in NORMAL]


def point(whisker: str) -> list[Column]:
    return [Column(Quantity.POINT, whisker, name) for name in POINT]


def parse(name: str) -> Column:
    """A column of a robot that is not known, by how its name ends; of a texture, the part behind the last "_" is its name."""
    whisker, _, what = name.rpartition("_")
    if what == DISTANCE:
        return Column(Quantity.DISTANCE, whisker, what)
    for quantity, endings in ((Quantity.NORMAL, NORMAL), (Quantity.POINT, POINT)):
        for ending in endings:
            if name.endswith(f"_{ending}"):
                return Column(quantity, name.removesuffix(f"_{ending}"), ending)
    return Column(Quantity.TEXTURE, whisker, what)


def has_normals(names: Iterable[str]) -> bool:
    """Whether a row of these columns may hold the direction of a surface."""
    return any(parse(name).quantity is Quantity.NORMAL for name in names)


class Layout:
    """The columns of a robot's rows behind time and motion, in their order."""

    def __init__(self, columns: Iterable[Column]):
        """ValueError when two columns have one name, or one has that of time, motion or truth."""
        self._columns: dict[str, Column] = {}
        self._of: dict[tuple[Quantity, str], list[str]] = {}
        for column in columns:
            if column.name in (TIME, *ODOMETRY, *TRUTH):
                raise ValueError(f"the column '{column.name}' has two meanings: every row has one for itself")
            if (other := self._columns.setdefault(column.name, column)) is not column:
                raise ValueError(
                    f"the column '{column.name}' has two meanings: {other.quantity.value}; {column.quantity.value}"
                )
            for whisker in {"", column.whisker}:
                self._of.setdefault((column.quantity, whisker), []).append(column.name)

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(self._columns)

    def of(self, quantity: Quantity, whisker: str = "") -> list[str]:
        """Names of the columns of a quantity, of one whisker or of all."""
        return self._of.get((quantity, whisker), [])

    def get(self, name: str) -> Column | None:
        return self._columns.get(name)


@dataclass(eq=False, repr=False)
class Row(Mapping):
    """One row. As a mapping it has the cells of the file by column: None where a cell is empty, nan where nothing was read."""

    kind: int
    t_s: float
    motion: np.ndarray  # (3,) since the last row, in the robot's frame before it: m, m, rad; of CARRIED infinite
    names: tuple[str, ...]  # of the columns behind time and motion
    cells: np.ndarray  # (n,) uint8: EMPTY, NOT_READ or VALUE
    numbers: np.ndarray  # (n,) in the unit of the name; 0 where there is none

    @classmethod
    def of(cls, cells: Mapping[str, float | None], kind: int = EXPLORING) -> Row:
        """Makes a row from cells by column; KeyError when time or motion is missing."""
        names = tuple(name for name in cells if name != TIME and name not in ODOMETRY)
        return cls.made(kind, cells[TIME], [cells[name] for name in ODOMETRY], names, [cells[name] for name in names])

    @classmethod
    def made(
        cls, kind: int, t_s: float, motion: ArrayLike, names: tuple[str, ...], cells: Iterable[float | None]
    ) -> Row:
        """Makes a row from the cells of these columns in order."""
        cells = list(cells)
        found = [EMPTY if v is None else NOT_READ if math.isnan(v) else VALUE for v in cells]
        numbers = [v if k == VALUE else 0.0 for v, k in zip(cells, found, strict=True)]
        return cls(kind, t_s, np.array(motion, float), names, np.array(found, np.uint8), np.array(numbers, float))

    @property
    def t_text(self) -> str:
        """Its time as the files hold it."""
        return f"{self.t_s:.10g}"

    def __getitem__(self, name: str) -> float | None:
        if name == TIME:
            return self.t_s
        if name in ODOMETRY:
            return float(self.motion[ODOMETRY.index(name)])
        at = _positions(self.names)[name]
        return (None, math.nan, float(self.numbers[at]))[self.cells[at]]

    def __iter__(self) -> Iterator[str]:
        return iter((TIME, *ODOMETRY, *self.names))

    def __len__(self) -> int:
        return 1 + len(ODOMETRY) + len(self.names)

    def __repr__(self) -> str:
        return f"Row({dict(self)})"

    def read(self, names: Iterable[str], empty: float = math.nan) -> np.ndarray:
        """(n,) values of these columns: `empty` where a cell is empty, nan where nothing was read. KeyError when one of the
        columns is missing."""
        at = [_positions(self.names)[name] for name in names]
        cells = self.cells[at]
        return np.where(cells == VALUE, self.numbers[at], np.where(cells == EMPTY, empty, math.nan))

    def find(self, names: Iterable[str]) -> np.ndarray:
        """Reads as `read` does, with nan at columns that are missing."""
        known = _positions(self.names)
        at = [known.get(name, -1) for name in names]
        values = np.where(self.cells == VALUE, self.numbers, math.nan)
        return np.append(values, math.nan)[at]


@lru_cache(maxsize=64)
def _positions(names: tuple[str, ...]) -> dict[str, int]:
    return {name: n for n, name in enumerate(names)}


def cell(value: float | None) -> str:
    """A cell as docs/formats.md has it: empty, nan, or a number."""
    return "" if value is None else f"{value:.6g}"
