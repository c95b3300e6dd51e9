"""Radial distance of a contact: peak deflection and a line per whisker (paper, equations 2 and 3)."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .native import doubles, ffi, lib
from .tables import TableError, numbers, read_columns

FORMAT = "whisker radial model 1"
FIELDS = ("a1", "a0", "sigma_mm", "low_mm", "high_mm")
REST_SHARE = 0.05  # the first samples of a recorded whisk, before it touches, give its rest
REST_LEAST = 10
TIP_MM = 3.0


def peak(samples: np.ndarray, rest) -> float:
    """Equation 2: largest deflection about `rest` over a contact, counts. samples (n, axes); nan when none is finite."""
    samples = np.ascontiguousarray(samples, dtype=np.float64)
    rest = np.ascontiguousarray(np.broadcast_to(np.asarray(rest, dtype=np.float64), samples.shape[1:]))
    return lib.nav_radial_peak(doubles(samples), len(samples), samples.shape[1], doubles(rest))


class RadialModel:
    """r = a1 f1 + a0 (equation 3), its standard error, and the radii it was fitted on."""

    def __init__(self, a1: float, a0: float, sigma_mm: float, low_mm: float, high_mm: float):
        self._line = ffi.new("struct nav_radial *", dict(zip(FIELDS, (a1, a0, sigma_mm, low_mm, high_mm), strict=True)))

    def __getattr__(self, name: str) -> float:
        if name in FIELDS:
            return getattr(self._line, name)
        raise AttributeError(name)

    @classmethod
    def fit(cls, peak_counts, radius_mm) -> "RadialModel":
        """Least squares over contacts; ValueError when fewer than three are usable or all peaks are equal."""
        peaks = np.ascontiguousarray(peak_counts, dtype=np.float64)
        radii = np.ascontiguousarray(radius_mm, dtype=np.float64)
        if peaks.shape != radii.shape or peaks.ndim != 1:
            raise ValueError(f"radial fit: {peaks.shape} peaks but {radii.shape} radii; give one radius per contact")
        model = cls(0.0, 0.0, 0.0, 0.0, 0.0)
        if lib.nav_radial_fit(model._line, doubles(peaks), doubles(radii), len(peaks)) < 0:
            raise ValueError(
                "radial fit: fewer than 3 usable contacts, or all peaks equal; record contacts at more radii"
            )
        return model

    peak = staticmethod(peak)

    def predict(self, peak_counts: float) -> tuple[float, float]:
        """(radius mm, sigma mm) of one contact."""
        return lib.nav_radial_predict(self._line, peak_counts), self._line.sigma_mm

    def contact_type(self, radius_mm: float) -> str:
        """'tip' near the outermost fitted radius (one sigma, at least TIP_MM) or beyond it, else 'shaft'."""
        return "tip" if radius_mm > self.high_mm - max(self.sigma_mm, TIP_MM) else "shaft"

    def save(self, path) -> None:
        content = {"format": FORMAT} | {name: getattr(self, name) for name in FIELDS}
        Path(path).write_text(json.dumps(content, indent=1) + "\n")

    @classmethod
    def load(cls, path) -> "RadialModel":
        """Read what `save` wrote; TableError with one line when it is something else."""
        try:
            content = json.loads(Path(path).read_text())
            if content["format"] != FORMAT:
                raise ValueError(f"format is '{content['format']}'")
            values = [float(content[name]) for name in FIELDS]
            if not np.isfinite(values).all():
                raise ValueError("a number is not finite")
            return cls(*values)
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise TableError(
                path, None, f"not a radial model ({error!r}); make one with 'whisker radial fit'"
            ) from error


@dataclass
class Whisks:
    """Recorded contacts of one whisker, in order of appearance."""

    contact: list[str]
    peak_counts: np.ndarray
    radius_mm: np.ndarray | None  # None when the file has no such column
    bad_rows: int  # rows with a cell that is no finite number: left out


def read_whisks(path, with_radius: bool) -> Whisks:
    """Contacts of a calibration CSV; `with_radius`: the column radius_mm is required, else not even read."""
    text = read_columns(path, ["contact", "t_s"] + (["radius_mm"] if with_radius else []))
    channels = [name for name in text if name not in ("contact", "radius_mm", "t_s", "whisk_rad_s")]
    if not channels:
        raise TableError(path, 1, "no channel column; add at least one, as in 'contact,radius_mm,t_s,x,y'")
    samples = np.column_stack([numbers(text[name]) for name in channels])
    names = list(dict.fromkeys(text["contact"]))
    ids = np.array(text["contact"])
    rows = [np.flatnonzero(ids == name) for name in names]
    peaks = np.array([_peak_of(samples[r]) for r in rows])
    radii = np.array([np.median(numbers(text["radius_mm"])[r]) for r in rows]) if with_radius else None
    return Whisks(names, peaks, radii, int((~np.isfinite(samples)).any(axis=1).sum()))


def _peak_of(samples: np.ndarray) -> float:
    finite = samples[np.isfinite(samples).all(axis=1)]
    if len(finite) == 0:
        return float("nan")
    return peak(finite, np.median(finite[: max(REST_LEAST, int(REST_SHARE * len(finite)))], axis=0))
