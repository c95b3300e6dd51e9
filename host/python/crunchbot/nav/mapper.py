"""The mapper of host/nav on the rows of a robot: poses as they come, and the map at any time.

Everything is in the frame of the first pose: x forward, y left of the robot as it stood then.
"""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..errors import UserError
from ..native import doubles, ffi, floats, lib, pointer
from ..scene import Arena, Robot, Scene
from .filters import ESTIMATE, ESTIMATES, pack, problem_of
from .observations import Observations, joined, stretch

FACE = np.dtype(
    [(name, "f8") for name in ("x0", "y0", "x1", "y1", "normal", "normal_sigma", "offset_sigma", "hits")]
    + [("face", "i4"), ("right", "i4")]
)
CORNER = np.dtype([(name, "f8") for name in ("x", "y", "xx", "xy", "yy")] + [("face", "i4", 2)])
FACES, CORNERS = ffi.typeof("struct nav_mapper_face[]"), ffi.typeof("struct nav_mapper_corner[]")
assert FACE.itemsize == ffi.sizeof("struct nav_mapper_face")
assert CORNER.itemsize == ffi.sizeof("struct nav_mapper_corner")
PATCH_M = 0.3
AGAIN_MOST = 2000  # rows that a new map takes of those before, at most: NAV_KIDNAP_AGAIN
TILES_EACH_WAY = 24  # of the lattice's first tile: host/nav/mapping/floor.h


class MappingError(UserError, ValueError):
    """A mapper that cannot be; one line."""


@dataclass(frozen=True)
class Lattice:
    """Tile (0, 0) has its lower left corner at `x`, `y` (m); tiles of `pitch` m follow along `turn` (rad) and across it."""

    x: float
    y: float
    turn: float
    pitch: float
    sigma_m: float
    sigma_turn: float
    sigma_pitch: float


@dataclass(frozen=True)
class Grid:
    """Square cells of `cell` m along the first pose's axes, the lower left corner of them all at (`x`, `y`), m. `occupied`:
    (rows, columns) probability that something solid is there, the lowest y first; 0.5: nothing is known."""

    x: float
    y: float
    cell: float
    occupied: np.ndarray


@dataclass(frozen=True)
class TouchMap:
    """What is believed of the world. `faces`: (n,) of FACE, stretches that were felt; `axes`: direction of their right
    angles, rad, None: not known; `lattice`: None where the evidence is for none. `tiles`: (column, row) of the lattice to
    (index of its likeliest texture, probability). `corners`: (n,) of CORNER, where faces meet, m, with covariance, m^2.
    `frame`: number of the part of the run (Mapper.parts) whose first pose is the origin.
    """

    faces: np.ndarray
    axes: float | None
    lattice: Lattice | None
    tiles: dict[tuple[int, int], tuple[int, float]]
    corners: np.ndarray = field(default_factory=lambda: np.zeros(0, CORNER))
    grid: Grid | None = None
    frame: int = 0


@dataclass(frozen=True)
class Part:
    """A part of a run, from row `first`, before which the robot was carried off; that was noticed at row `noticed`. `touched`:
    its map, in a frame of its own, whose origin is its first pose. The first part begins at row 0."""

    number: int
    first: int
    noticed: int
    touched: TouchMap


