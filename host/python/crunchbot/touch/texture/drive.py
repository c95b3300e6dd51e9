"""Recordings for training out of a drive: what each floor whisker felt while its tip was on one known surface."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...outputs import put
from ...scene import NOT_KNOWN_INDEX, Arena, Whisker

INSIDE_M = 0.05  # a border holds a tip, which lies behind its place then; the demo counts windows from here on, too
MOVING_M_S = 0.02  # a tip that is slower shows 2 mm of floor in a window of 100 ms
DEVIATIONS = 2.0  # of its place, that a tip is inside its tile beside this
GAP_S = 0.25  # longer without a pose, and nobody knows the way between
PLACE = re.compile(r".*_(?P<place>c\d+r\d+)_\d+\.csv")  # in a recording's name
GAP_PERIODS = 1.5  # a longer step between two samples is a gap


@dataclass(frozen=True)
class Drive:
    """Samples of a drive: times (n,) on the clock of the ticks, counts (n, lanes, 2), nan where one is not good."""

    t_s: np.ndarray
    counts: np.ndarray
    began_ns: int = 0  # since 1970


@dataclass(frozen=True)
class Way:
    """Where the robot was: times (m,) on the same clock, poses (m, 3) in the arena's frame, and how well they are known."""

    t_s: np.ndarray
    pose: np.ndarray
    sd_m: np.ndarray  # (m,) of the place
    sd_rad: np.ndarray  # (m,) of the heading


@dataclass(frozen=True)
class Stretch:
    """What one whisker felt of one surface without a break."""

    surface: str
    whisker: str
    place: str  # the tile, or empty
    t_s: np.ndarray  # (n,)
    counts: np.ndarray  # (n, 2)
    speed_m_s: float | None = None  # of the tip, the median


def over_tiles(drive: Drive, way: Way, whiskers: dict[int, Whisker], arena: Arena, least_s: float) -> list[Stretch]:
    """The stretches of so many seconds or more during which a tip moved over one tile whose texture is known. `whiskers`: by
    lane."""
    found, period = [], _period(drive.t_s)
    pose, known = _at(way, drive.t_s)
    floor = arena.floor_indices()
    for lane, whisker in whiskers.items():
        tip, inside = _tip(pose, whisker), INSIDE_M + DEVIATIONS * _sd_of(way, drive.t_s, whisker)
        column, row = (np.floor(tip[:, axis] / arena.tile_m).astype(int) for axis in range(2))
        within = (column >= 0) & (column < floor.shape[1]) & (row >= 0) & (row < floor.shape[0])
        surface = np.full(len(tip), NOT_KNOWN_INDEX, int)
        surface[within] = floor[row[within], column[within]]
        off = tip / arena.tile_m % 1.0 * arena.tile_m
        clear = (np.minimum(off, arena.tile_m - off) >= inside[:, None]).all(axis=1)
        speed = np.hypot(*np.gradient(tip, axis=0).T) / period
        use = known & within & clear & (surface != NOT_KNOWN_INDEX) & (speed >= MOVING_M_S)
        tile = row * floor.shape[1] + column
        for some in _runs(drive.t_s, use, tile, period, least_s):
            place = f"c{column[some.start]}r{row[some.start]}"
            name, pace = arena.textures[surface[some.start]], float(np.median(speed[some]))
            found.append(Stretch(name, whisker.name, place, drive.t_s[some], drive.counts[some, lane], pace))
    return found


def stated(
    drive: Drive, whiskers: dict[int, str], surface: str, first_s: float, last_s: float, least_s: float
) -> list[Stretch]:
    """The stretches between two times of the drive, all on one surface. `whiskers`: names by lane."""
    use = (drive.t_s >= first_s) & (drive.t_s <= last_s)
    runs = list(_runs(drive.t_s, use, np.zeros(len(use), int), _period(drive.t_s), least_s))
    return [Stretch(surface, name, "", drive.t_s[r], drive.counts[r, n]) for n, name in whiskers.items() for r in runs]


def write(folder: Path, name: str, stretches: list[Stretch], columns: tuple[str, ...]) -> None:
    """Put each as FOLDER/SURFACE/NAME_WHISKER_PLACE_N.csv; those of the same name are replaced."""
    for old in [path for path in folder.glob("*/*.csv") if path.name.startswith(f"{name}_")]:
        old.unlink()
        if not any(old.parent.iterdir()):
            old.parent.rmdir()
    for n, s in enumerate(stretches, 1):
        (folder / s.surface).mkdir(parents=True, exist_ok=True)
        speed = [] if s.speed_m_s is None else [f"{s.speed_m_s:.3f}"]
        head = ",".join(["t_s", *columns, *(["speed_m_s"] if speed else [])])
        cells = [["" if np.isnan(v) else f"{v:.0f}" for v in row] for row in s.counts]
        lines = [",".join([f"{t:.4f}", *row, *speed]) for t, row in zip(s.t_s, cells, strict=True)]
        file = "_".join(filter(None, [name, s.whisker, s.place, str(n)]))
        put(folder / s.surface / f"{file}.csv", "\n".join([head, *lines]) + "\n")


def place_of(path: Path) -> str:
    """The tile that a recording's name tells, as `write` puts it; else empty."""
    found = PLACE.fullmatch(path.name)
    return found["place"] if found else ""


def _period(t_s: np.ndarray) -> float:
    return float(np.median(np.diff(t_s)))


def _runs(t_s: np.ndarray, use: np.ndarray, key: np.ndarray, period: float, least_s: float) -> Iterator[slice]:
    """Samples in use that follow one another with one key, where they last so long."""
    cut = (np.diff(key) != 0) | (np.diff(use) != 0) | (np.diff(t_s) > GAP_PERIODS * period)
    edges = [0, *(np.flatnonzero(cut) + 1), len(use)]
    for first, last in zip(edges, edges[1:], strict=False):
        if use[first] and (last - first) * period >= least_s - 0.5 * period:
            yield slice(first, last)


def _at(way: Way, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Poses (n, 3) at these times, and whether they are known."""
    heading = np.unwrap(way.pose[:, 2])
    pose = np.column_stack([np.interp(t_s, way.t_s, v) for v in (way.pose[:, 0], way.pose[:, 1], heading)])
    after = np.searchsorted(way.t_s, t_s)
    inside = (after > 0) & (after < len(way.t_s))
    after = np.clip(after, 1, len(way.t_s) - 1)
    return pose, inside & (way.t_s[after] - way.t_s[after - 1] <= GAP_S)


def _sd_of(way: Way, t_s: np.ndarray, whisker: Whisker) -> np.ndarray:
    """Standard deviation of the tip's place, (n,)."""
    return np.interp(t_s, way.t_s, np.hypot(way.sd_m, np.hypot(*whisker.tip_m) * way.sd_rad))


def _tip(pose: np.ndarray, whisker: Whisker) -> np.ndarray:
    x, y = whisker.tip_m
    c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    return np.column_stack([pose[:, 0] + c * x - s * y, pose[:, 1] + s * x + c * y])
