"""What is known of the robot: the newest of each topic, the paths, the contacts, and when each process last spoke.

Fed with the messages of crunchbot.robot.network.messages as they come; gives plain values for JSON. Nothing grows without bound,
nothing is guessed: what no message has reported is None. Metres, radians, seconds of the bridge's clock.
"""

import math
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..observation import NOT_READ, VALUE, Column, Quantity, parse
from ..robot.network.messages import CORNER, FACE, HEALTH, SHAFT, TIP, End
from ..robot.network.ros import Pose
from ..robot.network.rows import between, compose
from ..scene import FARTHEST_M, Scene
from .maps import map_parts
from .surfaces import Surfaces

PATH_MOST = 3000  # points kept: 5 minutes at 10 Hz
CONTACTS_MOST = 60
PROCESSES_MOST = 32
COUNTERS_MOST = 24
CELLS_MOST = 512
FILTERS_MOST = 16
TOUCHED = (Quantity.NORMAL, Quantity.POINT)  # shown as surfaces, not by whisker
TEXT_MOST = 200  # characters of any received text
COUNTER_TEXT_MOST = 80  # of a counter's name, and of its value
SILENT_S = 3.0  # a process speaks once a second
BACK_S = 2.0  # a clock that goes back so far has begun anew
EXPECTED = ("pilot", "navigator")  # shown as not heard, until they are
MAPPER, SAME_NS = "mapper", 1_000_000  # the filter's name in its answers; two stamps of one row
TRUTHS_MOST = 100  # kept for a mapper's answer of the same time: 10 s
KINDS = ("exploring", "body whisk", "after a whisk", "carried")  # by Row.kind
PARTS = {TIP: "tip", SHAFT: "shaft"}
SHAPES = {FACE: "face", CORNER: "corner"}


def real(value: Any, places: int = 3) -> float | None:
    """A number for JSON; None: it is none."""
    value = float(value)
    return round(value, places) if math.isfinite(value) else None


def text(value: str, most: int = TEXT_MOST) -> str:
    """One line of bounded length."""
    return " ".join(value[: 2 * most].split())[:most]


def _sorted(cells: list[tuple[Column, int, float]]) -> tuple[list[dict], list[dict]]:
    """Cells by whisker: those of texture whiskers, those of object whiskers."""
    tips, rays = {}, []
    for column, cell, value in cells:
        whisker = text(column.whisker)
        if column.quantity is Quantity.DISTANCE:
            state = {VALUE: "contact", NOT_READ: "unread"}.get(cell, "none")
            rays.append({"name": whisker, "state": state, "mm": real(value, 1) if cell == VALUE else None})
        else:
            tips.setdefault(whisker, []).append((text(column.what), real(value) if cell == VALUE else None))
    return [{"name": name, "loglik": values} for name, values in tips.items()], rays


def placed(pose: Any) -> dict | None:
    """x, y, theta of a Pose; None: it is of no place that a map can have."""
    place = pose.xytheta
    return dict(zip(("x", "y", "theta"), map(real, place), strict=True)) if max(map(abs, place)) <= FARTHEST_M else None


def _spread(covariance: np.ndarray) -> float | None:
    """One standard deviation of the place, m."""
    return real(math.sqrt(max(0.0, covariance[0, 0] + covariance[1, 1])))


class Path:
    """The newest points of a path, numbered from the first that ever was."""

    def __init__(self):
        self.points: deque[tuple] = deque(maxlen=PATH_MOST)
        self.end = 0

    def add(self, *values: Any) -> None:
        self.points.append(tuple(real(value) for value in values))
        self.end += 1

    def since(self, number: int, most: int) -> tuple[int, list[tuple]]:
        """(number of the first, points) from `number` on; later ones if those are gone."""
        first = max(number, self.end - len(self.points))
        at = first - (self.end - len(self.points))
        return first, [self.points[n] for n in range(at, min(at + most, len(self.points)))]


@dataclass
class Process:
    """One process as its last word had it."""

    pid: int = 0
    state: str = ""
    counters: dict[str, str] = field(default_factory=dict)
    error: str = ""
    heard: float | None = None  # time.monotonic
    restarts: int = 0
    ended: bool = False  # by a last word of its own


