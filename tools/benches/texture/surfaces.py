"""Faces of walls: what a tip that slides along one measures of its texture, by speed and motion, and what the texture
costs the contact filter."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from crunchbot.pilot.feel import Drives, Feeler, Felt
from crunchbot.pilot.states import EXPLORE_M_S, PUSH_TICKS, TICK_S
from crunchbot.pilot.wheels import EXACT
from crunchbot.scene import Arena, Scene, Whisker
from crunchbot.touch.contact import Contact
from crunchbot.touch.mount import Mount
from crunchbot.touch.radial.model import fit
from crunchbot.touch.radial.whisk import WhiskModel
from crunchbot.touch.texture.train import train
from crunchbot_lab.demo.training import calibrate, flat, read_whisks
from crunchbot_lab.signals import World
from crunchbot_lab.simulation.scenes import OBJECT_TIP_DEG, make_scene

from crunchbot_lab.signals.recordings import ASLANT_RAD, BESIDE_M, SWEEPS, TIP_FIRST_RAD, surface_sweep  # isort: skip

from .scores import HZ, decide, summary
from .trials import SURFACES

TRAIN_SEED, TEST_SEED, OTHER_ROBOT = 6300, 6301, 6350
SPEEDS_M_S = (0.02, 0.05, 0.1, 0.15, 0.2)  # of a tip along the wall
OUTER, ALL = ("object_1", "object_4"), tuple(OBJECT_TIP_DEG)
SIDE_M, GAP_M, ALONG_M = 4.0, 2e-4, 0.25  # of the arena; to the wall at first; of wall in a recording
TOWARDS_RAD = (math.radians(1.0), math.radians(3.0))  # between the way and the wall
BLOCK, REST_BLOCKS, NOTICED_BLOCKS = 40, 12, 3  # ticks of a decision; at rest, and to notice a contact
RECORDINGS, PRESSES, FOLLOWED_M_S = 4, 10, 0.1  # of each whisker; speed of those that the contact filter follows
NINETY = 1.645
MOTIONS = ("backing off", "body whisk")


def walled(surface: str, robot: int) -> Scene:
    """The demo's robot of a seed in an empty arena with walls of this texture; an empty name: smooth."""
    scene = make_scene(robot)[0]
    return replace(scene, arena=Arena((SIDE_M, SIDE_M), SIDE_M, ("VINYL",), ("V",), (), wall=surface))


@dataclass
class Drive:
    """One whisker's contact, block by block: counts (n, BLOCK, 2), speeds ordered and the pose at the end of each, and
    the block from which the pilot may know of the contact. The robot stands still during the first ones."""

    whisker: Whisker
    counts: np.ndarray
    orders: list[tuple[float, float]]
    poses: list[tuple[float, float, float]]
    met: int


def driven(scene: Scene, name: str, heading: float, gap_m: float, seed: int, plan: Callable) -> Drive:
    """A drive that begins with the tip `gap_m` from the wall. `plan(n)`: speeds of block n since the contact is known;
    empty: it is over. Before, those of block 0, forwards only."""
    whisker = next(w for w in scene.robot.whiskers if w.name == name)
    tip = np.exp(1j * heading) * tip_of(whisker)
    world = World(scene.flat((SIDE_M - gap_m - tip.real, SIDE_M / 2, heading)), seed)
    lane, counts, orders, poses, met = world.lanes.index(name), [], [], [], 0
    while order := plan(len(counts) - met if met else -1):
        orders.append(order if len(counts) >= REST_BLOCKS else (0.0, 0.0))
        world.drive(*orders[-1])
        counts.append(world.run(BLOCK)[:, lane].astype(float))
        poses.append(world.pose)
        met = met or (len(counts) + NOTICED_BLOCKS if world.contact(lane).touching else 0)
    return Drive(whisker, np.array(counts), orders, poses, met)


def tip_of(whisker: Whisker) -> complex:
    return complex(*whisker.base_m) + whisker.length_m * np.exp(1j * whisker.yaw_rad)


def drive_by(surface: str, name: str, seed: int, robot: int, speed_m_s: float = FOLLOWED_M_S) -> Drive:
    """An outer whisker's tip slides along a wall beside the robot."""
    scene = walled(surface, robot)
    left = math.copysign(1.0, next(w.base_m[1] for w in scene.robot.whiskers if w.name == name))
    towards = np.random.default_rng(seed).uniform(*TOWARDS_RAD)
    blocks = round(ALONG_M / speed_m_s / TICK_S / BLOCK)
    return driven(scene, name, left * (towards - math.pi / 2), GAP_M, seed, lambda n: n < blocks and (speed_m_s, 0.0))


def body_whisk(surface: str, name: str, seed: int, robot: int) -> Drive:
    """The robot drives the tip into a wall, turns it in and back."""
    scene = walled(surface, robot)
    tip = float(np.angle(tip_of(next(w for w in scene.robot.whiskers if w.name == name))))
    aside = np.random.default_rng(seed).uniform(-TIP_FIRST_RAD, TIP_FIRST_RAD)
    heading = float(np.clip(aside - tip, -ASLANT_RAD, ASLANT_RAD))
    turn = math.copysign(EXACT.whisk_rad_s, -math.sin(heading + tip))
    push = PUSH_TICKS // BLOCK

    def plan(n: int) -> tuple[float, float] | bool:
        return (EXPLORE_M_S, 0.0) if n < 0 else n < 2 * push and (0.0, turn if n < push else -turn)

    return driven(scene, name, heading, BESIDE_M, seed, plan)


