"""Radial distance from whole whisks: the model of one whisker (host/nav/touch/radial/radial_whisk.h)."""

import math
from typing import Any

import numpy as np

from ...fields import Fields
from ...native import as_doubles, ffi, lib
from .curve import radii_of
from .push import LEAST, Contact
from .shape import TERMS, shape_of
from .whisk_fit import learn

LEAST_CONTACTS = 5
LOG_RATE_NONE = 1e-6  # rates were not known in calibration: seconds stand for radians


class WhiskModel:
    """`nav_whisk_model` of one whisker: made by `fit` or from what `content` gave."""

    plug = None
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
        self._c = ffi.new("struct nav_whisk_model *", content)

    @classmethod
    def of(cls, fields: Fields) -> "WhiskModel":
        """Makes a model from what `content` gave; ValueError names the field that is wrong."""
        found = {name: fields.number(name) for name in cls.SCALARS[1:]}
        for name in ("spread", "kappa", "direction_sd", "log_misfit_sd", "low_mm"):
            fields.number(name, LEAST)
        _, low_mm, high_mm = radii_of(fields, "tip_mm", "low_mm", "high_mm")
        fields.number("high_mm", math.nextafter(low_mm, math.inf))
        fields.number("cone_mm", math.nextafter(high_mm, math.inf))
        found |= {"axes": fields.whole("axes", 1, lib.NAV_TRACE_AXES)}
        lengths = {name: (lib.NAV_TRACE_AXES if name == "direction" else len(TERMS),) for name in cls.ARRAYS}
        for name, shape in (lengths | {"covariance": (len(TERMS), len(TERMS))}).items():
            found[name] = as_doubles(fields.array(name, len(shape)), f"field '{name}'", shape).tolist()
        return cls(found)

    @property
    def content(self) -> dict:
        """What makes the same model again, as plain numbers and lists."""
        scalars = {name: getattr(self._c, name) for name in self.SCALARS}
        arrays = {name: list(getattr(self._c, name)) for name in self.ARRAYS}
        return scalars | arrays | {"covariance": [list(row) for row in self._c.covariance]}

    def __getattr__(self, name: str):
        """A scalar member of `nav_whisk_model`, as kappa or low_mm; `spread`: relative standard deviation from whisk to
        whisk that is left."""
        if name in self.SCALARS:
            return getattr(self._c, name)
        raise AttributeError(name)

    def shape_of(self, contact: Contact) -> ffi.CData:
        """struct nav_shape of a contact, its commanded rate as in calibration where it is not known with this one."""
        log_rate = self._c.mean[TERMS.index("rate")]
        rate = contact.whisk_rad_s
        if abs(log_rate) < LOG_RATE_NONE:
            rate = None
        elif rate is None:
            rate = np.full(len(contact.t_s), math.exp(log_rate))
        return shape_of(Contact(contact.t_s, contact.samples, rate, contact.reported_rad_s))

    def counts_per_rad(self, whisk_rad_s: float) -> float:
        """Counts per radian by which the plug tilts; `whisk_rad_s`: of calibration, where its file did not state it."""
        turn = TERMS.index("turn")
        rate = whisk_rad_s if abs(self._c.mean[TERMS.index("rate")]) < LOG_RATE_NONE else 1.0
        return math.exp(self._c.log_gain - self._c.mean[turn]) / rate

    def along(self, deflection: np.ndarray) -> np.ndarray:
        """Deflections (n, axes), counts, as a signed length (n,) along the direction of calibration."""
        return np.asarray(deflection) @ np.array(list(self._c.direction)[: self.axes])

    @property
    def side(self) -> np.ndarray:
        """Unit vector (2,) over the first two axes at right angles to the direction of calibration."""
        x, y = self._c.direction[0], self._c.direction[1]
        return np.array([-y, x]) / max(1e-9, math.hypot(x, y))

    def share(self, radius_mm: float) -> float:
        """h(a): tilt of the plug per angle pushed at this radius."""
        return math.exp(lib.nav_whisk_height(self._c.kappa, self._c.cone_mm, radius_mm))

    def share_of(self, shape: Any) -> float:
        """What `share` gives for a radius, as a whisk shows it; negative: bent away from the direction of calibration; nan: no whole whisk."""
        if shape.quality != lib.NAV_SHAPE_WHOLE or not (shape.turn > 0 and shape.peak > 0):
            return math.nan
        turned = math.log(shape.turn) - self._c.mean[TERMS.index("turn")]
        size = math.exp(math.log(shape.peak) - self._c.log_gain - turned)
        return math.copysign(size, self.along([list(shape.direction)[: self.axes]])[0])

    def estimate(self, shape: Any) -> ffi.CData:
        """struct nav_whisk_estimate of a whisk."""
        out = ffi.new("struct nav_whisk_estimate *")
        lib.nav_whisk_estimate(self._c, shape, out)
        return out

    @classmethod
    def fit(cls, shapes: list, radius_mm: np.ndarray, axes: int) -> "WhiskModel":
        """Fits a model to shapes of contacts at known radii; ValueError when too few are usable or all at one radius."""
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
        return cls(learn([shapes[n] for n in use], radii) | {"axes": axes})
