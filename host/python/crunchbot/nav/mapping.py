"""A map from the rows of a scene folder, without the arena that the folder may hold; and the folder that is written."""

import io
import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..occupancy import FREE, SOLID, Pose, from_map
from ..outputs import made, put
from ..progress import bar
from ..scene import HELD as HELD_BY_SCENE
from ..scene import OBSERVATIONS, Arena, Prior, Robot, Scene, load_robot, write
from ..tables import TableError, read_rows
from .filters import ESTIMATE
from .map_scene import CELL_M, MapScene, map_scene
from .mapper import PATCH_M, Mapper, Part, TouchMap
from .observations import Observations, read_observations

CHUNK = 100  # rows between two steps of the progress bar
FACES, TILES, CORNERS, PARTS = "faces.csv", "tiles.csv", "corners.csv", "parts.csv"
PART = "part-{}"  # folder of the map of a part before the last
ESTIMATES, IMAGE, MAP, CELLS = "est.csv", "map.png", "map.yaml", "occupancy.npy"
HELD = (*HELD_BY_SCENE, PART.format("*"), MAP, CELLS)  # what stands in a map's folder
START_SIGMA = (0.02, 0.02, 0.03)  # of the first pose in prior.toml: m, m, rad
GREYS = {FREE: 254, SOLID: 0}  # of ROS; any other cell is 205
GREY_UNKNOWN = 205


@dataclass(frozen=True)
class Mapped:
    """A run over all rows: the estimates (n,) of ESTIMATE, each from the rows until then, and what is left at its end.
    `frame` (n,): the part of the run in whose frame an estimate is; `touched`: the map of the last part, or of the one asked
    for."""

    robot: Robot
    textures: tuple[str, ...]
    rows: Observations
    table: np.ndarray
    step_us: np.ndarray  # (n,) CPU time
    touched: TouchMap
    bad_cells: int
    bad_rows: int
    parts: tuple[Part, ...] = ()
    frame: np.ndarray = field(default_factory=lambda: np.zeros(0, int))

    def poses(self) -> np.ndarray:
        """(n, 3) in the frame of `touched`; nan for rows of other parts, and from a kidnap until it was noticed."""
        out = self.table["pose"].copy()
        out[self.frame != self.touched.frame] = np.nan
        for part in self.parts[1:]:
            out[part.first : part.noticed] = np.nan
        return out

    def before(self) -> list["Mapped"]:
        """The same with the map of each part before the last."""
        return [replace(self, touched=part.touched) for part in self.parts[:-1]]

    def scene(self) -> MapScene:
        return map_scene(self.touched, self.poses(), self.rows, self.robot, self.textures)


def read(folder: str | Path) -> tuple[Robot, tuple[str, ...], Observations]:
    """Robot, textures and rows of a scene folder. Its arena.toml is not read: textures are those that the columns of the
    observations name. SceneError or TableError names file, place and remedy."""
    folder = Path(folder)
    robot = replace(load_robot(folder), sensors=())
    textures = _textures(folder / OBSERVATIONS, robot)
    scene = Scene(Arena((PATCH_M, PATCH_M), PATCH_M, textures, ("?",), ()), robot)
    return robot, textures, read_observations(folder / OBSERVATIONS, scene)


def textures_in(names: Iterable[str], robot: Robot) -> tuple[str, ...]:
    """The textures that the columns of the first texture whisker name; none where there is no such column."""
    before = next((f"{whisker.name}_" for whisker in robot.of_role("texture")), None)
    return tuple(name.removeprefix(before) for name in names if before and name.startswith(before))


def _textures(path: Path, robot: Robot) -> tuple[str, ...]:
    tips = robot.of_role("texture")
    if not tips:
        return ("NONE",)
    names = textures_in(read_rows(path)[0], robot)
    if not names:
        tip = tips[0].name
        raise TableError(path, 1, f"no column of the texture whisker '{tip}'; name one {tip}_TEXTURE a texture")
    return names


