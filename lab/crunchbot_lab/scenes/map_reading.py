"""Poses and a map as `whisker map` and the mapper write them, from a folder, to be judged.

est.csv      poses of the rows, the first row's too (docs/formats.md); the only file that must be there. Rows without a
             pose are carried on by the odometry.
map.yaml     occupancy, as ROS map servers read it
faces.csv    faces: x0_m, y0_m, x1_m, y1_m, normal_rad
arena.toml   with robot.toml: a floor of tiles; with prior.toml, too, its mean says where the first pose is in the map.
             Without it poses and map are of one frame.
"""

from pathlib import Path

import numpy as np

from crunchbot.nav.filters import ESTIMATE
from crunchbot.nav.mapper import FACE, Lattice, TouchMap
from crunchbot.nav.mapping import ESTIMATES, FACES, MAP, Mapped
from crunchbot.nav.observations import Observations
from crunchbot.occupancy import NOWHERE, Occupancy, Pose, from_map, read_map, to_map
from crunchbot.scene import ARENA, NOT_KNOWN, Arena, Scene, load
from crunchbot.tables import TableError, numbers, read_columns

from .geometry import compose

ENDS, NORMAL = ("x0_m", "y0_m", "x1_m", "y1_m"), "normal_rad"
POSE = ("x_m", "y_m", "theta_rad")
COVARIANCE = ("xx_m2", "xy_m2", "yy_m2")
SAME_S = 1e-3  # times that differ by less are the same row's


def read_map_folder(folder: str | Path, scene: Scene, rows: Observations) -> tuple[Mapped, np.ndarray | None]:
    """What a folder holds of a scene with true poses, in the frame of its est.csv; and the cells of its occupancy, (n, 3) of
    x, y and whether solid, None: there is none. TableError or SceneError names file and remedy."""
    folder = Path(folder)
    table = _table(folder / ESTIMATES, rows)
    mapped = load(folder) if (folder / ARENA).exists() else None
    frame = map_frame(mapped)
    faces = _faces(folder / FACES, frame) if (folder / FACES).exists() else np.zeros(0, FACE)
    textures = scene.arena.textures
    lattice, tiles = _tiles(mapped.arena, frame, textures) if mapped else (None, {})
    touched = TouchMap(faces, None, lattice, tiles)
    cells = _cells(read_map(folder / MAP), frame) if (folder / MAP).exists() else None
    return Mapped(scene.robot, textures, rows, table, np.zeros(len(rows)), touched, 0, 0), cells


def _table(path: Path, rows: Observations) -> np.ndarray:
    """(n,) of ESTIMATE, with nan where no covariance is given."""
    text = read_columns(path, [*POSE])
    poses = np.column_stack([numbers(text[key]) for key in POSE])
    at = _rows_of(path, text, len(poses), rows)
    if not len(at) or at[0] != 0:
        raise TableError(path, 2, "no pose of the first row; give one, the others are counted from it")
    table = np.zeros(len(rows), ESTIMATE)
    table["covariance"] = np.nan
    place = dict(zip(at.tolist(), poses, strict=True))
    pose = poses[0]
    for n, step in enumerate(np.where(np.isfinite(rows.odometry), rows.odometry, 0.0)):
        table["pose"][n] = pose = place.get(n, compose(pose, step))
    if set(COVARIANCE) <= text.keys():
        xx, xy, yy = (numbers(text[name]) for name in COVARIANCE)
        table["covariance"][at, :2, :2] = np.stack([xx, xy, xy, yy], axis=-1).reshape(-1, 2, 2)
    return table


def _rows_of(path: Path, text: dict, count: int, rows: Observations) -> np.ndarray:
    """The row of each line: with as many lines as rows they are taken in order; else each is found by its t_s."""
    if count == len(rows):
        return np.arange(count)
    if "t_s" not in text:
        raise TableError(
            path, 1, f"{count} rows, the scene has {len(rows)}; give one for each, or add the column 't_s'"
        )
    times, known = numbers(text["t_s"]), rows.t_s
    order = np.argsort(known, kind="stable")
    at = order[np.clip(np.searchsorted(known[order], times - SAME_S), 0, len(known) - 1)]
    wrong = np.nonzero(~(np.abs(known[at] - times) <= SAME_S))[0]
    if len(wrong):
        reported = f"t_s {text['t_s'][wrong[0]]} is no row's of the scene; give those of it"
        raise TableError(path, int(wrong[0]) + 2, reported)
    if (np.diff(at) <= 0).any():
        line = int(np.nonzero(np.diff(at) <= 0)[0][0]) + 3
        raise TableError(path, line, "t_s is not later than the line before; give rows in order, each once")
    return at


def map_frame(mapped: Scene | None) -> Pose:
    """The pose of a map's frame in that of the poses it was made with."""
    if mapped is None or mapped.prior is None or mapped.prior.mean is None:
        return NOWHERE
    return tuple(float(v) for v in from_map(np.zeros((1, 3)), mapped.prior.mean)[0])


def _faces(path: Path, frame: Pose) -> np.ndarray:
    text = read_columns(path, [*ENDS, NORMAL])
    x0, y0, x1, y1, normal = (numbers(text[name]) for name in (*ENDS, NORMAL))
    faces = np.zeros(len(x0), FACE)
    first, last = (to_map(np.column_stack([x, y, normal]), frame) for x, y in ((x0, y0), (x1, y1)))
    faces["x0"], faces["y0"], faces["normal"] = first.T
    faces["x1"], faces["y1"], _ = last.T
    faces["face"] = np.arange(len(faces))
    return faces


def _tiles(arena: Arena, frame: Pose, textures: tuple[str, ...]) -> tuple[Lattice | None, dict]:
    """The floor's tiles; a letter that no texture of the scene begins with is not known."""
    if all(letter == NOT_KNOWN for row in arena.floor for letter in row):
        return None, {}
    index = {name[0]: n for n, name in enumerate(textures)}
    known = [
        ((column, len(arena.floor) - 1 - n), index[letter])
        for n, row in enumerate(arena.floor)
        for column, letter in enumerate(row)
        if letter in index
    ]
    return Lattice(*frame, arena.tile_m, 0.0, 0.0, 0.0), {tile: (texture, 1.0) for tile, texture in known}


def _cells(occupancy: Occupancy, frame: Pose) -> np.ndarray:
    """Middles of the cells that are solid or free."""
    size, cell = occupancy.size_m, occupancy.resolution_m
    columns, rows = (max(1, round(side / cell)) for side in size)
    kinds = np.zeros((rows, columns), np.int8)
    for boxes, kind in ((occupancy.unknown, 2), (occupancy.solid, 1)):
        for x0, y0, x1, y1 in boxes:
            kinds[round(y0 / cell) : round(y1 / cell), round(x0 / cell) : round(x1 / cell)] = kind
    row, column = np.nonzero(kinds < 2)
    middles = np.column_stack([(column + 0.5) * cell, (row + 0.5) * cell, np.zeros(len(row))])
    points = to_map(to_map(middles, occupancy.origin), frame)
    return np.column_stack([points[:, :2], kinds[row, column]])
