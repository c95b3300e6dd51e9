"""A made-up run of the robot for tests of whisker-view: the messages that pilot, navigator and simulation would send."""

import math
import os
import time
from collections import defaultdict
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from linkkit import sample

from crunchbot import observation as o
from crunchbot.robot.network import messages as m
from crunchbot.robot.network.inbox import Inbox
from crunchbot.robot.network.rows import between
from crunchbot.robot.network.streams import envelopes
from crunchbot.scene import Arena, Scene
from crunchbot.view.hub import Hub
from crunchbot.view.robot import RobotModel
from crunchbot.view.robot_source import InboxSource
from crunchbot.view.server import serving
from crunchbot_lab.simulation.scenes import make_robot

ROW_NS = 10**8
ARENA = Arena(
    (2.5, 2.5),
    0.5,
    ("VINYL", "SMOOTH", "ROUGH"),
    ("VSRVS", "RVSSR", "SRVRV", "VVSRS", "SRRVV"),
    ((0.5, 1.5, 1.0, 2.0), (1.5, 1.0, 2.0, 1.5), (0.5, 0.0, 1.0, 0.5)),
)
SCENE = Scene(ARENA, make_robot())
DOINGS = (("FORWARD", "the way ahead is free"), ("TURN", "the whisk is over"), ("FORWARD", "turned far enough"))
ROUTE = [(0.25, 0.25), (0.25, 1.2), (1.325, 1.2), (1.25, 1.25), (1.25, 2.325), (2.325, 2.25), (2.25, 0.4), (1.4, 0.3)]
SPEED_M_S = 0.12
REST_S = 1.0


def route(t_s: float) -> tuple[float, float, float]:
    """The true pose: along the route and back, ever again. At each corner the robot rests and turns."""
    way = [*ROUTE, *ROUTE[-2:0:-1], ROUTE[0]]
    legs = [(a, b, math.dist(a, b) / SPEED_M_S) for a, b in zip(way, way[1:], strict=False)]
    headings = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b, _ in legs]
    turns = [math.remainder(b - a, math.tau) for a, b in zip(headings, headings[1:] + headings[:1], strict=True)]
    laps, left = divmod(t_s, sum(long + REST_S for _, _, long in legs))
    leg = 0
    while left > legs[leg][2] + REST_S:
        left -= legs[leg][2] + REST_S
        leg += 1
    a, b, long = legs[leg]
    x, y = (a[k] + (b[k] - a[k]) * min(1.0, left / long) for k in (0, 1))
    turned = laps * sum(turns) + sum(turns[:leg]) + turns[leg] * max(0.0, left - long) / REST_S
    return x, y, headings[0] + turned


def estimate(t_s: float) -> tuple[float, float, float]:
    """The truth with an error that begins large, shrinks, and wanders."""
    x, y, theta = route(t_s)
    off = 0.15 * math.exp(-t_s / 12) + 0.02
    return x + off * math.sin(0.3 * t_s), y + off * math.cos(0.23 * t_s), theta + 0.06 * math.sin(0.2 * t_s)


