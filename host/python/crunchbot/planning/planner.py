"""The action that is expected to cut most entropy per second, over a belief of poses: host/nav/planning for Python.

Anytime: the work is counted in pairs of hypotheses and readings, and the best action so far stands when the budget is spent.
The same belief gives the same plan on any machine.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..native import as_doubles, doubles, ffi, floats, lib, octets
from .actions import Path, Vehicle, all_round
from .ground import Ground

HYPOTHESES = 96
BUDGET = 6_500_000  # pairs of hypotheses times readings: below 16 million instructions
PLACE_M, PLACE_RAD = 0.25, math.radians(30.0)  # poses nearer to each other are one place
STOP_NATS = 3.0  # a body does not go through what is solid: as much as a contact and its repetition in the next rows
CLEARANCE_M = 0.2  # from the robot's middle to what was met a while ago
FLOOR_BITS = 0.1  # an action that is expected to yield less is not worth its time
NOTHING_TOLD = "no place reads otherwise than another"
KNOWN = "no reading in reach is expected to yield 0.1 bits"
SHUT_IN = "what was met lately is in every way"


@dataclass(frozen=True)
class Plan:
    """`path`, and how many of its steps; `bits` that it is expected to cut, `seconds` that it takes, and the probability that
    nothing stops it; `refused`: why nothing is worth doing; `spent` of the budget."""

    path: Path | None = None
    steps: int = 0
    bits: float = 0.0
    seconds: float = 0.0
    passed: float = 1.0
    refused: str = ""
    spent: int = 0

    @property
    def bits_per_s(self) -> float:
        """Entropy cut per second."""
        return self.bits / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def moves(self) -> tuple[tuple[float, float], ...]:
        """Turn, rad, and drive, m, of each leg as far as the plan goes."""
        if self.path is None:
            return ()
        last = self.path.steps[self.steps - 1]
        whole = tuple((leg.turn_rad, leg.drive_m) for leg in self.path.legs[: last.leg])
        return (*whole, (self.path.legs[last.leg].turn_rad, last.driven_m))


@dataclass(frozen=True)
class Past:
    """By odometry, in the robot's frame: `met` (m, 2), things met lately, m; `been` (k, 3), poses that were read from lately."""

    met: np.ndarray
    been: np.ndarray


NO_PAST = Past(np.zeros((0, 2)), np.zeros((0, 3)))


def hypotheses(components: np.ndarray, most: int = HYPOTHESES) -> np.ndarray:
    """(most, 3) poses that stand for a belief with equal weights: every 1/most of its mass, in the components' order."""
    held = np.cumsum(components["mass"])
    at = np.searchsorted(held, (np.arange(most) + 0.5) / most * held[-1])
    return components["pose"][np.minimum(at, len(components) - 1)]