def slid(surface: str, name: str, speed_m_s: float, seed: int, robot: int) -> np.ndarray:
    """Counts (n, 2) of a drive-by while the pilot knows of the contact."""
    drive = drive_by(surface, name, seed, robot, speed_m_s)
    return np.concatenate(drive.counts[drive.met :])


@cache
def passed(seed: int, robot: int) -> dict[float, dict[str, list[np.ndarray]]]:
    """Recordings of drive-bys by speed and surface."""
    return {
        v: {
            s: [slid(s, w, v, 1000 * seed + 10 * n + k, robot) for w in OUTER for k in range(RECORDINGS)]
            for s in SURFACES
        }
        for n, v in enumerate(SPEEDS_M_S)
    }


@cache
def swept(seed: int, robot: int, whisk: bool) -> dict[str, list[np.ndarray]]:
    """Recordings of the pilot's own motions by surface, as the demo trains them."""
    text = flat(make_scene(robot)[0])
    return {
        s: [
            surface_sweep(text, w, s, 10_000 * seed + 1000 * n + 100 * lane + k, whisk).astype(float)
            for lane, w in enumerate(ALL)
            for k in range(SWEEPS // 2)
        ]
        for n, s in enumerate(SURFACES)
    }


def scored(model, recordings: dict[str, list[np.ndarray]]) -> dict:
    return summary([(k, d) for k, group in enumerate(recordings.values()) for r in group for d in decide(model, r)])


def faces() -> dict:
    """Windows of 100 ms by speed and motion, on walls that are not trained: the same robot, and another's whiskers."""
    runs = passed(TRAIN_SEED, TRAIN_SEED)
    by_speed = train({s: [r for v in SPEEDS_M_S for r in runs[v][s]] for s in SURFACES}, HZ)
    own = [swept(TRAIN_SEED, TRAIN_SEED, whisk) for whisk in (False, True)]
    by_motion = train({s: [r for part in own for r in part[s]] for s in SURFACES}, HZ)
    out = {}
    for robot in (TRAIN_SEED, OTHER_ROBOT):
        about = "another robot" if robot == OTHER_ROBOT else "the same robot"
        for v, recordings in passed(TEST_SEED, robot).items():
            out[f"drive-by, {1e3 * v:.0f} mm/s|{about}"] = scored(by_speed, recordings)
        for whisk, motion in enumerate(MOTIONS):
            out[f"{motion}|{about}"] = scored(by_motion, swept(TEST_SEED, robot, bool(whisk)))
    return out


def faces_contact() -> dict:
    """What the contact filter knows of a wall, by its texture and by motion: errors of the normal and of the place
    across the wall at the end of every block. The motion is the same for all textures."""
    out = {}
    for motion, drive, names in (("drive-by", drive_by, OUTER), (MOTIONS[1], body_whisk, ALL)):
        for surface in ("", *SURFACES):
            drives = [drive(surface, name, 1000 * TEST_SEED + k, TRAIN_SEED) for name in names for k in range(PRESSES)]
            out[f"{motion}|{surface or 'smooth'}"] = errors(
                [reported for drive in drives for reported in followed(drive)]
            )
    return out


def errors(seen: list[tuple[float, float, float] | None]) -> dict:
    reported = np.array([p for p in seen if p is not None]).reshape(-1, 3)
    normal = reported[np.isfinite(reported[:, 0])]
    return {
        "reports": len(seen),
        "known": len(reported) / len(seen),
        "normals": len(normal) / len(seen),
        "normal_deg": math.degrees(np.median(np.abs(normal[:, 0]))),
        "held_90": np.mean(np.abs(normal[:, 0]) < NINETY * normal[:, 1]),
        "place_mm": 1e3 * np.median(np.abs(reported[:, 2])),
    }


def followed(drive: Drive) -> list[tuple[float, float, float] | None]:
    """At the end of every block of a contact: error of the normal and its deviation, rad, and of the place, m; None:
    unknown."""
    whisker, found = drive.whisker, []
    feeler = Feeler(whisker, Mount.of(whisker).calibrated_turn, calibrated(whisker.name), EXACT.whisk_rad_s)
    contact, drives, good = Contact(), Drives(), np.ones(BLOCK, bool)
    for n, (samples, order, pose) in enumerate(zip(drive.counts, drive.orders, drive.poses, strict=True)):
        ticks = np.arange(n * BLOCK, (n + 1) * BLOCK)
        drives.order(n * BLOCK, order)
        contact.block(ticks, samples, good)
        feeler.block(ticks, samples, good, contact, drives)
        if n < drive.met or not contact.touching:
            continue
        felt = feeler.felt and feeler.felt.after(drives.since(feeler.felt.tick, int(ticks[-1])), int(ticks[-1]))
        found.append(felt and off_wall(felt, pose))
    return found


def off_wall(felt: Felt, pose: tuple[float, float, float]) -> tuple[float, float, float]:
    x, _, theta = pose
    place = x + math.cos(theta) * felt.point[0] - math.sin(theta) * felt.point[1] - SIDE_M
    normal = math.nan if math.isnan(felt.normal) else math.remainder(felt.normal + theta - math.pi, 2.0 * math.pi)
    return normal, felt.normal_sd, place


@cache
def calibrated(name: str) -> WhiskModel:
    """The model of whole whisks that a user has of a whisker."""
    with TemporaryDirectory() as folder:
        calibrate(Path(folder), make_scene(TRAIN_SEED)[0], name, TRAIN_SEED)
        return fit(read_whisks(Path(folder) / "radial" / f"{name}.csv", with_radius=True), "whisk").model
