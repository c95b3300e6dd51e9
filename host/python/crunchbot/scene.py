"""Scene folders: arena.toml, robot.toml, prior.toml. Read strictly; every complaint is one line with file and remedy.

Metres and radians. Arena frame: origin in the arena's lower left corner, x right, y up; its place on the map is `origin`.
Poses of a robot (prior, truth, estimates, messages) are on the map. Robot frame: x forward, y left.
"""

import math
import re
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from . import observation
from .base_table import CREATE, BaseTable, base_content, read_base
from .files import UnreadableError
from .images import nearest_levels, read_grey
from .observation import Column, Layout, Quantity
from .occupancy import NOWHERE, Box, Pose, from_map, placed, read_map, spread_on_map, to_map
from .outputs import put
from .scene_table import ANGLE_MOST, FARTHEST_M, LARGEST_M, SceneError, Table
from .sensor_tables import SensorTable, read_sensors, write_sensor

__all__ = ["LARGEST_M", "SceneError"]  # beside what is defined here

ARENA, ROBOT, PRIOR, OBSERVATIONS = "arena.toml", "robot.toml", "prior.toml", "observations.csv"
HELD = (ROBOT, ARENA, PRIOR, OBSERVATIONS, "*.csv", "*.png")  # what stands in a folder, with its tables and images
TEXTURES_MOST = 250  # texture indices are one byte in host/nav, with room for its marks
WHISKERS_MOST, OBSTACLES_MOST = 1000, 10_000
TILES_MOST = 10_000_000
NOT_KNOWN = "?"  # letter of a tile whose texture is not known
NOT_KNOWN_INDEX = 255


@dataclass(frozen=True)
class Arena:
    size_m: tuple[float, float]
    tile_m: float
    textures: tuple[str, ...]
    floor: tuple[str, ...]  # letters, the first row has the largest y
    obstacles: tuple[Box, ...]
    unknown: tuple[Box, ...] = ()  # nobody knows what stands there
    wall: str = ""  # texture of the walls' faces; empty: smooth, or not known
    surfaces: tuple[tuple[Box, str], ...] = ()  # the same of obstacles' faces

    def floor_indices(self) -> np.ndarray:
        """Texture index by [row, column], uint8; row 0 has the smallest y. Not known: NOT_KNOWN_INDEX."""
        letters = np.array(["".join(self.floor[::-1])]).view(np.uint32).reshape(len(self.floor), -1)
        out = np.full(letters.shape, NOT_KNOWN_INDEX, np.uint8)
        for index, name in enumerate(self.textures):
            out[letters == ord(name[0])] = index
        return out

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
    sensors: tuple[SensorTable, ...] = ()  # of the user's own
    odometry_turn_sigma_rad: float | None = None  # of a row's turn, from a gyroscope; None: the relative one holds
    base: BaseTable = CREATE

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
    origin: Pose = NOWHERE  # of the arena's frame in the map's
    odd: str = field(default="", compare=False)  # a line that says what is strange in its map

    @cached_property
    def layout(self) -> Layout:
        """Columns of the rows of this robot on this floor. Those of NORMAL and POINT may be missing in a row."""
        tips, rays = self.robot.of_role("texture"), [whisker.name for whisker in self.robot.of_role("object")]
        columns = [column for tip in tips for column in observation.textures(tip.name, self.arena.textures)]
        columns += map(observation.distance, rays)
        columns += [Column(Quantity.READING, "", sensor.name) for sensor in self.robot.sensors]
        columns += [column for of in (observation.normal, observation.point) for ray in rays for column in of(ray)]
        return Layout(columns)

    def warnings(self) -> list[str]:
        """What is odd but allowed, one line each."""
        out, size = [self.odd] if self.odd else [], self.arena.size_m
        reach = {w.name: math.hypot(*(w.tip_m or w.base_m)) + (w.length_m or 0.0) for w in self.robot.whiskers}
        far = [name for name, metres in reach.items() if metres > math.hypot(*size)]
        if far:
            text = f"{ROBOT}: whisker '{far[0]}' ends {reach[far[0]]:g} m from the robot's centre"
            out += [f"{text} in an arena of {size[0]:g} x {size[1]:g} m; give its places and length_m in metres"]
        if self.prior and self.prior.mean and (fault := self.fault_at(self.prior.mean)):
            x, y, _ = self.prior.mean
            out += [f"{PRIOR}: mean ({x:g}, {y:g}) is {fault}; the belief is clipped to free space"]
        return out

    def fault_at(self, pose: Pose) -> str:
        """Where a pose on the map is, if no robot can be there; else empty."""
        x, y, _ = from_map(np.array([pose]), self.origin)[0].tolist()
        if self.arena.is_free(x, y, 0.0):
            return ""
        width, height = self.arena.size_m
        if 0.0 <= x <= width and 0.0 <= y <= height:
            return "in an obstacle"
        corners = to_map(np.array([(a, b, 0.0) for a in (0.0, width) for b in (0.0, height)]), self.origin)
        (x0, y0, _), (x1, y1, _) = corners.min(axis=0), corners.max(axis=0)
        return f"outside the arena, which is within ({x0:.3g}, {y0:.3g}) and ({x1:.3g}, {y1:.3g})"

    def flat(self, start_pose: tuple[float, float, float]) -> str:
        """The text sim/world reads: one item a line."""
        arena, robot = self.arena, self.robot
        if arena.unknown or any(NOT_KNOWN in row for row in arena.floor):
            raise SceneError(f"{ARENA}: parts of the arena are unknown; a simulated world needs to know them all")
        lines = [_line("size_m", *arena.size_m), _line("tile_m", arena.tile_m)]
        lines += [] if self.origin == NOWHERE else [_line("origin", *self.origin)]
        lines += [_line("texture", name) for name in arena.textures] + [_line("floor", row) for row in arena.floor]
        lines += [_line("wall", arena.wall)] if arena.wall else []
        surface = dict(arena.surfaces)
        lines += [_line("obstacle", *box, *filter(None, [surface.get(box)])) for box in arena.obstacles]
        lines.append(_line("body_radius_m", robot.body_radius_m))
        for w in robot.whiskers:
            place = w.tip_m if w.role == "texture" else (*w.base_m, w.yaw_rad, w.length_m)
            lines.append(_line(f"{w.role}_whisker", w.name, *place))
        return "\n".join([*lines, *self.simulated, _line("start", *start_pose)]) + "\n"