class Planner:
    """`plan` for a robot on a ground that moves as `vehicle` does."""

    def __init__(
        self,
        ground: Ground,
        vehicle: Vehicle,
        after: int = 0,
        most: int = HYPOTHESES,
        budget: int = BUDGET,
        paths: list[Path] | None = None,
    ):
        """`after`: of the best actions, how many are looked at with a second one after them; `most`: hypotheses, at most
        128; `budget`: 0: no limit; `paths`: None: all_round. ValueError when one is out of range."""
        self._vehicle, self._most = vehicle, most
        self.paths = all_round(vehicle) if paths is None else paths
        self._nothing = ground.says_nothing()
        options = {
            "touch_stops": not vehicle.reads_always,
            "contact_s": vehicle.stopped_s,
            "stop_nats": STOP_NATS,
            "place_m": PLACE_M,
            "place_rad": PLACE_RAD,
            "clear_m": CLEARANCE_M,
            "floor_bits": FLOOR_BITS,
            "after": after,
            "budget": budget,
        }
        known, self._keep = _ground(ground)
        steps = [ffi.new("struct nav_planner_step[]", list(map(_step, path.steps))) for path in self.paths]
        listed = ffi.new(
            "struct nav_planner_path[]", [(len(p.steps), s) for p, s in zip(self.paths, steps, strict=True)]
        )
        made = ffi.NULL
        if 1 <= most <= lib.NAV_PLANNER_HYPOTHESES_MOST:
            robot, keep = _robot(ground)
            made = lib.nav_planner_new(
                known, robot, listed, len(steps), ffi.new("struct nav_planner_options *", options)
            )
            del keep  # until here
        if made == ffi.NULL:
            raise ValueError(f"{len(steps)} paths, {most} hypotheses: out of range, or no memory; give fewer")
        self._keep = (*self._keep, steps)
        self._planner = ffi.gc(made, lib.nav_planner_free)

    def plan(self, components: np.ndarray, past: Past = NO_PAST, truth: np.ndarray | None = None) -> Plan:
        """For a belief of components (n,) as nav.filters.COMPONENT; truth (3,): the pose whose readings are expected, None: those
        of every hypothesis in turn."""
        if self._nothing:
            return Plan(refused=NOTHING_TOLD)
        poses, true = self._poses(components, truth)
        met, been = as_doubles(past.met, "met", (None, 2)), as_doubles(past.been, "been", (None, 3))
        late = ffi.new("struct nav_planner_past *", {"met": len(met), "been": len(been)})
        late.thing, late.pose = doubles(met, "met", (None, 2)), doubles(been, "been", (None, 3))
        out = ffi.new("struct nav_planner_plan *")
        lib.nav_planner_plan(self._planner, doubles(poses, "poses", (None, 3)), len(poses), true, late, out)
        if out.path < 0:
            return Plan(refused=SHUT_IN if out.shut_in else KNOWN, spent=out.spent)
        return Plan(self.paths[out.path], out.steps, out.bits, out.seconds, out.passed, spent=out.spent)

    def whisk(self, components: np.ndarray, truth: np.ndarray | None = None) -> Plan:
        """What a body whisk at what is touched now is expected to yield."""
        poses, true = self._poses(components, truth)
        given = doubles(poses, "poses", (None, 3))
        bits = lib.nav_planner_touch(self._planner, given, len(poses), true, STOP_NATS)
        return Plan(bits=bits, seconds=self._vehicle.whisk_s)

    def _poses(self, components: np.ndarray, truth: np.ndarray | None) -> tuple[np.ndarray, int]:
        """(n, 3) and which of them is the true one; -1: none is."""
        poses = as_doubles(hypotheses(components, self._most), "components", (None, 3))
        if truth is None:
            return poses, -1
        poses[-1] = truth
        return poses, len(poses) - 1


def _step(step) -> tuple:
    return (*step.pose, step.seconds, step.texture_nats, step.touch_nats, step.turns, step.ends)


def _ground(ground: Ground):
    texture, clear = np.ascontiguousarray(ground.texture), np.ascontiguousarray(ground.clear_m)
    classes = octets(texture, "texture", (None, None))
    rows, columns = texture.shape
    out = ffi.new("struct nav_planner_ground *", {"rows": rows, "columns": columns, "cell": ground.cell_m})
    out.x = out.y = ground.corner_m
    out.texture, out.clear = classes, floats(clear, "clear_m", (rows, columns))
    return out, (texture, clear)


def _robot(ground: Ground):
    tips, rays = (ground.robot.of_role(role) for role in ("texture", "object"))
    tip = ffi.new("struct nav_tip[]", [whisker.tip_m for whisker in tips])
    ray = ffi.new("struct nav_ray[]", [(*whisker.base_m, whisker.yaw_rad, whisker.length_m) for whisker in rays])
    counts = {"body_radius": ground.robot.body_radius_m, "tips": len(tips), "rays": len(rays)}
    return ffi.new("struct nav_robot *", {**counts, "tip": tip, "ray": ray}), (tip, ray)
