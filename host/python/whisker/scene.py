"""Scene folders: arena.toml, robot.toml, prior.toml. Read strictly; every complaint is one line with file and remedy.

Metres and radians. World frame: origin in the arena's lower left corner, x right, y up. Robot frame: x forward, y left.
"""

import math
import re
from dataclasses import dataclass, field
from pathlib import Path

from .scene_table import SceneError, Table

ARENA, ROBOT, PRIOR, OBSERVATIONS = "arena.toml", "robot.toml", "prior.toml", "observations.csv"
TEXTURES_MOST = 250  # texture indices are one byte in host/nav, with room for its marks
WHISKERS_MOST, OBSTACLES_MOST = 1000, 10_000
LARGEST_M = 1000.0


@dataclass(frozen=True)
class Arena:
    size_m: tuple[float, float]
    tile_m: float
    textures: tuple[str, ...]
    floor: tuple[str, ...]  # letters, the first row has the largest y
    obstacles: tuple[tuple[float, float, float, float], ...]  # x0, y0, x1, y1

    def floor_indices(self) -> list[list[int]]:
        """Texture index by [row][column]; row 0 has the smallest y."""
        letters = {name[0]: index for index, name in enumerate(self.textures)}
        return [[letters[letter] for letter in row] for row in reversed(self.floor)]

    def is_free(self, x: float, y: float, radius: float) -> bool:
        """Whether a round body of this radius centred on (x, y) touches neither wall nor obstacle."""
        if not (radius <= x <= self.size_m[0] - radius and radius <= y <= self.size_m[1] - radius):
            return False
        gaps = (math.hypot(max(a - x, 0.0, x - c), max(b - y, 0.0, y - d)) for a, b, c, d in self.obstacles)
        return all(gap > 0.0 and gap >= radius for gap in gaps)


@dataclass(frozen=True)
class Whisker:
    """role "texture": tip_m; role "object": base_m, yaw_rad, length_m. The other fields are None."""

    name: str
    role: str
    tip_m: tuple[float, float] | None = None
    base_m: tuple[float, float] | None = None
    yaw_rad: float | None = None
    length_m: float | None = None


@dataclass(frozen=True)
class Robot:
    body_radius_m: float
    odometry_relative_sigma: float
    radial_sigma_m: float
    whiskers: tuple[Whisker, ...]  # in the file's order: lane 0 first

    def of_role(self, role: str) -> list[Whisker]:
        return [whisker for whisker in self.whiskers if whisker.role == role]


@dataclass(frozen=True)
class Prior:
    """kind "gaussian" with mean and sigma (x, y, theta), or "uniform" without."""

    kind: str
    mean: tuple[float, float, float] | None = None
    sigma: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Scene:
    arena: Arena
    robot: Robot
    prior: Prior | None = None
    simulated: tuple[str, ...] = field(default=(), compare=False)  # more lines of `flat`; no part of the folder

    def warnings(self) -> list[str]:
        """What is odd but allowed, one line each."""
        if self.prior is None or self.prior.mean is None:
            return []
        x, y, _ = self.prior.mean
        if self.arena.is_free(x, y, 0.0):
            return []
        return [f"{PRIOR}: mean ({x:g}, {y:g}) is not in free space; the belief is clipped to free space"]

    def flat(self, start_pose: tuple[float, float, float]) -> str:
        """The text sim/world reads: one item a line."""
        arena, robot = self.arena, self.robot
        lines = [_line("size_m", *arena.size_m), _line("tile_m", arena.tile_m)]
        lines += [_line("texture", name) for name in arena.textures] + [_line("floor", row) for row in arena.floor]
        lines += [_line("obstacle", *box) for box in arena.obstacles] + [_line("body_radius_m", robot.body_radius_m)]
        for w in robot.whiskers:
            place = w.tip_m if w.role == "texture" else (*w.base_m, w.yaw_rad, w.length_m)
            lines.append(_line(f"{w.role}_whisker", w.name, *place))
        return "\n".join([*lines, *self.simulated, _line("start", *start_pose)]) + "\n"


def load(path) -> Scene:
    """Read a scene folder; prior.toml may be absent. SceneError names file, line or key, and the remedy."""
    folder = Path(path)
    if not folder.is_dir():
        raise SceneError(f"{folder}: no such folder; give a scene folder with {ARENA} and {ROBOT}")
    prior = _prior(Table.read(folder / PRIOR)) if (folder / PRIOR).exists() else None
    return Scene(_arena(Table.read(folder / ARENA)), _robot(Table.read(folder / ROBOT)), prior)


def write(path, scene: Scene) -> None:
    """Write the folder that `load` reads back as an equal scene."""
    folder = Path(path)
    folder.mkdir(parents=True, exist_ok=True)
    arena, robot, prior = scene.arena, scene.robot, scene.prior
    text = [_toml("size_m", arena.size_m), _toml("tile_m", arena.tile_m)]
    text += [_toml("textures", arena.textures), _toml("floor", arena.floor)]
    for box in arena.obstacles:
        text += ["", "[[obstacle]]", _toml("min_m", box[:2]), _toml("max_m", box[2:])]
    (folder / ARENA).write_text("\n".join(text) + "\n")
    text = [_toml(key, getattr(robot, key)) for key in ("body_radius_m", "odometry_relative_sigma", "radial_sigma_m")]
    for whisker in robot.whiskers:
        text += ["", "[[whisker]]"] + [_toml(k, v) for k, v in vars(whisker).items() if v is not None]
    (folder / ROBOT).write_text("\n".join(text) + "\n")
    if prior is not None:
        (folder / PRIOR).write_text("\n".join(_toml(k, v) for k, v in vars(prior).items() if v is not None) + "\n")


