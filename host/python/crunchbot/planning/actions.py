"""What a robot may do next, as poses relative to where it stands: turn, drive, and follow a wall by turning out and in."""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

STEP_M, STEP_RAD = 0.1, math.radians(30.0)  # readings are foretold at steps of so much
REACH_M = 1.4
CUTS_M = (0.2, 0.4, 0.7, 1.0, REACH_M)  # lengths that a drive may have


@dataclass(frozen=True)
class Vehicle:
    """Speeds, m/s and rad/s; what a contact costs without and with a body whisk, s; `settle_s` after each
    change of speed, in which the floor is not read; `reads_always`: every contact is a reading,
    in every row, and stops nothing."""

    drive_m_s: float
    turn_rad_s: float
    contact_s: float = 0.0
    whisk_s: float = 0.0
    settle_s: float = 0.0
    reads_always: bool = False


@dataclass(frozen=True)
class Fan:
    """Turns to all sides with a drive after each: (directions,) of `turn_rad`, and (directions, steps, 3) of `poses` in the
    robot's frame; `turning` (directions, steps): the step is part of the turn; `valid`: the step is one at all; `driven_m`."""

    turn_rad: np.ndarray
    poses: np.ndarray
    turning: np.ndarray
    valid: np.ndarray
    driven_m: np.ndarray

    @classmethod
    @cache
    def all_round(cls) -> "Fan":
        """Every STEP_RAD, left and right, each with a drive of REACH_M."""
        half = round(math.pi / STEP_RAD)
        counts = [0, *(sign * n for n in range(1, half) for sign in (1, -1)), half]
        drives, steps = round(REACH_M / STEP_M), half + round(REACH_M / STEP_M)
        turn = np.array(counts) * STEP_RAD
        poses, driven = np.zeros((len(counts), steps, 3)), np.zeros((len(counts), steps))
        turning, valid = np.zeros((2, len(counts), steps), bool)
        for k, count in enumerate(counts):
            n = abs(count)
            poses[k, :n, 2] = math.copysign(STEP_RAD, count) * np.arange(1, n + 1)
            driven[k, n : n + drives] = STEP_M * np.arange(1, drives + 1)
            driven[k, n + drives :] = REACH_M
            poses[k, n:, 0], poses[k, n:, 1] = driven[k, n:] * math.cos(turn[k]), driven[k, n:] * math.sin(turn[k])
            poses[k, n:, 2] = turn[k]
            turning[k, :n], valid[k, : n + drives] = True, True
        return cls(turn, poses, turning, valid, driven)