def run(
    robot: Robot,
    textures: tuple[str, ...],
    rows: Observations,
    lattice: bool = True,
    quiet: bool = True,
) -> Mapped:
    """Map all rows. MappingError when there is no memory."""
    mapper = Mapper(robot, textures, lattice, rows.normal is not None)
    parts = [(np.zeros(0, ESTIMATE), np.zeros(0))]
    for first in bar(range(0, len(rows), CHUNK), disable=quiet, unit_scale=CHUNK, unit="rows", desc="map"):
        parts.append(mapper.replay(rows, first, min(CHUNK, len(rows) - first)))
    table, step_us = (np.concatenate(column) for column in zip(*parts, strict=True))
    return left_by(mapper, robot, textures, rows, table, step_us)


def left_by(
    mapper: Mapper, robot: Robot, textures: tuple[str, ...], rows: Observations, table: np.ndarray, step_us: np.ndarray
) -> Mapped:
    """What a mapper has made of rows: `table` (n,) of ESTIMATE, as it gave them."""
    parts, frame = mapper.parts(), np.zeros(len(table), int)
    for part in parts[1:]:
        frame[part.noticed :] = part.number
    left = (parts[-1].touched, mapper.bad_cells, mapper.bad_rows)
    return Mapped(robot, textures, rows, table, step_us, *left, parts, frame)


def write_map(place: str | Path, mapped: Mapped, overwrite: bool = False) -> MapScene:
    """Write the map of the last part, tables of parts and estimates, and each map before it to a folder of its own in there,
    as one. OutputError when it cannot be."""
    with made(place, overwrite, HELD) as folder:
        scene = _write_one(folder, mapped)
        for earlier in mapped.before():
            _write_one(folder / PART.format(earlier.touched.frame), earlier)
        _write_table(folder / ESTIMATES, _estimates(mapped))
        _write_table(folder / PARTS, _parts(mapped))
    return scene


def _write_one(folder: Path, mapped: Mapped) -> MapScene:
    """arena.toml, robot.toml, prior.toml, tables of faces, corners and tiles, map.png, map.yaml and occupancy.npy."""
    made = mapped.scene()
    start = from_map(np.zeros((1, 3)), made.origin)[0]
    write(folder, Scene(made.arena, mapped.robot, Prior("gaussian", tuple(float(v) for v in start), START_SIGMA)))
    _write_table(folder / FACES, _faces(mapped.touched, made.origin))
    _write_table(folder / CORNERS, _corners(mapped.touched, made.origin))
    _write_table(folder / TILES, _tiles(mapped))
    _write_image(folder, made)
    return made


def _write_table(path: Path, lines: list[str]) -> None:
    put(path, "\n".join(lines) + "\n")


def _faces(touched: TouchMap, origin: Pose) -> list[str]:
    lines = ["x0_m,y0_m,x1_m,y1_m,normal_rad,normal_sd_rad,offset_sd_m,contacts,right"]
    for face in touched.faces:
        ends = from_map(np.array([[face["x0"], face["y0"], face["normal"]], [face["x1"], face["y1"], 0.0]]), origin)
        place = (*ends[0, :2], *ends[1, :2], ends[0, 2], face["normal_sigma"], face["offset_sigma"])
        lines.append(",".join(f"{v:.6f}" for v in place) + f",{face['hits']:.0f},{face['right']}")
    return lines


def _tiles(mapped: Mapped) -> list[str]:
    tiles = sorted(mapped.touched.tiles.items())
    rows = [f"{column},{row},{mapped.textures[k]},{p:.6f}" for (column, row), (k, p) in tiles]
    return ["column,row,texture,probability", *rows]


def _estimates(mapped: Mapped) -> list[str]:
    lines, table = ["t_s,x_m,y_m,theta_rad,confidence,xx_m2,xy_m2,yy_m2,part"], mapped.table
    cells = (mapped.rows.t_text, table["pose"], table["confidence"], table["covariance"], mapped.frame)
    for t_s, pose, sure, cov, part in zip(*cells, strict=True):
        numbers = (*pose, sure)
        spread = (cov[0, 0], cov[0, 1], cov[1, 1])
        lines.append(",".join([t_s, *(f"{v:.6f}" for v in numbers), *(f"{v:.4g}" for v in spread), str(part)]))
    return lines


