"""The netbook's part: samples and odometry in, wheel speeds and observation rows out. Knows no device and no world.

The row of every 0.1 s is one of five kinds:
    exploring         odometry, texture of the last 200 samples while the tips sweep at the trained speed, radial cells
                      empty (read, no contact) or nan (touching: no measured distance)
    body whisk        zero odometry, texture empty, radial cells nan
    release in it     odometry since the last row that carried any, and the distance of each whisker measured
    first after it    odometry since the release
    carried           the base says that it may be anywhere: odometry infinite, nothing read

Where an object whisker's model holds its plug, a row that carries motion also reports the direction of the surface that is
touched or was just let go, and where. Where it has a texture model, rows carry the texture of the face that its tip swept
along in the last 200 samples.
"""

import math
from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import observation
from ..observation import CARRIED, EXPLORING, NORMAL, POINT, RELEASE, WHISK, Layout, Quantity, Row
from ..touch.contact import Contact
from ..touch.contact_filter import SURE
from ..touch.floor import WINDOW_LEAST_GOOD, WINDOW_SAMPLES, floor_whisker
from ..touch.mount import Mount
from ..touch.radial.model import Contact as Recorded
from ..touch.radial.model import estimate, peak
from .behaviour import BLOCK_TICKS, TICK_S, Behaviour, Habits, Whisk
from .feel import Drives, Feeler, Felt
from .states import FULL
from .tip import contact_type, move_for_tip
from .wheels import EXACT, NO_BUMPS, Bumps, Wheels

SETTLE_TICKS = 100  # the wheels' last change of speed must be this much older than a texture window
NOWHERE = Felt(0, (math.nan, math.nan), math.inf)
CATCH_WINDOWS = 8  # in a row without evidence, wheels driving and samples good: an edge crossed in passing holds the tip for half of it


