"""The way over a map, as it stands, that sweeps most new floor a second: host/nav/planning/coverage for Python.

What is open comes from a map that grows (`of_growing`). Ground that nobody knows may be driven on, and may stop the robot.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..native import doubles, ffi, floats, lib, octets
from ..scene import Robot
from .clearance import clearance, reach

CELL_M = 0.05
LIKELY = 0.5  # probability from which a place counts as occupied
BUDGET = 15_000  # states: 20 ms of the paper's netbook
MARGIN_M = 0.6  # of ground around what is known
BEEN_M = 0.05  # from where the robot's middle was: nothing stood there
SPARE_M, WRONG_M = 0.03, 0.085  # by which a map of one's own is often wrong, and by which it is never
# In a step of a cell: on ground that nobody knows; where the body would fit if the map were wrong; where it
# hardly fits; where whiskers would touch.
UNKNOWN, TIGHT, CLOSE, TOUCHED = math.exp(-CELL_M / 1.0), 0.5, 0.85, 0.97
# A face goes on beyond what was felt of it: a way across its line is stopped with probability ALONG there, e times less each
# GOES_ON_M further along.
ALONG, GOES_ON_M, ACROSS_M, NORMAL_RAD = 0.9, 1.0, 0.1, 0.3
STOPPED_M, BAR_M = (
    0.06,
    0.07,
)  # from where the robot was stopped to where its middle does not get, and the radius of that
AGAIN = 0.3  # probability of getting through there after all
ASLANT_RAD = math.radians(35.0)  # from the world's right angles: which face it was is open
LEAVE_M = 0.25  # around where it stands: it came there, so it gets away
LEAST_M2 = 0.02
NEAR_M = 0.08  # a corner so near is passed
NOTHING_NEW = "no new floor is in reach"


class Grid(Protocol):
    """Square cells, the lower left corner of them all at (x, y), m; `occupied` (rows, columns) probability that something solid
    is there, 0.5: nothing is known."""

    x: float
    y: float
    cell: float
    occupied: np.ndarray


class Growing(Protocol):
    """A map as it grows. `faces` (n,): fields x0, y0, x1, y1 (m), normal, normal_sigma (rad); `axes`: direction of their right angles, rad, or
    None; `frame`: number of the frame, whose poses are no others'."""

    @property
    def grid(self) -> Grid | None: ...
    @property
    def faces(self) -> np.ndarray: ...
    @property
    def axes(self) -> float | None: ...
    @property
    def frame(self) -> int: ...


@dataclass(frozen=True)
class Vehicle:
    """Speeds, m/s and rad/s; what a contact costs, s; `settle_s` after each change of speed."""

    drive_m_s: float
    turn_rad_s: float
    contact_s: float
    settle_s: float

    @property
    def stopped_s(self) -> float:
        """What it costs to be stopped: the way back, and a quarter turn away, for the way ahead is closed."""
        return self.contact_s + math.pi / 2.0 / self.turn_rad_s + 2.0 * self.settle_s


@dataclass(frozen=True)
class Field:
    """Cells of `cell_m`, (rows, columns), the lower left corner of them all at (`x_m`, `y_m`): `open` float32, probability that
    nothing stops the robot's middle there, and `fresh` uint8, 1 where the floor was not swept."""

    cell_m: float
    x_m: float
    y_m: float
    open: np.ndarray
    fresh: np.ndarray


@dataclass(frozen=True)
class Way:
    """Corners (n, 2) up to the end, m; what it is expected to sweep, m^2, in how many seconds; `refused`: why there is none."""

    corners: np.ndarray
    swept_m2: float = 0.0
    seconds: float = 0.0
    passed: float = 1.0
    refused: str = ""
    spent: int = 0

    def first(self, pose: np.ndarray) -> tuple[float, float]:
        """Turn, rad, and drive, m, of its first leg for a robot at pose (3,)."""
        off = self.corners - pose[:2]
        far = np.hypot(*off.T)
        n = min(int(np.argmax(far >= NEAR_M)), len(far) - 1)
        turn = math.remainder(math.atan2(off[n, 1], off[n, 0]) - pose[2], 2.0 * math.pi)
        return turn, float(far[n])


NO_WAY = np.zeros((0, 2))


