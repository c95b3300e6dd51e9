"""The action that is expected to cut most entropy per second, over a belief of poses, and a second action after it.

Anytime: the work is counted in pairs of hypotheses and steps, and a second action is looked into while the budget lasts. The
same belief gives the same plan on any machine.
"""

import math
from dataclasses import dataclass

import numpy as np

from . import information
from .actions import CUTS_M, STEP_M, STEP_RAD, Fan, Vehicle
from .places import FREE, NOTHING, Places

HYPOTHESES = 96
DOUBT = 0.1  # share of the hypotheses that stand for a belief that is wrong: the robot may be anywhere
DOUBT_MOST = 0.9
PASS_LEAST = 2.0  # of hypotheses for and against that an action is stopped, before any is asked
FLOOR_BITS = 0.1  # an action that is expected to tell less is not worth its time
SECOND_OF = 3  # first actions after which a second one is looked into
CLEARANCE_M = 0.2  # from the robot's middle to what was met a while ago
NOTHING_TOLD = "no place reads otherwise than another"
KNOWN = "no reading in reach tells more"
SHUT_IN = "what was met lately is in every way"


@dataclass(frozen=True)
class Plan:
    """Turn, then drive; `bits` that it is expected to cut and `seconds` that it takes; `refused`: why nothing is worth doing;
    `passed`: probability that nothing stops it, by the belief and if it may be anywhere."""

    turn_rad: float = 0.0
    distance_m: float = 0.0
    bits: float = 0.0
    seconds: float = 0.0
    refused: str = ""
    passed: tuple[float, float] = (0.5, 0.5)

    @property
    def bits_per_s(self) -> float:
        """Entropy cut per second."""
        return self.bits / self.seconds if self.seconds > 0.0 else 0.0


@dataclass(frozen=True)
class Past:
    """By odometry, in the robot's frame: `met` (m, 2), things met lately, m; `been` (k, 3), poses that were read from lately."""

    met: np.ndarray
    been: np.ndarray

    def fresh(self, fan: Fan) -> np.ndarray:
        """(directions, steps) whether a step leads to a pose that nothing was read from: a reading again tells nothing new."""
        if not len(self.been):
            return np.ones(fan.valid.shape, bool)
        off = fan.poses[..., None, :] - self.been
        turned = np.abs(np.remainder(off[..., 2] + math.pi, 2.0 * math.pi) - math.pi)
        near = (np.abs(off[..., 0]) < STEP_M / 2.0) & (np.abs(off[..., 1]) < STEP_M / 2.0) & (turned < STEP_RAD / 2.0)
        return ~near.any(axis=-1)

    def later(self, fan: Fan, action: tuple[int, int]) -> "Past":
        """As it is after this action (direction, cut), if nothing stops it."""
        direction, length = action[0], (0.0, *CUTS_M)[action[1]]
        turn, way = fan.turn_rad[direction], fan.valid[direction] & (fan.driven_m[direction] <= length + STEP_M / 2.0)
        c, s = math.cos(turn), math.sin(turn)
        back, here = np.array([[c, -s], [s, c]]), np.array([length * c, length * s])
        been = np.vstack([self.been, fan.poses[direction, way]])
        return Past((self.met - here) @ back, np.column_stack([(been[:, :2] - here) @ back, been[:, 2] - turn]))


NO_PAST = Past(np.zeros((0, 2)), np.zeros((0, 3)))


@dataclass(frozen=True)
class Foretold:
    """Of a fan of actions on n hypotheses: units (directions, cuts, n, n) between readings up to each cut, s (directions, cuts,
    n) until then, poses (directions, cuts, n, 3) at the end; `through`, whether nothing stops it; `open` (directions, cuts): nothing that was met is in the way."""

    units: np.ndarray
    seconds: np.ndarray
    ends: np.ndarray
    through: np.ndarray
    open: np.ndarray


def hypotheses(components: np.ndarray, most: int = HYPOTHESES) -> np.ndarray:
    """(most, 3) poses that stand for a belief with equal weights: every 1/most of its mass, in the components' order."""
    held = np.cumsum(components["mass"])
    at = np.searchsorted(held, (np.arange(most) + 0.5) / most * held[-1])
    return components["pose"][np.minimum(at, len(components) - 1)]