def _or_make_one(place: Path) -> str:
    """What to do about a place that is no scene folder."""
    if Path(place).suffix.lower() in (".mcap", ".db3"):
        return f"make one with 'whisker scene from {place} --out SCENE', or give a scene folder"
    return "give a scene folder"


def load(path: str | Path, map_file: str | Path | None = None) -> Scene:
    """Read a scene folder; prior.toml may be absent. SceneError names file, line or key, and the remedy.

    map_file: YAML of an occupancy map, whose boxes take the place of arena.toml's, or of all of it where there is none;
    then the scene's origin is the map's.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise SceneError(f"{folder}: no such folder; {_or_make_one(folder)} with {ARENA} and {ROBOT}")
    scene = _read(folder, map_file)
    try:
        _ = scene.layout
    except ValueError as error:
        raise SceneError(f"{folder / ROBOT}: {error}; rename a whisker, a texture or a sensor") from None
    _judge(folder, scene, map_file)
    return scene


def _judge(folder: Path, scene: Scene, map_file: str | Path | None) -> None:
    """SceneError where a robot can be nowhere, or is said to be where nothing is."""
    arena, radius, size = scene.arena, scene.robot.body_radius_m, scene.arena.size_m
    whole = f"{size[0]:g} x {size[1]:g} m"
    if not has_place(size, arena.obstacles, radius / math.sqrt(2.0)):  # the square within the body
        text = f"no place is free for a body with body_radius_m {radius:g} in {whole}"
        raise SceneError(f"{map_file or folder / ARENA}: {text}; take obstacles out, or give all sizes in metres")
    if scene.prior and scene.prior.mean:
        prior = in_arena(scene.prior, scene.origin)
        away = [max(-p, p - side, 0.0) / sigma for p, side, sigma in zip(prior.mean, size, prior.sigma, strict=False)]
        if math.hypot(*away) > math.sqrt(-2.0 * math.log(NO_MASS)):
            text = f"'mean' ({scene.prior.mean[0]:g}, {scene.prior.mean[1]:g}) is {scene.fault_at(scene.prior.mean)}"
            raise SceneError(f"{folder / PRIOR}: {text}; give a pose inside, in that frame")


def load_robot(path: str | Path) -> Robot:
    """The robot of a scene folder, whose arena is not read. SceneError names file, line or key, and the remedy."""
    folder = Path(path)
    if not folder.is_dir():
        raise SceneError(f"{folder}: no such folder; {_or_make_one(folder)} with {ROBOT} and {OBSERVATIONS}")
    return _robot(Table.read(folder / ROBOT), (LARGEST_M, LARGEST_M))


def _read(folder: Path, map_file) -> Scene:
    prior = _prior(Table.read(folder / PRIOR)) if (folder / PRIOR).exists() else None
    if map_file is None or (folder / ARENA).exists():
        arena, origin = _arena(Table.read(folder / ARENA))
        robot = _robot(Table.read(folder / ROBOT), arena.size_m)
        mapped = arena if map_file is None else _with_map(arena, map_file, origin)
        return Scene(mapped, robot, prior, origin=origin)
    occupancy = read_map(map_file)
    robot = _robot(Table.read(folder / ROBOT), occupancy.size_m)
    wide, odd = 2.0 * robot.body_radius_m, occupancy.odd
    if 0.0 < wide < occupancy.resolution_m:
        size = " x ".join(f"{side:g}" for side in occupancy.size_m)
        odd = f"{map_file}: field 'resolution' makes a pixel {occupancy.resolution_m:g} m wide, the robot is {wide:g}, "
        odd += f"and the map {size} m; give metres a pixel"
    arena = Arena(occupancy.size_m, max(occupancy.size_m), ("NONE",), (NOT_KNOWN,), occupancy.solid, occupancy.unknown)
    feeling = replace(robot, whiskers=tuple(robot.of_role("object")))  # no floor is known for the others
    return Scene(arena, feeling, prior, origin=occupancy.origin, odd=odd)


def _with_map(arena: Arena, map_file, origin: Pose) -> Arena:
    try:
        occupancy = read_map(map_file)
        solid, unknown = placed(occupancy, arena.size_m, origin)
    except ValueError as error:
        raise error if isinstance(error, SceneError) else SceneError(f"{map_file}: {error}") from error
    if not has_place(arena.size_m, (*solid, *unknown), 0.0):
        (x, y, _), (wide, high) = occupancy.origin, occupancy.size_m
        area = f"x {x:g} to {x + wide:g} and y {y:g} to {y + high:g} m, where nothing of the arena is free"
        raise SceneError(f"{map_file}: field 'origin' lays the map on {area}; give its place in the frame of {ARENA}")
    return replace(arena, obstacles=solid, unknown=unknown)


def in_arena(prior: Prior, origin: Pose) -> Prior:
    """A prior on the map as one in the frame of an arena of this origin."""
    if prior.mean is None or origin == NOWHERE:
        return prior
    mean = tuple(map(float, from_map(np.array([prior.mean]), origin)[0]))
    back = spread_on_map(np.diag(np.square(prior.sigma))[None], (0.0, 0.0, -origin[2]))[0]
    return Prior(prior.kind, mean, independent(back))


def independent(covariance: np.ndarray) -> tuple[float, float, float]:
    """Standard deviations of x, y and heading, independent, of a normal distribution that is in no direction narrower than
    one of this covariance (3, 3): each variance grows by its shares in common with the others."""
    sigma = np.sqrt(np.diag(covariance))
    both = np.outer(sigma, sigma)
    shares = np.divide(np.abs(covariance), both, out=np.zeros((3, 3)), where=both > 0.0)
    return tuple((sigma * np.sqrt(shares.sum(axis=1))).tolist())


def write(path: str | Path, scene: Scene) -> None:
    """Write the folder that `load` reads back as an equal scene."""
    folder = Path(path)
    folder.mkdir(parents=True, exist_ok=True)
    arena, robot, prior = scene.arena, scene.robot, scene.prior
    surface = dict(arena.surfaces)
    content = {"size_m": arena.size_m, "tile_m": arena.tile_m, "textures": arena.textures, "floor": arena.floor}
    content |= {"wall": arena.wall} if arena.wall else {}
    content |= {} if scene.origin == NOWHERE else {"origin": scene.origin}
    obstacles = [_corners(box) | ({"surface": surface[box]} if box in surface else {}) for box in arena.obstacles]
    _write(folder / ARENA, content | {"obstacle": obstacles, "unknown": list(map(_corners, arena.unknown))})
    content = {key: getattr(robot, key) for key in ("body_radius_m", "odometry_relative_sigma", "radial_sigma_m")}
    turn = robot.odometry_turn_sigma_rad
    content |= {} if turn is None else {"odometry_turn_sigma_rad": turn}
    sensors = [write_sensor(folder, sensor) for sensor in robot.sensors]
    whiskers = {"whisker": list(map(_given, robot.whiskers)), "sensor": sensors}
    _write(folder / ROBOT, content | whiskers | base_content(robot.base))
    if prior is not None:
        _write(folder / PRIOR, _given(prior))


def has_place(size: tuple[float, float], boxes: tuple[Box, ...], half: float) -> bool:
    """Whether a square of this half side is free anywhere. Its leftmost free places are right of a box, or of the wall;
    those in the middle are tried first, for most arenas have one there."""
    grown = np.array(boxes).reshape(-1, 4) + np.array([-half, -half, half, half])
    places = sorted({half, *grown[:, 2].tolist()})
    for x in places[len(places) // 2 :] + places[: len(places) // 2]:
        beside = grown[(grown[:, 0] <= x) & (x < grown[:, 2])]
        y = half
        for low, high in sorted(beside[:, [1, 3]].tolist()):
            if low > y:
                break
            y = max(y, high)
        if half <= x < size[0] - half and y < size[1] - half:
            return True
    return False


def _corners(box: Box) -> dict:
    return {"min_m": box[:2], "max_m": box[2:]}


def _given(item) -> dict:
    """Its fields, but for those that are None."""
    return {key: value for key, value in vars(item).items() if value is not None}


def _write(path: Path, content: dict) -> None:
    """Tables of which there is none are left out."""
    import tomli_w  # only who writes a scene needs it

    put(path, tomli_w.dumps({key: value for key, value in content.items() if value != []}))


def _line(word: str, *values) -> str:
    return " ".join([word, *(value if isinstance(value, str) else repr(float(value)) for value in values)])


TINY = 1e-9
NO_MASS = 0.01  # of a Gaussian, that lies as far out as the arena begins


def _arena(table: Table) -> tuple[Arena, Pose]:
    """With its origin on the map."""
    size = table.numbers("size_m", 2, TINY, LARGEST_M)
    tile = table.number("tile_m", TINY, LARGEST_M)
    textures = _textures(table)
    floor = _floor(table, size, tile, textures)
    wall = _surface(table, "wall")
    origin = _pose(table, "origin", LARGEST_M) if "origin" in table.content else NOWHERE
    surfaces: list[tuple[Box, str]] = []
    obstacles, unknown = (_boxes(table, key, size, surfaces) for key in ("obstacle", "unknown"))
    table.done()
    return Arena(size, tile, textures, floor, obstacles, unknown, wall, tuple(surfaces)), origin


def _surface(table: Table, key: str) -> str:
    """The texture of a face that this key names; empty without the key."""
    name = table.text(key) if key in table.content else ""
    if name and not re.fullmatch(r"\w+", name):
        raise table.fail(key, f"has the name '{name}'; use letters, digits and underscores")
    return name


def _boxes(table: Table, key: str, size: tuple[float, float], surfaces: list[tuple[Box, str]]) -> tuple[Box, ...]:
    """The boxes of this key; the textures of their faces are added to `surfaces`."""
    boxes = []
    for entry in table.tables(key, OBSTACLES_MOST):
        low, high = (entry.numbers(corner, 2, -LARGEST_M, LARGEST_M) for corner in ("min_m", "max_m"))
        surface = _surface(entry, "surface") if key == "obstacle" else ""
        entry.done()
        if not (low[0] < high[0] and low[1] < high[1]):
            raise entry.fail("max_m", "must be larger than min_m in x and y")
        if min(low) < -TINY or high[0] > size[0] + TINY or high[1] > size[1] + TINY:
            raise entry.fail("min_m" if min(low) < -TINY else "max_m", "is outside the arena; move the obstacle inside")
        boxes.append((*low, *high))
        surfaces += [(boxes[-1], surface)] if surface else []
    return tuple(boxes)


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
    columns_wanted, rows_wanted = (math.ceil(side / tile - 1e-6) for side in size)
    if columns_wanted * rows_wanted > TILES_MOST:
        raise table.fail(
            "tile_m", f"asks for {columns_wanted} x {rows_wanted} tiles, {TILES_MOST} are the most; make it larger"
        )
    image = isinstance(table.content.get("floor"), str)
    rows = _floor_image(table, textures) if image else table.strings("floor")
    letters = {name[0] for name in textures} | {NOT_KNOWN}
    other_case = {ord(c.swapcase()): c for c in letters if len(c.swapcase()) == 1 and c.swapcase() not in letters}
    rows = tuple(row.translate(other_case) for row in rows)
    if len(rows) != rows_wanted:
        raise table.fail("floor", f"has {len(rows)} rows; size_m and tile_m ask for {rows_wanted}")
    for number, row in enumerate(rows, start=1):
        if len(row) != columns_wanted:
            raise table.fail("floor", f"row {number} has {len(row)} tiles; size_m and tile_m ask for {columns_wanted}")
        for letter in sorted(set(row) - letters):
            raise table.fail("floor", f"row {number} has the letter '{letter}', no texture begins with it; mend it")
    return rows


def _floor_image(table: Table, textures) -> tuple[str, ...]:
    """A tile for each pixel, its texture by the nearest of evenly spaced grey levels, the first texture black; a pixel
    that can be looked through is not known."""
    path = table.path.parent / table.text("floor")
    try:
        grey = read_grey(path)
    except UnreadableError as error:
        raise table.fail("floor", f"{path}: {error}; give letters, or an image with a pixel for each tile") from error
    steps = max(len(textures) - 1, 1)
    index = nearest_levels(grey.level, tuple(round(255 * n / steps) for n in range(len(textures))))
    letters = np.array([name[0] for name in textures])[index]
    if grey.opaque is not None:
        letters[~grey.opaque] = NOT_KNOWN
    return tuple("".join(row) for row in letters.tolist())


def _robot(table: Table, size_m: tuple[float, float]) -> Robot:
    radius = table.number("body_radius_m", 0.0, LARGEST_M)
    odometry = table.number("odometry_relative_sigma", 0.0, 10.0)
    gyroscope = "odometry_turn_sigma_rad"
    turn = table.number(gyroscope, TINY, math.pi) if gyroscope in table.content else None
    radial = table.number("radial_sigma_m", TINY, LARGEST_M)
    whiskers = tuple(_whisker(entry) for entry in table.tables("whisker", WHISKERS_MOST))
    sensors = read_sensors(table, size_m)
    base = read_base(table)
    table.done()
    names = [named.name for named in (*whiskers, *sensors)]
    for number, name in enumerate(names):
        if name in names[:number]:
            raise table.fail("whisker", f"has the name '{name}' twice; rename one")
    return Robot(radius, odometry, radial, whiskers, sensors, turn, base)


def _whisker(entry: Table) -> Whisker:
    name = entry.name()
    role = entry.text("role", "texture", "object")
    if role == "texture":
        whisker = Whisker(name, role, tip_m=entry.numbers("tip_m", 2, -LARGEST_M, LARGEST_M))
    else:
        whisker = Whisker(
            name,
            role,
            base_m=entry.numbers("base_m", 2, -LARGEST_M, LARGEST_M),
            yaw_rad=entry.number("yaw_rad", -ANGLE_MOST, ANGLE_MOST),
            length_m=entry.number("length_m", TINY, LARGEST_M),
        )
    entry.done()
    return whisker


def _pose(table: Table, key: str, far: float) -> Pose:
    pose = table.numbers(key, 3, -far, far)
    if abs(pose[2]) > ANGLE_MOST:
        raise table.fail(key, f"must have a heading in rad from {-ANGLE_MOST:g} to {ANGLE_MOST:g}, not {pose[2]:g}")
    return pose


def _prior(table: Table) -> Prior:
    kind = table.text("kind", "gaussian", "uniform")
    if kind == "uniform":
        table.done()
        return Prior(kind)
    mean = _pose(table, "mean", FARTHEST_M)
    sigma = table.numbers("sigma", 3, TINY, LARGEST_M)
    table.done()
    return Prior(kind, mean, sigma)