class CoveragePlanner:
    """`plan` for robots that move as `vehicle` does and sweep the floor at `asides_m` beside their middle."""

    def __init__(self, vehicle: Vehicle, asides_m: np.ndarray, least_m2: float = LEAST_M2, budget: int = BUDGET):
        self._vehicle, self._asides = vehicle, np.ascontiguousarray(asides_m, float)
        self._least_m2, self._budget = least_m2, budget
        self._cells, self._made = 0, None

    def plan(self, field: Field, pose: np.ndarray) -> Way:
        """From pose (3,) in the field's frame."""
        if field.open.size > self._cells:
            self._make(2 * field.open.size)
        shape = field.open.shape
        ground = ffi.new("struct nav_coverage_ground *", {"columns": shape[1], "rows": shape[0], "cell": field.cell_m})
        ground.x, ground.y = field.x_m, field.y_m
        ground.open, ground.fresh = floats(field.open, "open", shape), octets(field.fresh, "fresh", shape)
        out = ffi.new("struct nav_coverage_plan *")
        lib.nav_coverage_plan(self._made, ground, *map(float, pose), out)
        if out.corners == 0:
            return Way(NO_WAY, refused=NOTHING_NEW, spent=out.spent)
        corners = np.array([(out.x[n], out.y[n]) for n in range(out.corners)])
        return Way(corners, out.swept_m2, out.seconds, out.passed, spent=out.spent)

    def _make(self, cells: int) -> None:
        vehicle, asides = self._vehicle, self._asides
        options = ffi.new(
            "struct nav_coverage_options *",
            {
                "drive_m_s": vehicle.drive_m_s,
                "turn_rad_s": vehicle.turn_rad_s,
                "begin_s": vehicle.settle_s,
                "stopped_s": vehicle.stopped_s,
                "least_m2": self._least_m2,
                "budget": self._budget,
                "asides": len(asides),
                "aside": doubles(asides, "asides_m", (len(asides),)),
            },
        )
        self._cells = min(cells, lib.NAV_COVERAGE_CELLS_MOST)
        made = lib.nav_coverage_new(self._cells, options)
        if made == ffi.NULL:
            raise ValueError(f"{self._cells} cells, {len(asides)} asides: out of range, or no memory; give fewer")
        self._made = ffi.gc(made, lib.nav_coverage_free)


def sweep(robot: Robot) -> float:
    """m from the robot's middle to either side that it sweeps as it goes: to its outermost texture whisker, or its rim."""
    return max((abs(whisker.tip_m[1]) for whisker in robot.of_role("texture")), default=robot.body_radius_m)


def lanes(robot: Robot) -> np.ndarray:
    """What a robot that maps sweeps, as `asides_m`."""
    most = int(sweep(robot) / CELL_M)
    return np.arange(-most, most + 1) * CELL_M


def turned(points: np.ndarray, turn: float) -> np.ndarray:
    """(n, 2) after a turn about the origin."""
    c, s = math.cos(turn), math.sin(turn)
    return points @ np.array([[c, s], [-s, c]])


def of_growing(
    known: Growing, been: np.ndarray, met: np.ndarray, pose: np.ndarray, robot: Robot
) -> tuple[Field, np.ndarray]:
    """What a growing map says to a robot that has been at (n, 2) and is at pose (3,), and that has met things at (m, 2) from places
    (m, 2), `met` (m, 4), m; all along the map's right angles: the field, and the pose in its frame."""
    turn = -(known.axes or 0.0)
    points, solid = _cells(known.grid)
    points, been, things, places = (turned(at, turn) for at in (points, been, met[:, :2], met[:, 2:]))
    bars = places + STOPPED_M * _directions(places, things)
    here = np.array([*turned(pose[None, :2], turn)[0], pose[2] + turn])
    everywhere = np.concatenate([points, been, things, here[None, :2]])
    low = CELL_M * np.floor((everywhere.min(axis=0) - MARGIN_M) / CELL_M)
    columns, rows = np.ceil((everywhere.max(axis=0) + MARGIN_M - low) / CELL_M).astype(int)

    def marked(at: np.ndarray) -> np.ndarray:
        out = np.zeros((rows, columns), bool)
        column, row = ((at - low) / CELL_M).astype(int).T
        out[row, column] = True
        return out

    closed = marked(points[solid > LIKELY]) & ~marked(been)
    swept = sweep(robot)
    way = clearance(marked(been), CELL_M, swept + 2.0 * CELL_M) + CELL_M / 2.0  # to the middle of a cell of the path
    open_ = np.full((rows, columns), UNKNOWN)
    for face in (*_faces(known.faces, turn, robot.body_radius_m), *_met_faces(bars, places, known.axes is not None)):
        _close_along(open_, face, low)
    np.putmask(open_, way <= BEEN_M + CELL_M / 2.0, 1.0)
    _close_at(open_, bars, low)
    passed = _passed(clearance(closed, CELL_M, reach(robot) + 2.0 * CELL_M), robot)
    open_ *= np.where(_near(open_, here, low) & ~closed, np.maximum(passed, TIGHT), passed)
    fresh = (way > swept) & ~closed
    return Field(CELL_M, *map(float, low), open_.astype(np.float32), fresh.astype(np.uint8)), here


