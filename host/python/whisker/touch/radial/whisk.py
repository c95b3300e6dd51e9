"""Radial distance from whole whisks (host/nav/touch/radial_whisk.h): recordings to shapes, calibration, model files.

Calibration is a maximum a posteriori fit of ln peak, contact by contact, against the known radii, in which the relative
spread from whisk to whisk is the same everywhere. Five contacts at six radii leave little to learn from, so every
parameter has a prior, from physics; a number is learned only as far as the contacts speak for it.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...native import doubles, ffi, lib

TERMS = ("turn", "rate", "told", "bow", "back")

# Priors of the weights, mean and standard deviation. The whisker bends as far as it is pushed, so the angle's weight is
# 1; unless the base turns otherwise than it is told, and the duration
# says little. Which of the two it is, the evidence decides. Faster by 3:1 changes the bending by some percent
# (overshoot, creep); a report of the angle is worth something; bow and return may tell of creep and rate, either way.
WEIGHT_MEAN = np.array([1.0, 0.0, 0.5, 0.0, 0.0])
WEIGHT_SD = np.array([0.03, 0.05, 0.5, 0.5, 0.5])
DOUBTED_MEAN, DOUBTED_SD = 0.5, 0.5  # of the angle's weight
TRUST = 3.0  # ln of the odds, before anything is seen, that duration tells the angle
LOG_KAPPA_SD = 1.5  # about 1, whisker_physics section 6: plugs from 0.1 to clamped are conceivable
# The cone's point over the outermost radius: 181.7 mm over 138 for this whisker; blunter and sharper ones are conceivable.
CONE_OVER_HIGH, LOG_CONE_SD = 1.3, 0.15
LOG_KAPPA_LIMITS, LOG_CONE_LIMITS = (-4.0, 4.0), (0.02, 2.0)  # of kappa; of cone over outermost radius
SPREAD_FIRST = 0.05  # of ln peak, where the iteration begins; the paper's whisks: 0.026 to 0.082
SPREAD_LEAST = 0.002
ROUNDS = 12

# Radii that are possible beyond the calibrated ones: one calibrated step inwards, outwards as far as the tip.
TIP_MM = 3.0
DIRECTION_LEAST_RAD = 0.05
LOG_MISFIT_LEAST = 0.5
SAMPLES_LEAST = 8
CROP_SHARE = 0.1  # of the peak: what is above belongs to the contact
LEAST_CONTACTS = 5
LOG_RATE_NONE = 1e-6  # rates were not known in calibration: seconds stand for radians


@dataclass
class Contact:
    """One recorded whisk: times (n,) s, samples (n, axes), rates of turn (n,) rad/s commanded and reported, or None."""

    t_s: np.ndarray
    samples: np.ndarray
    whisk_rad_s: np.ndarray | None = None
    told_rad_s: np.ndarray | None = None


def shape_of(contact: Contact):
    """struct nav_shape of a recorded whisk; what is recorded long before and after it is left out."""
    part = _crop(contact)
    trace, shape = ffi.new("struct nav_trace *"), ffi.new("struct nav_shape *")
    t_s = np.ascontiguousarray(contact.t_s[part], np.float64)
    samples = np.ascontiguousarray(contact.samples[part, : lib.NAV_TRACE_AXES], np.float64)
    rates = [
        None if rate is None else np.ascontiguousarray(rate[part], np.float64)
        for rate in (contact.whisk_rad_s, contact.told_rad_s)
    ]
    lib.nav_trace_begin(trace, samples.shape[1])
    pointers = [ffi.NULL if rate is None else doubles(rate) for rate in rates]
    lib.nav_trace_run(trace, len(t_s), doubles(t_s), doubles(samples), *pointers)
    lib.nav_shape_of(trace, shape)
    return shape


def _crop(contact: Contact) -> slice:
    """The contact and as much before and after it as it lasts, at least an eighth of the recording each."""
    finite = np.isfinite(contact.samples).all(axis=1)
    count = len(finite)
    if np.count_nonzero(finite) < 2 * SAMPLES_LEAST:
        return slice(0, count)
    rest = np.median(contact.samples[finite][: max(SAMPLES_LEAST, count // 20)], axis=0)
    size = np.where(finite, np.abs(contact.samples - rest).sum(axis=1), 0.0)
    level = np.sort(size)[-max(2, count // 50)]  # not the largest: that may be a bad record
    runs = np.flatnonzero(np.convolve(size > CROP_SHARE * level, np.ones(3), "same") == 3)
    if len(runs) == 0:
        return slice(0, count)
    margin = max(runs[-1] - runs[0], count // 8)
    return slice(max(0, runs[0] - margin), min(count, runs[-1] + margin))


def terms_of(shape) -> np.ndarray:
    """The model's terms of a whisk (TERMS); nan where one was not measured."""
    out = np.empty(len(TERMS))
    lib.nav_whisk_terms(shape, doubles(out))
    return out