class Planner:
    """`plan` for a robot that reads as `places` foretells and moves as `vehicle` does."""

    def __init__(self, places: Places, vehicle: Vehicle, steps: int = 2, most: int = HYPOTHESES):
        """`steps`: 1, greedy; 2: an action's worth includes that of the best one after it."""
        self._places, self._vehicle, self._steps, self._most = places, vehicle, steps, most
        self._anywhere = places.spread(most)
        self._nothing = places.tells_nothing()
        self._blocked = places.blocked.reshape(-1)
        self._texture, self._reach = (by.reshape(len(by), self._blocked.size) for by in (places.texture, places.reach))

    def plan(self, components: np.ndarray, past: Past = NO_PAST, doubt: float = DOUBT) -> Plan:
        """For a belief of components (n,) as nav.filters.COMPONENT, which is wrong with probability `doubt`."""
        if self._nothing:
            return Plan(refused=NOTHING_TOLD)
        poses, right = self._hypotheses(components, doubt)
        weights = np.full(len(poses), 1.0 / len(poses))
        same, first = information.one_place(poses), self.foretell(poses, past)
        gain = information.bits(first.units, weights, same)
        seconds = first.seconds @ weights
        worth = np.where(first.open, gain / np.maximum(seconds, 1e-6), -1.0)
        best = np.unravel_index(worth.argmax(), worth.shape)
        if not first.open[:, 1:].any():
            return Plan(refused=SHUT_IN)
        if gain[first.open].max(initial=0.0) < FLOOR_BITS:
            return Plan(refused=KNOWN)
        if self._steps > 1:
            best = self._with_second(first, past, weights, same, worth, seconds)
        turn, through = Fan.all_round().turn_rad[best[0]], first.through[best]
        kinds = through[:right], through[right:]
        passed = tuple(float((kind.sum() + PASS_LEAST) / (len(kind) + 2.0 * PASS_LEAST)) for kind in kinds)
        return Plan(float(turn), (0.0, *CUTS_M)[best[1]], float(gain[best]), float(seconds[best]), passed=passed)

    def whisk(self, components: np.ndarray, doubt: float = DOUBT) -> Plan:
        """What a body whisk at what is touched now is expected to tell."""
        poses, _ = self._hypotheses(components, doubt)
        reach = self._reach[:, self._places.index(poses)]
        units = np.zeros((len(poses), len(poses)), np.uint8)
        for symbols in reach:
            information.differ(units, symbols, information.TOUCH_UNITS)
        weights = np.full(len(poses), 1.0 / len(poses))
        gain = information.bits(units, weights, information.one_place(poses))
        return Plan(bits=float(gain), seconds=self._vehicle.whisk_s)

    def _hypotheses(self, components: np.ndarray, doubt: float) -> tuple[np.ndarray, int]:
        """Poses (n, 3) by the belief, then anywhere; and how many are by the belief."""
        anywhere = self._anywhere[: round(doubt * self._most)]
        return np.vstack([hypotheses(components, self._most - len(anywhere)), anywhere]), self._most - len(anywhere)

    def foretell(self, poses: np.ndarray, past: Past = NO_PAST) -> Foretold:
        """What all actions would read anew from each of poses (n, 3)."""
        fan, vehicle = Fan.all_round(), self._vehicle
        at = _after(poses, fan.poses)
        index = self._places.index(at)
        reach, texture = self._reach[:, index], self._texture[:, index]
        valid, touching = fan.valid[..., None], (reach != FREE).any(axis=0)
        stops = (self._blocked[index] | (touching & ~np.bool_(vehicle.reads_always))) & valid
        going = ~np.logical_or.accumulate(stops, axis=1)
        reached = np.concatenate([np.ones_like(going[:, :1]), going[:, :-1]], axis=1) & valid
        fresh = past.fresh(fan)[..., None]
        texture = np.where(going & valid & fresh, texture, NOTHING)
        felt = reached if vehicle.reads_always else reached & (going | ~fan.turning[..., None])
        reach = np.where(felt & fresh, reach, NOTHING)
        return self._cut(fan, poses, at, texture, reach, going, past.met)

    def _cut(self, fan: Fan, poses, at, texture, reach, going, met) -> Foretold:
        """The readings and their cost up to the end of the turn and to each of CUTS_M."""
        directions, count = len(fan.turn_rad), len(poses)
        lengths = np.array([0.0, *CUTS_M])
        units = np.zeros((directions, len(lengths), count, count), np.uint8)
        now = np.zeros((directions, count, count), np.uint8)
        for step in range(at.shape[1]):
            for symbols in texture[:, :, step]:
                information.differ(now, symbols, information.TEXTURE_UNITS)
            for symbols in reach[:, :, step]:
                information.differ(now, symbols, information.TOUCH_UNITS)
            for direction, cut in zip(*_cuts_after(fan, lengths, step), strict=True):
                units[direction, cut] = now[direction]
        none = np.abs(fan.turn_rad) < STEP_RAD / 2.0
        return Foretold(units, *_cost(fan, self._vehicle, poses, at, going, lengths), _open(fan, lengths, met, none))

    def _with_second(self, first: Foretold, past: Past, weights, same, worth, seconds) -> tuple[int, int]:
        """The first action of the pair that cuts most per second of both."""
        order = np.argsort(-worth, axis=None, kind="stable")[:SECOND_OF]
        best, found = np.unravel_index(order[0], worth.shape), -1.0
        for one in order:
            k = np.unravel_index(one, worth.shape)
            if worth[k] <= 0.0:
                continue
            then = self.foretell(first.ends[k], past.later(Fan.all_round(), k))
            total = np.minimum(then.units.astype(np.uint16) + first.units[k], information.UNITS_MOST).astype(np.uint8)
            both = information.bits(total, weights, same) / np.maximum(then.seconds @ weights + seconds[k], 1e-6)
            value = max(float(both[then.open].max()), float(worth[k]))
            if value > found:
                best, found = k, value
        return best


