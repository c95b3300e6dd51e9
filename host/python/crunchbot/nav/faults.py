"""What a robot's sensors cannot have given, and answers where the map says nothing: columns of rows judged, those of a file
and those of a running robot alike.

The bounds are what the base can do, the length and deviation of the whiskers, and a row for each 0.1 s.
"""

import math
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from ..base_table import BaseTable
from ..observation import DISTANCE, NORMAL, ODOMETRY, TIME
from ..occupancy import from_map
from ..scene import Robot, Scene, Whisker
from .observations import Observations

ROW_S = 0.1
APART = 2.5  # rows: where so many are between two, two are missing (gap.c)
MISSING_MOST = 10  # rows, after which nothing is known of the robot's way (gap.c)
ROW_MOST_M, ROW_MOST_RAD = 1.0, math.pi  # what intake.c takes in one row: the base's speed, and room for a whisk
SLACK_M, SLACK_RAD = 0.05, 0.1  # beyond what the base can do: for reports that come a little late
LENGTH_SLACK = 1.5  # of a whisker's length, within which a distance is read (range_model.c)
ACCURACY = 0.87  # of windows (texture_model.c)
SIDEWAYS_MOST = 0.5  # of the way ahead, for wheels that do not slide; motion in the map's frame has as much of both
TWINS_LEAST = 10  # rows with a contact in which two whiskers cannot read alike to the last digit
CONSTANT_LEAST = 100  # rows in which the base moves: even one that drives evenly is measured with noise
LEFT_MOST = 0.05  # share of rows or cells that may be left out without a word
CHANCE = 1e-6  # of what is called impossible
SECONDS, METRES = {"ms": 1e3, "us": 1e6, "ns": 1e9}, {"cm": 1e2, "mm": 1e3}
RADIANS = {"degrees": math.degrees(1.0)}
SHORTER, LONGER = {"0.1 mm": 10.0, "um": 1e3}, {"cm": 0.1, "m": 1e-3}  # than mm


def row_faults(rows: Observations, robot: Robot) -> list[str]:
    """What of these rows cannot be, or is left out: a line each with column, likeliest cause and remedy."""
    read = [values for values in (rows.texture, rows.radial_m, rows.own) if values is not None]
    if all(np.isnan(values).all() for values in read):
        return ["no row has a reading; all answers are the odometry's" if len(rows) else "no rows; record some"]
    with np.errstate(invalid="ignore", over="ignore"):  # of infinite cells
        return [*_times(rows), *_motions(rows, robot.base), *_alike(_columns(rows, robot))]


def ground_faults(poses: np.ndarray, scene: Scene) -> list[str]:
    """A line where too many of the answers (n, 3) are on ground that nobody mapped."""
    x, y, _ = from_map(poses, scene.origin).T
    inside = np.zeros(len(poses), bool)
    for x0, y0, x1, y1 in scene.arena.unknown:
        inside |= (x >= x0) & (x < x1) & (y >= y0) & (y < y1)
    if inside.sum() <= LEFT_MOST * len(poses):
        return []
    doubt = "where readings say little: the pose may be sure and wrong"
    return [f"{inside.mean():.0%} of the rows are on ground that nobody mapped, {doubt}; map it"]


def _alike(lines: Iterable[str]) -> Iterator[str]:
    """One line for columns that ask for one remedy."""
    of_remedy: dict[str, list[str]] = {}
    for line in lines:
        of_remedy.setdefault(line.partition("; ")[2], []).append(line)
    for first, *others in of_remedy.values():
        names = ", ".join(line.partition(":")[0].split("'")[1] for line in others)
        yield f"{first}; likewise {names}" if others else first


def _columns(rows: Observations, robot: Robot) -> Iterator[str]:
    for n, sensor in enumerate(robot.sensors if rows.own is not None else ()):
        yield from _left(sensor.name, rows.own[:, n], np.isfinite(rows.own[:, n]), "give numbers, or empty cells")
    moved = rows.odometry.any(axis=1)
    for n, whisker in enumerate(robot.of_role("object")):
        yield from _distances(whisker, rows.radial_m[:, n], robot.radial_sigma_m, moved)
        for other, whole in zip(robot.of_role("object")[:n], rows.radial_m.T, strict=False):
            touching = np.isfinite(whole) | np.isfinite(rows.radial_m[:, n])
            if touching.sum() >= TWINS_LEAST and np.array_equal(whole[touching], rows.radial_m[touching, n]):
                yield f"'{whisker.name}_{DISTANCE}' is that of {other.name} in every row; give each whisker its own"
        if rows.normal is not None:
            angle, deviation = rows.normal[:, n].T
            good = (np.abs(angle) <= math.tau) & (deviation > 0.0) & (deviation <= math.pi)
            yield from _left(f"{whisker.name}_{NORMAL[0]}", angle, good, "give rad, and a deviation above 0")
    for n, whisker in enumerate(robot.of_role("texture")):
        yield from _windows(f"{whisker.name}_TEXTURE", rows.texture[:, n])


