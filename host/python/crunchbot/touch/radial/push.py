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
ONSET_SHARE = 0.06  # of the shortest push in calibration: lines before and after the onset
ONSET_CLEAR = 0.4  # of the largest change of slope; later, larger ones may be slips (docs/methods/radial.md)
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
    """The push of a contact: depth (n,) from its onset on, deflection (n, channels) about the rest, unit of depth, and how long
    it took."""

    depth: np.ndarray
    deflection: np.ndarray
    unit: str
    seconds: float


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
    end = push_end(advance, samples, contact.depth_mm is not None)
    width = max(LINE_LEAST, _samples_in(window, advance[: end + 1]))
    onset = _onset(t_s[: end + 1], samples[: end + 1], width)
    if onset is None:
        return None
    before = slice(max(0, onset - width), onset + 1)
    rest = _line_end(t_s[before], samples[before])
    after = slice(onset, end + 1)
    return Press(advance[after] - advance[onset], samples[after] - rest, unit, float(t_s[end] - t_s[onset]))


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


def _line_end(t_s: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Value (channels,) at its last time of a least-squares line: a rest that drifts, as it is at the onset."""
    off = t_s - t_s.mean()
    square = float(off @ off)
    slope = off @ (samples - samples.mean(axis=0)) / square if square > 0.0 else 0.0
    return samples.mean(axis=0) + slope * off[-1]


def _onset(t_s: np.ndarray, samples: np.ndarray, width: int) -> int | None:
    """Index of the first clear change of slope, between lines over `width` samples before and after it."""
    count = len(t_s) - width
    if count <= width:
        return None
    x = (t_s - t_s[0])[:, None]
    y = samples - samples.mean(axis=0)
    sums = [np.cumsum(np.vstack([np.zeros((1, part.shape[1])), part]), axis=0) for part in (x, x * x, y, x * y)]
    sx, sxx, sy, sxy = (total[width:] - total[:-width] for total in sums)
    slopes = (width * sxy - sx * sy) / np.maximum(width * sxx - sx * sx, 1e-300)
    change = np.linalg.norm(slopes[width:] - slopes[:-width], axis=1)
    first = int(np.argmax(change >= ONSET_CLEAR * change.max()))
    return width + first + int(np.argmax(change[first : first + width]))


def reach_of(contact: Contact) -> float:
    """Advance of a whole contact up to its end."""
    advance, _ = advance_of(contact)
    good = np.isfinite(contact.samples).all(axis=1) & np.isfinite(advance)
    if np.count_nonzero(good) < 4 * LINE_LEAST:
        return math.inf
    advance = advance[good]
    return float(advance[push_end(advance, contact.samples[good], contact.depth_mm is not None)] - advance[0])
