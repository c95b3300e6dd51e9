"""Occupancy maps: an image and a YAML file, as ROS map servers read them. Solid and unknown cells become boxes.

Frames: a map's own frame, in which `origin` is the pose of the image's lower left corner; and the image's frame, with
that corner as origin. An arena's frame has a place in a map's likewise: `to_map` and `from_map` are the way, for all.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .fields import Fields
from .files import UnreadableError, read_text
from .images import Grey, read_grey
from .scene_table import ANGLE_MOST, LARGEST_M, SceneError

Box = tuple[float, float, float, float]  # x0, y0, x1, y1
Pose = tuple[float, float, float]
NOWHERE: Pose = (0.0, 0.0, 0.0)  # of a frame in itself
FREE, SOLID, UNKNOWN = 0, 1, 2
BOXES_MOST = 200_000  # of each kind, after merging
TEXT_MOST = 1 << 16
FINEST_M = 1e-4
MODES = ("trinary", "scale", "raw")


@dataclass(frozen=True)
class Occupancy:
    """Boxes in the image's frame; what is in none of them is free."""

    size_m: tuple[float, float]
    resolution_m: float
    origin: Pose
    solid: tuple[Box, ...]
    unknown: tuple[Box, ...]
    odd: str = ""  # a line that says what is strange, but allowed


def read_map(path: str | Path) -> Occupancy:
    """A map by its YAML file; SceneError names file, field and remedy."""
    path = Path(path)
    try:
        return _read(path)
    except SceneError:
        raise
    except (UnreadableError, ValueError) as error:
        raise SceneError(f"{path}: {error}; give a map server's YAML file and image") from error


def _read(path: Path) -> Occupancy:
    fields = Fields(_parsed(path))
    resolution = fields.number("resolution", FINEST_M, LARGEST_M)
    origin = fields.array("origin", 1, -LARGEST_M, LARGEST_M)
    if origin.shape not in ((2,), (3,)):
        raise fields.fail("origin", "must be x, y and yaw")
    origin = np.append(origin, 0.0)[:3]
    if abs(origin[2]) > ANGLE_MOST:
        raise fields.fail("origin", f"must have a yaw in rad from {-ANGLE_MOST:g} to {ANGLE_MOST:g}, not {origin[2]:g}")
    mode = fields.text("mode").lower() if fields.has("mode") else MODES[0]
    if mode not in MODES:
        raise fields.fail("mode", f"must be {' or '.join(map(repr, MODES))}, not {fields.take('mode')!r}")
    limits = [fields.number(name, 0.0, 1.0) for name in ("free_thresh", "occupied_thresh")]
    if limits[0] > limits[1]:
        raise ValueError("field 'free_thresh' is above occupied_thresh")
    negate = fields.take("negate") if fields.has("negate") else 0
    if negate not in (0, 1):
        raise ValueError("field 'negate' is neither 0 nor 1")
    image = path.parent / str(fields.take("image"))
    try:
        grey = read_grey(image)
    except UnreadableError as error:
        raise ValueError(f"field 'image': {image}: {error}") from error
    rows, columns = grey.level.shape
    size = (round(columns * resolution, 9), round(rows * resolution, 9))
    if max(size) > LARGEST_M:
        raise ValueError(f"field 'resolution' makes the map {max(size):g} m long, {LARGEST_M:g} m are the most")
    kinds = cells_of(grey, mode, bool(negate), *limits)
    shares = [float((kinds == kind).mean()) for kind in (FREE, SOLID, UNKNOWN)]
    found = (
        f"no cell is {{}}: {shares[FREE]:.0%} free, {shares[SOLID]:.0%} solid, {shares[UNKNOWN]:.0%} unknown by mode "
        f"{mode}, negate {int(negate)}, free_thresh {limits[0]:g} and occupied_thresh {limits[1]:g}; mend these fields"
    )
    if shares[FREE] in (0.0, 1.0):  # no place to be, or nothing to meet
        raise SceneError(f"{path}: {found.format('solid' if shares[FREE] else 'free')}, or the image")
    odd = "" if shares[SOLID] else f"{path}: {found.format('solid')} if there are walls"
    solid, unknown = (_scaled(boxes_of(kinds == kind), rows, resolution) for kind in (SOLID, UNKNOWN))
    return Occupancy(size, resolution, tuple(map(float, origin)), solid, unknown, odd)


def _parsed(path: Path) -> object:
    import yaml  # only who reads a map needs it

    text = read_text(path)
    if len(text) > TEXT_MOST:
        raise UnreadableError(f"more than {TEXT_MOST >> 10} KiB")
    try:
        read, node = yaml.safe_load(text), yaml.compose(text, yaml.SafeLoader)
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        place = getattr(error, "problem_mark", None)
        raise UnreadableError(f"not YAML{f' (line {place.line + 1})' if place else ''}") from error
    fields = [key.value for key, _ in node.value] if isinstance(node, yaml.MappingNode) else []
    if twice := next((name for name in fields if fields.count(name) > 1), None):
        raise UnreadableError(f"field '{twice}' appears twice; keep one")
    return read


