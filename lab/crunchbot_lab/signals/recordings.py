"""Recordings for training and calibration, made with the same world that the robot later drives in.

Files follow the project's formats: texture recordings are one folder per surface with CSV files `t_s,x,y`; radial
calibration is one CSV file per whisker, `contact,radius_mm,t_s,whisk_rad_s,x,y`. x and y are raw counts at 2 kHz.
"""

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from crunchbot.outputs import put

from .world import TICK_S, World

SPEEDS_M_S = (0.05, 0.1, 0.15, 0.2)
# A drive over one surface, repeated: share of the speed, turn (rad/s), seconds. Mostly straight, with arcs and a reverse.
MOVES = ((1.0, 0.0, 3.0), (1.0, 0.6, 0.5), (1.0, 0.0, 2.0), (1.0, -0.6, 0.5), (-1.0, 0.0, 1.0), (0.0, 0.6, 1.0))

WHISK_RAD_S = math.pi / 24  # the body whisk
# Every 10 mm over 50 mm from the tip. A contact exactly at the tip cannot be held: the last stays 2 mm inside.
RADII_MM = (90.0, 100.0, 110.0, 120.0, 130.0, 138.0)
REST_S = 0.2
GAP_RAD = 0.002  # between whisker and post at rest
# Sweeps along a wall: the pilot's speeds, what it needs to notice a contact, and how often it decides.
APPROACH_M_S, RETREAT_M_S, PUSH_S, NOTICED_S, BLOCK_TICKS = 0.15, 0.03, 0.6, 0.06, 40
TIP_FIRST_RAD = math.radians(30.0)  # at most, between the wall's normal and the tip's direction from the centre
ASLANT_RAD = math.radians(60.0)  # at most, between the wall's normal and the way
BESIDE_M = 0.4  # from the wall at first
SWEEPS = 12
POST_M = 0.03  # side of the square post
TOWARDS_RAD = math.radians(10.0)  # between the whisker at first contact and the post's face that runs along it
ROBOT_LINES = r"(body_|texture_|object_|mechanics |sensor |batch )"  # of a scene's flat text
BENCH_M = 4.0  # side of the empty arena around it
LEAD_M = 0.6  # before a drive is recorded: tips pass a border, are let go where it holds them, and turn about beside it


class RadialContact(NamedTuple):
    """One body whisk against a post at a known radial distance."""

    radius_mm: float
    counts: np.ndarray  # (n, 2) raw counts: rest, push, back, rest
    whisk_rad_s: np.ndarray  # (n,) commanded, positive towards the post

    def until(self, end: int) -> "RadialContact":
        """Its first `end` samples."""
        return RadialContact(self.radius_mm, self.counts[:end], self.whisk_rad_s[:end])


def surface_drive(
    flat: str, surface: str, speed_m_s: float, seconds: float, seed: int, moves: Sequence = MOVES
) -> dict[str, np.ndarray]:
    """Drive the robot of a scene over one surface: counts (n, 2) of each texture whisker by name.

    The tips begin on another tile of it: as in an arena, the floor they sweep is not as high as the one they stood on first.
    """
    side = BENCH_M + 4.0 * (LEAD_M + speed_m_s * seconds)  # neither a wall nor another border within reach
    start = (side / 2, side / 4, 0.0)
    world = World(_bench(flat, side, surface, start, tiles=2), seed)
    world.drive(speed_m_s, 0.0)
    world.run(round(LEAD_M / speed_m_s / TICK_S))
    total, parts, done = round(seconds / TICK_S), [], 0
    while done < total:
        for share, omega, duration in moves:
            ticks = min(round(duration / TICK_S), total - done)
            world.drive(share * speed_m_s, omega)
            parts.append(world.run(ticks))
            done += ticks
    counts = np.concatenate(parts)
    return {name: counts[:, world.lanes.index(name)] for name in _names(flat, "texture_whisker")}


