"""A map by touch as a scene that filters take: axis-parallel boxes, a floor of tiles, and ground of which nothing is known.

The arena's frame stands on the lattice's tiles, or along the faces' right angles, or is the first pose's.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..occupancy import FREE, SOLID, UNKNOWN, Box, Pose, boxes_of, from_map, to_map
from ..scene import NOT_KNOWN, Arena, Robot
from .mapper import Grid, TouchMap
from .observations import Observations

CELL_M = 0.025
THICK_M = 0.05  # of what is solid behind a face; deeper nobody has felt
MARGIN_M = 0.1  # around all that was felt
SQUARE_RAD = math.radians(3)  # faces within so much of the axes become boxes, others rows of cells
SURE = 0.8  # of a tile's texture, to be written into the map
GAP_M = 0.15  # between two stretches of one face, that is taken as solid


@dataclass(frozen=True)
class MapScene:
    """An arena, the pose of its frame in that of the first pose, and cells of CELL_M: (rows, columns) of FREE, SOLID or
    UNKNOWN, the first row at the lowest y; and probabilities that something solid is there, 0.5: nothing is known."""

    arena: Arena
    origin: Pose
    cells: np.ndarray
    occupied: np.ndarray


def map_scene(
    touched: TouchMap, poses: np.ndarray, rows: Observations, robot: Robot, textures: tuple[str, ...]
) -> MapScene:
    """The MapScene of a map, with the poses (n, 3) at which its rows were read."""
    start = _frame(touched)
    path = from_map(poses, start)
    faces = _bridged(np.array([_moved(face, start) for face in touched.faces]).reshape(-1, 6))
    low, high = _bounds(path, faces, robot)
    tile = round(touched.lattice.pitch if touched.lattice else float(max(high - low)), 6)
    first = np.floor(low / tile).astype(int) if touched.lattice else np.zeros(2, int)
    corner = first * tile if touched.lattice else low
    size = np.round(np.ceil((high - corner) / tile) * tile if touched.lattice else high - low, 6)
    shift = (float(corner[0]), float(corner[1]), 0.0)
    faces[:, :4] -= np.tile(corner, 2)
    cells = _body_cells(from_map(path, shift), robot.body_radius_m - CELL_M, size)
    faces = np.array([part for face in faces for part in _standing(face, cells)]).reshape(-1, 6)
    cells = _free_cells(from_map(path, shift), rows, robot, size)
    solid = [box for face in faces for box in _solid(face, cells, size)]
    _clear_before(cells, faces)
    floor = _floor(touched, first, np.round(size / tile).astype(int), textures)
    unknown = _unknown(cells, size)
    arena = Arena((float(size[0]), float(size[1])), float(tile), textures, floor, tuple(solid), unknown)
    c, s = math.cos(start[2]), math.sin(start[2])
    x, y = start[0] + c * corner[0] - s * corner[1], start[1] + s * corner[0] + c * corner[1]
    origin = (float(x), float(y), start[2])
    return MapScene(arena, origin, cells, _occupied(touched.grid, origin, cells.shape))


def _occupied(grid: Grid | None, origin: Pose, shape: tuple[int, ...]) -> np.ndarray:
    """Probabilities of the map's cells in the arena's frame: each that of the cell about its middle."""
    out = np.full(shape, 0.5, np.float32)
    if grid is None or not grid.occupied.size:
        return out
    rows, columns = np.indices(shape).reshape(2, -1)
    middles = to_map(np.column_stack([(columns + 0.5) * CELL_M, (rows + 0.5) * CELL_M, np.zeros(rows.size)]), origin)
    at = np.floor((middles[:, :2] - [grid.x, grid.y]) / grid.cell).astype(int)
    inside = (at >= 0).all(axis=1) & (at < grid.occupied.shape[::-1]).all(axis=1)
    out[rows[inside], columns[inside]] = grid.occupied[at[inside, 1], at[inside, 0]]
    return out


def _frame(touched: TouchMap) -> Pose:
    """The pose, in the first pose's frame, along which the map is square."""
    if touched.lattice:
        return (touched.lattice.x, touched.lattice.y, touched.lattice.turn)
    return (0.0, 0.0, touched.axes or 0.0)