def _cause(units: dict[str, float], fits: Callable[[float], bool]) -> str:
    """A question that names the units in which what was given fits."""
    found = " or ".join(unit for unit, factor in units.items() if fits(factor))
    return f" (are these {found}?)" if found else ""


def _left(name: str, values: np.ndarray, good: np.ndarray, remedy: str) -> list[str]:
    """A line where too many of the cells that are not nan are not good."""
    bad, read = ~good & ~np.isnan(values), np.count_nonzero(~np.isnan(values))
    if bad.sum() <= LEFT_MOST * read:
        return []
    first = f"{values[bad][0]:.6g}" if np.isfinite(values[bad][0]) else "no finite number"
    return [f"'{name}': {bad.sum()} of {read} cells cannot be and are left out, e.g. {first}; {remedy}"]


def _period(rows: Observations) -> float:
    """Median time between rows that are in order, s."""
    steps = np.diff(rows.t_s[rows.in_order()])
    return float(np.median(steps)) if len(steps) else ROW_S


def _is_usual(period: float) -> bool:
    return ROW_S / APART < period < ROW_S * APART


def _times(rows: Observations) -> Iterator[str]:
    order, period, count = rows.in_order(), _period(rows), len(rows)
    back = np.flatnonzero(~order)
    if len(back) > LEFT_MOST * count:
        text = f"is no number, or no later than before, in {len(back)} of {count} rows, first row {back[0] + 1}"
        yield f"'{TIME}' {text}: only their motion counts, of copies nothing; give the end of each row by one clock"
    if not _is_usual(period):
        cause = _cause(SECONDS, lambda unit: _is_usual(period / unit))
        yield f"'{TIME}': rows are {period:.3g} s apart{cause}; give seconds, and a row each {ROW_S:g} s"
        return
    steps = np.diff(rows.t_s[order]) / period
    leap = steps > MISSING_MOST + 1.5
    if leap.any():
        text = f"leaps by {period * steps.max():.6g} s to row {np.flatnonzero(order)[steps.argmax() + 1] + 1}"
        yield f"'{TIME}' {text}; what the robot did meanwhile is not known: look why no row came, or the clock was set"
    missing = int(np.round(steps[~leap] - 1.0).sum()) - len(back)
    if missing > LEFT_MOST * (missing + count):
        yield f"'{TIME}': {missing} rows are missing among {count}, their motion is assumed; look what loses them"


def _motions(rows: Observations, base: BaseTable) -> list[str]:
    """By what the base can do in the time since the row before that moved, for a whisk's motion is held back."""
    number, moved, carried = np.arange(len(rows)), rows.odometry.any(axis=1), np.isinf(rows.odometry).any(axis=1)
    since = np.concatenate([[-1], np.maximum.accumulate(np.where(moved, number, -1))[:-1]])
    seconds = (number - since) * ROW_S
    if _is_usual(_period(rows)):
        seconds = np.where(since < 0, seconds, np.fmax(seconds, rows.t_s - rows.t_s[since]))
    beyond, lines, known = np.zeros(len(rows), bool), [], np.where(carried[:, None], 0.0, rows.odometry)
    far, turned = base.wheel_most_m_s * seconds + SLACK_M, base.turn_most_rad_s * seconds + SLACK_RAD
    for columns, units, most in ((slice(0, 2), METRES, far), (slice(2, 3), RADIANS, turned)):
        part = known[:, columns]
        size, change = (np.abs(np.hypot.reduce(p, axis=1)) for p in (part, np.diff(part, axis=0)))
        beyond |= ~(size <= most)
        share = np.mean(~(size <= most))
        if share > LEFT_MOST:
            cause = _cause(units, lambda unit, size=size, most=most: np.mean(~(size / unit <= most)) <= LEFT_MOST)
            if np.mean(change > most[1:]) <= LEFT_MOST:  # as smooth as a path
                cause = " (are these sums since the start?)"
            text = f"{share:.0%} of the rows are no number, or more than the base can do, as {np.nanmax(size, initial=0):.3g}"
            lines += [f"'{ODOMETRY[columns][0]}': {text}{cause}; give the motion since the row before, in m and rad"]
    if beyond.any() and not lines:
        first, most = int(beyond.argmax()), (ROW_MOST_M, ROW_MOST_M, ROW_MOST_RAD)
        lost = ~(np.abs(known) <= most).all(axis=1)
        motion = ", ".join(f"{value:.3g}" for value in rows.odometry[first])
        text = f"moves by {motion} in {seconds[first]:.1f} s, which the base cannot; {beyond.sum()} rows are so"
        lines += [f"row {first + 1} {text}, {lost.sum()} left out: was it carried, or its odometry set anew?"]
    if carried.any():
        text = f"the robot was carried in {carried.sum()} rows, first row {carried.argmax() + 1}"
        lines += [f"{text}: it may be anywhere then; give it a pose, or let it drive"]
    return lines or [*_ways(rows.odometry[moved])]


