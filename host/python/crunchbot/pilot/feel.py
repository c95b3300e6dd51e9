"""How the surface lies that an object whisker touches, reported in the robot's frame: the contact filter on a pilot's samples."""

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from ..scene import Whisker
from ..touch.contact import Contact
from ..touch.contact_filter import ContactFilter, Reports, settings_of
from ..touch.radial.plug import CREEP, Plug
from .states import TICK_S

REST_BLOCKS = 2  # that give the rest: creep of an earlier contact may be left in the samples
BLOCKS_BEFORE = REST_BLOCKS + 4  # the filter begins so long before the onset: it finds the touch in the noise itself
NOISE_COUNTS = 11.0  # of one sample (crunchbot.touch.contact)
LEAST_TICKS = 200  # of a contact, before which the ringing of the touch is stronger than the surface's vibration
MODEL_RAD = 0.05  # error of a normal beside what the filter states: it knows a calibrated whisker, not the whisker


class Drives:
    """The wheels' speeds as they were ordered, by the tick from which they are in effect."""

    def __init__(self):
        self._orders: deque[tuple[int, float, float]] = deque([(0, 0.0, 0.0)], maxlen=64)

    def order(self, tick: int, drive: tuple[float, float]) -> None:
        if drive != self._orders[-1][1:]:
            self._orders.append((tick, *drive))

    def at(self, ticks: np.ndarray) -> np.ndarray:
        """(n, 2) speeds, m/s and rad/s, during these ticks."""
        orders = np.array(self._orders)
        return orders[np.maximum(np.searchsorted(orders[:, 0], ticks, "right") - 1, 0), 1:]

    def since(self, tick: int, end: int) -> np.ndarray:
        """(3,) motion from the end of one tick to the end of another, in the robot's frame at the first."""
        v, omega = TICK_S * self.at(np.arange(tick + 1, end + 1)).T
        theta = np.cumsum(omega) - 0.5 * omega
        return np.array([np.sum(v * np.cos(theta)), np.sum(v * np.sin(theta)), np.sum(omega)])


@dataclass(frozen=True)
class Felt:
    """What was touched, in the robot's frame at the end of `tick`: the point and its deviation, m, the direction of the
    surface's outward normal and its deviation, rad (nan: a corner, or not known), the probabilities that the tip is on it and
    that it slides.
    """

    tick: int
    point: tuple[float, float]
    point_sd: float
    normal: float = math.nan
    normal_sd: float = math.nan
    face: float = 0.0
    slip: float = 0.0

    def after(self, motion: np.ndarray, tick: int) -> "Felt":
        """What was felt, as seen from where the robot is at `tick`, after this motion."""
        x, y = self.point[0] - motion[0], self.point[1] - motion[1]
        c, s = math.cos(motion[2]), math.sin(motion[2])
        normal = math.remainder(self.normal - motion[2], 2.0 * math.pi)
        return replace(self, tick=tick, point=(c * x + s * y, c * y - s * x), normal=normal)


