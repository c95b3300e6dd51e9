"""Calibration of a radial model from whole whisks at known radii.

It is a maximum a posteriori fit of ln peak, contact by contact, against the known radii, in which the relative spread from
whisk to whisk is the same everywhere. Five contacts at six radii leave little to learn from, so every parameter has a prior,
from physics; a number is learned only as far as the contacts speak for it.
"""

import math
from typing import NamedTuple

import numpy as np

from ...native import lib
from .push import TIP_MM
from .shape import terms_of

# Priors of the weights, mean and standard deviation. The whisker bends as far as it is pushed, so the angle's weight is
# 1; unless the base turns otherwise than it is ordered, and the duration says little. Which of the two it is, the evidence
# decides. Faster by 3:1 changes the bending by some percent (overshoot, creep); a report of the angle is worth something;
# bow and return may follow creep and rate, either way.
WEIGHT_MEAN = np.array([1.0, 0.0, 0.5, 0.0, 0.0])
WEIGHT_SD = np.array([0.03, 0.05, 0.5, 0.5, 0.5])
DOUBTED_MEAN, DOUBTED_SD = 0.5, 0.5  # of the angle's weight
TRUST = 3.0  # ln of the odds, before anything is seen, that the angle follows from the duration
LOG_KAPPA_SD = 1.5  # about 1, whisker_physics section 6: plugs from 0.1 to clamped are conceivable
# The cone's point over the outermost radius: 181.7 mm over 138 for this whisker; blunter and sharper ones are conceivable.
CONE_OVER_HIGH, LOG_CONE_SD = 1.3, 0.15
LOG_KAPPA_LIMITS, LOG_CONE_LIMITS = (-4.0, 4.0), (0.02, 2.0)  # of kappa; of cone over outermost radius
SPREAD_FIRST = 0.05  # of ln peak, where the iteration begins; the paper's whisks: 0.026 to 0.082
SPREAD_LEAST = 0.002
ROUNDS = 12

# Radii that are possible beyond the calibrated ones: one calibrated step inwards, outwards as far as the tip.
DIRECTION_LEAST_RAD = 0.05
LOG_MISFIT_LEAST = 0.5


def learn(shapes: list, radii: np.ndarray) -> dict:
    """What a model of these whisks holds, but for the number of axes; `radii` (whisks,), mm."""
    return _bending(radii, shapes) | _looks(shapes) | _possible(radii)


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


def _bending(radii: np.ndarray, shapes: list) -> dict:
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
