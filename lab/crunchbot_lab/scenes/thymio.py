"""Scenes from recordings of a Thymio on a printed floor: text files of numbers, one line every 0.1 s (docs/formats.md).

Two grey-level sensors look at cells of black and white. They are texture whiskers here: a reading's likelihood by class
is a normal distribution about the class's level, and a share of readings at cell borders carries no information.
"""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from crunchbot.files import UnreadableError, read_text
from crunchbot.images import nearest_levels, read_grey
from crunchbot.nav.observations import Observations
from crunchbot.scene import Arena, Prior, Robot, Scene, Whisker
from crunchbot.tables import TableError, number

from .files import rounded

ROW_S = 0.1
TRUTH_FILE, POSITIONS, TURNS = "gt.txt", "odom_pose.txt", "odom_quaternion.txt"
SENSORS = {"left": (0.072, 0.011), "right": (0.072, -0.011)}  # robot frame, m
FILES = {TRUTH_FILE: 3, POSITIONS: 2, TURNS: 2, **{f"sensor_{name}.txt": 1 for name in SENSORS}}  # numbers a line
MAP, PIXEL_M = "map.png", 0.01
CLASSES = ("BLACK", "WHITE")
BLACK_COUNT, WHITE_COUNT = 60.0, 750.0  # of the analogue-digital converter
SIGMA = 0.15  # of a reading on one colour, as a share of the way from black to white
BORDER_SHARE, BORDER_LEVELS = 0.2, 1.5  # readings at cell borders: any level, evenly over so many times that way
ODOMETRY_RELATIVE = 0.1
RADIAL_M = 0.005  # no whisker reads it


def is_thymio(path: Path) -> bool:
    """Whether a folder holds such a recording; one without the truth is one too."""
    return all((path / name).is_file() for name in FILES if name != TRUTH_FILE)


def read_thymio(path: Path, warn: Callable[[str], None]) -> tuple[Scene, Observations]:
    """The scene, its start unknown, and a row for each line but the first; TableError names file and line.

    The floor's image lies beside the recording or one folder up; its first axis is x, its second y.
    """
    wanted = [name for name in FILES if name != TRUTH_FILE or (path / name).is_file()]
    columns = {name: _numbers(path / name, FILES[name]) for name in wanted}
    longest = max(map(len, columns.values()))
    for name, values in columns.items():
        if len(values) != longest:
            raise TableError(path / name, None, f"{len(values)} lines, other files have {longest}; give all the same")
    if longest < 2:
        raise TableError(path / POSITIONS, None, "one line is no motion; give a recording of two lines or more")
    scene = Scene(_arena(path), _robot(), Prior("uniform"))
    counts = np.column_stack([columns[f"sensor_{name}.txt"] for name in SENSORS])[1:]
    odometry = _motions(columns[POSITIONS], 2.0 * np.arctan2(*columns[TURNS].T))
    truth = columns[TRUTH_FILE][1:] if TRUTH_FILE in columns else None
    rows = longest - 1
    times = (np.arange(rows) + 1) * ROW_S
    return scene, rounded(Observations(times, [], odometry, _loglik(counts), np.empty((rows, 0)), truth))


def _numbers(path: Path, width: int) -> np.ndarray:
    """(lines, width); a cell that is no number is nan."""
    try:
        lines = [line.split() for line in read_text(path).splitlines()]
    except UnreadableError as error:
        raise TableError(path, None, f"{error}; give a text file of numbers") from error
    for index, cells in enumerate(lines, start=1):
        if len(cells) != width:
            raise TableError(path, index, f"{len(cells)} numbers where {width} belong; give every line all its numbers")
    return np.array([[number(cell) for cell in cells] for cells in lines]).reshape(len(lines), width)


def _motions(places: np.ndarray, headings: np.ndarray) -> np.ndarray:
    """(n - 1, 3) motion from line to line in the frame of the line before; places (n, 2), headings (n,)."""
    (dx, dy), cosine, sine = np.diff(places, axis=0).T, np.cos(headings[:-1]), np.sin(headings[:-1])
    turned = np.remainder(np.diff(headings) + math.pi, 2 * math.pi) - math.pi
    return np.column_stack([cosine * dx + sine * dy, cosine * dy - sine * dx, turned])


def _loglik(counts: np.ndarray) -> np.ndarray:
    """(n, sensors, classes) log-likelihoods of readings (n, sensors); nan where one is no number."""
    level = (counts - BLACK_COUNT) / (WHITE_COUNT - BLACK_COUNT)
    off = (level[:, :, None] - np.arange(len(CLASSES))) / SIGMA
    clear = (1.0 - BORDER_SHARE) * np.exp(-0.5 * off**2) / (SIGMA * math.sqrt(2 * math.pi))
    return np.log(clear + BORDER_SHARE / BORDER_LEVELS)


def _robot() -> Robot:
    tips = tuple(Whisker(name, "texture", tip_m=place) for name, place in SENSORS.items())
    return Robot(0.0, ODOMETRY_RELATIVE, RADIAL_M, tips)


def _arena(path: Path) -> Arena:
    image = next((place / MAP for place in (path, path.resolve().parent) if (place / MAP).is_file()), path / MAP)
    try:
        level = read_grey(image).level
    except UnreadableError as error:
        raise TableError(image, None, f"{error}; put the floor's image there, or one folder up") from error
    index = nearest_levels(level, (0, 255))
    edge = _cell_edge(index)
    floor = tuple("".join(CLASSES[n][0] for n in row) for row in index[::edge, ::edge].T[::-1])
    size = tuple(round(pixels * PIXEL_M, 6) for pixels in index.shape)
    return Arena(size, round(edge * PIXEL_M, 6), CLASSES, floor, ())


def _cell_edge(index: np.ndarray) -> int:
    """Pixels along the edge of the largest square cells, counted from the corner, that each have one class."""
    for edge in range(min(index.shape), 1, -1):
        if index.shape[0] % edge == index.shape[1] % edge == 0:
            cells = index.reshape(index.shape[0] // edge, edge, index.shape[1] // edge, edge)
            if (cells == cells[:, :1, :, :1]).all():
                return edge
    return 1
