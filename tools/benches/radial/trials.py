"""Whisks with real mechanics for the radial bench: spread between angle and plug, speeds, sampling, what spoils them.

The spread of a whisk is split evenly: half its variance is in the angle turned, half in gain and creep of the plug. The
true rate is known to the oracle only. Sources of the angle's part: `duration`, the base turns at the commanded rate
but for a longer or shorter time; `rate`, it turns faster or slower than commanded for the same time; `rate, reported`:
the same, and the base reports its rate with 2 % of error.
"""

import math
from typing import NamedTuple

import numpy as np

from crunchbot.touch.radial.model import Contact, Whisks, peak
from crunchbot_lab.signals.mechanics import Whisker, contact, unknowns
from crunchbot_lab.signals.world import TICK_S

RADII_MM = (90.0, 100.0, 110.0, 120.0, 130.0, 138.0)
SPREADS = (0.082, 0.040, 0.026, 0.063)  # the paper's whiskers (whisker_physics section 4)
PAPER_MM = (5.68, 2.78, 1.82, 4.37)
WHISK_RAD_S, PUSH_S = math.pi / 24, 0.6
SOURCES = ("duration", "rate", "rate, reported")
TOLD_ERROR = 0.02
CREEP_SHARE = 0.25  # of the plug's variance; the rest is gain
CREEP_SEEN = 0.42  # of creep's final value, after such a push with the typical time constant
PARAMETERS = (*unknowns(), "length", "exit_diameter", "cone", "pivot", "gap")


class Kind(NamedTuple):
    """What a set of whisks is like; `speeds`: the fastest over the slowest; `radii_mm` None: anywhere, 90 to 139 mm."""

    spread: float
    source: str = "duration"
    speeds: float = 1.0
    hz: float = 2000.0
    radii_mm: tuple | None = RADII_MM


class Set(NamedTuple):
    """Whisks and what only an oracle knows: the rate at which each was pushed."""

    whisks: Whisks
    true_rad_s: np.ndarray


def recorded(whisker: Whisker, kind: Kind, repeats: int, rng: np.random.Generator) -> Set:
    """`repeats` whisks at each radius, or six times as many anywhere."""
    radii = kind.radii_mm or tuple(rng.uniform(90.0, 139.0, len(RADII_MM) * repeats))
    truth = np.repeat(radii, repeats if kind.radii_mm else 1)
    made = [_whisk(whisker, radius, kind, rng) for radius in truth]
    contacts = [c for c, _ in made]
    peaks = np.array([_paper_peak(c.samples) for c in contacts])
    return Set(Whisks([str(n) for n in range(len(truth))], contacts, peaks, truth, 0), np.array([a for _, a in made]))


def _paper_peak(samples: np.ndarray) -> float:
    """Equation 2 as `whisker radial` takes it from a recording."""
    finite = samples[np.isfinite(samples).all(axis=1)]
    return peak(finite, np.median(finite[: max(3, len(finite) // 20)], axis=0)) if len(finite) else math.nan


def _whisk(whisker: Whisker, radius_mm: float, kind: Kind, rng: np.random.Generator) -> tuple[Contact, float]:
    part = kind.spread / math.sqrt(2.0)
    angle, gain, creep, log_speed = rng.normal(0, part, 3).tolist() + [rng.uniform(-0.5, 0.5)]
    speed = WHISK_RAD_S * kind.speeds**log_speed
    true = speed if kind.source == "duration" else speed * (1 + angle)
    plug = {
        "gain": whisker.gain * (1 + math.sqrt(1 - CREEP_SHARE) * gain),
        "creep": max(0.0, whisker.creep + math.sqrt(CREEP_SHARE) / CREEP_SEEN * creep),
    }
    this = Whisker(**{name: getattr(whisker, name) for name in PARAMETERS} | plug)
    pushed = WHISK_RAD_S * PUSH_S * (1 + angle)
    done = contact(this, radius_mm * 1e-3, true, pushed, seed=int(rng.integers(1 << 31)))
    step = round(1 / (kind.hz * TICK_S))
    counts = done.counts[::step].astype(np.float64)
    t_s = np.arange(len(counts)) * step * TICK_S
    found = np.full(len(t_s), true * (1 + TOLD_ERROR * rng.normal())) if kind.source == "rate, reported" else None
    return Contact(t_s, counts, np.full(len(t_s), speed), found), true


SPOILS = (
    "nothing",
    "saturated",
    "stuck",
    "swapped",
    "sign-flipped",
    "offset drift",
    "1 % bad records",
    "20 % NaN",
    "all NaN",
)


def spoilt(contact: Contact, how: str, rng: np.random.Generator, other: Contact) -> Contact:
    """A contact as a broken chain would give it; `other`: the same contact as another whisker would see it."""
    if how == "swapped":
        contact = other
    x = contact.samples.copy()
    if how == "saturated":
        x = np.clip(x, 32768 - 800, 32768 + 800)
    elif how == "stuck":
        x[int(0.35 * len(x)) :] = x[int(0.35 * len(x))]
    elif how == "sign-flipped":
        x = 65536 - x
    elif how == "offset drift":
        x += np.linspace(-40, 40, len(x))[:, None]
    elif how == "1 % bad records":
        hit = rng.random(len(x)) < 0.01
        x[hit] = rng.uniform(0, 65535, (np.count_nonzero(hit), x.shape[1]))
    elif how == "20 % NaN":
        x[rng.random(len(x)) < 0.2] = np.nan
    elif how == "all NaN":
        x[:] = np.nan
    return Contact(contact.t_s, x, contact.whisk_rad_s, contact.reported_rad_s)
