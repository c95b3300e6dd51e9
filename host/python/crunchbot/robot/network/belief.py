"""A filter's belief in at most so many components, its shape kept: every hypothesis, not one ellipse."""

import numpy as np

from ...nav.filters import COMPONENT
from .messages import Belief, Header
from .ranges import COMPONENTS_MOST

NEGLECTED = 1e-3  # share of the belief that its lightest components may hold together; they are left out
FINEST = (0.02, np.radians(2.5))  # m, rad: cells to merge components in; doubled until few enough are left


def condense(components: np.ndarray, most: int = COMPONENTS_MOST) -> np.ndarray:
    """At most `most` components, (n,) of COMPONENT, heaviest first: the lightest left out, those of a cell become one.

    A merged component has the cell's mean pose and mass, and a width that takes in those of its parts and their distances
    (moments kept; sigma_m is that of x and y together, per axis).
    """
    mass = np.ascontiguousarray(components["mass"])
    # Those below an even share of what may be left out are left out, all together: they need not be sorted.
    heavy = np.flatnonzero(mass >= NEGLECTED * mass.sum() / max(len(mass), 1))
    kept = components[heavy[np.argsort(-mass[heavy], kind="stable")]]
    held = np.cumsum(kept["mass"])
    kept = kept[: int(np.searchsorted(held, (1.0 - NEGLECTED) * mass.sum())) + 1] if len(kept) else kept
    scale = 1.0
    while len(kept) > most:
        cells = _cells(kept["pose"], scale)
        if cells.max() < most:
            kept = _merged(kept, cells)
        scale *= 2.0
    return kept


def _cells(poses: np.ndarray, scale: float) -> np.ndarray:
    """(n,) number of each pose's cell, from 0."""
    size = np.array([FINEST[0], FINEST[0], FINEST[1]]) * scale
    keys = np.floor(poses / size).astype(np.int64)
    keys[:, 2] %= max(1, round(2.0 * np.pi / size[2]))
    keys -= keys.min(axis=0)
    _, rows, turns = keys.max(axis=0) + 1
    return np.unique((keys[:, 0] * rows + keys[:, 1]) * turns + keys[:, 2], return_inverse=True)[1]


def _merged(components: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """One component a cell."""
    mass, count = components["mass"], cells.max() + 1

    def mean(values):
        return np.bincount(cells, mass * values, count) / out["mass"]

    out = np.zeros(count, COMPONENT)
    out["mass"] = np.bincount(cells, mass, count)
    x, y, theta = components["pose"].T
    out["pose"][:, 0], out["pose"][:, 1] = mean(x), mean(y)
    out["pose"][:, 2] = np.arctan2(mean(np.sin(theta)), mean(np.cos(theta)))
    off = components["pose"] - out["pose"][cells]
    turned = np.arctan2(np.sin(off[:, 2]), np.cos(off[:, 2]))
    out["sigma_m"] = np.sqrt(mean(components["sigma_m"] ** 2 + (off[:, 0] ** 2 + off[:, 1] ** 2) / 2.0))
    out["sigma_rad"] = np.sqrt(mean(components["sigma_rad"] ** 2 + turned**2))
    return out[np.argsort(-out["mass"], kind="stable")]


def to_message(header: Header, name: str, seq: int, components: int, few: np.ndarray) -> Belief:
    """The Belief of a filter after row `seq`: of as many components, condensed to `few`."""
    columns = (*few["pose"].T, few["mass"], few["sigma_m"], few["sigma_rad"])
    return Belief(header, name, seq, components, float(few["mass"].sum()), *(c.astype("f4") for c in columns))
