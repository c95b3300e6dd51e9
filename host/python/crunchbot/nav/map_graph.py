"""A factor graph over the poses at which something was touched, the faces and the lattice: GTSAM (extra `graph`) beside the
mapper of host/nav, which says what is of which face.

Poses are joined by the odometry, contacts are points on lines, normals are directions of them, changes of texture are
points on the lattice's lines. Poses as they come are iSAM2's, from rows until then; the map is of one batch at the end.
What closes a loop has a robust kernel.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..scene import Robot
from .filters import ESTIMATE
from .mapper import Lattice, Mapper, MappingError, Part, TouchMap
from .observations import Observations

CHUNK = 10  # rows after which the mapper is asked for its faces
DRIFT_RAD, MEMORY_M, MEMORY_RAD = 0.03, 0.3, 2.0  # of the odometry, as host/nav/mapping takes it
LEAST = 1e-8  # m^2, rad^2 of any row: it keeps the graph regular
ROUGH_M, RIGHT_RAD = 0.001, 0.006  # of any face; of right angles
UNKNOWN = (0.5, 0.5)  # rad, m: of a face before it is felt, which keeps the graph regular
BORDER_M = 0.03  # of a change of texture about the lattice's line
BEYOND_M = 0.05  # past the end of what was felt of a face, and still of it
FACING = 0.15  # cosine between whisker and normal, at least
GATE = 3.0  # standard deviations
SAME_M, SAME_RAD = 0.08, 0.2  # faces of two moments that are one
AGAIN = 100  # rows after which a face is met again, which closes a loop
CHANGES_PER_M = 2.5  # of texture
SURE, BORDER_MOST_M = 0.9, 0.06  # of a texture; between the last of one and the first of the next, half of it
TEMPER_NATS = 2.0  # between the best texture and the next, at most
KERNEL = 1.0  # of Cauchy's estimator, standard deviations
ITERATIONS = 50


def gtsam_module() -> Any:
    """GTSAM; MappingError where it is not installed."""
    try:
        import gtsam  # an extra of its own
    except ImportError as error:
        text = "--representation graph: needs the package gtsam; run: pip install 'crunchbot[graph]'"
        raise MappingError(text) from error
    return gtsam


@dataclass
class Line:
    """A face: normal . (p - anchor) = offset. `seen`: its stretch as the mapper had it last; `row`: met last."""

    key: int
    anchor: np.ndarray
    normal: float
    seen: np.void
    row: int
    low: float = math.inf
    high: float = -math.inf
    hits: int = 0


class Graph:
    """Rows in, factors and estimates out. All keys are whole numbers: poses from 0, lines from LINES, axes at AXES."""

    LINES, AXES, LATTICE = 10_000_000, 20_000_000, 20_000_001

    def __init__(self, robot: Robot):
        self.g = gtsam_module()
        self.robot = robot
        self.factors, self.fresh = self.g.NonlinearFactorGraph(), self.g.NonlinearFactorGraph()
        self.values, self.new = self.g.Values(), self.g.Values()
        parameters = self.g.ISAM2Params()
        parameters.setRelinearizeThreshold(0.01)
        parameters.relinearizeSkip = 1
        self.isam = self.g.ISAM2(parameters)
        self.lines: list[Line] = []
        self.rows: list[int] = []  # of the poses
        self.pending, self.noise = self.g.Pose2(), np.zeros(2)
        self.at = self.g.Pose2()
        self.axes = False
        self.corner: np.ndarray | None = None
        self._insert(0, self.at)
        self._add(self.g.PriorFactorPose2(0, self.at, self._diagonal(1e-6, 1e-6, 1e-6)))
        self.rows.append(-1)

    def _diagonal(self, *sigmas: float) -> Any:
        return self.g.noiseModel.Diagonal.Sigmas(np.array(sigmas))

    def _robust(self, sigma: float) -> Any:
        kernel = self.g.noiseModel.mEstimator.Cauchy.Create(KERNEL)
        return self.g.noiseModel.Robust.Create(kernel, self._diagonal(sigma))

    def _insert(self, key: int, value: Any) -> None:
        self.values.insert(key, value)
        self.new.insert(key, value)

    def _add(self, factor: Any) -> None:
        self.factors.add(factor)
        self.fresh.add(factor)

    def move(self, step: np.ndarray) -> None:
        """Odometry of a row."""
        relative = self.robot.odometry_relative_sigma
        step = np.where(np.isfinite(step), step, 0.0)
        distance, turn = math.hypot(step[0], step[1]), abs(float(step[2]))
        heading = relative**2 * turn * max(turn, MEMORY_RAD) + DRIFT_RAD**2 * distance
        gyroscope = self.robot.odometry_turn_sigma_rad
        heading = gyroscope**2 if gyroscope else heading
        self.noise += (relative**2 * distance * max(distance, MEMORY_M) + LEAST, heading + LEAST)
        self.pending = self.pending.compose(self.g.Pose2(*(float(v) for v in step)))

    def here(self) -> Any:
        """Where the robot is, by the last pose's estimate."""
        return self.at.compose(self.pending)

    def pose(self, row: int) -> int:
        """The pose after this row as one of the graph; its key."""
        if self.rows[-1] == row:
            return len(self.rows) - 1
        key = len(self.rows)
        way = math.hypot(self.pending.x(), self.pending.y())
        sideways = math.sqrt(self.noise[0] + self.noise[1] * way * way / 3)
        noise = self._diagonal(sideways, sideways, math.sqrt(self.noise[1]))
        self._add(self.g.BetweenFactorPose2(key - 1, key, self.pending, noise))
        self.at = self.here()
        self._insert(key, self.at)
        self.rows.append(row)
        self.pending, self.noise = self.g.Pose2(), np.zeros(2)
        return key

    def line_of(self, stretch: np.void, row: int) -> Line:
        """The line that the mapper has as this stretch; a new one where there is none."""
        for line in self.lines:
            turn = math.remainder(float(stretch["normal"] - line.seen["normal"]), 2 * math.pi)
            if abs(turn) < SAME_RAD and _near(line.seen, stretch):
                line.seen = stretch
                return line
        anchor = np.array([stretch["x0"] + stretch["x1"], stretch["y0"] + stretch["y1"]]) / 2
        line = Line(self.LINES + len(self.lines), anchor, float(stretch["normal"]), stretch, row)
        value = np.array([line.normal, 0.0])
        self._insert(line.key, value)
        self._add(self.g.PriorFactorVector(line.key, value, self._diagonal(*UNKNOWN)))
        self.lines.append(line)
        if stretch["right"]:
            self._right(line)
        return line

    def _right(self, line: Line) -> None:
        if not self.axes:
            self._insert(self.AXES, np.array([line.normal]))
            self._add(self.g.PriorFactorVector(self.AXES, np.array([line.normal]), self._diagonal(UNKNOWN[0])))
            self.axes = True
        quarter = math.pi / 2

        def error(_factor: Any, values: Any, jacobians: list | None) -> np.ndarray:
            turn = values.atVector(line.key)[0] - values.atVector(self.AXES)[0]
            if jacobians is not None:
                jacobians[0], jacobians[1] = np.array([[1.0, 0.0]], order="F"), np.array([[-1.0]], order="F")
            return np.array([turn - quarter * round(turn / quarter)])

        self._add(self.g.CustomFactor(self._robust(RIGHT_RAD), [line.key, self.AXES], error))

    def contact(self, pose: int, line: Line, point: np.ndarray, sigma: float) -> None:
        """A point (robot's frame, m) is on the line."""
        noise = self._robust(sigma) if self._again(line, pose) else self._diagonal(sigma)
        self._add(self.g.CustomFactor(noise, [pose, line.key], _point_on_line(pose, line, point)))

    def normal(self, pose: int, line: Line, direction: float, sigma: float) -> None:
        """The line's normal has this direction (robot's frame, rad)."""

        def error(_factor: Any, values: Any, jacobians: list | None) -> np.ndarray:
            if jacobians is not None:
                jacobians[0] = np.array([[0.0, 0.0, -1.0]], order="F")
                jacobians[1] = np.array([[1.0, 0.0]], order="F")
            off = values.atVector(line.key)[0] - values.atPose2(pose).theta() - direction
            return np.array([math.remainder(off, 2 * math.pi)])

        self._add(self.g.CustomFactor(self._robust(sigma), [pose, line.key], error))

    def lattice(self, found: Lattice) -> None:
        """Takes the mapper's lattice, at its first sight, as (u, v, pitch, turn) about its corner."""
        if self.corner is not None:
            return
        self.corner = np.array([found.x, found.y])
        value = np.array([0.0, 0.0, found.pitch, found.turn])
        self._insert(self.LATTICE, value)
        prior = self._diagonal(found.sigma_m, found.sigma_m, found.sigma_pitch, found.sigma_turn)
        self._add(self.g.PriorFactorVector(self.LATTICE, value, prior))

    def border(self, pose: int, point: np.ndarray) -> None:
        """Textures change at a point (robot's frame, m): it is on the nearest line of the lattice."""
        if self.corner is None:
            return
        lattice = self.values.atVector(self.LATTICE) if not self.isam.valueExists(self.LATTICE) else None
        lattice = self.isam.calculateEstimateVector(self.LATTICE) if lattice is None else lattice
        off = [_off_lattice(self.at, lattice, self.corner, point, axis)[0] for axis in (0, 1)]
        axis = int(abs(off[1]) < abs(off[0]))
        corner, key = self.corner, self.LATTICE

        def error(_factor: Any, values: Any, jacobians: list | None) -> np.ndarray:
            found = _off_lattice(values.atPose2(pose), values.atVector(key), corner, point, axis)
            if jacobians is not None:
                jacobians[0], jacobians[1] = (np.array([slope], order="F") for slope in found[1:])
            return np.array([found[0]])

        if abs(off[axis]) < GATE * BORDER_M:
            self._add(self.g.CustomFactor(self._robust(BORDER_M), [pose, key], error))

    def _again(self, line: Line, pose: int) -> bool:
        row = self.rows[pose]
        again = row - line.row > AGAIN
        line.row = row
        line.hits += 1
        return again

    def step(self) -> np.ndarray:
        """iSAM2 takes what is new; covariance (3, 3) of the last pose, world's frame."""
        last = len(self.rows) - 1
        self.isam.update(self.fresh, self.new)
        self.fresh, self.new = self.g.NonlinearFactorGraph(), self.g.Values()
        self.at = self.isam.calculateEstimatePose2(last)
        turn = np.eye(3)
        turn[:2, :2] = self.at.rotation().matrix()
        return turn @ self.isam.marginalCovariance(last) @ turn.T

    def batch(self) -> Any:
        """All values that fit all factors best (Levenberg-Marquardt), from iSAM2's."""
        parameters = self.g.LevenbergMarquardtParams()
        parameters.setMaxIterations(ITERATIONS)
        begin = self.isam.calculateEstimate()
        return self.g.LevenbergMarquardtOptimizer(self.factors, begin, parameters).optimize()