def _after(poses: np.ndarray, relative: np.ndarray) -> np.ndarray:
    """(..., n, 3) poses reached from poses (n, 3) by motions (..., 3)."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x, y, turn = (relative[..., k, None] for k in range(3))
    return np.stack([poses[:, 0] + c * x - s * y, poses[:, 1] + s * x + c * y, poses[:, 2] + turn], axis=-1)


def _cuts_after(fan: Fan, lengths: np.ndarray, step: int) -> tuple[np.ndarray, np.ndarray]:
    """(direction, cut) pairs whose last step is this one; what has no step before its cut ends with the first."""
    turns = fan.turning.sum(axis=1)
    last = turns[:, None] + np.rint(lengths / STEP_M).astype(int) - 1
    return np.nonzero(last == step)


def _cost(fan: Fan, vehicle: Vehicle, poses, at, going, lengths) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Seconds (directions, cuts, n), end poses (directions, cuts, n, 3), and whether nothing stops it on the way."""
    turns = fan.turning.sum(axis=1)
    last = turns[:, None] + np.rint(lengths / STEP_M).astype(int) - 1
    steps = np.cumsum(going & fan.valid[..., None], axis=1)
    k = np.arange(len(fan.turn_rad))[:, None]
    done = np.where((last >= 0)[..., None], steps[k, np.maximum(last, 0)], 0)
    wanted = (last + 1)[..., None]
    turned = np.minimum(done, turns[:, None, None])
    hit = done < wanted
    legs = 1.0 + ((turned > 0) & (done > turned))
    seconds = (
        legs * vehicle.settle_s
        + turned * (STEP_RAD / vehicle.turn_rad_s)
        + (done - turned) * (STEP_M / vehicle.drive_m_s)
    )
    seconds = seconds + np.where(hit, vehicle.contact_s, 0.0)
    ends = np.where((done > 0)[..., None], at[k[..., None], np.maximum(done - 1, 0), np.arange(len(poses))], poses)
    return seconds, ends, ~hit


def _open(fan: Fan, lengths: np.ndarray, met: np.ndarray, none: np.ndarray) -> np.ndarray:
    """(directions, cuts) whether an action is one (standing still is none) and passes by what was met."""
    out = np.ones((len(fan.turn_rad), len(lengths)), bool)
    out[none, 0] = False
    if not len(met):
        return out
    along = np.column_stack([np.cos(fan.turn_rad), np.sin(fan.turn_rad)])
    ahead, aside = met @ along.T, np.abs(met @ np.column_stack([-along[:, 1], along[:, 0]]).T)
    in_way = np.where((ahead > 0.0) & (aside < CLEARANCE_M), ahead - CLEARANCE_M, math.inf).min(axis=0)
    return out & (lengths <= np.maximum(in_way, 0.0)[:, None])