class WhiskModel:
    """`nav_whisk_model` of one whisker: made by `fit` or from what `content` gave."""

    kind = "default"
    node: int | None = None  # whose whisker it is, where known
    SCALARS = ("axes", "log_gain", "kappa", "cone_mm", "spread", "low_mm", "high_mm", "tip_mm") + (
        "direction_sd",
        "log_misfit",
        "log_misfit_sd",
        "frozen",
    )
    ARRAYS = ("weight", "mean", "scatter", "direction")

    def __init__(self, content: dict):
        """`content`: SCALARS, ARRAYS and "covariance" by name."""
        arrays = {name: [float(v) for v in content[name]] for name in self.ARRAYS}
        scalars = {name: float(content[name]) for name in self.SCALARS[1:]}
        covariance = np.array(content["covariance"], np.float64).reshape(len(TERMS), len(TERMS))
        everything = [*scalars.values(), *(v for values in arrays.values() for v in values), *covariance.flat]
        if not np.isfinite(everything).all():
            raise ValueError("a number is not finite")
        lengths = {name: lib.NAV_TRACE_AXES if name == "direction" else len(TERMS) for name in self.ARRAYS}
        if any(len(arrays[name]) != length for name, length in lengths.items()):
            raise ValueError("a list has not as many members as it should")
        if not (
            1 <= int(content["axes"]) <= lib.NAV_TRACE_AXES
            and 0 < scalars["low_mm"] < scalars["high_mm"] < scalars["cone_mm"]
        ):
            raise ValueError("axes or radii are impossible")
        if min(scalars["spread"], scalars["kappa"], scalars["direction_sd"], scalars["log_misfit_sd"]) <= 0:
            raise ValueError("a deviation is not above 0")
        rest = {"axes": int(content["axes"]), "covariance": covariance.tolist()}
        self._c = ffi.new("struct nav_whisk_model *", scalars | arrays | rest)

    @property
    def content(self) -> dict:
        """What makes the same model again, as plain numbers and lists."""
        scalars = {name: getattr(self._c, name) for name in self.SCALARS}
        arrays = {name: list(getattr(self._c, name)) for name in self.ARRAYS}
        return scalars | arrays | {"covariance": [list(row) for row in self._c.covariance]}

    @property
    def axes(self) -> int:
        return self._c.axes

    @property
    def low_mm(self) -> float:
        return self._c.low_mm

    @property
    def high_mm(self) -> float:
        return self._c.high_mm

    @property
    def tip_mm(self) -> float:
        return self._c.tip_mm

    @property
    def kappa(self) -> float:
        return self._c.kappa

    @property
    def cone_mm(self) -> float:
        return self._c.cone_mm

    @property
    def spread(self) -> float:
        """Relative standard deviation from whisk to whisk that is left."""
        return self._c.spread

    def shape_of(self, contact: Contact):
        """struct nav_shape of a contact, its commanded rate as in calibration where it is not known with this one."""
        log_rate = self._c.mean[TERMS.index("rate")]
        rate = contact.whisk_rad_s
        if abs(log_rate) < LOG_RATE_NONE:
            rate = None
        elif rate is None:
            rate = np.full(len(contact.t_s), math.exp(log_rate))
        return shape_of(Contact(contact.t_s, contact.samples, rate, contact.told_rad_s))

    def counts_per_rad(self, whisk_rad_s: float) -> float:
        """Counts per radian by which the plug tilts; `whisk_rad_s`: of calibration, where its file did not tell."""
        turn = TERMS.index("turn")
        rate = whisk_rad_s if abs(self._c.mean[TERMS.index("rate")]) < LOG_RATE_NONE else 1.0
        return math.exp(self._c.log_gain - self._c.mean[turn]) / rate

    def along(self, deflection) -> np.ndarray:
        """Deflections (n, axes), counts, as a signed length (n,) along the direction of calibration."""
        return np.asarray(deflection) @ np.array(list(self._c.direction)[: self.axes])

    def share(self, radius_mm: float) -> float:
        """h(a): tilt of the plug per angle pushed at this radius."""
        return math.exp(lib.nav_whisk_height(self._c.kappa, self._c.cone_mm, radius_mm))

    def share_of(self, shape) -> float:
        """The same as a whisk shows it, negative when it bent away from the direction of calibration; nan: no whole whisk."""
        if shape.quality != lib.NAV_SHAPE_WHOLE or not (shape.turn > 0 and shape.peak > 0):
            return math.nan
        turned = math.log(shape.turn) - self._c.mean[TERMS.index("turn")]
        size = math.exp(math.log(shape.peak) - self._c.log_gain - turned)
        return math.copysign(size, self.along([list(shape.direction)[: self.axes]])[0])

    def estimate(self, shape):
        """struct nav_whisk_estimate of a whisk."""
        out = ffi.new("struct nav_whisk_estimate *")
        lib.nav_whisk_estimate(self._c, shape, out)
        return out

    @classmethod
    def fit(cls, shapes: list, radius_mm, axes: int) -> "WhiskModel":
        """From shapes of contacts at known radii; ValueError when too few are usable or all at one radius."""
        radii = np.asarray(radius_mm, np.float64)
        use = [
            n for n, s in enumerate(shapes) if s.quality == lib.NAV_SHAPE_WHOLE and s.peak > 0 and np.isfinite(radii[n])
        ]
        radii = radii[use]
        if len(use) < LEAST_CONTACTS or len(set(radii.tolist())) < 3 or radii.min() <= 0:
            raise ValueError(
                f"radial fit: {len(use)} of {len(shapes)} contacts are whole whisks with a radius above 0; "
                f"at least {LEAST_CONTACTS}, at 3 radii or more, are needed: record more"
            )
        shapes = [shapes[n] for n in use]
        return cls(_learn(radii, shapes) | _looks(shapes) | _possible(radii) | {"axes": axes})

    def left_out_error(self, shapes: list, radius_mm) -> float:
        """RMS error, mm, of contacts each predicted by a model that was fitted without it; nan when there are too few."""
        radii = np.asarray(radius_mm, np.float64)
        left = [float("nan")]
        for n in range(len(shapes)):
            others = [k for k in range(len(shapes)) if k != n]
            try:
                without = WhiskModel.fit([shapes[k] for k in others], radii[others], self.axes)
            except ValueError:
                continue
            left.append(without.estimate(shapes[n]).radius_mm - radii[n])
        found = np.square(left)[np.isfinite(left)]
        return float(np.sqrt(found.mean())) if len(found) else float("nan")