def _near(seen: np.void, stretch: np.void) -> bool:
    """Whether the middle of a stretch is on another one, or nearly."""
    x, y = ((stretch[f"{axis}0"] + stretch[f"{axis}1"]) / 2 for axis in "xy")
    off, beyond = _place(seen, np.array([x, y]))
    half = math.hypot(stretch["x1"] - stretch["x0"], stretch["y1"] - stretch["y0"]) / 2
    return abs(off) < SAME_M and beyond < SAME_M + half


def _place(stretch: np.void, point: np.ndarray) -> tuple[float, float]:
    """Of a point: m in front of the stretch, and m past its ends."""
    start, end = np.array([stretch["x0"], stretch["y0"]]), np.array([stretch["x1"], stretch["y1"]])
    normal = np.array([math.cos(stretch["normal"]), math.sin(stretch["normal"])])
    length = math.hypot(*(end - start))
    along = float((point - start) @ (end - start)) / length if length > 0 else 0.0
    return float(normal @ (point - start)), max(-along, along - length, 0.0)


def _point_on_line(pose: int, line: Line, point: np.ndarray) -> Callable:
    def error(_factor: Any, values: Any, jacobians: list | None) -> np.ndarray:
        at, (direction, offset) = values.atPose2(pose), values.atVector(line.key)
        c, s = math.cos(at.theta()), math.sin(at.theta())
        lx, ly = c * point[0] - s * point[1], s * point[0] + c * point[1]
        nx, ny = math.cos(direction), math.sin(direction)
        dx, dy = at.x() + lx - line.anchor[0], at.y() + ly - line.anchor[1]
        if jacobians is not None:
            jacobians[0] = np.array([[nx * c + ny * s, ny * c - nx * s, ny * lx - nx * ly]], order="F")
            jacobians[1] = np.array([[nx * dy - ny * dx, -1.0]], order="F")
        return np.array([nx * dx + ny * dy - offset])

    return error