def _corners(touched: TouchMap, origin: Pose) -> list[str]:
    c, s = math.cos(origin[2]), math.sin(origin[2])
    back, lines = np.array([[c, s], [-s, c]]), ["x_m,y_m,xx_m2,xy_m2,yy_m2"]
    for corner in touched.corners:
        x, y, _ = from_map(np.array([[corner["x"], corner["y"], 0.0]]), origin)[0]
        cov = back @ np.array([[corner["xx"], corner["xy"]], [corner["xy"], corner["yy"]]]) @ back.T
        lines.append(f"{x:.6f},{y:.6f},{cov[0, 0]:.4g},{cov[0, 1]:.4g},{cov[1, 1]:.4g}")
    return lines


def _parts(mapped: Mapped) -> list[str]:
    rows = [f"{part.number},{part.first},{part.noticed}" for part in mapped.parts]
    return ["part,first_row,noticed_row", *rows]


def _write_image(folder: Path, made: MapScene) -> None:
    from PIL import Image  # only who writes an image needs it

    grey = np.full(made.cells.shape, GREY_UNKNOWN, np.uint8)
    for kind, level in GREYS.items():
        grey[made.cells == kind] = level
    image, cells = io.BytesIO(), io.BytesIO()
    Image.fromarray(grey[::-1]).save(image, "png")
    np.lib.format.write_array(cells, made.occupied)
    put(folder / IMAGE, image.getvalue())
    put(folder / CELLS, cells.getvalue())
    text = f"image: {IMAGE}\nmode: trinary\nresolution: {CELL_M}\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
    put(folder / MAP, text + "occupied_thresh: 0.65\nfree_thresh: 0.196\n")


def summary(mapped: Mapped, made: MapScene) -> dict:
    """The object `whisker map --json` prints."""
    touched, us = mapped.touched, mapped.step_us if len(mapped.step_us) else np.zeros(1)
    lattice = touched.lattice
    return {
        "steps": len(mapped.table),
        "size_m": [round(v, 3) for v in made.arena.size_m],
        "faces": len({int(n) for n in touched.faces["face"]}),
        "tile_m": round(lattice.pitch, 4) if lattice else None,
        "tiles": sum(letter != "?" for row in made.arena.floor for letter in row),
        "confidence": round(float(mapped.table["confidence"][-1]), 4) if len(mapped.table) else None,
        "step_us_mean": round(float(us.mean()), 1),
        "step_us_p99": round(float(np.quantile(us, 0.99)), 1),
        "peak_bytes": int(mapped.table["bytes"].max()) if len(mapped.table) else 0,
        "parts": len(mapped.parts),
        "lost_s": [round(float(mapped.rows.t_s[part.noticed]), 3) for part in mapped.parts[1:]],
        "bad_cells": mapped.bad_cells,
        "bad_rows": mapped.bad_rows,
        "regions_hold": False,  # with odometry as in the families `raw` and `noisy`: docs/results/map.md
    }


def spoken(reported: dict) -> list[str]:
    """What `whisker map` prints without --json: a summary's lines for a person."""
    wide, high = reported["size_m"]
    tiles = f"{reported['tiles']} tiles of {reported['tile_m']:.2f} m" if reported["tile_m"] else "no lattice of tiles"
    lines = [f"{reported['steps']} rows: {reported['faces']} faces and {tiles} in {wide:g} m x {high:g} m"]
    if reported["confidence"] is not None:
        said = f"confidence at the end: {reported['confidence']:.2f}"
        lines += [f"{said}; with poor odometry the 90 % regions do not hold: docs/results/map.md"]
    if reported["lost_s"]:
        when = ", ".join(f"{at:.1f} s" for at in reported["lost_s"])
        lines += [f"carried off at {when}: {reported['parts']} parts, of which the last is written"]
    bad = reported["bad_rows"], reported["bad_cells"]
    return lines + ([f"not used: {bad[0]} rows, {bad[1]} cells"] if any(bad) else [])
