"""Peak to radius by a parabola or a rational function: the paper's line bends when the plug is no match for the whisker."""

import numpy as np

from ...fields import Fields
from .whisk_fit import TIP_MM


def radii_of(fields: Fields, *names: str) -> list[float]:
    """A deviation, the lowest and the highest radius of a model, mm."""
    sigma, low, high = (fields.number(name, 0.0, RADIUS_MOST_MM) for name in names)
    fields.number(names[2], low, RADIUS_MOST_MM)
    return [sigma, low, high]


class Known:
    """What models of known radii share. high_mm: the outermost of them; sigma_mm: error of a prediction."""

    node: int | None = None  # whose whisker it is, where known
    high_mm: float
    sigma_mm: float

    def contact_type(self, radius_mm: float) -> str:
        """'tip' near the outermost fitted radius (one sigma, at least TIP_MM) or beyond it, else 'shaft'."""
        return "tip" if radius_mm > self.high_mm - max(self.sigma_mm, TIP_MM) else "shaft"


RADIUS_MOST_MM = 1e5
LEAST = 1e-12  # of what must be above 0
LEAST_BELOW, BELOW_MOST = (
    0.05,
    50.0,
)  # of the rational curve's denominator at the largest peak: no pole among the contacts
GRID, ZOOMS = 21, 7


class CurveModel(Known):
    """r = (c0 + c1 f + c2 f^2)/(1 + d f), f = peak/scale: `quadratic` has d = 0, `rational` c2 = 0.

    The rational one is exact for a conical whisker in a plug of any stiffness (whisker_physics section 4).
    """

    KINDS = ("quadratic", "rational")
    NUMBERS = ("c0", "c1", "c2", "d", "scale", "sigma_mm", "low_mm", "high_mm")

    def __init__(self, content: dict):
        """`content`: "kind" and NUMBERS by name."""
        self.kind = content["kind"]
        values = [float(content[name]) for name in self.NUMBERS]
        self.c0, self.c1, self.c2, self.d, self.scale, self.sigma_mm, self.low_mm, self.high_mm = values

    @classmethod
    def of(cls, fields: Fields) -> "CurveModel":
        """Makes a model from what `content` gave; ValueError names the field that is wrong."""
        numbers = {name: fields.number(name) for name in cls.NUMBERS[:4]} | {"scale": fields.number("scale", LEAST)}
        radii = zip(cls.NUMBERS[5:], radii_of(fields, *cls.NUMBERS[5:]), strict=True)
        return cls({"kind": fields.text("kind", *cls.KINDS)} | numbers | dict(radii))

    @property
    def content(self) -> dict:
        """What makes the same model again."""
        return {"kind": self.kind} | {name: getattr(self, name) for name in self.NUMBERS}

    @classmethod
    def fit(cls, kind: str, peak_counts: np.ndarray, radius_mm: np.ndarray) -> "CurveModel":
        """Least squares; sigma_mm is the RMS error of places left out. ValueError when they do not determine it."""
        peaks, radii = (np.asarray(v, np.float64) for v in (peak_counts, radius_mm))
        use = np.isfinite(peaks) & np.isfinite(radii)
        peaks, radii = peaks[use], radii[use]
        if len(peaks) < 5 or len(np.unique(peaks)) < 4:
            raise ValueError(
                f"radial fit: {kind} needs at least 5 usable contacts of different peaks; record contacts at more radii"
            )
        scale = float(np.abs(peaks).max())
        numbers = cls._solve(kind, peaks / scale, radii)
        model = cls(
            {"kind": kind, "scale": scale, "low_mm": radii.min(), "high_mm": radii.max(), "sigma_mm": 0.0} | numbers
        )
        left = []
        for place in np.unique(radii):
            kept = radii != place
            if len(np.unique(peaks[kept])) < 4:
                kept[:] = True
            without = cls(model.content | cls._solve(kind, peaks[kept] / scale, radii[kept]))
            left += [without.predict(one)[0] - place for one in peaks[radii == place]]
        model.sigma_mm = float(np.sqrt(np.mean(np.square(left))))
        return model

    @staticmethod
    def _solve(kind: str, f: np.ndarray, radii: np.ndarray) -> dict:
        """Least squares of the radii; given d, the rational curve is linear, and d is searched on ever finer grids."""
        if kind == "quadratic":
            c0, c1, c2 = np.linalg.lstsq(np.column_stack([np.ones(len(f)), f, f**2]), radii, rcond=None)[0]
            return {"c0": c0, "c1": c1, "c2": c2, "d": 0.0}
        low, high = np.log([LEAST_BELOW, BELOW_MOST])
        for _ in range(ZOOMS):
            tried = np.linspace(low, high, GRID)
            columns = np.stack([np.ones(len(f)), f], axis=1) / (1.0 + np.expm1(tried)[:, None, None] * f[:, None])
            found = np.linalg.pinv(columns) @ radii
            left = np.sum((np.einsum("gnk,gk->gn", columns, found) - radii) ** 2, axis=1)
            best = int(np.argmin(left))
            low, high = tried[max(0, best - 1)], tried[min(GRID - 1, best + 1)]
        c0, c1 = found[best]
        return {"c0": c0, "c1": c1, "c2": 0.0, "d": np.expm1(tried[best])}

    def predict(self, peak_counts: float) -> tuple[float, float]:
        """(radius mm, sigma mm) of one contact; the radius is held where the curve is known, and 10 % beyond."""
        f = peak_counts / self.scale
        below = 1.0 + self.d * f
        if not np.isfinite(f) or below <= 0.0:
            return (self.high_mm if np.isfinite(f) else float("nan")), self.high_mm - self.low_mm
        slack = 0.1 * self.high_mm
        mm = (self.c0 + self.c1 * f + self.c2 * f * f) / below
        return float(np.clip(mm, self.low_mm - slack, self.high_mm + slack)), self.sigma_mm
