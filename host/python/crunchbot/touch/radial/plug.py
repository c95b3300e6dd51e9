"""The plug in which a whisker stands, from contacts at known radii: what the contact filter knows of a whisker.

A whisker pushed by an angle at distance a tilts its plug by the angle times h(a), h = (1 - x)/(1 - x + kappa x), x = a/cone
(conical beam in a compliant plug, Birdwell et al. 2007); creep adds to that tilt. So ln deflection - ln angle is
ln counts_per + ln h(a). The maximum of the posterior over counts_per, kappa and cone: five contacts at six radii leave
little to learn from, so plug and cone have priors, and the spread from contact to contact is the same everywhere.
"""

import math
from dataclasses import dataclass

import numpy as np

from ...fields import Fields
from .push import AXES_MOST, LEAST, TIP_MM, UNITS, Press

CREEP, CREEP_S = 0.075, 0.5  # further tilt after a long time, share, and its time constant (whisker_physics section 6)
LOG_KAPPA_SD = 1.5  # about 1, whisker_physics section 6: plugs from 0.1 to clamped are conceivable
# The cone's point over the outermost radius: 181.7 mm over 138 for this whisker; blunter and sharper ones are conceivable.
CONE_OVER_HIGH, LOG_CONE_SD = 1.3, 0.15
LOG_KAPPA_LIMITS, LOG_CONE_LIMITS = (-4.0, 4.0), (0.02, 2.0)  # of kappa; of cone over outermost radius
SPREAD_FIRST, SPREAD_LEAST = 0.05, 0.002  # of ln deflection; the paper's whisks: 0.026 to 0.082
ROUNDS = 12
LEAST_CONTACTS, LEAST_PLACES = 5, 3


@dataclass(frozen=True)
class Plug:
    """counts_per: counts of field per tilt of one `unit` of advance (of mm: per radian); spread: of ln deflection from
    contact to contact, the error of what is learnt included; direction: unit vector (channels,) in which it bent."""

    unit: str
    counts_per: float
    kappa: float
    cone_mm: float
    spread: float
    direction: np.ndarray

    NUMBERS = ("counts_per", "kappa", "cone_mm", "spread")

    @classmethod
    def of(cls, fields: Fields) -> "Plug":
        """Makes a plug from what `content` gave; ValueError names the field that is wrong."""
        numbers = {name: fields.number(name, LEAST) for name in cls.NUMBERS}
        direction = fields.array("direction", 1, -1.0, 1.0)
        if not 1 <= len(direction) <= AXES_MOST:
            raise fields.fail("direction", f"must have 1 to {AXES_MOST} numbers")
        return cls(fields.text("unit", *UNITS.values()), **numbers, direction=direction)

    @property
    def content(self) -> dict:
        """What makes the same plug again."""
        numbers = {name: getattr(self, name) for name in self.NUMBERS}
        return {"unit": self.unit} | numbers | {"direction": self.direction.tolist()}

    def counts_per_rad(self, whisk_rad_s: float) -> float:
        """Counts per radian by which the plug tilts; `whisk_rad_s`: of calibration, where its file did not state it."""
        return self.counts_per / (whisk_rad_s if self.unit == UNITS[""] else 1.0)

    def most(self, radius_mm: float) -> float:
        """Tilt of the plug per angle pushed at this radius, at most: with creep, and three deviations from contact to contact."""
        share = float(np.exp(_log_height(np.array([radius_mm]), math.log(self.kappa), self.cone_mm))[0])
        return share * (1.0 + CREEP + 3.0 * self.spread)

    def along(self, deflection: np.ndarray) -> np.ndarray:
        """Deflections (n, channels), counts, as a signed length (n,) along the direction of calibration."""
        return np.asarray(deflection) @ self.direction

    @property
    def side(self) -> np.ndarray:
        """Unit vector (2,) over the first two channels at right angles to the direction of calibration."""
        x, y = self.direction[0], self.direction[1]
        return np.array([-y, x]) / max(1e-9, math.hypot(x, y))

    @classmethod
    def fit(cls, presses: list[Press | None], radius_mm: np.ndarray) -> "Plug | None":
        """Of pushes at known radii (n,) mm; None where they are too few, or not alike."""
        use = [n for n, press in enumerate(presses) if press is not None and press.steady > 0.0]
        pushes, radii = [presses[n] for n in use], np.asarray(radius_mm, np.float64)[use]
        if len(use) < LEAST_CONTACTS or len(np.unique(radii)) < LEAST_PLACES or len({p.unit for p in pushes}) != 1:
            return None
        ends = np.array([push.deflection[push.end] for push in pushes])
        sizes = np.linalg.norm(ends, axis=1)
        angles = np.array([push.steady for push in pushes])
        if not (sizes > 0.0).all() or not (angles > 0.0).all():
            return None
        unit = pushes[0].unit
        if unit == UNITS["push_mm_s"]:
            angles = np.arctan(angles / radii)
        seconds = np.array([push.seconds for push in pushes])
        log_share = np.log(sizes / (angles * (1.0 + creep_of(seconds))))
        direction = np.mean(ends / sizes[:, None], axis=0)
        log_counts, kappa, cone_mm, spread = _fitted(radii, log_share)
        direction /= max(1e-9, float(np.linalg.norm(direction)))
        return cls(unit, math.exp(log_counts), kappa, cone_mm, spread, direction)


def creep_of(seconds: np.ndarray) -> np.ndarray:
    """Share by which a plug that is tilted at a steady rate for so long tilts further by creep."""
    part = CREEP_S / np.maximum(seconds, 1e-9)
    return CREEP * (1.0 - part * (1.0 - np.exp(-1.0 / part)))


def _log_height(radii: np.ndarray, log_kappa: float, cone_mm: float) -> np.ndarray:
    rest = 1.0 - radii / cone_mm
    return np.log(rest / (rest + math.exp(log_kappa) * radii / cone_mm))


def _fitted(radii: np.ndarray, log_share: np.ndarray) -> tuple[float, float, float, float]:
    """ln counts, kappa, cone (mm), spread: Gauss-Newton on the posterior, its spread by its own residuals."""
    high, step = radii.max() + TIP_MM, 1e-4
    mean = np.array([0.0, 0.0, math.log(CONE_OVER_HIGH)])
    precision = np.array([0.0, LOG_KAPPA_SD**-2, LOG_CONE_SD**-2])

    def model(theta: np.ndarray) -> np.ndarray:
        return theta[0] + _log_height(radii, theta[1], high * math.exp(theta[2]))

    theta = mean.copy()
    theta[0] = np.mean(log_share - model(mean))
    spread = SPREAD_FIRST
    for _ in range(ROUNDS):
        slopes = np.column_stack([(model(theta + by) - model(theta - by)) / (2 * step) for by in step * np.eye(3)])
        covariance = np.linalg.inv(slopes.T @ slopes / spread**2 + np.diag(precision))
        theta = theta + covariance @ (slopes.T @ (log_share - model(theta)) / spread**2 + precision * (mean - theta))
        theta[1] = np.clip(theta[1], *LOG_KAPPA_LIMITS)
        theta[2] = np.clip(theta[2], *LOG_CONE_LIMITS)
        used = np.trace(covariance @ slopes.T @ slopes) / spread**2
        left = log_share - model(theta)
        spread = max(SPREAD_LEAST, math.sqrt(float(left @ left) / max(1.0, len(radii) - used)))
    unknown = float(np.mean(np.sum(slopes @ covariance * slopes, axis=1)))
    return theta[0], math.exp(theta[1]), high * math.exp(theta[2]), math.sqrt(spread**2 + unknown)
