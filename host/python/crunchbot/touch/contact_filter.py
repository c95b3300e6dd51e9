"""A contact followed through time: where, at which normal, sliding or not, and whether the object moves (contact_filter.h)."""

from typing import NamedTuple

import numpy as np

from ..native import as_doubles, doubles, ffi, lib, octets
from .radial.plug import CREEP, CREEP_S, Plug
from .radial.push import Contact

# The CrunchBot's whisker; a calibration's kappa and cone replace them.
LENGTH_M, CONE_M, KAPPA = 0.140, 0.181739, 1.0
SETTINGS = {
    "cone_m": CONE_M,
    "kappa": KAPPA,
    "creep": CREEP,
    "creep_s": CREEP_S,
    "noise_rad": 2.0e-4,  # 0.03 degrees of field at 2.75 of field per tilt
    "largest_rad": 0.25,
    "gain_sd": 0.01,
    "model_share": 0.02,
    "friction": 0.3,
    "friction_sd": 0.115,  # anywhere from 0.1 to 0.5: resin on wood, plastic, steel
    "motion_share": 0.01,
    "ring_hz": 40.0,
    "ring_damping": 0.1,
    "speed_sd": 0.15,
    "speed_drift": 0.005,
    "moving": 0.02,
    "caught": 0.02,
    "other": 0.1,
    "sample_s": 5e-4,
    "block": 20,
    "report": 2,
}
POSITIVE = ("cone_m", "kappa", "creep_s", "noise_rad", "largest_rad", "ring_hz", "sample_s")
LIMITS = {"friction": 0.5, "moving": 0.5, "caught": 0.3, "other": 0.1}
TIPS = (0.3001, 0.8499)  # length over cone, just within the ends of the beam's tables (contact_beam.h)
LEAST_SAMPLES = 100
FORCE_MOST_RAD = 2.85  # of a force on the tip in the beam's table (contact_beam.h)
NINETY = 1.645  # standard deviations to the ends of a 90 % interval
MOTIONS = ("body whisk", "drive-by", "sweep")
SURE = 0.9  # probability from which on something is said: a tip on a surface, a corner
# In 60 simulated contacts of a corner that moves, 11 of 181 reports before this way had small deviations, and 1 of the 11
# regions held; after it 526 of 539, and 98 % held.
CHANGED_LEAST_M = 5e-4
# Deviations up to which something is sure. In 118 contacts of chains regions of places held in 91 % of the reports up to 6 mm (n
# 1477) and in 14 % above (n 36): their hypotheses lie apart. Normals above 10 degrees were 15 off in the median (n 49).
POINT_MOST_M, NORMAL_MOST_RAD = 0.006, float(np.radians(10.0))


def settings_of(plug: Plug, length_m: float) -> dict[str, float]:
    """Of a calibrated whisker; its cone is limited to what the beam's tables hold."""
    cone_m = length_m / float(np.clip(length_m / (1e-3 * plug.cone_mm), *TIPS))
    return {"kappa": plug.kappa, "cone_m": cone_m, "gain_sd": plug.spread}