def _off_lattice(
    at: Any, lattice: np.ndarray, corner: np.ndarray, point: np.ndarray, axis: int
) -> tuple[float, tuple[float, ...], tuple[float, ...]]:
    """m of a point (robot's frame) from the nearest line across an axis; its slopes by the pose and by the lattice."""
    c, s = math.cos(at.theta()), math.sin(at.theta())
    lx, ly = c * point[0] - s * point[1], s * point[0] + c * point[1]
    dx, dy = at.x() + lx - corner[0], at.y() + ly - corner[1]
    turn, pitch = lattice[3] + axis * math.pi / 2, lattice[2]
    nx, ny = math.cos(turn), math.sin(turn)
    along = nx * dx + ny * dy - lattice[axis]
    number = round(along / pitch)
    by_pose = (nx * c + ny * s, ny * c - nx * s, ny * lx - nx * ly)
    by_lattice = (-float(axis == 0), -float(axis == 1), -float(number), nx * dy - ny * dx)
    return along - number * pitch, by_pose, by_lattice


class Borders:
    """Changes of texture under the texture whiskers, by a hidden Markov model of each; points in the robot's frame."""

    def __init__(self, robot: Robot, classes: int):
        self.tips = [np.array(whisker.tip_m) for whisker in robot.of_role("texture")]
        self.belief = np.full((len(self.tips), classes), 1.0 / classes)
        self.surface = np.full(len(self.tips), -1)
        self.last: list[np.ndarray | None] = [None] * len(self.tips)  # the tip where the old texture was sure last
        self.path = (0.0, 0.0, 0.0)

    def take(self, step: np.ndarray, windows: np.ndarray) -> list[np.ndarray]:
        """Odometry and windows (tips, classes) of a row: where borders were crossed, seen from where the robot is."""
        step = np.where(np.isfinite(step), step, 0.0)
        x, y, turn = self.path
        c, s = math.cos(turn), math.sin(turn)
        self.path = (x + c * step[0] - s * step[1], y + s * step[0] + c * step[1], turn + float(step[2]))
        found = []
        for n, tip in enumerate(self.tips):
            if not np.isfinite(windows[n]).all():
                continue
            moved = math.hypot(step[0], step[1]) + math.hypot(*tip) * abs(step[2])
            keep = math.exp(-CHANGES_PER_M * moved)
            p = (keep * self.belief[n] + (1.0 - keep) / self.belief.shape[1]) * _likelihood(windows[n])
            self.belief[n] = p / p.sum()
            found += self._crossed(n, self._out(tip))
        return [self._back(point) for point in found]

    def _crossed(self, n: int, place: np.ndarray) -> list[np.ndarray]:
        best = int(self.belief[n].argmax())
        if self.belief[n][best] < SURE:
            return []
        last, changed = self.last[n], self.surface[n] not in (-1, best)
        self.surface[n], self.last[n] = best, place
        near = changed and last is not None and math.hypot(*(place - last)) < 2 * BORDER_MOST_M
        return [(place + last) / 2] if near and last is not None else []

    def _out(self, point: np.ndarray) -> np.ndarray:
        x, y, turn = self.path
        c, s = math.cos(turn), math.sin(turn)
        return np.array([x + c * point[0] - s * point[1], y + s * point[0] + c * point[1]])

    def _back(self, point: np.ndarray) -> np.ndarray:
        x, y, turn = self.path
        c, s, (dx, dy) = math.cos(turn), math.sin(turn), point - (x, y)
        return np.array([c * dx + s * dy, c * dy - s * dx])


