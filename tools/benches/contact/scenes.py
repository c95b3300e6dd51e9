"""Contacts whose truth is known: corners by sim/mechanics with vibration; corners and surfaces by a chain of links in
MuJoCo.

A scene gives, for every tick of 0.5 ms from the first touch on: the base's motion as reported, the measured tilt of the
plug in two axes, and the truth in the whisker's frame.
"""

import hashlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..mechanics.measure import chain, spec

ROOT = Path(__file__).resolve().parents[3]
FOLLOW = Path(__file__).resolve().parent / "peers/follow.py"

TICK_S = 5e-4
CONE, TIP = 0.181739, 0.140
CREEP, CREEP_S, KAPPA = 0.075, 0.5, 1.0
NOISE_RAD, GAIN_SD, MOTION_SD = 2e-4, 0.01, 0.01
# Resin on painted wood or plastic about 0.2 to 0.4; whisker on steel 0.48 (Huet and Hartmann 2016, IEEE Trans. Haptics).
FRICTION = (0.1, 0.5)
RADIUS_SD_M, SPEED_SD = 0.03, 0.15  # of a place anywhere from 36 to 140 mm; of each component of an object's velocity
LEAD = 800  # ticks before a corner is touched
EVERY = 10  # ticks between two solutions of the elastica
QUARTER = np.pi / 2
REACH_M = 1e-3  # beyond the tip: the chain ends in a cap
LEAST_M, LARGEST_RAD = 0.036, 0.25  # nearer, the mount is touched; the plug's stop


class Scene(NamedTuple):
    """Arrays over n ticks; whisker's frame, SI."""

    bases: np.ndarray  # (n, 3) as reported
    tilt: np.ndarray  # (n, 2) measured
    point: np.ndarray  # (n, 2)
    normal: np.ndarray  # (n,) of the surface; nan: a corner
    velocity: np.ndarray  # (n, 2) of the object
    grip: np.ndarray  # (n,) share of the friction cone that the force uses; nan: not known


class Draw(NamedTuple):
    """What a contact's filter does not know: ln of the gain, friction, error of the reported motion, noise."""

    gain: float
    friction: float
    motion: float
    rng: np.random.Generator

    @classmethod
    def of(cls, words: str) -> "Draw":
        """By the hash of what the contact is called."""
        rng = np.random.default_rng(list(hashlib.sha256(words.encode()).digest()))
        return cls(GAIN_SD * rng.normal(), rng.uniform(*FRICTION), MOTION_SD * rng.normal(), rng)

    def measured(self, tilt: np.ndarray) -> np.ndarray:
        """(n, 2) from the tilt (n,) of the bending's plane."""
        both = np.column_stack([np.exp(self.gain) * tilt, np.zeros(len(tilt))])
        return both + NOISE_RAD * self.rng.normal(size=both.shape)


