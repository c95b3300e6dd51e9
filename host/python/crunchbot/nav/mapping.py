"""A map from the rows of a scene folder, without the arena that the folder may hold; and the folder that is written."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..occupancy import FREE, SOLID, from_map
from ..progress import bar
from ..scene import OBSERVATIONS, Arena, Prior, Robot, Scene, load_robot, write
from ..tables import TableError, read_rows, unwritable
from .filters import ESTIMATE
from .grid_mapper import GridMapper
from .map_graph import GraphMapper
from .map_scene import CELL_M, MapScene, map_scene
from .mapper import PATCH_M, Mapper, TouchMap
from .observations import Observations, read_observations

CHUNK = 100  # rows between two steps of the progress bar
FACES, TILES, ESTIMATES, IMAGE, MAP = "faces.csv", "tiles.csv", "est.csv", "map.png", "map.yaml"
START_SIGMA = (0.02, 0.02, 0.03)  # of the first pose in prior.toml: m, m, rad
REPRESENTATIONS: dict[str, type[Mapper] | type[GraphMapper]] = {
    "faces": Mapper,
    "grid": GridMapper,
    "graph": GraphMapper,
}
GREYS = {FREE: 254, SOLID: 0}  # of ROS; any other cell is 205
GREY_UNKNOWN = 205


@dataclass(frozen=True)
class Mapped:
    """A run over all rows: the estimates (n,) of ESTIMATE in the frame of the first pose, and what is left at its end."""

    robot: Robot
    textures: tuple[str, ...]
    rows: Observations
    table: np.ndarray
    step_us: np.ndarray  # (n,) CPU time
    touched: TouchMap
    bad_cells: int
    bad_rows: int

    def scene(self) -> MapScene:
        return map_scene(self.touched, self.table["pose"], self.rows, self.robot, self.textures)


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
    seed: int = 0,
    particles: int | None = None,
    lattice: bool = True,
    quiet: bool = True,
    representation: str = "faces",
) -> Mapped:
    """Map all rows, by one of REPRESENTATIONS. MappingError when an option is out of range."""
    kind = REPRESENTATIONS[representation]
    mapper = kind(robot, textures, seed, particles, lattice, rows.normal is not None)
    parts = [(np.zeros(0, ESTIMATE), np.zeros(0))]
    for first in bar(range(0, len(rows), CHUNK), disable=quiet, unit_scale=CHUNK, unit="rows", desc="map"):
        parts.append(mapper.replay(rows, first, min(CHUNK, len(rows) - first)))
    table, step_us = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Mapped(robot, textures, rows, table, step_us, mapper.map(), mapper.bad_cells, mapper.bad_rows)


def write_map(folder: str | Path, mapped: Mapped) -> MapScene:
    """Write arena.toml, robot.toml, prior.toml, faces.csv, tiles.csv, est.csv, map.png and map.yaml; TableError when it
    cannot be."""
    folder, made = Path(folder), mapped.scene()
    start = from_map(np.zeros((1, 3)), made.origin)[0]
    prior = Prior("gaussian", tuple(float(v) for v in start), START_SIGMA)
    try:
        write(folder, Scene(made.arena, mapped.robot, prior))
        _write_tables(folder, mapped, made)
        _write_image(folder, made)
    except OSError as error:
        raise unwritable(folder, error) from error
    return made


def _write_tables(folder: Path, mapped: Mapped, made: MapScene) -> None:
    touched = mapped.touched
    faces = ["x0_m,y0_m,x1_m,y1_m,normal_rad,normal_sd_rad,offset_sd_m,contacts,right"]
    for face in touched.faces:
        ends = from_map(
            np.array([[face["x0"], face["y0"], face["normal"]], [face["x1"], face["y1"], 0.0]]), made.origin
        )
        place = (*ends[0, :2], *ends[1, :2], ends[0, 2], face["normal_sigma"], face["offset_sigma"])
        faces.append(",".join(f"{v:.6f}" for v in place) + f",{face['hits']:.0f},{face['right']}")
    tiles = ["column,row,texture,probability"]
    tiles += [f"{column},{row},{mapped.textures[k]},{p:.6f}" for (column, row), (k, p) in sorted(touched.tiles.items())]
    poses = ["t_s,x_m,y_m,theta_rad,confidence,xx_m2,xy_m2,yy_m2"]
    cells = (mapped.rows.t_text, mapped.table["pose"], mapped.table["confidence"], mapped.table["covariance"])
    for t_s, pose, sure, cov in zip(*cells, strict=True):
        numbers = (*pose, sure)
        spread = (cov[0, 0], cov[0, 1], cov[1, 1])
        poses.append(",".join([t_s, *(f"{v:.6f}" for v in numbers), *(f"{v:.4g}" for v in spread)]))
    for name, lines in ((FACES, faces), (TILES, tiles), (ESTIMATES, poses)):
        (folder / name).write_text("\n".join(lines) + "\n")


def _write_image(folder: Path, made: MapScene) -> None:
    from PIL import Image  # only who writes an image needs it

    grey = np.full(made.cells.shape, GREY_UNKNOWN, np.uint8)
    for kind, level in GREYS.items():
        grey[made.cells == kind] = level
    Image.fromarray(grey[::-1]).save(folder / IMAGE)
    text = f"image: {IMAGE}\nmode: trinary\nresolution: {CELL_M}\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
    (folder / MAP).write_text(text + "occupied_thresh: 0.65\nfree_thresh: 0.196\n")


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
        "bad_cells": mapped.bad_cells,
        "bad_rows": mapped.bad_rows,
    }
