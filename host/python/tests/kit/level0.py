"""A small world of observations only: random arenas, a robot exploring with body whisks, and the rows it would report.

Written for these tests, from the paper's description and docs/formats.md; it shares no code with
host/nav (its own ray casting is sampled), so that the filters are not tested against themselves.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from crunchbot.nav.localise import Observations
from crunchbot.scene import Arena, Prior, Robot, Scene, Whisker

TEXTURES = ("VINYL", "SMOOTH", "ROUGH")
ROW_S, FINE_S = 0.1, 0.01
FORWARD_M_S, TURN_RAD_S, WHISK_RAD_S = 0.13, 0.62, math.pi / 24
PRESS_M = 0.012  # a whisker driven so far into an object is noticed
PUSH_RAD = math.radians(4.5)


@dataclass
class World:
    """Rates of what goes wrong."""

    accuracy: float = 0.9
    error_rows: float = 3.0  # wrong windows come in runs
    catch: float = 0.3  # of border crossings
    radial_sigma_m: float = 0.005
    odometry: float = 0.02  # spread of a move's gain; a run's own gain has half of it
    miss: float = 0.0
    ghost: float = 0.0
    scale: float = 0.0


def random_scene(rng: np.random.Generator, prior: Prior | None = None) -> Scene:
    floor = tuple("".join(rng.choice(list("VSR"), 5)) for _ in range(5))
    tiles = rng.choice([n for n in range(25) if n not in (6, 7, 8, 11, 12, 13)], 3, replace=False)
    boxes = tuple((0.5 * (n % 5), 0.5 * (n // 5), 0.5 * (n % 5) + 0.5, 0.5 * (n // 5) + 0.5) for n in map(int, tiles))
    rays = [(0.13, 0.05, 0.2), (0.13, -0.05, -0.2), (0.1, 0.1, 0.7), (0.1, -0.1, -0.7)]
    whiskers = [Whisker(f"floor{s}", "texture", tip_m=(0.05, y)) for s, y in (("L", 0.2), ("R", -0.2))]
    whiskers += [
        Whisker(f"w{i}", "object", base_m=(x, y), yaw_rad=a, length_m=0.14) for i, (x, y, a) in enumerate(rays)
    ]
    return Scene(Arena((2.5, 2.5), 0.5, TEXTURES, floor, boxes), Robot(0.165, 0.05, 0.005, tuple(whiskers)), prior)


def compose(a, b):
    c, s = math.cos(a[2]), math.sin(a[2])
    return np.array([a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], a[2] + b[2]])


def ray_range(arena: Arena, x, y, heading, reach) -> float:
    """First contact along a ray by sampling every 0.5 mm; inf beyond reach."""
    along = np.arange(0.0, reach, 0.0005)
    px, py = x + along * math.cos(heading), y + along * math.sin(heading)
    hit = (px <= 0) | (px >= arena.size_m[0]) | (py <= 0) | (py >= arena.size_m[1])
    for a, b, c, d in arena.obstacles:
        hit |= (px >= a) & (px <= c) & (py >= b) & (py <= d)
    return float(along[hit.argmax()]) if hit.any() else math.inf


@dataclass
class Explorer:
    """The robot in its world; `row` lets 0.1 s pass and reports it."""

    scene: Scene
    world: World
    rng: np.random.Generator
    pose: np.ndarray
    state: str = "forward"
    goal: float = 1.0
    sign: float = 1.0
    pushed: float = 0.0
    whisker: int = -1
    reading: tuple[int, float] | None = None
    pending: np.ndarray = field(default_factory=lambda: np.zeros(3))
    drift: dict = field(default_factory=dict)

    def __post_init__(self):
        self.run_gain = 1 + self.world.scale + self.rng.normal(0, self.world.odometry / 2, 2)
        self.gain = self._new_gain()
        self.rays = self.scene.robot.of_role("object")
        self.tips = self.scene.robot.of_role("texture")

    def _new_gain(self):
        return self.run_gain * (1 + np.clip(self.rng.normal(0, self.world.odometry, 2), -0.05, 0.05))

    def ranges(self) -> np.ndarray:
        bases = [compose(self.pose, (*w.base_m, w.yaw_rad)) for w in self.rays]
        return np.array([ray_range(self.scene.arena, *b, w.length_m) for b, w in zip(bases, self.rays, strict=True)])

    def _enter(self, state: str, goal: float = 0.0) -> None:
        self.state, self.goal, self.gain = state, goal, self._new_gain()

    def _turn(self, low: float, high: float) -> None:
        self._enter("turn", math.radians(self.rng.uniform(low, high)))
        self.sign = self.rng.choice([-1.0, 1.0])

    def _drive(self, v: float, omega: float) -> bool:
        """Moves for one fine step; False when the body is blocked."""
        step = np.array([v * FINE_S, 0.0, omega * FINE_S])
        moved = compose(self.pose, step)
        if not self.scene.arena.is_free(moved[0], moved[1], self.scene.robot.body_radius_m):
            return False
        self.pose = moved
        self.pending = compose(self.pending, step * [self.gain[0], 0.0, self.gain[1]])
        return True

    def fine(self) -> None:
        getattr(self, f"_{self.state}")()

    def _forward(self) -> None:
        free = self._drive(FORWARD_M_S, 0.0)
        self.goal -= FORWARD_M_S * FINE_S
        deep = self.ranges() < 0.14 - PRESS_M
        if deep.any():
            self.whisker = int(deep.argmax())
            self._enter("back", 0.12)
        elif not free:
            self._enter("clear", 0.08)
        elif self.goal <= 0:
            self._turn(25, 100)

    def _back(self) -> None:
        free = self._drive(-0.05, 0.0)
        self.goal -= 0.05 * FINE_S
        if not free or self.goal <= 0:
            self._enter("clear", 0.08)
        elif not np.isfinite(self.ranges()).any():
            self.sign = -1.0 if self.rays[self.whisker].base_m[1] > 0 else 1.0
            self._enter("whisk", math.radians(45))

    def _whisk(self) -> None:
        self._drive(0.0, self.sign * WHISK_RAD_S)
        self.goal -= WHISK_RAD_S * FINE_S
        touching = np.isfinite(self.ranges())
        if touching.any():
            self.whisker = int(touching.argmax())
            self._enter("push", PUSH_RAD)
        elif self.goal <= 0:
            self._enter("clear", 0.08)

    def _push(self) -> None:
        self._drive(0.0, self.sign * WHISK_RAD_S)
        self.goal -= WHISK_RAD_S * FINE_S
        if self.goal <= 0:
            self._enter("out", math.radians(25))

    def _out(self) -> None:
        before = self.ranges()[self.whisker]
        self._drive(0.0, -self.sign * WHISK_RAD_S)
        self.goal -= WHISK_RAD_S * FINE_S
        if not np.isfinite(self.ranges()[self.whisker]):
            if np.isfinite(before) and self.rng.random() >= self.world.miss:
                self.reading = (self.whisker, before + self.rng.normal(0, self.world.radial_sigma_m))
            self._enter("hold", 0.1)
        elif self.goal <= 0:
            self._enter("clear", 0.08)

    def _hold(self) -> None:
        self.goal -= FINE_S
        if self.goal <= 0:
            self._enter("clear", 0.08)

    def _clear(self) -> None:
        free = self._drive(-FORWARD_M_S, 0.0)
        self.goal -= FORWARD_M_S * FINE_S
        if not free or self.goal <= 0:
            self._turn(60, 180)

    def _turn_state(self) -> None:
        self._drive(0.0, self.sign * TURN_RAD_S)
        self.goal -= TURN_RAD_S * FINE_S
        if self.goal <= 0:
            self._enter("forward", FORWARD_M_S * self.rng.uniform(2.5, 6.0))

    def row(self):
        """One row: odometry (3,), texture (tips, 3), radial_m (rays,), truth (3,)."""
        states = set()
        for _ in range(round(ROW_S / FINE_S)):
            states.add(self.state)
            self._turn_state() if self.state == "turn" else self.fine()
        whisking = bool(states & {"back", "whisk", "push", "out", "hold"})
        texture = np.full((len(self.tips), 3), np.nan)
        radial = np.full(len(self.rays), np.nan)
        odometry = np.zeros(3)
        if not whisking or self.reading:
            odometry, self.pending = self.pending, np.zeros(3)
            radial = np.where(np.isfinite(self.ranges()), np.nan, np.inf)
        if self.reading:
            radial[self.reading[0]] = min(self.reading[1], 0.2)
            self.reading = None
        if len(states) == 1 and states <= {"forward", "turn"}:
            texture = np.array([self._window(n) for n in range(len(self.tips))])
        if self.rng.random() < self.world.ghost:
            radial[self.rng.integers(len(radial))] = self.rng.uniform(0.02, 0.14)
        return odometry, texture, radial, self.pose.copy()

    def _window(self, tip: int) -> np.ndarray:
        """Log-likelihoods as a naive Bayes makes them: tens of nats apart, wrong in runs, wrong while caught."""
        x, y, _ = compose(self.pose, (*self.scene.robot.of_role("texture")[tip].tip_m, 0.0))
        arena = self.scene.arena
        column, line = (int(np.clip(v // arena.tile_m, 0, 4)) for v in (x, y))
        true = arena.floor_indices()[line][column]
        memory = self.drift.setdefault(tip, {"tile": (column, line), "wrong": 0, "as": 0})
        crossed, memory["tile"] = memory["tile"] != (column, line), (column, line)
        share = 1 - self.world.accuracy
        if memory["wrong"] == 0 and crossed and self.rng.random() < self.world.catch:
            memory["wrong"], memory["as"] = int(self.rng.integers(3, 10)), int(self.rng.integers(3))
        elif memory["wrong"] == 0 and self.rng.random() < share / (self.world.error_rows * self.world.accuracy):
            memory["wrong"] = 1 + self.rng.poisson(self.world.error_rows - 1)
            memory["as"] = int((true + self.rng.integers(1, 3)) % 3)
        said = memory["as"] if memory["wrong"] else true
        memory["wrong"] = max(0, memory["wrong"] - 1)
        loglik = -10.0 - self.rng.exponential(40.0, 3)
        loglik[said] = 0.0
        return loglik - 700.0


def record(seed: int, rows: int = 600, world: World | None = None, wrong_m: float = 0.2, wrong_deg: float = 10.0):
    """A scene whose Gaussian prior is wrong by that much, and its observations with the truth."""
    rng = np.random.default_rng(seed)
    scene = random_scene(rng)
    start = np.array([1.25, 0.85, rng.uniform(-math.pi, math.pi)])
    explorer = Explorer(scene, world or World(), rng, start.copy())
    side = rng.uniform(-math.pi, math.pi)
    off = [wrong_m * math.cos(side), wrong_m * math.sin(side), math.radians(wrong_deg) * rng.choice([-1, 1])]
    mean = tuple(float(v) for v in start + off)
    scene = Scene(scene.arena, scene.robot, Prior("gaussian", mean, (0.15, 0.15, 0.2)))
    taken = [explorer.row() for _ in range(rows)]
    t_s = np.round((np.arange(rows) + 1) * ROW_S, 4)
    columns = [np.array(column) for column in zip(*taken, strict=True)]
    return scene, Observations(t_s, [f"{t:g}" for t in t_s], *columns)