def seen(bases: np.ndarray, world: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points of the world (n, 2) in the moving whisker's frame, and its direction (n,), after each tick."""
    place, direction = np.zeros(2), 0.0
    out, directions = np.empty_like(world), np.empty(len(world))
    for i, base in enumerate(bases):
        c, s = np.cos(direction), np.sin(direction)
        place = place + TICK_S * np.array([c * base[0] - s * base[1], s * base[0] + c * base[1]])
        direction += TICK_S * base[2]
        x, y = world[i] - place
        c, s = np.cos(direction), np.sin(direction)
        out[i], directions[i] = (c * x + s * y, c * y - s * x), direction
    return out, directions


def turned(vectors: np.ndarray, directions: np.ndarray) -> np.ndarray:
    c, s = np.cos(directions), np.sin(directions)
    return np.column_stack([c * vectors[:, 0] + s * vectors[:, 1], c * vectors[:, 1] - s * vectors[:, 0]])


class Plan(NamedTuple):
    """What happens: an object is met at a place of the straight whisker while base (n, 3) and object (n, 2) move."""

    bases: np.ndarray  # velocity along and across the whisker, rate of turn
    velocity: np.ndarray  # of the object, in the world, whose axes are the whisker's at the first touch
    touched_m: float
    normal: float = QUARTER  # of the surface there
    thing: dict = {"kind": "peg"}  # what is met (peers/follow.py); sim/mechanics knows pegs only
    lies: bool = False  # the contact goes on when the whisker lies along the surface


class Corner(NamedTuple):
    """A plan whose object is a corner."""

    plan: Plan

    def felt(self, friction: float, ahead_m: float = 0.0, level: int | None = None):
        """Tilt (n,) by sim/mechanics, point (n, 2) and object's velocity (n, 2) in the whisker's frame.

        `ahead_m`: how far the corner stands ahead of the place at which it would touch first. Base and object have
        moved as in the first tick for LEAD ticks before: what the start excites has decayed.
        """
        from crunchbot_lab.signals.mechanics import WHOLE, Whisker, touch

        whisker = Whisker(kappa=KAPPA, friction=friction, creep=CREEP, creep_s=CREEP_S)
        bases = np.concatenate([np.tile(self.plan.bases[0], (LEAD, 1)), self.plan.bases])
        velocity = np.concatenate([np.tile(self.plan.velocity[0], (LEAD, 1)), self.plan.velocity])
        moved = TICK_S * np.cumsum(velocity, axis=0)
        back, direction = seen(bases[:LEAD], np.zeros((LEAD, 2)))
        x, y = np.array([self.plan.touched_m, ahead_m]) - back[-1]  # in the whisker's frame at the first touch
        c, s = np.cos(direction[-1]), np.sin(direction[-1])
        point, directions = seen(bases, np.array([c * x - s * y, s * x + c * y]) - moved[LEAD - 1] + moved)
        radius, theta = np.hypot(*point.T), np.arctan2(point[:, 1], point[:, 0])
        on = (theta > 0) & (radius < TIP)
        felt = touch(
            whisker,
            np.where(on, radius, 0),
            np.where(on, theta, 0),
            bases[:, 2],
            seed=1,
            level=WHOLE if level is None else level,
        )
        return felt.tilt_rad[LEAD:, 0], point[LEAD:], turned(velocity, directions)[LEAD:]

    def scene(self, draw: Draw) -> Scene:
        tilt, point, velocity = self.felt(draw.friction)
        none = np.full(len(tilt), np.nan)
        reported = self.plan.bases * (1 + draw.motion)
        return Scene(reported, draw.measured(tilt), point, none, velocity, none)

    def bound(self, draw: Draw) -> np.ndarray:
        """(n,) Cramer-Rao bound of the point's error, mm: root of the trace of its least covariance after each tick.

        Unknown: start of the contact (free), place, gain, friction, error of the reported motion, and of an object that
        moves its velocity, with the priors of the filter. The whisker is quasi-static, the kind of contact known.
        """
        from crunchbot_lab.signals.mechanics import LARGE

        moves = bool(np.any(self.plan.velocity))
        steps = {"radius": 1e-4, "ahead": 1e-5, "motion": 1e-3, "friction": 1e-2} | (
            {"vx": 1e-3, "vy": 1e-3} if moves else {}
        )

        def answer(radius=0.0, ahead=0.0, motion=0.0, friction=0.0, vx=0.0, vy=0.0):
            plan = self.plan
            other = Corner(Plan(plan.bases * (1 + motion), plan.velocity + np.array([vx, vy]), plan.touched_m + radius))
            tilt, point, _ = other.felt(draw.friction + friction, ahead, LARGE)
            return tilt, point

        tilts, points = [], []
        for name, step in steps.items():
            (high, high_at), (low, low_at) = answer(**{name: step}), answer(**{name: -step})
            tilts.append((high - low) / (2 * step))
            points.append((high_at - low_at) / (2 * step))
        middle = answer()[0]
        slopes = np.column_stack([*tilts, middle])  # the last: by ln of the gain
        places = np.stack([*points, np.zeros_like(points[0])], axis=2)
        prior = dict.fromkeys(steps, 0.0) | {"radius": RADIUS_SD_M**-2.0, "motion": MOTION_SD**-2.0}
        prior |= {"friction": 12.0 / (FRICTION[1] - FRICTION[0]) ** 2} | (
            {"vx": SPEED_SD**-2.0, "vy": SPEED_SD**-2.0} if moves else {}
        )
        held = np.diag([*prior.values(), GAIN_SD**-2.0])
        information = held + np.cumsum(slopes[:, :, None] * slopes[:, None, :], axis=0) / NOISE_RAD**2
        least = np.linalg.pinv(information[EVERY:], hermitian=True)
        traces = np.einsum("nik,nkl,nil->n", places[EVERY:], least, places[EVERY:])
        return 1e3 * np.sqrt(np.concatenate([np.full(EVERY, np.nan), traces]))


def job_of(plan: Plan, draw: Draw) -> dict:
    """What peers/follow.py is asked for."""
    against = plan.bases - np.column_stack([plan.velocity, np.zeros(len(plan.bases))])
    job = {"beam": spec(0.3e-3, KAPPA, 20), "thing": plan.thing, "place": [plan.touched_m, 0.0], "normal": plan.normal}
    return job | {"friction": round(draw.friction, 6), "bases": against.round(6).tolist()}


def chained(plan: Plan, draw: Draw) -> Scene | None:
    """The plan by a chain of 20 links in MuJoCo, whose plug does not creep; None when nothing is felt."""
    reported = chain("grip", job_of(plan, draw), FOLLOW)
    places = reported["places"]
    touched = [i for i, place in enumerate(places) if place is not None and np.hypot(*place[:2]) < TIP + REACH_M]
    if len(touched) < 2:
        return None
    used = np.arange(touched[0], touched[-1] + 1)
    kept = [i for i in used if places[i] is not None]
    x, y, normal, grip = (np.interp(used, kept, column) for column in np.array([places[i] for i in kept]).T)
    tilt = np.array(reported["tilt"])[used]
    ends = [len(used), *np.flatnonzero((np.abs(tilt) > LARGEST_RAD) | (np.hypot(x, y) < LEAST_M))[:1]]
    if plan.thing["kind"] == "face" and not plan.lies:
        ends.append(lying(x))
    used, x, y, normal, grip, tilt = (part[: min(ends)] for part in (used, x, y, normal, grip, tilt))
    return Scene(
        plan.bases[used] * (1 + draw.motion),
        draw.measured(tilt),
        np.column_stack([x, y]),
        normal if plan.thing["kind"] != "peg" else np.full(len(used), np.nan),
        plan.velocity[used],
        grip,
    )


def lying(x: np.ndarray) -> int:
    """Samples before the contact leaves the tip, after which the whisker lies along a face."""
    left = np.flatnonzero(x < TIP - 0.012)
    return int(left[0]) if len(left) else len(x)