class OneMap:
    """Takes rows of observations and knows, after each, the pose and the map; or that it is lost, for good."""

    def __init__(
        self,
        robot: Robot,
        textures: tuple[str, ...],
        lattice: bool = True,
        normals: bool = False,
    ):
        """`lattice`: whether to look for one; `normals`: rows may hold directions of the surfaces that whiskers touch.
        MappingError when there is no memory."""
        self._problem, self._keep = problem_of(Scene(nowhere(textures), robot), {})
        self._texture = (len(robot.of_role("texture")), len(textures))
        self._rays = len(robot.of_role("object"))
        self._problem.robot.normals = normals
        options = ffi.new("struct nav_mapper_options *", {"lattice": lattice})
        made = lib.nav_mapper_new(self._problem, options)
        if made == ffi.NULL:
            raise MappingError("a mapper does not fit in memory; free some")
        self._mapper = ffi.gc(made, lib.nav_mapper_free)

    def replay(self, rows: Observations, first: int, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Rows `first` to `first + count`: (count,) of ESTIMATE and (count,) microseconds of CPU time. ValueError when there
        are not so many."""
        if not 0 <= first <= first + count <= len(rows):
            raise ValueError(f"rows {first} to {first + count}: outside the {len(rows)} rows given; choose rows inside")
        table, step_us = np.zeros(count, ESTIMATE), np.zeros(count)
        packed, keep = pack(rows, self._texture, self._rays, 0)
        out = pointer(ESTIMATES, ESTIMATE, table, "table", (count,))
        lib.nav_mapper_replay(self._mapper, packed, first, count, out, doubles(step_us, "step_us", (count,)))
        del keep  # until here
        return table, step_us

    def map(self) -> TouchMap:
        """The map after the last row: cheap enough for once a second."""
        corners = self._listed(lib.nav_mapper_corners, CORNERS, CORNER, "corners")
        axes, lattice = lib.nav_mapper_lattice(self._mapper).axes, self.lattice()
        tiles = dict(self._tiles()) if lattice else {}
        known = None if axes != axes else float(axes)
        return TouchMap(self.faces(), known, lattice, tiles, corners, self._grid())

    @property
    def lost(self) -> tuple[int, int] | None:
        """Of the rows taken, from 0: before which one the robot was carried off, and at which that was noticed; None: it was
        not. The map is then that of before, and no more rows are taken."""
        lost = lib.nav_mapper_lost(self._mapper)
        return (int(lost.first), int(lost.noticed)) if lost.first >= 0 else None

    def faces(self) -> np.ndarray:
        """(n,) of FACE, stretches that were felt."""
        return self._listed(lib.nav_mapper_faces, FACES, FACE, "faces")

    def lattice(self) -> Lattice | None:
        """None where the evidence is for none."""
        found = lib.nav_mapper_lattice(self._mapper)
        place = (found.x, found.y, found.turn, found.pitch)
        return Lattice(*place, found.sigma_m, found.sigma_turn, found.sigma_pitch) if found.pitch > 0.0 else None

    def _listed(self, get: Callable[..., int], kind: Any, dtype: np.dtype, name: str) -> np.ndarray:
        room = get(self._mapper, ffi.NULL, 0)
        out = np.zeros(room, dtype)
        return out[: get(self._mapper, pointer(kind, dtype, out, name, (room,)), room)]

    def _grid(self) -> Grid:
        grid = lib.nav_mapper_grid(self._mapper)
        occupied = np.zeros((grid.rows, grid.columns), np.float32)
        lib.nav_mapper_occupancy(self._mapper, floats(occupied, "occupied", occupied.shape))
        return Grid(grid.x, grid.y, grid.cell, occupied)

    def _tiles(self) -> Iterator[tuple[tuple[int, int], tuple[int, float]]]:
        texture = ffi.new("int *")
        for column in range(-TILES_EACH_WAY, TILES_EACH_WAY):
            for row in range(-TILES_EACH_WAY, TILES_EACH_WAY):
                sure = lib.nav_mapper_tile(self._mapper, column, row, texture)
                if sure > 0.0:
                    yield (column, row), (int(texture[0]), float(sure))

    @property
    def bad(self) -> np.ndarray:
        """Cells and rows that were not taken."""
        return np.array([lib.nav_mapper_bad_cells(self._mapper), lib.nav_mapper_bad_rows(self._mapper)])


class Mapper:
    """The maps of a run, one after the other: where the robot turns out to have been carried off, a new one begins at the row
    since which it was."""

    def __init__(self, robot: Robot, textures: tuple[str, ...], lattice: bool = True, normals: bool = False):
        """As OneMap."""
        self._begin = lambda: OneMap(robot, textures, lattice, normals)
        self._map, self._past = self._begin(), list[Part]()
        self._first = self._noticed = self._taken = 0
        self._last, self._kept = deque[Observations](), 0  # the newest rows, and how many there are
        self._bad = np.zeros(2, int)  # beside those of the map

    def replay(self, rows: Observations, first: int, count: int) -> tuple[np.ndarray, np.ndarray]:
        """As OneMap's. A row's estimate is in the frame of the part that it was noticed to be of by then."""
        table, step_us = self._map.replay(rows, first, count)
        self._last.append(stretch(rows, first, first + count))
        self._taken, self._kept = self._taken + count, self._kept + count
        if self._map.lost:
            again, again_us = self._begin_anew(*self._map.lost)
            known = max(self._noticed - (self._taken - count), 0)  # rows of `table` that count
            late = len(again) - (count - known)
            table[known:], step_us[known:] = again[late:], again_us[late:]
            step_us[known] += again_us[:late].sum()
        while self._kept - len(self._last[0]) >= AGAIN_MOST:
            self._kept -= len(self._last.popleft())
        return table, step_us

    def _begin_anew(self, first: int, noticed: int) -> tuple[np.ndarray, np.ndarray]:
        """A new map, of all rows since `first`; what it answers to these."""
        self._past.append(Part(self.frame, self._first, self._noticed, self.map()))
        self._noticed, self._first = self._first + noticed, self._first + first
        rows, begun, bad = joined(self._last), self._first - (self._taken - self._kept), self._map.bad
        self._map = self._begin()
        until = self._noticed + 1 - self._first
        old = self._map.replay(rows, begun, until)
        self._bad += bad - self._map.bad
        new = self._map.replay(rows, begun + until, len(rows) - begun - until)
        return tuple(np.concatenate(column) for column in zip(old, new, strict=True))

    @property
    def frame(self) -> int:
        """Number of the part in whose frame the last estimate and the map are."""
        return len(self._past)

    def map(self) -> TouchMap:
        """The map after the last row: cheap enough for once a second."""
        return replace(self._map.map(), frame=self.frame)

    def parts(self) -> tuple[Part, ...]:
        """What the run fell into so far; one part where the robot was never carried off."""
        return (*self._past, Part(self.frame, self._first, self._noticed, self.map()))

    @property
    def bad_cells(self) -> int:
        return int(self._bad[0] + self._map.bad[0])

    @property
    def bad_rows(self) -> int:
        return int(self._bad[1] + self._map.bad[1])


def nowhere(textures: tuple[str, ...]) -> Arena:
    """An arena of which nothing but the textures' names is known. Its tile stands for the least patch of one texture that
    is looked for; runs of wrong windows are shorter than half of it."""
    return Arena((PATCH_M, PATCH_M), PATCH_M, textures, ("?",), ())