class Reports(NamedTuple):
    """What is known in the middle of each report's last block; arrays over k reports, lengths m, angles rad, speeds m/s.

    Whisker's frame: origin at the follicle's exit, x along the unbent whisker, y where axis 0 tilts.
    """

    sample: np.ndarray  # (k,) index of the sample each is of
    point: np.ndarray  # (k, 2)
    point_cov: np.ndarray  # (k, 2, 2)
    velocity: np.ndarray  # (k, 2) of the object
    velocity_cov: np.ndarray  # (k, 2, 2)
    motion: list[str]  # of MOTIONS
    arc_m: np.ndarray  # (k,) along the shaft
    arc_sd_m: np.ndarray
    plane_rad: np.ndarray  # of the bending about the whisker
    plane_sd: np.ndarray
    normal_rad: np.ndarray  # the surface's outward normal
    normal_sd: np.ndarray
    speed: np.ndarray  # of the object, if it moves
    speed_sd: np.ndarray
    sweep: np.ndarray  # probabilities: the object moves ...
    corner: np.ndarray  # ... is a corner ...
    tip: np.ndarray  # ... lies at the tip ...
    slip: np.ndarray  # ... the contact slides
    friction: np.ndarray
    friction_sd: np.ndarray
    curvature: np.ndarray  # of the surface, 1/m, a corner's counted as 0
    curvature_sd: np.ndarray
    other: np.ndarray  # probability that none of the hypotheses holds
    along: np.ndarray  # share of the way since the touch that pushes along the whisker
    changed_m: np.ndarray  # way by which the base has left the motion that it had at the touch

    @property
    def sure(self) -> np.ndarray:
        """(k,) Whether the point is known."""
        point_sd = np.sqrt(np.trace(self.point_cov, axis1=1, axis2=2) / 2.0)
        return (self.other < 0.5) & (point_sd <= POINT_MOST_M) & ~self.columned & ~self.relative

    @property
    def relative(self) -> np.ndarray:
        """(k,) Whether only the object's motion relative to the base is known: it moves, and the base goes on as it did
        at the touch. Place and speed then differ by no more than how the whisker's stiffness changes as it bends."""
        return (self.sweep >= 0.5) & (self.changed_m < CHANGED_LEAST_M)

    @property
    def columned(self) -> np.ndarray:
        """(k,) Whether the whisker may be bent as a column, which no hypothesis is: the push lies along it rather than
        across, and the force, which leans from the normal by friction's angle at most, may lie beyond the beam's table."""
        force = np.abs(self.normal_rad) + NINETY * self.normal_sd + np.arctan(LIMITS["friction"])
        return (self.along > np.sqrt(0.5)) & (force > FORCE_MOST_RAD)

    @property
    def faced(self) -> np.ndarray:
        """(k,) Whether the normal is known: of a surface that stands, under the tip."""
        on = (self.tip >= SURE) & (self.sweep < 0.5) & (self.normal_sd <= NORMAL_MOST_RAD)
        return self.sure & on