def at(pose, place) -> tuple[float, float]:
    """A place of the robot's frame in the arena's."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return pose[0] + place[0] * c - place[1] * s, pose[1] + place[0] * s + place[1] * c


def texture_at(x: float, y: float) -> str:
    column, row = (min(4, max(0, int(v / ARENA.tile_m))) for v in (x, y))
    return ARENA.floor[4 - row][column]


@cache
def reach(ray, row: int) -> float | None:
    """How far out on a whisker, m, something begins at the time of a row; None: it is free."""
    true = route(row / 10)
    for n in range(1, 15):
        out = ray.length_m * n / 14
        x, y = at(true, (ray.base_m[0] + out * math.cos(ray.yaw_rad), ray.base_m[1] + out * math.sin(ray.yaw_rad)))
        if not ARENA.is_free(x, y, 0.0):
            return out
    return None


def belief_message(stamp_ns: int, places, seed: int = 1, number: int = 400, mass: float = 1.0) -> m.Belief:
    """Poses about each of `places` (share, x, y, theta, sigma_m), heaviest first."""
    rng = np.random.default_rng(seed)
    rows = []
    for share, x, y, theta, sigma in places:
        n = max(1, round(number * share))
        around = rng.normal((x, y, theta), (sigma, sigma, 0.15), (n, 3))
        rows.append(np.column_stack([around, np.full(n, share / n), np.full(n, 0.02), np.full(n, 0.1)]))
    columns = np.concatenate(rows).T.astype(np.float32)
    return m.Belief(m.Header.at(stamp_ns, "map"), "adaptive", stamp_ns // ROW_NS, columns.shape[1], mass, *columns)


@dataclass
class MadeUpRun:
    """`messages(row)` gives what is sent for a row; `skip` are rows that are lost on the way."""

    seed: int = 1
    simulated: bool = True
    skip: set[int] = field(default_factory=set)

    def messages(self, row: int) -> list[tuple[str, object]]:
        """(topic, message) in the order they are sent."""
        stamp = row * ROW_NS
        reported: list[tuple[str, object]] = []
        if row not in self.skip:
            reported.append(("observation", self.observation(row)))
        reported += [("localisation", self.localisation(row))] + self.contact(row)
        if self.simulated:
            reported.append(("truth", m.PoseStamped(m.Header.at(stamp, "map"), m.Pose.planar(*route(stamp / 1e9)))))
        if row % 5 == 0:
            reported.append(("belief", self.belief(row)))
        if row % 10 == 0:
            reported += [(f"health/{name}", self.health(name, row)) for name in ("pilot", "navigator")]
        if row % 100 == 0:
            doing = DOINGS[row // 100 % len(DOINGS)]
            reported.append(("behaviour", m.Behaviour(m.Header.at(stamp), doing[0], m.Time.of(stamp), doing[1])))
        return reported

    def observation(self, row: int) -> m.Observation:
        rng = np.random.default_rng((self.seed, row))
        names, cells, values = [], [], []
        true = route(row / 10)
        whisking = row % 100 > 85
        for tip in SCENE.robot.of_role("texture"):
            under = texture_at(*at(true, tip.tip_m))
            for name in ARENA.textures:
                names.append(f"{tip.name}_{name}")
                cells.append(o.EMPTY if whisking else o.VALUE)
                values.append(0.0 if whisking else float(rng.normal(-1.0 if name[0] == under else -6.0, 0.8)))
        for ray in SCENE.robot.of_role("object"):
            radius = None if whisking else reach(ray, row)
            names.append(f"{ray.name}_mm")
            cells.append(o.NOT_READ if whisking else o.EMPTY if radius is None else o.VALUE)
            values.append(1e3 * (radius or 0.0))
        kind = o.WHISK if whisking else o.EXPLORING
        before, pose = (between(route(0.0), route(max(0, n) / 10)) for n in (row - 1, row))
        motion = between(before, pose)
        return m.Observation(
            m.Header.at(row * ROW_NS), row, kind, motion, pose, names, np.array(cells, np.uint8), np.array(values)
        )

    def localisation(self, row: int) -> m.Localisation:
        t_s = row / 10
        sigma = 0.12 * math.exp(-t_s / 12) + 0.02
        pose = m.PoseWithCovariance.planar(estimate(t_s), np.diag([sigma**2, sigma**2, 0.01]))
        confidence = min(0.97, 1.0 - 0.75 * math.exp(-t_s / 9)) - 0.3 * math.exp(-(((t_s - 30) / 3) ** 2))
        missed = len([k for k in self.skip if k < row])
        header = m.Header.at(row * ROW_NS, "map")
        return m.Localisation(header, "adaptive", pose, confidence, row, 1, 0, missed, 0, "scene")

    def contact(self, row: int) -> list[tuple[str, m.Contact]]:
        """The state of each object whisker: a touch that begins, is measured a row later, or is over."""
        return [("contact", reported) for ray in SCENE.robot.of_role("object") if (reported := self.touch(ray, row))]

    def touch(self, ray, row: int) -> m.Contact | None:
        began = row
        while began > 0 and reach(ray, began - 1) is not None:
            began -= 1
        radius = reach(ray, row)
        header, onset = m.Header.at(row * ROW_NS), m.Time.of(began * ROW_NS)
        if radius is None:
            return None if began == row else m.Contact(header, ray.name, False, onset, m.Time.of(row * ROW_NS))
        if row - began > 1:
            return None
        tip = radius > 0.6 * ray.length_m
        measured = (True, radius, 0.0014, m.TIP if tip else m.SHAFT, m.FACE if tip else m.CORNER) if row > began else ()
        return m.Contact(header, ray.name, True, onset, m.Time(), *measured)

    def belief(self, row: int) -> m.Belief:
        """About the estimate, and for half a minute also about the place that looks alike."""
        x, y, theta = estimate(row / 10)
        sigma = 0.1 * math.exp(-row / 120) + 0.025
        other = max(0.0, 0.45 - row / 1200)
        places = [(1.0 - other, x, y, theta, sigma)]
        if other > 0.02:
            places.append((other, 0.28 + 0.2 * y, 0.9 + 0.1 * x, theta + 2.0, 1.6 * sigma))
        return belief_message(row * ROW_NS, places, seed=row)

    def health(self, name: str, row: int) -> m.ProcessHealth:
        counts = {"pilot": {"rows": row, "contacts": row // 100}, "navigator": {"rows": row, "step_us": 240}}[name]
        pairs = [m.KeyValue(key, str(value)) for key, value in counts.items()]
        return m.ProcessHealth(m.Header.at(row * ROW_NS), name, 4000 + len(name), "running", pairs)


class Clock:
    """A monotonic clock that stands until it is moved."""

    def __init__(self):
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


def touch_map(tiles=(), faces=(), corners=(), seq: int = 11) -> m.TouchMap:
    """A mapper's map of these things, each a row of its group's fields, in their order."""
    groups = [np.array(rows, float).reshape(-1, n).T for rows, n in ((tiles, 4), (faces, 7), (corners, 3))]
    columns = [column for group in groups for column in group]
    return m.TouchMap(m.Header.at(ROW_NS), seq, 0, ["VINYL", "ROUGH"], np.array([0.0, 0.1, 0.2, 0.5]), *columns)


class Post:
    """A robot without a network: what is posted is in `source`, as bytes that are yet to be decoded."""

    def __init__(self):
        self.inbox = Inbox("whisker/robot/", 10_000)
        self.poses: list[tuple[float, float, float]] = []  # that pages have sent
        self.source = InboxSource("robot", self.inbox, "Listening at nothing", set_pose=self.poses.append)
        self._streams = defaultdict(envelopes)

    def put(self, topic: str, message, encoding: str | None = None, data: bytes | None = None) -> None:
        """A message, or in its place any `data` of any `encoding`."""
        self.inbox.put(sample(f"whisker/robot/{topic}", message, next(self._streams[topic]), encoding, data))

    def play(self, run, rows: range, model: RobotModel) -> None:
        """All of these rows straight into a model."""
        for row in rows:
            for topic, message in run.messages(row):
                self.put(topic, message)
            for topic, message in self.source.poll():
                model.take(topic, message)


@asynccontextmanager
async def robot_view(
    post: Post, scene: Scene | None = SCENE, run=None, rows: int = 0, may_set_pose: bool = True, clock=time.monotonic
):
    """A server that shows this robot; gives its port and hub. `run`: MadeUpRun or the like, whose
    first rows it has received."""
    hub = Hub([f"whisker-test-no-ring-{os.getpid()}"], post.source, scene, may_set_pose=may_set_pose)
    hub.robot._clock = clock
    post.play(run or MadeUpRun(), range(rows), hub.robot)
    async with serving(hub, "127.0.0.1", 0, []) as port:
        yield port, hub
