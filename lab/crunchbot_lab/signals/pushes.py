"""What goes wrong with recorded pushes: they end early, begin late, begin in contact, slip.

Each takes a contact, the sample of its touch, that of its peak and random numbers, and gives another contact.
"""

from dataclasses import replace

import numpy as np

from crunchbot.touch.radial.push import Contact

LEAST_REST = 3  # samples


def _part(whole: Contact, first: int, end: int | None = None) -> Contact:
    return Contact(whole.t_s[first:end], whole.samples[first:end], whole.whisk_rad_s[first:end])


def _rest(whole: Contact, touch: int) -> np.ndarray:
    return whole.samples[: max(LEAST_REST, touch // 2)].mean(axis=0)


def cut(whole: Contact, touch: int, peak: int, rng: np.random.Generator) -> Contact:
    """Its recording ends within the push."""
    return _part(whole, 0, int(touch + (peak - touch) * rng.uniform(0.6, 0.95)))


def delayed(whole: Contact, touch: int, peak: int, rng: np.random.Generator) -> Contact:
    """The base moves for 0.25 to 1.5 s before."""
    step = float(np.median(np.diff(whole.t_s)))
    more = int(rng.uniform(0.25, 1.5) / step)
    rest = _rest(whole, touch) + rng.normal(0.0, 11.0, (more, whole.samples.shape[1]))
    samples = np.concatenate([rest, whole.samples])
    return Contact(step * np.arange(len(samples)), samples, np.full(len(samples), whole.whisk_rad_s[0]))


def started(whole: Contact, touch: int, peak: int, rng: np.random.Generator) -> Contact:
    """It touches already when the recording begins."""
    return _part(whole, int(touch + (peak - touch) * rng.uniform(0.02, 0.25)))


def slipped(whole: Contact, touch: int, peak: int, rng: np.random.Generator) -> Contact:
    """It slips late, and loses a part of its deflection."""
    at, samples = int(touch + (peak - touch) * rng.uniform(0.5, 0.9)), whole.samples.copy()
    samples[at:] -= rng.uniform(0.1, 0.3) * (samples[at] - _rest(whole, touch))
    return replace(whole, samples=samples)


HOWS = {"cut": cut, "delayed": delayed, "started in contact": started, "slipped": slipped}


def spoilt(contacts: list[Contact], touch: int, how: str, rng: np.random.Generator, each: int = 1) -> list[Contact]:
    """Every `each`-th of them so; none: 0."""
    peaks = [int(np.argmax(np.linalg.norm(one.samples - _rest(one, touch), axis=1))) for one in contacts]
    return [
        HOWS[how](one, touch, peak, rng) if each and n % each == 0 else one
        for n, (one, peak) in enumerate(zip(contacts, peaks, strict=True))
    ]
