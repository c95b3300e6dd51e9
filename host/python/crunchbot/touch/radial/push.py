"""A recorded contact and its push: from where the whisker is first touched to where it is bent most."""

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from ...fields import HUGE

SAMPLES_LEAST = 8
RADIUS_MOST_MM = 1e5
TIP_MM = 3.0  # from the outermost calibrated radius outwards it is the tip
LEAST = 1e-12  # of what must be above 0
LINE_LEAST = 8  # samples in a line
ONSET_SHARE = 0.06  # of the shortest push in calibration: depth up to which an onset is not certain
# A slip: a fall by more than the paper's whisks differ in the mean, of their deflection, between parts of that window, or
# samples, within which the push itself makes up for less than half of that.
SLIP, SLIP_SHARE, SLIP_LEAST = 0.05, 0.25, 3
POINTS, TOUCHES, FINER = 200, 64, 8  # of the fit of an onset: means of samples, places tried, and between two of these
STARTED = 0.5  # of the shortest push in calibration: what advances so far and shows no touch began in contact
MEDIAN = 5  # samples: a running median takes out single bad records
AXES_MOST = 8
UNITS = {"depth_mm": "mm", "push_mm_s": "mm", "whisk_rad_s": "rad", "": "s"}


@dataclass
class Contact:
    """One recorded contact: times (n,) s, samples (n, axes), and where known, each (n,): rates of turn commanded and
    reported, rad/s; rate of a push by translation, mm/s; depth of the push, mm, from any zero."""

    t_s: np.ndarray
    samples: np.ndarray
    whisk_rad_s: np.ndarray | None = None
    reported_rad_s: np.ndarray | None = None
    push_mm_s: np.ndarray | None = None
    depth_mm: np.ndarray | None = None

    def until(self, end: int) -> "Contact":
        """The contact's first `end` samples."""
        columns = (getattr(self, field.name) for field in fields(self))
        return Contact(*(None if column is None else column[:end] for column in columns))


class Press(NamedTuple):
    """The push of a contact: depth (n,) from its onset on, deflection (n, channels) about the rest, unit of depth; how long
    it grew without a slip, and up to which depth."""

    depth: np.ndarray
    deflection: np.ndarray
    unit: str
    seconds: float
    steady: float

    @property
    def end(self) -> int:
        """Index of the last sample before a slip."""
        return max(0, int(np.searchsorted(self.depth, self.steady, "right")) - 1)


def advance_of(contact: Contact) -> tuple[np.ndarray, str]:
    """How far the base has moved (n,), and its unit: by the depth, else by a rate's integral, else the time. Of a turn that the
    base reports, the whole is its report's: reports are coarse, and the order's course is smooth."""
    if contact.depth_mm is not None:
        return np.asarray(contact.depth_mm, np.float64), UNITS["depth_mm"]
    for name in ("push_mm_s", "whisk_rad_s"):
        rate = getattr(contact, name)
        if rate is not None:
            steps = np.diff(contact.t_s, prepend=contact.t_s[:1]) * np.abs(rate)
            advance = np.cumsum(np.nan_to_num(steps))
            return advance * (_reported(contact) if name == "whisk_rad_s" else 1.0), UNITS[name]
    return np.asarray(contact.t_s, np.float64) - contact.t_s[0], UNITS[""]


def _reported(contact: Contact) -> float:
    """Turn reported over turn commanded; 1 where either is not known."""
    if contact.reported_rad_s is None or contact.whisk_rad_s is None:
        return 1.0
    steps = np.diff(contact.t_s, prepend=contact.t_s[:1])
    turned = [float(np.nansum(steps * np.abs(rate))) for rate in (contact.reported_rad_s, contact.whisk_rad_s)]
    return turned[0] / turned[1] if min(turned) > 0.0 else 1.0


def presses_of(contacts: list[Contact]) -> tuple[list[Press | None], float]:
    """The pushes of calibration, and the window in which their onsets were looked for."""
    window = ONSET_SHARE * min((reach_of(contact) for contact in contacts), default=0.0)
    return [press_of(contact, window) for contact in contacts], window


def press_of(contact: Contact, window: float) -> Press | None:
    """The push of a contact, whole or so far; None when the samples show none. `window`: advance on both sides of the
    onset over which lines are laid to find it."""
    advance, unit = advance_of(contact)
    columns = np.column_stack([contact.samples, advance, contact.t_s])
    good = (np.abs(columns) < HUGE).all(axis=1)  # False for nan
    t_s, advance, samples = contact.t_s[good], advance[good], _median(contact.samples[good])
    if len(t_s) < 4 * LINE_LEAST or not t_s[-1] > t_s[0]:
        return None
    end = push_end(advance, samples, contact.depth_mm is not None) + 1
    t_s, advance, samples = t_s[:end], np.maximum.accumulate(advance[:end]), samples[:end]
    if end < LINE_LEAST or not advance[-1] > advance[0]:
        return None
    touched, rest = _touch(t_s, advance, samples)
    width = max(SLIP_LEAST, _samples_in(SLIP_SHARE * window, advance))
    steady = _steady_end(samples, int(np.searchsorted(advance, touched)), width)
    if LINE_LEAST <= steady < end and advance[steady - 1] > advance[0]:
        touched, rest = _touch(t_s[:steady], advance[:steady], samples[:steady])
    if touched == advance[0] and advance[steady - 1] - touched < STARTED * window / ONSET_SHARE:
        return None
    first = int(np.searchsorted(advance, touched))
    seconds = float(t_s[steady - 1] - np.interp(touched, advance, t_s))
    return Press(advance[first:] - touched, samples[first:] - rest, unit, seconds, float(advance[steady - 1] - touched))