def _ways(moved: np.ndarray) -> Iterator[str]:
    """Of rows (n, 3) that the base can have driven each by itself."""
    ahead, side, turn = moved.T
    for name, values in zip(ODOMETRY[::2], (ahead, turn), strict=True):
        if len(values) >= CONSTANT_LEAST and np.ptp(values) == 0.0:
            yield f"'{name}' is {values[0]:.6g} in all of {len(values)} rows in which the robot moves; look at the odometry"
    slid = np.abs(side - ahead * np.tan(0.5 * turn)).sum()  # beside the chord of an arc
    if slid > SLACK_M + SIDEWAYS_MOST * np.abs(ahead).sum():
        cause = "(are x and y exchanged, or in the map's frame?)"
        yield f"'{ODOMETRY[1]}' sums to {slid:.3g} m sideways, which wheels do not go {cause}; give motion ahead and to the left"


def _distances(whisker: Whisker, values: np.ndarray, sigma: float, moved: np.ndarray) -> Iterator[str]:
    name, length = f"{whisker.name}_{DISTANCE}", whisker.length_m
    good = (values >= 0.0) & (np.isposinf(values) | (values <= LENGTH_SLACK * length))
    bad = values[~good & ~np.isnan(values)]
    fits = bad.min(initial=math.inf) > 0.0
    cause = _cause(SHORTER, lambda unit: fits and bad.max(initial=0.0) / unit <= LENGTH_SLACK * length)
    remedy = f"give mm from the base, up to {1e3 * length:g}, and leave the cell empty where nothing is touched{cause}"
    yield from _left(name, 1e3 * values, good, remedy)
    touching = good & np.isfinite(values)
    if not touching.any():
        return
    most, touches = values[touching].max(), np.count_nonzero(np.diff(touching, prepend=False) & touching)
    if (most / length) ** touches < CHANCE:  # a contact is as likely anywhere along the whisker
        cause = _cause(LONGER, lambda unit: most / unit <= LENGTH_SLACK * length)
        yield f"'{name}' is at most {1e3 * most:.3g} of a whisker of {1e3 * length:g} mm{cause}; give mm, and length_m in m"
    if not moved.any() and np.ptp(values[touching]) > 6.0 * sigma:
        yield f"'{name}' changes, and the odometry is 0 in every row; give its motion"
    level, count = np.unique(values[touching & moved], return_counts=True)
    if not len(level):
        return
    top, alike = int(count.argmax()), count.sum() * np.diff(level).min(initial=math.inf) / (sigma * math.sqrt(math.tau))
    alike, rare = alike if len(level) > 1 else 0.0, math.sqrt(-2.0 * math.log(CHANCE))
    end = not 3.0 * sigma < level[top] < length - 3.0 * sigma or 2 * count[top] > count.sum()
    if end and count[top] > max(LEFT_MOST * count.sum(), alike + rare * (1.0 + math.sqrt(alike))):
        text = f"is {1e3 * level[top]:.6g} in {count[top]} of {count.sum()} rows with a contact while the robot moves"
        yield f"'{name}' {text}; leave the cell empty where nothing is touched, or look at the sensor"


def _windows(name: str, values: np.ndarray) -> Iterator[str]:
    """Log-likelihoods (n, textures) of a whisker."""
    good = np.isfinite(values).all(axis=1)
    worst = np.where(np.isnan(values[:, 0]), np.nan, np.where(good, 0.0, np.inf))
    yield from _left(name, worst, good, "give the logarithm of each texture's likelihood")
    some = values[good]
    if not len(some) or np.ptp(some[0]) == 0.0:
        return
    for whole in (1.0, 100.0):
        if (some >= 0.0).all() and np.allclose(some.sum(axis=1), whole, rtol=1e-3):
            yield f"'{name}' sum to {whole:g} (are these probabilities?); give their logarithms"
    if (some == some[0]).all() and ACCURACY ** len(some) < CHANCE:
        yield f"'{name}' are the same in all of {len(some)} windows; look at the sensor, or leave the cells empty"