def _likelihood(window: np.ndarray) -> np.ndarray:
    """Of each texture, tempered so that no window is surer than TEMPER_NATS."""
    off = window - window.max()
    spread = -np.sort(off)[-2] if len(off) > 1 else 0.0
    return np.exp(off * min(1.0, TEMPER_NATS / spread if spread > 0 else 1.0))


class GraphMapper:
    """As Mapper: takes rows and knows, after each, the pose; at the end the map."""

    def __init__(
        self,
        robot: Robot,
        textures: tuple[str, ...],
        seed: int = 0,
        particles: int | None = None,
        lattice: bool = True,
        normals: bool = False,
    ):
        """Options are the mapper's, which says what is of which face. MappingError when one is out of range, or GTSAM is
        not installed."""
        self.graph = Graph(robot)
        self.mapper = Mapper(robot, textures, seed, particles, lattice, normals)
        self.robot, self.borders = robot, Borders(robot, len(textures))
        self.whiskers = robot.of_role("object")
        self.known: np.ndarray | None = None
        self.cov, self.path = np.zeros((3, 3)), []

    def replay(self, rows: Observations, first: int, count: int) -> tuple[np.ndarray, np.ndarray]:
        """As Mapper.replay."""
        tables, times = [np.zeros(0, ESTIMATE)], [np.zeros(0)]
        for begin in range(first, first + count, CHUNK):
            size = min(CHUNK, first + count - begin)
            table, step_us = self.mapper.replay(rows, begin, size)
            places = table["pose"].copy()
            for k in range(size):
                begun = time.process_time()
                self._row(rows, begin + k, places[k], table["covariance"][k])
                at = self.graph.here()
                table["pose"][k] = (at.x(), at.y(), at.theta())
                table["covariance"][k] = self.cov + np.diag([*[self.graph.noise[0]] * 2, self.graph.noise[1]])
                step_us[k] += 1e6 * (time.process_time() - begun)
            begun = time.process_time()
            self.known, found = self.mapper.faces(), self.mapper.lattice()
            if found is not None:
                self.graph.lattice(found)
            step_us[-1] += 1e6 * (time.process_time() - begun)
            tables.append(table)
            times.append(step_us)
        return np.concatenate(tables), np.concatenate(times)

    def parts(self) -> list[Part]:
        """One: the graph has one frame, and what the mapper says of kidnaps is not used."""
        return [Part(0, 0, 0, None, None, None)]

    def _row(self, rows: Observations, row: int, place: np.ndarray, cov: np.ndarray) -> None:
        graph, news = self.graph, False
        graph.move(rows.odometry[row])
        for n, whisker in enumerate(self.whiskers):
            distance = float(rows.radial_m[row, n])
            if not 0.0 <= distance <= whisker.length_m or self.known is None:
                continue
            c, s = math.cos(whisker.yaw_rad), math.sin(whisker.yaw_rad)
            point = np.array([whisker.base_m[0] + distance * c, whisker.base_m[1] + distance * s])
            stretch, facing = self._face(place, cov, point, whisker.yaw_rad)
            if stretch is None:
                continue
            pose, line = graph.pose(row), graph.line_of(stretch, row)
            graph.contact(pose, line, point, math.hypot(self.robot.radial_sigma_m * facing, ROUGH_M))
            if rows.normal is not None and np.isfinite(rows.normal[row, n]).all():
                graph.normal(pose, line, *(float(v) for v in rows.normal[row, n]))
            news = True
        for point in self.borders.take(rows.odometry[row], rows.texture[row]):
            if graph.corner is not None:
                graph.border(graph.pose(row), point)
                news = True
        if news:
            self.cov = graph.step()

    def _face(self, place: np.ndarray, cov: np.ndarray, point: np.ndarray, yaw: float) -> tuple[np.void | None, float]:
        """The stretch that a contact is of, by the mapper's pose, and the cosine between its normal and the whisker."""
        c, s = math.cos(place[2]), math.sin(place[2])
        at = np.array([place[0] + c * point[0] - s * point[1], place[1] + s * point[0] + c * point[1]])
        best, nearest, cosine = None, math.inf, 0.0
        for stretch in self.known if self.known is not None else ():
            facing = -math.cos(float(stretch["normal"]) - place[2] - yaw)
            off, beyond = _place(stretch, at)
            spread = math.sqrt(
                self.robot.radial_sigma_m**2 + float(stretch["offset_sigma"]) ** 2 + (cov[0, 0] + cov[1, 1]) / 2
            )
            if facing > FACING and beyond < BEYOND_M and abs(off) < min(GATE * spread, nearest):
                best, nearest, cosine = stretch, abs(off), facing
        return best, cosine

    def map(self) -> TouchMap:
        """The mapper's map with the faces where the batch puts them."""
        touched = self.mapper.map()
        if len(self.graph.rows) < 2:
            return touched
        values = self.graph.batch()
        self.path = [(row, values.atPose2(key)) for key, row in enumerate(self.graph.rows)]
        faces = touched.faces.copy()
        for stretch in faces:
            for line in self.graph.lines:
                turn = math.remainder(float(stretch["normal"] - line.seen["normal"]), 2 * math.pi)
                if abs(turn) < SAME_RAD and _near(line.seen, stretch):
                    _put(stretch, line, values.atVector(line.key))
                    break
        return replace(touched, faces=faces)

    @property
    def bad_cells(self) -> int:
        return self.mapper.bad_cells

    @property
    def bad_rows(self) -> int:
        return self.mapper.bad_rows


def _put(stretch: np.void, line: Line, value: np.ndarray) -> None:
    """Moves a stretch onto the line as the graph has it."""
    normal = np.array([math.cos(value[0]), math.sin(value[0])])
    for end in "01":
        point = np.array([stretch[f"x{end}"], stretch[f"y{end}"]])
        point = point - normal * (normal @ (point - line.anchor) - value[1])
        stretch[f"x{end}"], stretch[f"y{end}"] = point
    stretch["normal"] = math.remainder(float(value[0]), 2 * math.pi)