class Pilot:
    """One robot's decisions. The same seed, samples and odometry always give the same drives and rows."""

    def __init__(
        self,
        robot: Any,
        texture_models: dict,
        radial_models: dict,
        seed: int,
        wheels: Wheels = EXACT,
        habits: Habits = FULL,
    ):
        """`robot.whiskers` in lane order; models by whisker name: texture models of the floor, and of faces for any object
        whisker; radial ones of any kind, calibrated at the rate of whisking of `wheels`; `seed` of the random turns."""
        self.names = {lane: whisker.name for lane, whisker in enumerate(robot.whiskers)}
        self.texture_lanes = [n for n, w in enumerate(robot.whiskers) if w.role == "texture"]
        self.floor_sides = {lane: math.copysign(1.0, robot.whiskers[lane].tip_m[1]) for lane in self.texture_lanes}
        self.object_lanes = [n for n, w in enumerate(robot.whiskers) if w.role == "object"]
        self.radial_models = radial_models
        self.contacts = {lane: Contact() for lane in self.object_lanes}
        self.mounts = {lane: Mount.of(robot.whiskers[lane]) for lane in self.object_lanes}
        self.feelers = {
            lane: Feeler(robot.whiskers[lane], self.mounts[lane].calibrated_turn, model.plug, wheels.whisk_rad_s)
            for lane in self.object_lanes
            if (model := radial_models.get(self.names[lane])) and model.plug
        }
        self._drives = Drives()
        self._sure_m = robot.radial_sigma_m  # filters take distances to be as good as this
        first_turn = {lane: mount.corner_turn for lane, mount in self.mounts.items()}
        sides = {lane: -mount.face_turn for lane, mount in self.mounts.items()}
        rng = np.random.default_rng(seed)
        self.behaviour = Behaviour(self.contacts, first_turn, rng, sides, wheels, habits)
        self.face_lanes = [lane for lane in self.object_lanes if self.names[lane] in texture_models]
        self.surfaces = {
            lane: floor_whisker(texture_models[self.names[lane]], np.random.default_rng([seed, lane]))
            for lane in (*self.texture_lanes, *self.face_lanes)
        }
        self.layout = self._layout()
        self.bad_samples = 0
        self.whisks: list[dict] = []  # every whisk that was pushed to its end: see `_measure`
        self._recent = deque(maxlen=WINDOW_SAMPLES // BLOCK_TICKS)  # of the last 0.1 s: (samples, good) of all lanes
        self._whisk_samples: list[
            tuple[np.ndarray, np.ndarray]
        ] = []  # ticks and samples of the whisker that began the whisk
        self._whisk: Whisk | None = None  # whose they are
        self._silent = dict.fromkeys(self.texture_lanes, 0)  # windows in a row without evidence
        self._measured: dict[int, tuple[int, float]] = {}  # lane: release tick, mm
        self._pending = np.zeros(3)  # motion not yet in a row, in the frame of the last row that carried any
        self._was_whisking = False

    def _layout(self) -> Layout:
        """Columns of the rows: floor textures, textures of faces, distances, and how surfaces lie."""
        columns = []
        for lane in self.texture_lanes:
            columns += observation.textures(self.names[lane], self.surfaces[lane].model.classes)
        for lane in self.face_lanes:
            classes = self.surfaces[lane].model.classes
            columns += observation.textures(self.names[lane], classes, Quantity.SURFACE)
        columns += [observation.distance(self.names[lane]) for lane in self.object_lanes]
        for lane in self.feelers:
            columns += observation.normal(self.names[lane]) + observation.point(self.names[lane])
        return Layout(columns)

    @property
    def changed(self) -> str:
        """A line where a floor whisker, its mount or its speed is not its model's; else empty."""
        lines = (f"{self.names[n]}: {self.surfaces[n].changed}" for n in self.texture_lanes if self.surfaces[n].changed)
        return next(lines, "")

    def block(self, first_tick: int, alpha: np.ndarray, beta: np.ndarray, status: np.ndarray) -> tuple[float, float]:
        """Decide on the 40 ticks from `first_tick`: arrays (40, lanes) of counts and status -> v in m/s, omega in rad/s."""
        lanes, good = len(self.names), np.asarray(status)[:, : len(self.names)] == 0
        samples = np.empty((lanes, len(good), 2)).swapaxes(0, 1)  # those of one lane lie together
        samples[:, :, 0], samples[:, :, 1] = alpha[:, :lanes], beta[:, :lanes]
        ticks = np.arange(first_tick, first_tick + len(good))
        self.bad_samples += int(good.size - np.count_nonzero(good))
        self._recent.append((samples, good))
        for lane, contact in self.contacts.items():
            contact.block(ticks, samples[:, lane], good[:, lane])
        if any(self.behaviour.drive):
            for lane in self.texture_lanes:
                self.surfaces[lane].follow(samples[good[:, lane], lane])
        for lane, feeler in self.feelers.items():
            same = self.behaviour.whisk is not None and self.behaviour.whisk.lane == lane
            feeler.block(ticks, samples[:, lane], good[:, lane], self.contacts[lane], self._drives, same)
        self._follow_whisk(ticks, samples, good)
        drive = self.behaviour.decide(int(ticks[-1]))
        self._drives.order(self.behaviour.drive_since, drive)
        return drive

    def odometry(self, tick: int, dx: float, dy: float, dtheta: float, bumps: Bumps = NO_BUMPS) -> Row:
        """The observation row of the 0.1 s that end at `tick`; motion in the robot frame at their start."""
        self.behaviour.moved(tick, dx, dy, dtheta, bumps)
        if bumps.carried:
            return self._carried(tick)
        self._pending = compose(self._pending, (dx, dy, dtheta))
        whisking = self.behaviour.whisking
        released = {n: m for n, m in self._measured.items() if m[0] <= tick}
        held_back = whisking and not released
        moved = np.zeros(3) if held_back else self._pending
        if not held_back:
            self._pending = np.zeros(3)
        cells: list[float | None] = []
        for lane in self.texture_lanes:
            cells += self._texture_cells(lane, tick, held_back=whisking or self._was_whisking)
        for lane in self.face_lanes:
            cells += self._surface_cells(lane, tick)
        cells += [self._radial_cell(lane, released, whisking) for lane in self.object_lanes]
        for lane in self.feelers:
            cells += _felt_cells(None if held_back else self._felt(lane, tick, released))
        for lane in released:
            del self._measured[lane]
        self._was_whisking = whisking
        measured = any(math.isfinite(distance) for _, distance in released.values())
        kind = RELEASE if measured else WHISK if whisking else EXPLORING
        return Row.made(kind, round((tick + 1) * TICK_S, 4), moved, self.layout.names, cells)

    def _carried(self, tick: int) -> Row:
        """The row of a robot that may be anywhere; what was felt and moved before says nothing of there."""
        self._pending = np.zeros(3)
        self._measured.clear()
        for lane in self.texture_lanes:
            self._texture_cells(lane, tick, held_back=True)
        distances = self.layout.of(Quantity.DISTANCE)
        nothing = [math.nan if name in distances else None for name in self.layout.names]
        return Row.made(CARRIED, round((tick + 1) * TICK_S, 4), [math.inf] * 3, self.layout.names, nothing)

    def _follow_whisk(self, ticks, samples, good) -> None:
        """Gather the whisk's samples; once a whisker that was pushed long enough lets go, its distance is known."""
        whisk = self.behaviour.whisk
        if whisk is not self._whisk:
            self._whisk = whisk
            self._whisk_samples.clear()
        if whisk is None or whisk.start < 0:
            return
        use = good[:, whisk.lane]
        self._whisk_samples.append((ticks[use], samples[use, whisk.lane]))
        contact = self.contacts[whisk.lane]
        pushed = whisk.start < contact.onset <= whisk.push_end - self.behaviour.wheels.push_ticks
        if pushed and contact.release > contact.onset and not whisk.measured:
            whisk.measured = True
            self._measure(whisk)

    def _measure(self, whisk: Whisk) -> None:
        """Tell the distance and what kind of contact it was; after one of the shaft, how the tip gets there.

        Of a whisk: whisker, onset and release (ticks), turn, peak_counts, line_mm (the model's own answer), sigma_mm
        (of the distance), distance_mm and type ("tip" or "shaft"; None: unsure), tries (whisks before it at the same object), face (probability
        that the tip is on a surface, by the contact filter; nan: not known).
        """
        lane, turn = whisk.lane, whisk.direction
        contact, mount, model = self.contacts[lane], self.mounts[lane], self.radial_models[self.names[lane]]
        ticks, samples = joined(self._whisk_samples)
        push = (ticks >= contact.onset) & (ticks < contact.onset + self.behaviour.wheels.push_ticks)
        counts = peak(samples[push], contact.rest)
        recorded = Recorded(ticks * TICK_S, samples, np.full(len(ticks), self.behaviour.wheels.whisk_rad_s))
        reported = estimate(model, recorded, counts)
        sigma_mm, face = reported.sigma_mm, math.nan
        if lane in self.feelers:
            distance, sigma_mm, face = self._felt_distance(lane)
        else:
            distance = mount.distance(reported.radius_mm, turn)
        kind = contact_type(mount, distance)
        if distance is not None:
            self._measured[lane] = (contact.release, distance)
        if kind == "shaft" and (move := move_for_tip(mount, distance)):
            self.behaviour.aim(move)
        made = {"whisker": self.names[lane], "onset": contact.onset, "release": contact.release, "turn": turn}
        made |= {
            "peak_counts": counts,
            "line_mm": reported.radius_mm,
            "sigma_mm": sigma_mm,
            "distance_mm": distance,
        }
        self.whisks.append(made | {"type": kind, "tries": whisk.tries, "face": face})

    def _felt_distance(self, lane: int) -> tuple[float | None, float, float]:
        """Distance (None: unsure) and its deviation, mm, by the contact filter at the release; probability of a face."""
        bent, last, release = self.feelers[lane].bent, self.feelers[lane].last, self.contacts[lane].release
        model, wheels = self.radial_models[self.names[lane]], self.behaviour.wheels
        nearest = model.known_mm[0]
        pushed = wheels.push_ticks * TICK_S * wheels.whisk_rad_s
        if bent is None or self.feelers[lane].most > pushed * model.plug.most(nearest):
            return None, math.nan, math.nan  # bent more than any corner would that was calibrated: caught
        here = last.after(self._drives.since(last.tick, release), release) if last else NOWHERE
        faces = (bent.face, last.face) if last else (bent.face,)
        distance = self.mounts[lane].felt(faces, here.point, here.point_sd, nearest, self._sure_m)
        return distance, 1e3 * (here if last else bent).point_sd, bent.face

    def _texture_cells(self, lane: int, tick: int, held_back: bool) -> list[float | None]:
        whisker = self.surfaces[lane]
        if held_back or not self._sweeping(tick):
            whisker.pause()
            self._silent[lane] = 0
            return _likelihoods(whisker, None)
        window = self._window(lane)
        loglik = whisker.look(window)
        self._notice_catch(lane, window)
        return _likelihoods(whisker, loglik)

    def _window(self, lane: int) -> np.ndarray:
        """(n, 2) samples of the last 0.1 s, nan where one is bad."""
        return np.concatenate([np.where(good[:, lane, None], s[:, lane], np.nan) for s, good in self._recent])

    def _surface_cells(self, lane: int, tick: int) -> list[float | None]:
        """What the window says of the face that an object whisker's tip sweeps along."""
        whisker = self.surfaces[lane]
        if not self._along_face(lane, tick):
            whisker.pause()
            return _likelihoods(whisker, None)
        return _likelihoods(whisker, whisker.look(self._window(lane)))

    def _along_face(self, lane: int, tick: int) -> bool:
        """Whether the whisker touched during the whole window, the wheels at one speed; and by its tip, which slides, where that
        is known."""
        since = max(self.contacts[lane].onset, self.behaviour.drive_since + SETTLE_TICKS)
        steady = any(self.behaviour.drive) and since <= tick + 1 - WINDOW_SAMPLES
        felt = self.feelers[lane].felt if lane in self.feelers else None
        return steady and self.contacts[lane].touching and (felt is None or min(felt.face, felt.slip) >= SURE)

    def _notice_catch(self, lane: int, window: np.ndarray) -> None:
        """A catch leaves good samples without evidence, window after window; a surface never trained does not."""
        few = np.count_nonzero(np.isfinite(window).all(axis=1)) < WINDOW_LEAST_GOOD
        reported = few or not self.surfaces[lane].silent
        self._silent[lane] = 0 if reported else self._silent[lane] + 1
        if self._silent[lane] >= CATCH_WINDOWS:
            self._silent[lane] = 0
            self.behaviour.catch(self.floor_sides[lane])

    def _sweeping(self, tick: int) -> bool:
        """Whether the tips moved over the floor at the speed they were trained at during the whole window."""
        v, omega = self.behaviour.drive
        steady = self.behaviour.drive_since + SETTLE_TICKS <= tick + 1 - WINDOW_SAMPLES
        return steady and self.behaviour.wheels.sweeps(v, omega)

    def _felt(self, lane: int, tick: int, released: dict) -> Felt | None:
        """What a whisker touches, or has just let go, from where the robot is at `tick`."""
        felt = self.feelers[lane].felt
        if felt is None or not (lane in released or self.contacts[lane].touching):
            return None
        return felt.after(self._drives.since(felt.tick, tick), tick)

    def _radial_cell(self, lane: int, released: dict, whisking: bool) -> float | None:
        if lane in released:
            return released[lane][1]
        if self.contacts[lane].touching or not self.contacts[lane].settled or (whisking and not released):
            return math.nan
        return None


def _likelihoods(whisker, loglik: np.ndarray | None) -> list[float | None]:
    """A cell for each class of a floor whisker's model."""
    return [None] * len(whisker.model.classes) if loglik is None else list(map(float, loglik))


def _felt_cells(felt: Felt | None) -> list[float | None]:
    """Cells of NORMAL and POINT."""
    if felt is None:
        return [None] * len(NORMAL + POINT)
    normal = (None, None) if math.isnan(felt.normal) else (felt.normal, felt.normal_sd)
    return [*normal, *felt.point, felt.point_sd]


def joined(blocks: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Ticks (n,) and samples (n, 2) of blocks in order."""
    ticks, samples = zip(*blocks, strict=True)
    return np.concatenate(ticks), np.concatenate(samples)


def compose(first: Sequence[float], then: Sequence[float]) -> np.ndarray:
    """Motion `first` followed by `then` (each x, y in m and theta in rad, in the frame at its own start)."""
    c, s = math.cos(first[2]), math.sin(first[2])
    return np.array([first[0] + c * then[0] - s * then[1], first[1] + s * then[0] + c * then[1], first[2] + then[2]])