def _moved(face: np.void, frame: Pose) -> tuple[float, ...]:
    """x0, y0, x1, y1 of a stretch in the frame, direction of its normal, number of its face."""
    ends = np.array([[face["x0"], face["y0"], 0.0], [face["x1"], face["y1"], 0.0]])
    (x0, y0, _), (x1, y1, _) = from_map(ends, frame)
    return (x0, y0, x1, y1, float(face["normal"]) - frame[2], float(face["face"]))


def _bridged(faces: np.ndarray) -> np.ndarray:
    """(n, 6) with stretches of one face joined where hardly anything lies between."""
    out: list[np.ndarray] = []
    for face in faces:
        if out and out[-1][5] == face[5] and math.hypot(*(face[:2] - out[-1][2:4])) <= GAP_M:
            out[-1][2:4] = face[2:4]
        else:
            out.append(face.copy())
    return np.array(out).reshape(-1, 6)


def _bounds(path: np.ndarray, faces: np.ndarray, robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    reach = [math.hypot(*w.base_m) + w.length_m for w in robot.of_role("object")]
    reach += [math.hypot(*w.tip_m) for w in robot.of_role("texture")]
    way = path[np.isfinite(path).all(axis=1)][:, :2]
    points = np.concatenate([way, np.zeros((int(not len(way)), 2))])
    wide = max([robot.body_radius_m, *reach]) + MARGIN_M
    low, high = points.min(axis=0) - wide, points.max(axis=0) + wide
    ends = faces[:, :4].reshape(-1, 2)
    if len(ends):
        low, high = np.minimum(low, ends.min(axis=0) - MARGIN_M), np.maximum(high, ends.max(axis=0) + MARGIN_M)
    return low, high


def _body_cells(path: np.ndarray, radius: float, size: np.ndarray) -> np.ndarray:
    """Cells over which a body of this radius has passed are FREE, all others UNKNOWN."""
    columns, lines = (int(math.ceil(side / CELL_M - 1e-9)) for side in size)
    cells = np.full((lines, columns), UNKNOWN, np.uint8)
    around = np.arange(-radius, radius + CELL_M / 2, CELL_M / 2)
    body = np.array([(x, y) for x in around for y in around if math.hypot(x, y) <= radius]).reshape(-1, 2)
    way = path[np.isfinite(path).all(axis=1), :2]
    stood = np.unique(np.round(way / (CELL_M / 2)).astype(int), axis=0) * (CELL_M / 2)
    for offset in body:
        _mark(cells, stood + offset, FREE)
    return cells


def _standing(face: np.ndarray, passed: np.ndarray) -> Iterator[np.ndarray]:
    """The parts of a stretch that the body has not passed through."""
    start, way = face[:2], face[2:4] - face[:2]
    count = max(int(math.hypot(*way) / CELL_M), 1)
    middles = start + ((np.arange(count) + 0.5) / count)[:, None] * way
    at = np.clip(np.floor(middles / CELL_M).astype(int), 0, np.array(passed.shape[::-1]) - 1)
    kept = passed[at[:, 1], at[:, 0]] != FREE
    edges = np.flatnonzero(np.diff(kept, prepend=False, append=False))
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        yield np.concatenate([start + a / count * way, start + b / count * way, face[4:]])


def _free_cells(path: np.ndarray, rows: Observations, robot: Robot, size: np.ndarray) -> np.ndarray:
    """Cells over which the body or an untouched part of a whisker has passed are FREE, all others UNKNOWN."""
    cells = _body_cells(path, robot.body_radius_m, size)
    known = np.isfinite(path).all(axis=1)
    way = path[known]
    for number, whisker in enumerate(robot.of_role("object")):
        read = rows.radial_m[known, number]
        reach = np.where(np.isinf(read), whisker.length_m, read - CELL_M)
        for share in np.arange(0.0, whisker.length_m, CELL_M / 2):
            sure = share <= np.nan_to_num(reach, nan=-1.0)
            x, y = (whisker.base_m[i] + share * (math.cos, math.sin)[i](whisker.yaw_rad) for i in (0, 1))
            c, s = np.cos(way[sure, 2]), np.sin(way[sure, 2])
            _mark(cells, way[sure, :2] + np.column_stack([c * x - s * y, s * x + c * y]), FREE)
    return cells


def _mark(cells: np.ndarray, points: np.ndarray, kind: int) -> None:
    at = np.floor(points / CELL_M).astype(int)
    inside = (at >= 0).all(axis=1) & (at < cells.shape[::-1]).all(axis=1)
    cells[at[inside, 1], at[inside, 0]] = kind


def _solid(face: np.ndarray, cells: np.ndarray, size: np.ndarray) -> Iterator[Box]:
    """Boxes behind a face, whose cells become SOLID."""
    (x0, y0, x1, y1), normal = face[:4], face[4]
    off = math.remainder(normal, math.pi / 2)
    if abs(off) <= SQUARE_RAD:
        middle_x, middle_y = (x0 + x1) / 2, (y0 + y1) / 2
        half, turn = math.hypot(x1 - x0, y1 - y0) / 2, normal - off
        nx, ny = round(math.cos(turn)), round(math.sin(turn))
        xs = sorted((middle_x - half * abs(ny), middle_x + half * abs(ny), middle_x - THICK_M * nx))
        ys = sorted((middle_y - half * abs(nx), middle_y + half * abs(nx), middle_y - THICK_M * ny))
        yield from _put(cells, (xs[0], ys[0], xs[-1], ys[-1]), size)
        return
    count = max(int(math.hypot(x1 - x0, y1 - y0) / CELL_M), 1)
    for share in (np.arange(count) + 0.5) / count:
        x, y = x0 + share * (x1 - x0), y0 + share * (y1 - y0)
        x, y = x - CELL_M / 2 * math.cos(normal), y - CELL_M / 2 * math.sin(normal)
        yield from _put(cells, (x - CELL_M / 2, y - CELL_M / 2, x + CELL_M / 2, y + CELL_M / 2), size)


def _put(cells: np.ndarray, box: Box, size: np.ndarray) -> Iterator[Box]:
    x0, y0, x1, y1 = (float(round(v, 6)) for v in _within(box, size))
    if x0 < x1 and y0 < y1:
        a, b = int(x0 / CELL_M), int(y0 / CELL_M)
        cells[b : int(math.ceil(y1 / CELL_M)), a : int(math.ceil(x1 / CELL_M))] = SOLID
        yield (x0, y0, x1, y1)


def _clear_before(cells: np.ndarray, faces: np.ndarray) -> None:
    """A cell that a face cuts would hide it if it were unknown: those before faces are free."""
    for x0, y0, x1, y1, normal, _ in faces:
        count = max(int(math.hypot(x1 - x0, y1 - y0) / (CELL_M / 2)), 1)
        share = ((np.arange(count) + 0.5) / count)[:, None]
        for ahead in (0.5, 1.5):
            points = np.array([x0, y0]) + share * np.array([x1 - x0, y1 - y0])
            at = np.floor((points + ahead * CELL_M * np.array([math.cos(normal), math.sin(normal)])) / CELL_M).astype(
                int
            )
            inside = (at >= 0).all(axis=1) & (at < cells.shape[::-1]).all(axis=1)
            column, row = at[inside].T
            cells[row, column] = np.where(cells[row, column] == UNKNOWN, FREE, cells[row, column])


def _floor(touched: TouchMap, first: np.ndarray, count: np.ndarray, textures: tuple[str, ...]) -> tuple[str, ...]:
    """Letters, the first string at the greatest y."""

    def letter(column: int, row: int) -> str:
        index, sure = touched.tiles.get((column, row), (0, 0.0))
        return textures[index][0] if sure >= SURE else NOT_KNOWN

    if not touched.lattice:
        return (NOT_KNOWN,)
    columns, rows = (range(int(first[i]), int(first[i] + count[i])) for i in (0, 1))
    return tuple("".join(letter(column, row) for column in columns) for row in reversed(rows))


def _unknown(cells: np.ndarray, size: np.ndarray) -> tuple[Box, ...]:
    boxes = [tuple(CELL_M * v for v in box) for box in boxes_of(cells == UNKNOWN)]
    clipped = (tuple(float(round(v, 6)) for v in _within(box, size)) for box in boxes)
    return tuple(box for box in clipped if box[0] < box[2] and box[1] < box[3])


def _within(box: Box, size: np.ndarray) -> Box:
    return (max(box[0], 0.0), max(box[1], 0.0), min(box[2], float(size[0])), min(box[3], float(size[1])))