def write_surface_drives(
    folder: Path,
    flat: str,
    surfaces: Iterable[str],
    seed: int,
    seconds: float = 16.0,
    speeds: Sequence = SPEEDS_M_S,
    moves: Sequence = MOVES,
) -> None:
    """Write FOLDER/SURFACE/WHISKER_N.csv: one recording per texture whisker and drive; drive N at the N-th of the speeds."""
    for n, surface in enumerate(surfaces):
        place = folder / surface
        place.mkdir(parents=True, exist_ok=True)
        for k, speed in enumerate(speeds):
            for whisker, counts in surface_drive(flat, surface, speed, seconds, _derive(seed, n, k), moves).items():
                _write_csv(place / f"{whisker}_{k + 1}.csv", "t_s,x,y", [("", counts)])


def surface_sweep(flat: str, whisker: str, surface: str, seed: int, whisk: bool) -> np.ndarray:
    """Counts (n, 2) of one object whisker while its tip slides along a wall of this surface.

    The robot drives into the wall at an angle drawn from the seed, its tip first. Then it backs off, or turns into the wall
    and back by a body whisk. What is kept begins there and ends where the tip lets go.
    """
    x, y, yaw, length = next(place for name, place in _places(flat, "object_whisker") if name == whisker)
    tip = math.atan2(y + length * math.sin(yaw), x + length * math.cos(yaw))
    aside = np.random.default_rng(seed).uniform(-TIP_FIRST_RAD, TIP_FIRST_RAD)
    heading = float(np.clip(aside - tip, -ASLANT_RAD, ASLANT_RAD))
    start = (BENCH_M - BESIDE_M, BENCH_M / 2, heading)
    world = World(_bench(flat, BENCH_M, "VINYL", start) + f"wall {surface}\n", seed)
    lane = world.lanes.index(whisker)
    world.drive(APPROACH_M_S, 0.0)
    while not world.contact(lane).touching:
        if world.blocked:
            raise ValueError(f"{whisker}: the body meets a wall before the tip; is the whisker mounted to touch first?")
        world.run(BLOCK_TICKS)
    world.run(round(NOTICED_S / TICK_S))
    parts = []
    if whisk:
        into = math.copysign(WHISK_RAD_S, -math.sin(heading + tip))
        world.drive(0.0, into)
        parts.append(world.run(round(PUSH_S / TICK_S))[:, lane])
        world.drive(0.0, -into)
    else:
        world.drive(-RETREAT_M_S, 0.0)
    while world.contact(lane).touching:
        parts.append(world.run(BLOCK_TICKS)[:, lane])
    return np.concatenate(parts)


def write_surface_sweeps(folder: Path, flat: str, surfaces: Iterable[str], seed: int, count: int = SWEEPS) -> None:
    """Write FOLDER/SURFACE/WHISKER_N.csv: `count` sweeps of each object whisker along a wall of each surface, every second
    by a body whisk."""
    for n, surface in enumerate(surfaces):
        place = folder / surface
        place.mkdir(parents=True, exist_ok=True)
        for lane, whisker in enumerate(_names(flat, "object_whisker")):
            for k in range(count):
                counts = surface_sweep(flat, whisker, surface, _derive(seed, n, lane, k), bool(k % 2))
                _write_csv(place / f"{whisker}_{k + 1}.csv", "t_s,x,y", [("", counts)])


def radial_contacts(
    flat: str, whisker: str, seed: int, repeats: int = 5, push_s: float = 0.6, radii_mm: Sequence = RADII_MM
) -> list[RadialContact]:
    """Body whisks of one object whisker against a post at each radius, `repeats` times.

    The base rests 0.2 s, turns at pi/24 rad/s until `push_s` seconds after first contact, turns back as far, rests.
    """
    contacts = []
    for n, radius_mm in enumerate(radii_mm):
        scene, side = _post_scene(flat, whisker, radius_mm * 1e-3)
        world = World(scene, _derive(seed, *whisker.encode(), n))
        for _ in range(repeats):
            contacts.append(RadialContact(radius_mm, *_whisk(world, world.lanes.index(whisker), side, push_s)))
    return contacts