def _cells(grid: Grid | None) -> tuple[np.ndarray, np.ndarray]:
    """Middles (n, 2) of the cells of which something is known, m, and how likely they are solid (n,)."""
    if grid is None or not grid.occupied.size:
        return np.zeros((0, 2)), np.zeros(0)
    row, column = np.nonzero(grid.occupied != 0.5)
    middles = np.column_stack([grid.x + (column + 0.5) * grid.cell, grid.y + (row + 0.5) * grid.cell])
    return middles, grid.occupied[row, column]


def _middles(shape: tuple[int, int], low: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rows, columns = shape
    return np.meshgrid(low[0] + (np.arange(columns) + 0.5) * CELL_M, low[1] + (np.arange(rows) + 0.5) * CELL_M)


@dataclass(frozen=True)
class _Face:
    """A stretch around a middle (2,), `half` m to both sides, with this direction of the free side, rad: the robot's middle comes as
    near as `before_m`."""

    middle: np.ndarray
    half: float
    normal: float
    before_m: float


def _faces(faces: np.ndarray, turn: float, radius: float) -> Iterator[_Face]:
    """Those whose direction is known."""
    for face in faces[faces["normal_sigma"] <= NORMAL_RAD] if len(faces) else ():
        ends = turned(np.array([[face["x0"], face["y0"]], [face["x1"], face["y1"]]]), turn)
        yield _Face(ends.mean(axis=0), math.hypot(*(ends[1] - ends[0])) / 2.0, face["normal"] + turn, radius)


def _directions(places: np.ndarray, things: np.ndarray) -> np.ndarray:
    """(m, 2) of length 1, from places to things."""
    off = things - places
    return off / np.maximum(np.hypot(*off.T), 1e-9)[:, None]


def _met_faces(things: np.ndarray, places: np.ndarray, right: bool) -> Iterator[_Face]:
    """What was met, as faces that look to where the robot was; `right`: along the axes, as faces are."""
    for thing, place in zip(things, places, strict=True):
        normal = math.atan2(*(place - thing)[::-1])
        nearest = math.pi / 2.0 * round(normal / (math.pi / 2.0))
        if not right or abs(normal - nearest) <= ASLANT_RAD:
            yield _Face(thing, 0.0, nearest if right else normal, 0.0)


def _close_along(open_: np.ndarray, face: _Face, low: np.ndarray) -> None:
    """Where a face may go on beyond what was felt of it."""
    x, y = _middles(open_.shape, low)
    nx, ny = math.cos(face.normal), math.sin(face.normal)
    before = nx * (x - face.middle[0]) + ny * (y - face.middle[1])
    beyond = np.maximum(np.abs(nx * (y - face.middle[1]) - ny * (x - face.middle[0])) - face.half, 0.0)
    across = (1.0 - ALONG * np.exp(-beyond / GOES_ON_M)) ** (CELL_M / (face.before_m + ACROSS_M))
    np.minimum(open_, np.where((before > -ACROSS_M) & (before < face.before_m), UNKNOWN * across, UNKNOWN), out=open_)


def _close_at(open_: np.ndarray, bars: np.ndarray, low: np.ndarray) -> None:
    """Where the robot was stopped: the more often, the less open."""
    x, y = _middles(open_.shape, low)
    for bar in bars:
        open_ *= np.where((x - bar[0]) ** 2 + (y - bar[1]) ** 2 < BAR_M**2, AGAIN ** (CELL_M / (2.0 * BAR_M)), 1.0)


def _passed(clear: np.ndarray, robot: Robot) -> np.ndarray:
    """Probability that nothing stops the robot's middle in a cell so far from what is solid, m."""
    radius = robot.body_radius_m
    limits = (radius - WRONG_M, radius - SPARE_M, radius + SPARE_M, reach(robot))
    return np.array([0.0, TIGHT, CLOSE, TOUCHED, 1.0])[np.searchsorted(limits, clear, side="right")]


def _near(open_: np.ndarray, here: np.ndarray, low: np.ndarray) -> np.ndarray:
    """(rows, columns) bool: where it may drive, for it came there, whatever the map says."""
    x, y = _middles(open_.shape, low)
    return (x - here[0]) ** 2 + (y - here[1]) ** 2 < LEAVE_M**2