class ContactFilter:
    """One whisker's filter. Keywords replace SETTINGS; ValueError names one that does not exist or is out of range."""

    def __init__(self, length_m: float = LENGTH_M, **settings: float):
        unknown = sorted(set(settings) - set(SETTINGS))
        if unknown:
            raise ValueError(f"{unknown[0]}: no setting of the contact filter; use one of {', '.join(SETTINGS)}")
        chosen = SETTINGS | settings
        for name, value in chosen.items():
            _check(name, value)
        self._config = ffi.new("struct nav_contact_filter_config *", chosen)
        self._beam = ffi.new("struct nav_contact_beam *")
        if not lib.nav_contact_beam_make(self._beam, length_m / chosen["cone_m"]):
            raise ValueError(
                f"length_m {length_m}, cone_m {chosen['cone_m']}: no whisker; its length is 0.3 to 0.85 of its cone"
            )
        self.state = ffi.new("struct nav_contact_filter *")
        lib.nav_contact_filter_init(self.state, self._config, self._beam)

    @classmethod
    def calibrated(
        cls, plug: Plug, contact: Contact, **settings: float
    ) -> "tuple[ContactFilter, np.ndarray, np.ndarray]":
        """A filter of a calibrated whisker, and the push of a recorded contact for `run`:
        its bases (n, 3) and tilts (n, 2).

        The push ends at the greatest deflection. The base turns about the follicle's exit by `whisk_rad_s`, or moves across
        the whisker by `push_mm_s`; ValueError when the contact has neither, or too few samples.
        """
        t_s, samples = contact.t_s, as_doubles(contact.samples, "samples", (len(contact.t_s), None))
        if len(t_s) < LEAST_SAMPLES or not t_s[-1] > t_s[0]:
            raise ValueError(f"{len(t_s)} samples; give at least {LEAST_SAMPLES}, with rising times")
        turn, push = contact.whisk_rad_s, contact.push_mm_s
        if turn is None and push is None:
            raise ValueError("no motion of the base; give the column whisk_rad_s or push_mm_s")
        first = samples[: max(10, len(samples) // 20)]
        off = samples - np.nanmedian(first, axis=0)
        noise = float(np.nanstd(plug.along(first)))
        per_rad = plug.counts_per_rad(float(np.nanmedian(turn)) if turn is not None else 1.0)
        along = plug.along(off)
        across = off[:, :2] @ plug.side if samples.shape[1] > 1 else np.zeros(len(off))
        end = int(np.nanargmax(along)) + 1
        bases = np.zeros((end, 3))
        if push is not None:
            bases[:, 1] = -1e-3 * np.abs(push[:end])
        else:
            bases[:, 2] = -np.abs(turn[:end])
        made = settings_of(plug, LENGTH_M) | {"noise_rad": max(noise, 1e-9) / per_rad}
        made |= {"sample_s": float(t_s[-1] - t_s[0]) / (len(t_s) - 1)}
        return cls(**(made | settings)), bases, np.column_stack([along, across])[:end] / per_rad

    def begin(self) -> None:
        """Forget the contact; the counts of bad samples stay."""
        lib.nav_contact_filter_begin(self.state)

    @property
    def not_read(self) -> dict[str, int]:
        """Samples that were not read, by cause, and contacts that nothing explained."""
        return {name: getattr(self.state, name) for name in ("bad", "stuck", "saturated", "restarts")}

    def run(self, bases: np.ndarray, tilts: np.ndarray, good: np.ndarray | None = None) -> Reports:
        """Take the samples of a contact, and report.

        `bases` (n, 3): velocity of the follicle's exit along and across the unbent whisker (m/s) and its rate of turn
        (rad/s, anticlockwise); `tilts` (n, 2) of the plug about its rest, rad; `good` (n,) uint8 or bool, 0: not read.
        nan, saturated and stuck samples are counted and not read. ValueError when shapes differ.
        """
        bases = as_doubles(bases, "bases", (None, 3))
        count = len(bases)
        tilts = as_doubles(tilts, "tilts", (count, 2))
        good = np.ones(count, np.uint8) if good is None else np.ascontiguousarray(good, np.uint8)
        each = self._config.block * self._config.report
        most = count // each + 1
        made, ends = ffi.new("struct nav_contact_answer[]", most), np.empty(most)
        used = lib.nav_contact_filter_run(
            self.state,
            doubles(bases, "bases", (count, 3)),
            doubles(tilts, "tilts", (count, 2)),
            octets(good, "good", (count,)),
            count,
            made,
            doubles(ends, "ends", (most,)),
            most,
        )
        known = [k for k in range(used) if made[k].parts]
        return _reports([made[k] for k in known], ends[known])


def _check(name: str, value: float) -> None:
    """ValueError names a setting that is out of range."""
    if name in ("block", "report"):
        sound, wanted = value >= 1 and value == int(value), "a number of at least 1"
    elif name in POSITIVE:
        sound, wanted = value > 0, "a number above 0"
    elif name in LIMITS:
        sound, wanted = 0 <= value <= LIMITS[name], f"0 to {LIMITS[name]:g}"
    else:
        sound, wanted = value >= 0, "a number of at least 0"
    if not (np.isfinite(value) and sound):
        raise ValueError(f"{name}: {value}; give {wanted}")


def _reports(made: list, ends: np.ndarray) -> Reports:
    def pairs(name: str) -> np.ndarray:
        return np.array([list(getattr(a, name)) for a in made]).reshape(-1, 2)

    def squares(name: str) -> np.ndarray:
        return np.array([[list(row) for row in getattr(a, name)] for a in made]).reshape(-1, 2, 2)

    reported = {"sample": ends.astype(np.int64), "motion": [MOTIONS[a.motion] for a in made]}
    reported |= {name: pairs(name) for name in ("point", "velocity")}
    reported |= {name: squares(name) for name in ("point_cov", "velocity_cov")}
    return Reports(
        **{n: np.array([getattr(a, n) for a in made]) for n in Reports._fields if n not in reported}, **reported
    )