def cells_of(grey: Grey, mode: str, negate: bool, free: float, occupied: float) -> np.ndarray:
    """(rows, columns) of FREE, SOLID or UNKNOWN, as nav2_map_server has 0, 100 and what is neither: in mode "trinary" it takes
    the alpha of an image for a fourth colour, in "scale" both thresholds are on the scale, "raw" is not negated."""
    seen, level = grey.level, np.arange(256)
    if mode == "trinary" and grey.alpha is not None:
        seen = ((3 * seen.astype(np.uint16) + grey.alpha + 2) // 4).astype(np.uint8)
    shade = level if negate else 255 - level
    share = np.where(level <= 100, level / 100.0, np.nan) if mode == "raw" else shade / 255.0
    table = np.full(256, UNKNOWN, np.uint8)
    table[share < free], table[share > occupied] = FREE, SOLID
    if mode == "raw" or (mode == "scale" and free < occupied):
        percent = np.rint(100.0 * (share if mode == "raw" else (share - free) / (occupied - free)))
        table[percent <= 0.0], table[percent >= 100.0] = FREE, SOLID
    kinds = table[seen]
    if mode == "scale" and grey.opaque is not None:
        kinds[~grey.opaque] = UNKNOWN
    return kinds


def boxes_of(cells: np.ndarray) -> list[tuple[int, int, int, int]]:
    """Boxes (column, row, end column, end row) that cover the true cells of (rows, columns) once each: runs of a row, and
    equal runs of rows that follow each other as one. ValueError beyond BOXES_MOST."""
    done, open_runs = [], {}
    for row in range(len(cells)):
        edges = np.flatnonzero(np.diff(cells[row], prepend=False, append=False)).tolist()
        runs = set(zip(edges[::2], edges[1::2], strict=True))
        done += [(a, begun, b, row) for (a, b), begun in open_runs.items() if (a, b) not in runs]
        open_runs = {run: open_runs.get(run, row) for run in sorted(runs)}
        if len(done) + len(open_runs) > BOXES_MOST:
            raise ValueError(
                f"more than {BOXES_MOST} boxes of solid or unknown cells; make the image coarser or cleaner"
            )
    return [*done, *((a, begun, b, len(cells)) for (a, b), begun in open_runs.items())]


def _scaled(boxes: list[tuple[int, int, int, int]], rows: int, metres: float) -> tuple[Box, ...]:
    """Pixels from the top as metres from the bottom."""
    return tuple(
        (round(a * metres, 9), round((rows - d) * metres, 9), round(c * metres, 9), round((rows - b) * metres, 9))
        for a, b, c, d in boxes
    )


def placed(
    occupancy: Occupancy, size_m: tuple[float, float], origin: Pose = NOWHERE
) -> tuple[tuple[Box, ...], tuple[Box, ...]]:
    """Solid and unknown boxes in an arena of this size and origin; around the map nothing is known."""
    x, y, yaw = np.round(from_map(np.array([occupancy.origin]), origin)[0], 9).tolist()
    if yaw != 0.0:
        raise ValueError(f"field 'origin': the yaw must be that of the origin in arena.toml, {origin[2]:g}")
    high_x, high_y = x + occupancy.size_m[0], y + occupancy.size_m[1]
    wide, high = size_m
    margins = [(0.0, 0.0, x, high), (high_x, 0.0, wide, high), (x, 0.0, high_x, y), (x, high_y, high_x, high)]
    solid, unknown = (
        [(a + x, b + y, c + x, d + y) for a, b, c, d in boxes] for boxes in (occupancy.solid, occupancy.unknown)
    )
    return _clipped(solid, size_m), _clipped([*unknown, *margins], size_m)


def _clipped(boxes: list[Box], size_m: tuple[float, float]) -> tuple[Box, ...]:
    kept = ((max(a, 0.0), max(b, 0.0), min(c, size_m[0]), min(d, size_m[1])) for a, b, c, d in boxes)
    return tuple(box for box in kept if box[0] < box[2] and box[1] < box[3])


def to_map(poses: np.ndarray, origin: Pose) -> np.ndarray:
    """Poses (n, 3) of a frame as those of the map in which it has this origin; headings stay in -pi .. pi."""
    if origin == NOWHERE:
        return poses
    x, y, yaw = origin
    cosine, sine = math.cos(yaw), math.sin(yaw)
    turned = np.remainder(poses[:, 2] + yaw + math.pi, 2 * math.pi) - math.pi
    columns = (x + cosine * poses[:, 0] - sine * poses[:, 1], y + sine * poses[:, 0] + cosine * poses[:, 1], turned)
    return np.column_stack(columns)


def from_map(poses: np.ndarray, origin: Pose) -> np.ndarray:
    """The way back."""
    x, y, yaw = origin
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return to_map(poses, (-cosine * x - sine * y, sine * x - cosine * y, -yaw))


def spread_on_map(covariances: np.ndarray, origin: Pose) -> np.ndarray:
    """Covariances (n, 3, 3) of x, y and heading, turned as `to_map` turns their poses."""
    if origin == NOWHERE:
        return covariances
    cosine, sine = math.cos(origin[2]), math.sin(origin[2])
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return turn @ covariances @ turn.T
