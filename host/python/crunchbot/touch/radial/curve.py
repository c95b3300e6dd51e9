"""The peak of a contact (equation 2), and peak to radius by a rational function: the paper's line bends when the plug is no
match for the whisker."""

import numpy as np
from numpy.typing import ArrayLike

from ...fields import Fields
from ...native import as_doubles, doubles, lib
from .plug import Plug
from .push import LEAST, RADIUS_MOST_MM, TIP_MM


def radii_of(fields: Fields, *names: str) -> list[float]:
    """A deviation, the lowest and the highest radius of a model, mm."""
    sigma, low, high = (fields.number(name, 0.0, RADIUS_MOST_MM) for name in names)
    fields.number(names[2], low, RADIUS_MOST_MM)
    return [sigma, low, high]


class Known:
    """What models of known radii share. low_mm, high_mm: the innermost and outermost of them; sigma_mm: error of a prediction."""

    node: int | None = None  # whose whisker it is, where known
    plug: Plug | None = None  # of the whisker, where calibration tells it
    low_mm: float
    high_mm: float
    sigma_mm: float

    @property
    def known_mm(self) -> tuple[float, float]:
        """Radii between which the model is known: the calibrated ones, and SLACK beyond."""
        slack = SLACK * self.high_mm
        return self.low_mm - slack, self.high_mm + slack

    def contact_type(self, radius_mm: float) -> str:
        """'tip' near the outermost fitted radius (one sigma, at least TIP_MM) or beyond it, else 'shaft'."""
        return "tip" if radius_mm > self.high_mm - max(self.sigma_mm, TIP_MM) else "shaft"


LEAST_BELOW, BELOW_MOST = (
    0.05,
    50.0,
)  # of the rational curve's denominator at the largest peak: no pole among the contacts
GRID, ZOOMS = 21, 7
SLACK = 0.1  # of the outermost radius, beyond those calibrated: where the curve still answers
REST_SHARE = 0.05  # the first samples of a recorded whisk, before it touches, give its rest
REST_LEAST = 3  # samples: slow recordings have few before the touch


def peak(samples: np.ndarray, rest: ArrayLike) -> float:
    """Equation 2: largest deflection about `rest` over a contact, counts. samples (n, axes); nan when none is finite."""
    samples = as_doubles(samples, "samples", (None, None))
    count, axes = samples.shape
    rest = as_doubles(rest, "rest", (axes,))
    return lib.nav_radial_peak(doubles(samples, "samples", (count, axes)), count, axes, doubles(rest, "rest", (axes,)))


def peak_of(samples: np.ndarray) -> float:
    """Equation 2 of a recorded contact (n, axes) about the median of its first samples, counts; nan when none is finite."""
    finite = samples[np.isfinite(samples).all(axis=1)]
    if len(finite) == 0:
        return float("nan")
    return peak(finite, np.median(finite[: max(REST_LEAST, int(REST_SHARE * len(finite)))], axis=0))


class CurveModel(Known):
    """r = (c0 + c1 f)/(1 + d f), f = peak/scale: exact for a conical whisker in a plug of any stiffness (whisker_physics
    section 4)."""

    NUMBERS = ("c0", "c1", "d", "scale", "sigma_mm", "low_mm", "high_mm")

    def __init__(self, numbers: dict[str, float]):
        """`numbers`: NUMBERS by name."""
        values = [float(numbers[name]) for name in self.NUMBERS]
        self.c0, self.c1, self.d, self.scale, self.sigma_mm, self.low_mm, self.high_mm = values

    @classmethod
    def of(cls, fields: Fields) -> "CurveModel":
        """Makes a model from what `content` gave; ValueError names the field that is wrong."""
        numbers = {name: fields.number(name) for name in cls.NUMBERS[:3]} | {"scale": fields.number("scale", LEAST)}
        return cls(numbers | dict(zip(cls.NUMBERS[4:], radii_of(fields, *cls.NUMBERS[4:]), strict=True)))

    @property
    def content(self) -> dict:
        """What makes the same model again."""
        return {name: getattr(self, name) for name in self.NUMBERS}

    @classmethod
    def fit(cls, peak_counts: np.ndarray, radius_mm: np.ndarray) -> "CurveModel":
        """Least squares; sigma_mm is the RMS error of places left out. ValueError when they do not determine it."""
        peaks, radii = (np.asarray(v, np.float64) for v in (peak_counts, radius_mm))
        use = np.isfinite(peaks) & np.isfinite(radii)
        peaks, radii = peaks[use], radii[use]
        if len(peaks) < 5 or len(np.unique(peaks)) < 4:
            raise ValueError(
                "radial fit: a curve needs at least 5 usable contacts of different peaks; record contacts at more radii"
            )
        scale = float(np.abs(peaks).max())
        known = {"scale": scale, "low_mm": radii.min(), "high_mm": radii.max(), "sigma_mm": 0.0}
        model = cls(known | cls._solve(peaks / scale, radii))
        left = []
        for place in np.unique(radii):
            kept = radii != place
            if len(np.unique(peaks[kept])) < 4:
                kept[:] = True
            without = cls(known | cls._solve(peaks[kept] / scale, radii[kept]))
            left += [without.predict(one)[0] - place for one in peaks[radii == place]]
        model.sigma_mm = float(np.sqrt(np.mean(np.square(left))))
        return model

    @staticmethod
    def _solve(f: np.ndarray, radii: np.ndarray) -> dict[str, float]:
        """Least squares of the radii; given d the curve is linear, and d is searched on ever finer grids."""
        low, high = np.log([LEAST_BELOW, BELOW_MOST])
        for _ in range(ZOOMS):
            tried = np.linspace(low, high, GRID)
            columns = np.stack([np.ones(len(f)), f], axis=1) / (1.0 + np.expm1(tried)[:, None, None] * f[:, None])
            found = np.linalg.pinv(columns) @ radii
            left = np.sum((np.einsum("gnk,gk->gn", columns, found) - radii) ** 2, axis=1)
            best = int(np.argmin(left))
            low, high = tried[max(0, best - 1)], tried[min(GRID - 1, best + 1)]
        c0, c1 = found[best]
        return {"c0": c0, "c1": c1, "d": np.expm1(tried[best])}

    def predict(self, peak_counts: float) -> tuple[float, float]:
        """(radius mm, sigma mm) of one contact; the radius is held where the curve is known, and SLACK beyond."""
        f = peak_counts / self.scale
        below = 1.0 + self.d * f
        if not np.isfinite(f) or below <= 0.0:
            return (self.high_mm if np.isfinite(f) else float("nan")), self.high_mm - self.low_mm
        return float(np.clip((self.c0 + self.c1 * f) / below, *self.known_mm)), self.sigma_mm

    def knows(self, radius_mm: float) -> bool:
        """Whether an answer is the curve's own, and not held at the end of where it is known; False for nan."""
        low, high = self.known_mm
        return low < radius_mm < high