def _line(word: str, *values) -> str:
    return " ".join([word, *(value if isinstance(value, str) else repr(float(value)) for value in values)])


def _toml(key: str, value) -> str:
    def text(item) -> str:
        if isinstance(item, tuple):
            return "[" + ", ".join(map(text, item)) + "]"
        return '"' + item.replace("\\", "\\\\").replace('"', '\\"') + '"' if isinstance(item, str) else repr(item)

    return f"{key} = {text(value)}"


TINY = 1e-9


def _arena(table: Table) -> Arena:
    size = table.numbers("size_m", 2, TINY, LARGEST_M)
    tile = table.number("tile_m", TINY, LARGEST_M)
    textures = _textures(table)
    floor = _floor(table, size, tile, textures)
    boxes = []
    for entry in table.tables("obstacle", OBSTACLES_MOST):
        low, high = (entry.numbers(key, 2, -LARGEST_M, LARGEST_M) for key in ("min_m", "max_m"))
        entry.done()
        if not (low[0] < high[0] and low[1] < high[1]):
            raise entry.fail("max_m", "must be larger than min_m in x and y")
        if min(low) < -TINY or high[0] > size[0] + TINY or high[1] > size[1] + TINY:
            raise entry.fail("min_m" if min(low) < -TINY else "max_m", "is outside the arena; move the obstacle inside")
        boxes.append((*low, *high))
    table.done()
    return Arena(size, tile, textures, floor, tuple(boxes))


def _textures(table: Table) -> tuple[str, ...]:
    names = table.strings("textures")
    letters = [name[0] for name in names]
    for name in names:
        if letters.count(name[0]) > 1:
            raise table.fail("textures", f"has two names that begin with '{name[0]}'; rename one")
        if not re.fullmatch(r"\w+", name):
            raise table.fail("textures", f"has the name '{name}'; use letters, digits and underscores")
    if len(names) > TEXTURES_MOST:
        raise table.fail("textures", f"has {len(names)} names; {TEXTURES_MOST} are the most")
    return names


def _floor(table: Table, size, tile: float, textures) -> tuple[str, ...]:
    rows = table.strings("floor")
    columns_wanted, rows_wanted = (math.ceil(side / tile - 1e-6) for side in size)
    if len(rows) != rows_wanted:
        raise table.fail("floor", f"has {len(rows)} rows; size_m and tile_m ask for {rows_wanted}")
    letters = {name[0] for name in textures}
    for number, row in enumerate(rows, start=1):
        if len(row) != columns_wanted:
            raise table.fail("floor", f"row {number} has {len(row)} tiles; size_m and tile_m ask for {columns_wanted}")
        for letter in row:
            if letter not in letters:
                raise table.fail("floor", f"row {number} has the letter '{letter}', no texture begins with it; mend it")
    return rows


def _robot(table: Table) -> Robot:
    radius = table.number("body_radius_m", 0.0, LARGEST_M)
    odometry = table.number("odometry_relative_sigma", 0.0, 10.0)
    radial = table.number("radial_sigma_m", TINY, LARGEST_M)
    whiskers = tuple(_whisker(entry) for entry in table.tables("whisker", WHISKERS_MOST))
    table.done()
    names = [whisker.name for whisker in whiskers]
    for number, name in enumerate(names):
        if name in names[:number]:
            raise table.fail("whisker", f"has the name '{name}' twice; rename one")
    return Robot(radius, odometry, radial, whiskers)


def _whisker(entry: Table) -> Whisker:
    name = entry.string("name")
    if not re.fullmatch(r"\w+", name):
        raise entry.fail("name", f"is '{name}'; use letters, digits and underscores")
    role = entry.string("role", ("texture", "object"))
    if role == "texture":
        whisker = Whisker(name, role, tip_m=entry.numbers("tip_m", 2, -LARGEST_M, LARGEST_M))
    else:
        whisker = Whisker(
            name,
            role,
            base_m=entry.numbers("base_m", 2, -LARGEST_M, LARGEST_M),
            yaw_rad=entry.number("yaw_rad", -10.0, 10.0),
            length_m=entry.number("length_m", TINY, LARGEST_M),
        )
    entry.done()
    return whisker


def _prior(table: Table) -> Prior:
    kind = table.string("kind", ("gaussian", "uniform"))
    if kind == "uniform":
        table.done()
        return Prior(kind)
    mean = table.numbers("mean", 3, -LARGEST_M, LARGEST_M)
    sigma = table.numbers("sigma", 3, TINY, LARGEST_M)
    table.done()
    return Prior(kind, mean, sigma)