def _possible(radii: np.ndarray) -> dict:
    steps = np.diff(np.unique(radii))
    return {
        "low_mm": max(1.0, radii.min() - float(np.median(steps))),
        "high_mm": radii.max() + TIP_MM,
        "tip_mm": radii.max() - TIP_MM,
    }


def _looks(shapes: list) -> dict:
    """Direction, misfit and frozen samples of calibrated whisks."""
    directions = np.array([list(s.direction) for s in shapes])
    mean = directions.mean(axis=0)
    mean /= max(1e-9, float(np.linalg.norm(mean)))
    off = np.arccos(np.clip(directions @ mean, -1.0, 1.0))
    misfit = np.log([s.misfit + 1e-9 for s in shapes])
    return {
        "direction": mean.tolist(),
        "direction_sd": max(DIRECTION_LEAST_RAD, float(np.sqrt(np.mean(off**2)))),
        "log_misfit": float(misfit.mean()),
        "log_misfit_sd": max(LOG_MISFIT_LEAST, float(misfit.std())),
        "frozen": max(s.frozen for s in shapes),
    }


def _heights(log_kappa: float, log_cone: float, radii: np.ndarray) -> np.ndarray:
    kappa, cone = math.exp(log_kappa), math.exp(log_cone)
    return np.array([lib.nav_whisk_height(kappa, cone, r) for r in radii])


