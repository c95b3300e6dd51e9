"""Faults of recorded contacts: what cannot be learned from, and what is read in spite of a fault."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...tables import TableError, Warn
from .push import SAMPLES_LEAST, Contact

RATES_APART = 0.1  # relative: contacts sampled alike
STUCK_MOST = 0.5  # of a contact's samples: share that one value beside the rest may last
SATURATED_RUN, SATURATED_LEAST = 3, 3  # samples in a row at a channel's extreme; contacts that reach it so
NAMED_MOST = 5  # contacts in a line


def radii_of_contacts(path: str | Path, names: list[str], radius_mm: np.ndarray, rows: list[np.ndarray]) -> np.ndarray:
    """The one radius of each contact; TableError where a contact has none above 0, or two."""
    for name, some in zip(names, rows, strict=True):
        known = radius_mm[some]
        if not (known[np.isfinite(known)] > 0.0).any() or (known <= 0.0).any():
            text = f"contact {name}: column 'radius_mm' holds no number above 0; give its distance from the mount"
            raise TableError(path, int(some[0]) + 2, text)
        known = known[np.isfinite(known)]
        if known.min() != known.max():
            text = (
                f"contact {name}: column 'radius_mm' holds {known.min():g} and {known.max():g}; give each contact one"
            )
            raise TableError(path, int(some[0]) + 2, f"{text} radius, and each contact a name of its own")
    return np.array([np.nanmedian(radius_mm[some]) for some in rows])


def faulty(
    path: str | Path,
    channels: list[str],
    names: list[str],
    contacts: list[Contact],
    directions: np.ndarray | None,
    warn: Warn,
) -> np.ndarray:
    """Whether a contact (n,) is too short or stuck to learn from. Every fault is a line to `warn`; TableError for those that
    leave nothing to read."""
    good = [np.isfinite(c.samples).all(axis=1) & np.isfinite(c.t_s) for c in contacts]
    late = [n for n, c in enumerate(contacts) if (np.diff(c.t_s[good[n]]) <= 0.0).any()]
    if late:
        raise TableError(
            path, None, f"column 't_s' does not increase {_list(names, late)}; give each row its time in s"
        )
    bad = sum(int((~some).sum()) for some in good)
    if bad:
        warn(f"{path}: {bad} rows have a cell that is no number in t_s or a channel; they are left out")
    whole = [c.samples[some] for c, some in zip(contacts, good, strict=True)]
    short = np.array([len(some) < SAMPLES_LEAST for some in whole])
    if short.all():
        text = (
            f"no contact has {SAMPLES_LEAST} rows with numbers in t_s and {', '.join(channels)}; record longer contacts"
        )
        raise TableError(path, None, text)
    if short.any():
        warn(f"{path}: fewer than {SAMPLES_LEAST} samples {_list(names, np.flatnonzero(short))}; record these anew")
    for fault in _rates(names, contacts, good, ~short):
        warn(f"{path}: {fault}")
    kept = np.flatnonzero(~short)
    dead = [c for c in range(len(channels)) if all(np.ptp(whole[n][:, c]) == 0.0 for n in kept)]
    if len(dead) == len(channels):
        raise TableError(path, None, f"no channel ever changes ({', '.join(channels)}); check sensor and cable")
    stuck = np.zeros(len(contacts), bool)
    for c, channel in enumerate(channels):
        if c in dead:
            warn(f"{path}: column '{channel}' never changes; check its sensor, or leave the column out")
            continue
        held = kept[[_stuck(whole[n][:, c]) for n in kept]]
        groups = np.zeros(len(contacts)) if directions is None else np.nan_to_num(directions)
        held = [
            n
            for n in held
            if 2 * np.isin(held, np.flatnonzero(groups == groups[n])).sum() < (groups == groups[n]).sum()
        ]
        if held:
            warn(f"{path}: column '{channel}' is stuck {_list(names, held)}; check sensor and cable, record these anew")
        stuck[held] = True
        cut = [n for n in kept if _at_extreme(whole[n][:, c], np.concatenate([whole[k][:, c] for k in kept]))]
        if len(cut) >= SATURATED_LEAST:
            warn(f"{path}: column '{channel}' is saturated {_list(names, cut)}; push less, or move the sensor away")
    return short | stuck


def _list(names: list[str], chosen) -> str:
    """'in 7 contacts (0, 3, ...)'."""
    shown = ", ".join(names[n] for n in chosen[:NAMED_MOST]) + (", ..." if len(chosen) > NAMED_MOST else "")
    return f"in {len(chosen)} contact{'s' if len(chosen) > 1 else ''} ({shown})"


def _rates(names: list[str], contacts: list[Contact], good: list[np.ndarray], use: np.ndarray) -> Iterator[str]:
    period = np.array(
        [np.median(np.diff(c.t_s[g])) if u else np.nan for c, g, u in zip(contacts, good, use, strict=True)]
    )
    slow, fast = np.nanargmax(period), np.nanargmin(period)
    if period[slow] > (1.0 + RATES_APART) * period[fast]:
        rates = f"{1.0 / period[slow]:.4g} Hz (contact {names[slow]}) to {1.0 / period[fast]:.4g} Hz (contact {names[fast]})"
        yield f"column 't_s': sampled at {rates}; record all contacts at one rate"


def _stuck(x: np.ndarray) -> bool:
    """Whether one value lasts for the whole contact, or one beside the rest for most of it."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(x)) + 1, [len(x)]])
    longest = int(np.argmax(np.diff(edges)))
    rest = np.median(x[: max(3, len(x) // 20)])
    lasts = (edges[longest + 1] - edges[longest]) / len(x)
    return len(edges) == 2 or (lasts > STUCK_MOST and x[edges[longest]] != rest)


def _at_extreme(x: np.ndarray, everything: np.ndarray) -> bool:
    """Whether a contact's channel stays at the extreme of all contacts, away from its rest."""
    rest = np.median(x[: max(3, len(x) // 20)])
    ends = [end for end in (everything.min(), everything.max()) if end != rest]
    return any((np.convolve(x == end, np.ones(SATURATED_RUN)) == SATURATED_RUN).any() for end in ends)
