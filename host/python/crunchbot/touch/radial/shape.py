"""Recorded whisks as shapes (host/nav/touch/radial/radial_whisk.h), the numbers in which a model sees them."""

from typing import Any

import numpy as np

from ...native import as_doubles, doubles, ffi, lib
from .push import SAMPLES_LEAST, Contact

TERMS = ("turn", "rate", "reported", "bow", "back")
CROP_SHARE = 0.1  # of the peak: what is above belongs to the contact


def shape_of(contact: Contact) -> ffi.CData:
    """struct nav_shape of a recorded whisk; what is recorded long before and after it is left out. ValueError: a column has
    another length than the others, or no channel."""
    samples = as_doubles(contact.samples, "samples", (None, None))[:, : lib.NAV_TRACE_AXES]
    if not samples.shape[1]:
        raise ValueError(f"samples: shape {samples.shape}; give at least one channel")
    part = _crop(contact)
    t_s = _column(contact, "t_s", part)
    rates = [
        ffi.NULL if getattr(contact, name) is None else _column(contact, name, part)
        for name in ("whisk_rad_s", "reported_rad_s")
    ]
    samples = np.ascontiguousarray(samples[part])
    trace, shape = ffi.new("struct nav_trace *"), ffi.new("struct nav_shape *")
    lib.nav_trace_begin(trace, samples.shape[1])
    lib.nav_trace_run(trace, len(samples), t_s, doubles(samples, "samples", samples.shape), *rates)
    lib.nav_shape_of(trace, shape)
    return shape


def _column(contact: Contact, name: str, part: slice):
    """Part of a column for C, which keeps its array alive."""
    values = as_doubles(getattr(contact, name), name, (len(contact.samples),))[part]
    return doubles(values, name, values.shape)


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


def terms_of(shape: Any) -> np.ndarray:
    """The model's terms of a whisk (TERMS); nan where one was not measured."""
    out = np.empty(len(TERMS))
    lib.nav_whisk_terms(shape, doubles(out, "terms", (len(TERMS),)))
    return out
