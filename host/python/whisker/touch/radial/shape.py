"""Recorded whisks as shapes (host/nav/touch/radial_whisk.h), the numbers in which a model sees them."""

from dataclasses import dataclass

import numpy as np

from ...native import doubles, ffi, lib

TERMS = ("turn", "rate", "told", "bow", "back")
SAMPLES_LEAST = 8
CROP_SHARE = 0.1  # of the peak: what is above belongs to the contact


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
