"""What readings would tell of which hypothesis is true.

With hypotheses of weights w whose readings z are distributed as p_i, I(hypothesis; z) is between
-sum_i w_i ln sum_j w_j exp(-D_ij) with D the Bhattacharyya distance of p_i and p_j, and the same with the Kullback-Leibler
divergence (Kolchinsky and Tracey, Estimating Mixture Entropy with Pairwise Distances, Entropy 19, 2017). The lower one is used.
Readings of successive steps count as independent given the hypothesis, so that distances add up.
"""

import math

import numpy as np

from .places import NOTHING

# Bhattacharyya distance, nats, of a texture window that is right in 85 % under two of three classes. A contact, 5 % of them
# missed and 1 % invented, is at twice that from none.
UNIT_NATS = 0.545
TEXTURE_UNITS, TOUCH_UNITS = 1, 2
UNITS_MOST = 255
PLACE_M, PLACE_RAD = 0.25, math.radians(30.0)  # poses nearer to each other are one place
NEAR = np.exp(-UNIT_NATS * np.arange(UNITS_MOST + 1)).astype(np.float32)


def differ(units: np.ndarray, symbols: np.ndarray, each: int) -> None:
    """Adds `each` to units (..., n, n) uint8 where the symbols (..., n) of two hypotheses differ and both are known."""
    known = symbols != NOTHING
    apart = (symbols[..., :, None] != symbols[..., None, :]) & known[..., :, None] & known[..., None, :]
    units += apart.view(np.uint8) * np.uint8(each)


def bits(units: np.ndarray, weights: np.ndarray, same: np.ndarray) -> np.ndarray:
    """(...,) bits that readings at distances units (..., n, n) tell of the place among hypotheses of weights (n,).

    same (n, n) bool: two hypotheses are one place. What readings tell beyond the place is taken off: the information about the
    hypothesis less that about the hypothesis given its place.
    """
    likely, weights = NEAR[units], weights.astype(np.float32)
    within = np.where(same, likely, np.float32(0.0)) @ weights / (same @ weights)
    return -(np.log2(likely @ weights / within) @ weights)


def one_place(poses: np.ndarray) -> np.ndarray:
    """(n, n) bool which of poses (n, 3) are one place: within PLACE_M and PLACE_RAD."""
    off = poses[:, None] - poses[None]
    turned = np.abs(np.remainder(off[..., 2] + math.pi, 2.0 * math.pi) - math.pi)
    return (np.hypot(off[..., 0], off[..., 1]) < PLACE_M) & (turned < PLACE_RAD)


def entropy_bits(weights: np.ndarray) -> float:
    """Entropy of weights (n,) that sum to 1."""
    some = weights[weights > 0.0]
    return float(-(some * np.log2(some)).sum())


def capacity_bits(accuracy: float, classes: int) -> float:
    """Most bits that a window of a classifier tells, right in `accuracy`, its errors even: log2 C - H(error) - e log2(C - 1)."""
    if classes < 2:
        return 0.0
    error = 1.0 - accuracy
    lost = 0.0 if error <= 0.0 else -error * math.log2(error) + error * math.log2(classes - 1)
    return math.log2(classes) + accuracy * math.log2(accuracy) - lost