class Feeler:
    """Follows the contacts of one whisker. Of the present or the last one: `felt`, None where nothing is known now; `last`, the
    last that was known; `bent`, what was known when the whisker was bent most, and by how much, `most`, rad."""

    def __init__(self, whisker: Whisker, calibrated_turn: float, plug: Plug, whisk_rad_s: float):
        """`calibrated_turn`: sign of the turn that pressed it in calibration; `whisk_rad_s`: of calibration."""
        self._base, self._yaw, self._plug = whisker.base_m, whisker.yaw_rad, plug
        self._out = -calibrated_turn  # the filter's y axis is to the left of the whisker, or with -1 to its right
        self._per_rad = plug.counts_per_rad(whisk_rad_s)
        self._filter = ContactFilter(
            whisker.length_m, noise_rad=NOISE_COUNTS / self._per_rad, **settings_of(plug, whisker.length_m)
        )
        self._recent: deque[tuple[np.ndarray, np.ndarray, np.ndarray]] = deque(maxlen=BLOCKS_BEFORE + 1)
        self._onset = -1
        self._rest: np.ndarray | None = None  # None: no object is followed
        self.felt: Felt | None = None
        self.last: Felt | None = None
        self.bent: Felt | None = None
        self.most = 0.0
        self._doubted = False  # what was known did not last while it was bent by more than creep leaves

    @property
    def not_read(self) -> dict[str, int]:
        return self._filter.not_read

    def block(
        self,
        ticks: np.ndarray,
        samples: np.ndarray,
        good: np.ndarray,
        contact: Contact,
        drives: Drives,
        same: bool = False,
    ) -> None:
        """Take ticks (n,), samples (n, 2) in counts and good (n,), of which `contact` knows already.

        `same`: what is touched is what was touched before, as in a body whisk; the filter then follows it over the gap.
        """
        self._recent.append((ticks, samples, good))
        new = contact.touching and contact.onset != self._onset
        if not contact.touching and not (same and self._rest is not None):
            self._rest = None
            return
        if new:
            self._onset, self.felt, self.last, self.bent = contact.onset, None, None, None
            self.most, self._doubted = 0.0, False
        if self._rest is None or (new and not same):
            self._filter.begin()
            self._rest = _rest(list(self._recent)[:REST_BLOCKS], contact.rest)
            ticks, samples, good = (np.concatenate(part) for part in zip(*self._recent, strict=True))
        tilts = self._tilts(samples - self._rest)
        reported = self._filter.run(self._bases(drives.at(ticks)), tilts, good)
        if (
            not contact.touching
            or not len(reported.sample)
            or ticks[max(reported.sample[-1], 0)] < contact.onset + LEAST_TICKS
        ):
            return
        self.felt = self._placed(reported, ticks) if reported.sure[-1] else None
        bent = abs(float(np.median(tilts[:, 0])))
        if bent >= self.most:
            self.most, self.bent = bent, self.felt
        self._doubted |= self.last is not None and reported.other[-1] >= 0.5 and bent > CREEP * self.most
        self.last = None if self._doubted else self.felt or self.last

    def _bases(self, drives: np.ndarray) -> np.ndarray:
        """(n, 3) motion of the follicle's exit in the filter's frame."""
        v, omega = drives.T
        x, y = v - omega * self._base[1], omega * self._base[0]
        c, s = math.cos(self._yaw), math.sin(self._yaw)
        return np.column_stack([c * x + s * y, self._out * (c * y - s * x), self._out * omega])

    def _tilts(self, off: np.ndarray) -> np.ndarray:
        return np.column_stack([self._plug.along(off), off @ self._plug.side]) / self._per_rad

    def _placed(self, reported: Reports, ticks: np.ndarray) -> Felt:
        x, y = reported.point[-1]
        c, s = math.cos(self._yaw), math.sin(self._yaw)
        y *= self._out
        point = self._base[0] + c * x - s * y, self._base[1] + s * x + c * y
        point_sd, slip = math.sqrt(np.trace(reported.point_cov[-1]) / 2.0), float(reported.slip[-1])
        felt = Felt(int(ticks[max(reported.sample[-1], 0)]), point, point_sd, slip=slip)
        face, sd = float(reported.tip[-1]), math.hypot(reported.normal_sd[-1], MODEL_RAD)
        if not reported.faced[-1]:
            return replace(felt, face=face)
        normal = math.remainder(self._yaw + self._out * reported.normal_rad[-1], 2.0 * math.pi)
        return replace(felt, normal=normal, normal_sd=sd, face=face)


def _rest(blocks: list[tuple[np.ndarray, np.ndarray, np.ndarray]], otherwise: np.ndarray) -> np.ndarray:
    """Mean (2,) of the good samples of blocks, counts."""
    samples = np.concatenate([samples[good] for _, samples, good in blocks])
    return samples.mean(axis=0) if len(samples) else otherwise