def _median(samples: np.ndarray) -> np.ndarray:
    if len(samples) < MEDIAN:
        return samples
    padded = np.pad(samples, ((MEDIAN // 2, MEDIAN // 2), (0, 0)), mode="reflect")
    return np.median(np.lib.stride_tricks.sliding_window_view(padded, MEDIAN, axis=0), axis=-1)


def push_end(advance: np.ndarray, samples: np.ndarray, known: bool) -> int:
    """Index at which the push ends: the greatest depth where it is known, else the greatest deflection."""
    if known:
        return int(np.argmax(advance))
    width = max(1, len(samples) // 100)
    rest = samples[: max(LINE_LEAST, len(samples) // 20)].mean(axis=0)
    size = np.linalg.norm(samples - rest, axis=1)
    return int(np.argmax(np.convolve(size, np.ones(width) / width, "same")))


def _samples_in(window: float, advance: np.ndarray) -> int:
    """Number of samples in which the base advances by `window` while it moves; at most all of them."""
    steps = np.diff(advance)
    steps = steps[steps > 0.0]
    return min(len(advance), int(window * len(steps) / steps.sum())) if len(steps) else 0


def _steady_end(samples: np.ndarray, first: int, width: int) -> int:
    """How many samples the deflection grows, from sample `first` on, without a slip: a fall between means over `width`."""
    pushed = samples[first:]
    if len(pushed) < 2 * width:
        return len(samples)
    bent = pushed[-width:].mean(axis=0) - pushed[:width].mean(axis=0)
    along = pushed @ bent / max(LEAST, float(np.linalg.norm(bent)))
    means = np.convolve(along, np.ones(width) / width, "valid")
    falls = np.flatnonzero(means[:-width] - means[width:] > SLIP * np.ptp(means))
    return first + int(falls[0]) + width if len(falls) else len(samples)


def _touch(t_s: np.ndarray, advance: np.ndarray, samples: np.ndarray) -> tuple[float, np.ndarray]:
    """Advance at the touch, and the rest (channels,) there: least squares of a rest that drifts and of a deflection that
    grows from the touch on. Where none of these has been at rest before, it touches from its first sample on."""
    parts = np.array_split(np.arange(len(t_s)), min(len(t_s), POINTS))
    means = [np.array([column[rows].mean(axis=0) for rows in parts]) for column in (t_s - t_s[0], advance, samples)]
    step = (means[1][-1] - advance[0]) / TOUCHES
    tried = advance[0] + step * np.arange(TOUCHES)
    left, rest = _left(*means, tried)
    best = int(np.argmin(left))
    if best > 0:
        tried = tried[best] + step * np.linspace(-1.0, 1.0, FINER + 1)[1:-1]
        left, rest = _left(*means, tried)
        best = int(np.argmin(left))
    return float(tried[best]), rest[best]


def _left(
    t_s: np.ndarray, advance: np.ndarray, samples: np.ndarray, touched: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What a touch at each of these (k,) leaves unexplained, and the rest there (k, channels). Infinite unless the whisker bends
    by more behind it than before, and faster; but for a touch at the first sample, before which nothing is."""
    depth, at_s = np.clip(advance - touched[:, None], 0.0, None), np.interp(touched, advance, t_s)[:, None]
    part = depth / depth[:, -1:]
    before = at_s > 0.0
    columns = np.stack([np.ones_like(part), before * (t_s - at_s) / t_s[-1], part, part**2, part**3], axis=2)
    square = columns.transpose(0, 2, 1) @ columns + LEAST * np.eye(5)
    fitted = np.linalg.solve(square, columns.transpose(0, 2, 1) @ samples)
    left = np.square(samples - columns @ fitted).sum(axis=(1, 2))
    drift, grown = np.linalg.norm(fitted[:, 1], axis=1), np.linalg.norm(fitted[:, 2:].sum(axis=1), axis=1)
    rests = grown > drift * np.maximum(at_s, t_s[-1] - at_s)[:, 0] / t_s[-1]
    return np.where(rests | ~before[:, 0], left, np.inf), fitted[:, 0]


def reach_of(contact: Contact) -> float:
    """Advance of a whole contact up to its end."""
    advance, _ = advance_of(contact)
    good = np.isfinite(contact.samples).all(axis=1) & np.isfinite(advance)
    if np.count_nonzero(good) < 4 * LINE_LEAST:
        return math.inf
    advance = advance[good]
    return float(advance[push_end(advance, contact.samples[good], contact.depth_mm is not None)] - advance[0])