class _Posterior(NamedTuple):
    theta: np.ndarray  # log gain, log kappa, log cone/high, weights
    covariance: np.ndarray
    spread: float
    evidence: float  # ln, by Laplace's approximation
    shape_share: float  # variance of ln peak that gain, kappa and cone leave open, mean over the contacts


def _learn(radii: np.ndarray, shapes: list) -> dict:
    """Gain, kappa, cone, the terms' weights and the spread from whisk to whisk."""
    high = radii.max() + TIP_MM
    raw = np.array([terms_of(s) for s in shapes])
    known = np.isfinite(raw)
    mean = np.array([raw[k, n].mean() if k.any() else 0.0 for n, k in enumerate(known.T)])
    off = np.where(known, raw - mean, 0.0)
    log_peak = np.log([s.peak for s in shapes])
    doubted = (np.array([DOUBTED_MEAN, *WEIGHT_MEAN[1:]]), np.array([DOUBTED_SD, *WEIGHT_SD[1:]]))
    found = [_posterior(radii, high, log_peak, off, *prior) for prior in ((WEIGHT_MEAN, WEIGHT_SD), doubted)]
    best = found[0] if found[0].evidence + TRUST >= found[1].evidence else found[1]
    return {
        "log_gain": float(best.theta[0]),
        "kappa": math.exp(best.theta[1]),
        "cone_mm": high * math.exp(best.theta[2]),
        "weight": best.theta[3:].tolist(),
        "mean": mean.tolist(),
        "scatter": [float(raw[k, n].std()) if k.any() else 1.0 for n, k in enumerate(known.T)],
        "covariance": best.covariance[3:, 3:].tolist(),
        "spread": math.sqrt(best.spread**2 + best.shape_share),
    }


def _posterior(radii, high, log_peak, off, weight_mean, weight_sd) -> _Posterior:
    """Gauss-Newton on the posterior, its spread by its own residuals."""
    prior_mean = np.array([0.0, 0.0, math.log(CONE_OVER_HIGH), *weight_mean])
    prior_sd = np.array([1e3, LOG_KAPPA_SD, LOG_CONE_SD, *weight_sd])
    theta = prior_mean.copy()
    theta[0] = np.mean(log_peak - _heights(0.0, math.log(CONE_OVER_HIGH * high), radii))
    spread = SPREAD_FIRST
    for _ in range(ROUNDS):
        left = log_peak - _model(theta, high, radii, off)
        slopes = np.column_stack([np.ones(len(radii)), *_slopes(theta, high, radii), off])
        covariance = np.linalg.inv(slopes.T @ slopes / spread**2 + np.diag(prior_sd**-2.0))
        theta = theta + covariance @ (slopes.T @ left / spread**2 + (prior_mean - theta) / prior_sd**2)
        theta[1] = np.clip(theta[1], *LOG_KAPPA_LIMITS)
        theta[2] = np.clip(theta[2], *LOG_CONE_LIMITS)
        used = np.trace(covariance @ slopes.T @ slopes) / spread**2
        left = log_peak - _model(theta, high, radii, off)
        spread = max(SPREAD_LEAST, math.sqrt(float(left @ left) / max(1.0, len(radii) - used)))
    misfit = float(left @ left) / spread**2 + float(np.sum(((theta - prior_mean) / prior_sd) ** 2))
    evidence = 0.5 * np.linalg.slogdet(covariance)[1] - np.log(prior_sd).sum() - len(radii) * math.log(spread)
    shape_share = float(np.mean([row @ covariance[:3, :3] @ row for row in slopes[:, :3]]))
    return _Posterior(theta, covariance, spread, float(evidence) - 0.5 * misfit, shape_share)


def _model(theta: np.ndarray, high: float, radii: np.ndarray, off: np.ndarray) -> np.ndarray:
    """ln peak of each contact."""
    return theta[0] + _heights(theta[1], theta[2] + math.log(high), radii) + off @ theta[3:]


def _slopes(theta: np.ndarray, high: float, radii: np.ndarray, step: float = 1e-4) -> list[np.ndarray]:
    """Derivatives of ln h by log kappa and log cone."""
    out = []
    for shift in ((step, 0.0), (0.0, step)):
        ends = [
            _heights(theta[1] + sign * shift[0], theta[2] + math.log(high) + sign * shift[1], radii) for sign in (1, -1)
        ]
        out.append((ends[0] - ends[1]) / (2 * step))
    return out