def write_radial_contacts(path: Path, contacts: Sequence[RadialContact]) -> None:
    """Write one whisker's contacts; they are numbered from 0, and time starts at 0 in each."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = ["contact,radius_mm,t_s,whisk_rad_s,x,y"]
    for n, (radius_mm, counts, rates) in enumerate(contacts):
        rows = enumerate(zip(rates, *counts.T.tolist(), strict=True))
        lines += [f"{n},{radius_mm:g},{k * TICK_S:.4f},{rate:.6g},{x},{y}" for k, (rate, x, y) in rows]
    put(path, "\n".join(lines) + "\n")


def _whisk(world: World, lane: int, side: int, push_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Counts and commanded rate."""
    rest = round(REST_S / TICK_S)
    world.drive(0.0, 0.0)
    parts = [world.run(rest)]
    world.drive(0.0, side * WHISK_RAD_S)
    approach = 0
    while not world.contact(lane).touching:
        parts.append(world.run(1))
        approach += 1
        if approach * TICK_S * WHISK_RAD_S > 2 * GAP_RAD:
            raise ValueError(
                "the whisker does not reach the post; is it mounted to sweep sideways when the robot turns?"
            )
    push = round(push_s / TICK_S)
    parts.append(world.run(push))
    world.drive(0.0, -side * WHISK_RAD_S)
    parts.append(world.run(push + approach))
    world.drive(0.0, 0.0)
    parts.append(world.run(rest))
    rates = np.repeat([0.0, WHISK_RAD_S, -WHISK_RAD_S, 0.0], [rest, approach + push, push + approach, rest])
    return np.concatenate(parts)[:, lane], rates


def _post_scene(flat: str, whisker: str, radius_m: float) -> tuple[str, int]:
    """A bench with a post whose corner the whisker meets at this radius, and which way to turn (+1 left, -1 right).

    The post is on the side away from the robot's centre, where turning presses the whisker against it, and reaches from
    the corner towards the base: as the robot turns, the shaft is drawn back over the corner, and stays on the post.
    """
    x, y, yaw = next(place[:3] for name, place in _places(flat, "object_whisker") if name == whisker)
    side = 1 if y * math.cos(yaw) - x * math.sin(yaw) > 0 else -1
    heading = side * TOWARDS_RAD - yaw
    centre = BENCH_M / 2
    corner_x = centre + x * math.cos(heading) - y * math.sin(heading) + radius_m * math.cos(TOWARDS_RAD)
    corner_y = centre + x * math.sin(heading) + y * math.cos(heading) + radius_m * side * math.sin(TOWARDS_RAD)
    low_y, high_y = sorted((corner_y, corner_y + side * POST_M))
    scene = _bench(flat, BENCH_M, "VINYL", (centre, centre, heading - side * GAP_RAD))
    return scene + f"obstacle {corner_x - POST_M!r} {low_y!r} {corner_x!r} {high_y!r}\n", side


def _bench(flat: str, side_m: float, surface: str, start: tuple[float, float, float], tiles: int = 1) -> str:
    """The robot of a scene in an empty square arena with one surface, so many tiles a side."""
    robot = [line for line in flat.splitlines() if re.match(ROBOT_LINES, line)]
    arena = [f"size_m {side_m!r} {side_m!r}", f"tile_m {side_m / tiles!r}", f"texture {surface}"]
    arena += [f"floor {tiles * surface[0]}"] * tiles
    return "\n".join([*arena, *robot, "start " + " ".join(map(repr, start))]) + "\n"


def _places(flat: str, item: str) -> list[tuple[str, list[float]]]:
    words = [line.split("#")[0].split() for line in flat.splitlines()]
    return [(w[1], list(map(float, w[2:]))) for w in words if w and w[0] == item]


def _names(flat: str, item: str) -> list[str]:
    return [name for name, _ in _places(flat, item)]


def _derive(seed: int, *path: int) -> int:
    """A seed of its own for each recording."""
    return int(np.random.SeedSequence([seed, *path]).generate_state(1, np.uint64)[0])


def _write_csv(path: Path, header: str, parts: Iterable[tuple[str, np.ndarray]]) -> None:
    """parts: the beginning of each line, and counts (n, 2)."""
    lines = [f"{start}{n * TICK_S:.4f},{x},{y}" for start, part in parts for n, (x, y) in enumerate(part.tolist())]
    put(path, "\n".join([header, *lines]) + "\n")