class RobotModel:
    """`take` every message; read the rest. `clock` is replaced by tests."""

    def __init__(self, scene: Scene | None = None, clock: Callable[[], float] = time.monotonic):
        self.scene, self._clock = scene, clock
        self.run = -1
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget all but the scene."""
        self.processes = {name: Process() for name in EXPECTED}
        self.run += 1
        self._heard: dict[str, float] = {}
        self._forget()

    def _forget(self) -> None:
        """All but health and scene: a run has begun."""
        self.now_s: float | None = None
        self.pose = self.truth = self.behaviour = self.row = self.belief = None
        self.grid = self.touched = None  # of a mapper
        self._anchor: tuple | None = None  # a true pose, and the mapper's at that time
        self._true: deque[tuple[int, tuple]] = deque(maxlen=TRUTHS_MOST)  # stamp, pose
        self.path, self.true_path = Path(), Path()
        self.contacts: dict[tuple[str, int], dict] = {}
        self.surfaces = Surfaces()
        self.rows = {"missed": None, "unseen": 0}
        self.filters: dict[str, dict] = {}  # the newest answer of each, the robot's first
        self._read_s: float | None = None  # of the last row in which a whisker read anything, or of the first row
        self._seq: int | None = None
        self._filter = ""

    def take(self, topic: str, message: Any) -> None:
        """A message of a topic of crunchbot.robot.network.messages.TOPICS, or of health; of any, an End."""
        kind = HEALTH if topic.startswith(f"{HEALTH}/") else topic
        if isinstance(message, End):
            return self._take_end(topic.removeprefix(f"{HEALTH}/"), message)
        take = getattr(self, f"_take_{kind}", None)
        if take is None:
            return
        if kind in ("observation", "truth"):
            self._tick(message.header.stamp.ns / 1e9)
        take(message)
        self._heard[kind] = self._clock()

    def age(self, *topics: str) -> float | None:
        """Seconds since something came of one of these topics (none: of any); None: never."""
        heard = [at for topic, at in self._heard.items() if topic in topics or not topics]
        return self._clock() - max(heard) if heard else None

    def _tick(self, stamp_s: float) -> None:
        if self.now_s is not None and stamp_s < self.now_s - BACK_S:
            self._forget()
            self.run += 1
        self.now_s = max(stamp_s, self.now_s or 0.0)

    def _take_observation(self, row) -> None:
        if self._seq is not None and row.seq > self._seq + 1:
            self.rows["unseen"] += row.seq - self._seq - 1
        self._seq = row.seq
        columns = map(self._column, row.names)
        cells = list(zip(columns, row.cells.tolist(), row.values.tolist(), strict=True))[:CELLS_MOST]
        tips, rays = _sorted([cell for cell in cells if cell[0].quantity not in TOUCHED])
        self.surfaces.take(row.seq, [cell for cell in cells if cell[0].quantity in TOUCHED])
        if self._read_s is None or VALUE in row.cells:
            self._read_s = row.header.stamp.ns / 1e9
        self.row = {"seq": row.seq, "kind": KINDS[row.kind], "tips": tips, "rays": rays}

    def unread_s(self) -> float | None:
        """Seconds of the robot's clock without a reading; None: no row has come."""
        return None if self._read_s is None else self.now_s - self._read_s

    def _column(self, name: str) -> Column:
        """The column of this name, by the scene's layout, or, without a scene, by the name alone."""
        known = self.scene.layout.get(name) if self.scene else None
        return known or parse(name)

    def _take_localisation(self, reported) -> None:
        """Of several filters the first is the one whose pose is the robot's."""
        self._filter = self._filter or reported.filter
        self._note_filter(reported)
        if reported.filter != self._filter:
            return
        self.rows["missed"] = reported.rows_missed
        self._note_mapper(reported)
        self.pose = placed(reported.pose.pose)
        if self.pose is None:
            return
        self.path.add(reported.header.stamp.ns / 1e9, *self.pose.values(), reported.confidence)
        covariance = reported.pose.planar_covariance
        self.pose |= {
            "sigma_m": _spread(covariance),
            "sigma_rad": real(math.sqrt(max(0.0, covariance[2, 2]))),
            "confidence": real(reported.confidence),
            "filter": text(reported.filter),
            "stamp_s": real(reported.header.stamp.ns / 1e9),
            "skipped": reported.rows_skipped,
            "first_seq": reported.first_seq,
            "prior": text(reported.prior),
        }
        self.surfaces.place(reported.observation_seq, self.pose)

    def _note_filter(self, reported) -> None:
        name, place = text(reported.filter), placed(reported.pose.pose)
        if place is not None and (name in self.filters or len(self.filters) < FILTERS_MOST):
            sigma_m = _spread(reported.pose.planar_covariance)
            self.filters[name] = {"name": name, "confidence": real(reported.confidence), "sigma_m": sigma_m} | place

    def _note_mapper(self, reported) -> None:
        """A mapper's frame is its own: the truth is shown in it, by the first row of which both are known."""
        if reported.filter != MAPPER or self._anchor:
            return
        wanted_ns = reported.header.stamp.ns
        true = next((pose for stamp_ns, pose in self._true if abs(stamp_ns - wanted_ns) <= SAME_NS), None)
        if true is not None:
            self._anchor, self.true_path = (true, reported.pose.pose.xytheta), Path()

    def _take_truth(self, reported) -> None:
        true = reported.pose.xytheta
        self._true.append((reported.header.stamp.ns, true))
        if self._anchor:
            reported.pose = Pose.planar(*compose(self._anchor[1], between(self._anchor[0], true)))
        elif self._filter == MAPPER:
            return
        self.truth = placed(reported.pose)
        if self.truth is not None:
            self.true_path.add(reported.header.stamp.ns / 1e9, *self.truth.values())

    def _take_belief(self, reported) -> None:
        if reported.filter == (self._filter or reported.filter):
            self.belief = reported

    def _take_map(self, reported) -> None:
        self.grid = reported

    def _take_touch_map(self, reported) -> None:
        self.touched = reported

    def _take_behaviour(self, reported) -> None:
        since = reported.since.ns / 1e9
        self.behaviour = {"state": text(reported.state), "since_s": real(since), "reason": text(reported.reason)}

    def _take_contact(self, reported) -> None:
        key = (reported.whisker, reported.onset.ns)
        contact = self.contacts.setdefault(key, {"x": None, "y": None})
        contact |= {
            "whisker": text(reported.whisker),
            "onset_s": real(reported.onset.ns / 1e9),
            "release_s": None if reported.touching else real(reported.release.ns / 1e9),
        }
        measured = {"radius_m": None, "sigma_m": None, "part": None, "surface": None}
        if reported.measured:
            measured = {"radius_m": real(reported.radius_m, 4), "sigma_m": real(reported.sigma_m, 5)}
            measured |= {"part": PARTS.get(reported.part), "surface": SHAPES.get(reported.shape)}
            contact["x"], contact["y"] = self._place(reported.whisker, reported.radius_m)
        contact |= measured if reported.measured or "part" not in contact else {}
        while len(self.contacts) > CONTACTS_MOST:
            del self.contacts[next(iter(self.contacts))]

    def _place(self, whisker: str, radius_m: float) -> tuple[float | None, float | None]:
        """Where on the map a contact so far out on a whisker is, if the robot is where it is estimated now."""
        named = [w for w in self.scene.robot.of_role("object") if w.name == whisker] if self.scene else []
        if not named or self.pose is None:
            return None, None
        base, yaw, theta = named[0].base_m, named[0].yaw_rad, self.pose["theta"]
        forward, left = base[0] + radius_m * math.cos(yaw), base[1] + radius_m * math.sin(yaw)
        x = self.pose["x"] + forward * math.cos(theta) - left * math.sin(theta)
        return real(x), real(self.pose["y"] + forward * math.sin(theta) + left * math.cos(theta))

    def _take_health(self, reported) -> None:
        name = text(reported.process) or "nameless"
        if name not in self.processes and len(self.processes) >= PROCESSES_MOST:
            return
        process = self.processes.setdefault(name, Process())
        if process.heard is not None and process.pid != reported.pid:
            process.restarts += 1
        process.pid, process.state, process.error = reported.pid, text(reported.state), text(reported.last_error)
        pairs = reported.counters[:COUNTERS_MOST]
        process.counters = {text(p.key, COUNTER_TEXT_MOST): text(p.value, COUNTER_TEXT_MOST) for p in pairs}
        process.heard, process.ended = self._clock(), False

    def _take_end(self, name: str, reported) -> None:
        """A process that ended in good order has a word for why; other streams end with it."""
        if name in self.processes:
            process = self.processes[name]
            process.ended, process.state = True, text(f"ended: {reported.reason}" if reported.reason else "ended")

    def health(self) -> list[dict]:
        """Every process, by name, with its age in whole seconds; but for a navigator whose place a mapper has taken."""
        known = dict(sorted(self.processes.items()))
        if MAPPER in known and known["navigator"].heard is None:
            del known["navigator"]
        return [self._process(name, process) for name, process in known.items()]

    def _process(self, name: str, process: Process) -> dict:
        age = None if process.heard is None else self._clock() - process.heard
        reported = {key: getattr(process, key) for key in ("pid", "state", "counters", "error", "restarts", "ended")}
        silent = age is not None and age > SILENT_S and not process.ended
        return {"name": name, "age_s": None if age is None else int(age), "silent": silent} | reported

    def touching(self) -> list[dict]:
        """Contacts that have no end yet."""
        return [contact for contact in self.contacts.values() if contact["release_s"] is None]

    def map(self) -> dict | None:
        """The newest map for JSON; None: no mapper has sent one."""
        return None if self.touched is None else map_parts(self.touched, self.grid)

    def belief_columns(self) -> np.ndarray:
        """(n, 6) float32 of the newest belief: x, y, theta, weight, sigma_m, sigma_rad."""
        reported = self.belief
        columns = (reported.x, reported.y, reported.theta, reported.weight, reported.sigma_m, reported.sigma_rad)
        return np.column_stack(columns).astype("<f4")
