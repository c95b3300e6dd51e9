"""Families of scenes that no filter was made for: arenas, robots, rates, noise and maps of every kind, and real runs.

What a family leaves open is drawn anew for each seed: sizes, whiskers, noise, what is wrong with a map, where a robot is
carried to. Recordings of others are not kept here: their families need the folder where they lie.
"""

import argparse
import math
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from crunchbot.nav.observations import Observations, joined, stretch
from crunchbot.scene import NOT_KNOWN, Arena, Scene
from crunchbot_lab.scenes import arenas, families, faults, robots
from crunchbot_lab.scenes.families import Recipe
from crunchbot_lab.scenes.files import rounded
from crunchbot_lab.scenes.making import ROW_S, Made, make_recipe
from crunchbot_lab.scenes.readings import World
from crunchbot_lab.scenes.recordings import read_recording
from crunchbot_lab.scenes.walk import Pace

ROWS, SLOW_ROWS, QUICK_ROWS = 600, 300, 3000  # a minute at 10, 5 and 50 Hz
KIDNAPS, KIDNAP_ROWS = (200, 500), 850
CREATE = World(odometry=0.08, odometry_memory_m=0.5, run_gain=0.05, drift_rad=0.03)
RECORDINGS = "WHISKER_RECORDINGS"  # in the environment: the folder of --data
REAL = ("random_1", "random_2")  # folders of a Thymio's runs, below `thymio` of the folder of recordings
REAL_FIRST = 100  # rows: a real run begins at one of these
SPLICED, SPLICED_ROWS = 4, (200, 300)  # parts of a spliced run, rows of each
SPLICED_M = 0.3  # twice what counts as locked: so far it is carried at least

Draw = Callable[[Recipe, np.random.Generator], Recipe]


@dataclass(frozen=True)
class Family:
    """`group`: what a figure is wanted for; `seed_of`: the family whose seeds it has, where pairs are compared; `folds`:
    images of the truth that count."""

    group: str
    make: Callable[[int], Made]
    folds: int = 1
    seed_of: str = ""


def room(low: float, high: float, per_m2: float = 0.4, textures=arenas.TEXTURES, tile=(0.2, 0.5)) -> arenas.Maker:
    """Any size from `low` to `high` m a side, tiles of 20 to 50 cm that need not divide it, boxes anywhere."""

    def make(rng: np.random.Generator, radius: float) -> Arena:
        inner = arenas.scattered((low, low), (high, high), per_m2, textures)(rng, radius)
        edge = float(round(rng.uniform(*tile), 3))
        columns, rows = (math.ceil(side / edge - 1e-6) for side in inner.size_m)
        floor = arenas.random_floor(columns, rows, textures, rng)
        return Arena(inner.size_m, edge, textures, floor, inner.obstacles)

    return make


def printed_floor(rng: np.random.Generator, radius: float) -> Arena:
    """Black and white cells of 2 to 4 cm, as small robots drive over."""
    edge = float(round(rng.uniform(0.02, 0.04), 3))
    cells = round(rng.uniform(1.5, 2.0) / edge)  # from each of its places another is as far off as a kidnap carries
    textures = ("BLACK", "WHITE")
    side = float(round(edge * cells, 6))
    return Arena((side, side), edge, textures, arenas.random_floor(cells, cells, textures, rng), ())


def nearly_symmetric(shift_m: float) -> arenas.Maker:
    """Alike after 180 degrees but for one box, which stands `shift_m` off."""

    def make(rng: np.random.Generator, radius: float) -> Arena:
        arena = arenas.symmetric(2)(rng, radius)
        if not arena.obstacles:
            return arena
        x0, y0, x1, y1 = arena.obstacles[0]
        by = -shift_m if x1 + shift_m > arena.size_m[0] else shift_m
        return replace(arena, obstacles=((x0 + by, y0, x1 + by, y1), *arena.obstacles[1:]))

    return make


def whiskers(tips: int, rays: int, rng: np.random.Generator):
    """So many texture and object whiskers somewhere round the body."""
    at = rng.uniform(-math.pi, math.pi) + 2 * math.pi * np.arange(rays) / max(rays, 1)
    lean = rng.uniform(-0.3, 0.3, rays)
    places = [
        (0.15 * math.cos(a), 0.15 * math.sin(a), math.remainder(a + b, 2 * math.pi))
        for a, b in zip(at, lean, strict=True)
    ]
    far, turn = rng.uniform(0.1, 0.25, tips), rng.uniform(-math.pi, math.pi, tips)
    spots = [(r * math.cos(a), r * math.sin(a)) for r, a in zip(far, turn, strict=True)]
    made = robots.robot(*robots.tips(*spots), *robots.rays(*places))
    return lambda: made


# Maps as the filters get them.


def moved_box(arena: Arena, rng: np.random.Generator) -> Arena:
    """One box stands 10 to 25 cm off."""
    if not arena.obstacles:
        return arena
    gone, turn, by = int(rng.integers(len(arena.obstacles))), rng.uniform(0, 2 * math.pi), rng.uniform(0.1, 0.25)
    x0, y0, x1, y1 = arena.obstacles[gone]
    dx = float(np.clip(by * math.cos(turn), -x0, arena.size_m[0] - x1))
    dy = float(np.clip(by * math.sin(turn), -y0, arena.size_m[1] - y1))
    boxes = list(arena.obstacles)
    boxes[gone] = (x0 + dx, y0 + dy, x1 + dx, y1 + dy)
    return replace(arena, obstacles=tuple(boxes))


def new_box(arena: Arena, rng: np.random.Generator) -> Arena:
    """A box where there is none."""
    width, depth = rng.uniform(0.1, 0.4, 2)
    x, y = rng.uniform(0, arena.size_m[0] - width), rng.uniform(0, arena.size_m[1] - depth)
    return replace(arena, obstacles=(*arena.obstacles, (x, y, x + width, y + depth)))


def wrong_tiles(arena: Arena, rng: np.random.Generator) -> Arena:
    """One tile in ten has another texture."""
    for _ in range(max(1, round(0.1 * len(arena.floor) * len(arena.floor[0])))):
        arena = faults.wrong_tile(arena, rng)
    return arena


def stretched(arena: Arena, rng: np.random.Generator) -> Arena:
    """All of it is drawn 1 to 3 % too large."""
    by = 1.0 + rng.uniform(0.01, 0.03)
    boxes = tuple(tuple(by * edge for edge in box) for box in arena.obstacles)
    return replace(arena, size_m=tuple(by * side for side in arena.size_m), tile_m=by * arena.tile_m, obstacles=boxes)


def padded(made: Made, rng: np.random.Generator) -> Made:
    """The room within up to 3 m of ground on each side that nobody mapped, its wall 2 to 10 cm thick and, one time in two,
    not mapped over a stretch as wide as the robot; and a patch of ground in the room that nobody mapped."""
    arena = made.scene.arena
    (width, height), edge, thick = arena.size_m, arena.tile_m, rng.uniform(0.02, 0.1)
    left, below, right, above = (int(n) for n in rng.integers(1, max(2, round(3.0 / edge) + 1), 4))
    blank = NOT_KNOWN * (left + len(arena.floor[0]) + right)
    floor = (*[blank] * above, *(NOT_KNOWN * left + row + NOT_KNOWN * right for row in arena.floor), *[blank] * below)
    x, y, size = edge * left, edge * below, (edge * len(blank), edge * len(floor))
    x1, y1 = x + width, y + height
    gap = 2.5 * made.scene.robot.body_radius_m * (rng.random() < 0.5)
    at = y + rng.uniform(0.0, height - gap)
    wall = [(x - thick, y - thick, x1 + thick, y), (x - thick, y1, x1 + thick, y1 + thick), (x - thick, y, x, y1)]
    wall += [(x1, y, x1 + thick, at), (x1, at + gap, x1 + thick, y1)] if gap else [(x1, y, x1 + thick, y1)]
    patch, corner = rng.uniform(0.1, 0.4, 2), rng.uniform(0.0, 1.0, 2)
    px, py = x + corner[0] * (width - patch[0]), y + corner[1] * (height - patch[1])
    grey = [(0, 0, x - thick, size[1]), (x - thick, 0, size[0], y - thick), (x - thick, y1 + thick, *size)]
    grey += [(x1 + (0.0 if gap else thick), y - thick, size[0], y1 + thick), (px, py, px + patch[0], py + patch[1])]
    solid = [(x + a, y + b, x + c, y + d) for a, b, c, d in arena.obstacles] + wall
    kept = [tuple(float(v) for v in np.clip(box, 0.0, (*size, *size))) for box in solid]
    around = replace(arena, size_m=size, floor=floor, obstacles=tuple(kept), unknown=tuple(_boxes(grey)))
    return replace(made, scene=replace(made.scene, arena=around, origin=(-x, -y, 0.0)))


def _boxes(found: list) -> list[tuple[float, ...]]:
    return [tuple(float(v) for v in box) for box in found if box[0] < box[2] and box[1] < box[3]]


# Rows.


def gap(seconds: float) -> faults.Fault:
    """So many seconds of rows never come, their odometry lost, a third of the way through."""

    def fault(o: Observations, scene: Scene, rng: np.random.Generator) -> Observations:
        first, count = len(o) // 3, round(seconds / ROW_S)
        return faults._taken(o, np.concatenate([np.arange(first), np.arange(first + count, len(o))]))

    return fault


def at_rate(hz: float) -> faults.Fault:
    return lambda o, scene, rng: replace(o, t_s=(np.arange(len(o)) + 1) / hz)


# Draws: what a recipe becomes.


def with_world(**changes) -> Draw:
    """A change that is a pair is drawn evenly between its ends."""

    def draw(r: Recipe, rng: np.random.Generator) -> Recipe:
        found = {key: rng.uniform(*v) if isinstance(v, tuple) else v for key, v in changes.items()}
        return replace(r, world=replace(r.world, **found))

    return draw


def with_floor(**changes) -> Draw:
    return lambda r, rng: replace(r, **changes)


def with_whiskers(tips: tuple[int, int], rays: tuple[int, int]) -> Draw:
    """From so many to so many of each."""
    return lambda r, rng: replace(r, robot=whiskers(*(int(rng.integers(a, b + 1)) for a, b in (tips, rays)), rng))


def with_gap(low: float, high: float) -> Draw:
    return lambda r, rng: replace(r, faults=(gap(rng.uniform(low, high)),), rows=ROWS + round(high / ROW_S))


def with_rate(hz: float, rows: int) -> Draw:
    """The same speeds as at 10 Hz."""
    by = 1.0 / (hz * ROW_S)
    pace = Pace(0.02 * by, 0.2 * by, 0.01 * by)
    return lambda r, rng: replace(r, pace=pace, rows=rows, faults=(at_rate(hz),))


def near_symmetry(r: Recipe, rng: np.random.Generator) -> Recipe:
    return replace(r, arena=nearly_symmetric(10 ** rng.uniform(-3.0, -1.3)))


def printed(r: Recipe, rng: np.random.Generator) -> Recipe:
    robot = robots.robot(*robots.tips((0.072, 0.011), (0.072, -0.011)), odometry=0.1, radius=0.0)
    return replace(r, arena=printed_floor, robot=lambda: robot, pace=Pace(0.01, 0.1, 0.02))


def as_it_is(r: Recipe, rng: np.random.Generator) -> Recipe:
    return r


STARTS: dict[str, Callable[[Recipe], Recipe]] = {
    "known": lambda r: r,
    "anywhere": lambda r: replace(r, uniform=True),
    "kidnaps": lambda r: replace(r, kidnap_rows=KIDNAPS, rows=max(r.rows, KIDNAP_ROWS)),
}
BASE = Recipe("", room(2.0, 3.5), rows=ROWS)
FEW = with_floor(arena=room(2.0, 3.5, textures=arenas.TEXTURES[:2]))


def maker(start: str, draw: Draw, after: Callable[[Made, np.random.Generator], Made] | None = None):
    def make(seed: int) -> Made:
        rng = np.random.default_rng([seed, len(families.BASES)])  # a stream that no part of a scene draws from
        made = make_recipe(STARTS[start](draw(BASE, rng)), seed)
        return after(made, rng) if after else made

    return make


# Name -> group, start, draw, images of the truth.
DRAWN: dict[str, tuple[str, str, Draw, int]] = {
    "room, known": ("as stated", "known", as_it_is, 1),
    "room, anywhere": ("as stated", "anywhere", as_it_is, 1),
    "room, kidnaps": ("as stated", "kidnaps", as_it_is, 1),
    "small room": ("as stated", "anywhere", with_floor(arena=room(1.5, 1.8)), 1),
    "hall": ("as stated", "anywhere", with_floor(arena=room(5.0, 9.0, 0.25), rows=2 * ROWS), 1),
    "square tiles, kidnaps": ("as stated", "kidnaps", with_floor(arena=arenas.tiled()), 1),
    "many whiskers": ("as stated", "anywhere", with_whiskers((3, 12), (6, 16)), 1),
    "textures only": ("as stated", "anywhere", with_whiskers((2, 5), (0, 0)), 1),
    "two textures": ("few textures", "anywhere", FEW, 1),
    "two textures, kidnaps": ("few textures", "kidnaps", FEW, 1),
    "printed floor": ("few textures", "anywhere", printed, 1),
    "printed floor, kidnaps": ("few textures", "kidnaps", printed, 1),
    "one object whisker, known": ("one and two whiskers", "known", with_whiskers((0, 0), (1, 1)), 1),
    "one texture whisker": ("one and two whiskers", "anywhere", with_whiskers((1, 1), (0, 0)), 1),
    "two whiskers": ("one and two whiskers", "anywhere", with_whiskers((1, 1), (1, 1)), 1),
    "contacts only": ("contacts", "anywhere", with_whiskers((0, 0), (4, 8)), 1),
    "contacts only, kidnaps": ("contacts", "kidnaps", with_whiskers((0, 0), (4, 8)), 1),
    "5 Hz": ("rates and gaps", "anywhere", with_rate(5.0, SLOW_ROWS), 1),
    "50 Hz": ("rates and gaps", "anywhere", with_rate(50.0, QUICK_ROWS), 1),
    "gap": ("rates and gaps", "known", with_gap(3.0, 20.0), 1),
    "dropped rows": ("rates and gaps", "anywhere", with_floor(faults=(faults.dropped,)), 1),
    "more noise than stated": (
        "noise not as stated",
        "anywhere",
        with_world(odometry=(0.1, 0.2), odometry_memory_m=0.3, radial_sigma_m=(0.01, 0.02)),
        1,
    ),
    "wheels off": ("noise not as stated", "anywhere", with_world(scale=(0.85, 1.15), turn_scale=(0.85, 1.15)), 1),
    "a Create's wheels": ("noise not as stated", "anywhere", with_floor(world=CREATE), 1),
    "spinning wheels": ("noise not as stated", "known", with_floor(slips=4), 1),
    "catches": ("noise not as stated", "anywhere", with_world(catch=(0.3, 0.7)), 1),
    "raw windows": ("noise not as stated", "anywhere", with_floor(world=families.RAW), 1),
    "dead whisker": ("noise not as stated", "anywhere", with_floor(faults=(faults.dead,)), 1),
    "swapped whiskers": ("noise not as stated", "anywhere", with_floor(faults=(faults.swapped,)), 1),
    "nearly symmetric": ("near symmetry", "anywhere", near_symmetry, 2),
    "wrong tiles": ("wrong map", "anywhere", with_floor(map_fault=wrong_tiles), 1),
    "wrong tiles, kidnaps": ("wrong map", "kidnaps", with_floor(map_fault=wrong_tiles), 1),
    "a box moved": ("wrong map", "anywhere", with_floor(map_fault=moved_box), 1),
    "a box missing": ("wrong map", "anywhere", with_floor(map_fault=faults.lost_obstacle), 1),
    "a box too many, kidnaps": ("wrong map", "kidnaps", with_floor(map_fault=new_box), 1),
    "map too large": ("wrong map", "anywhere", with_floor(map_fault=stretched), 1),
}
GREY = {
    "clean room": ("anywhere", with_whiskers((1, 2), (3, 6))),
    "clean room, contacts only": ("anywhere", with_whiskers((0, 0), (4, 8))),
}


def _real(folder: Path, name: str) -> tuple[Scene, Observations]:
    return read_recording(folder / "thymio" / name, kind="thymio")


def real(folder: Path, name: str) -> Callable[[int], Made]:
    """A real run from one of its first rows on."""

    def make(seed: int) -> Made:
        scene, rows = _real(folder, name)
        first = int(np.random.default_rng(seed).integers(REAL_FIRST))
        return Made(scene, _stamped(stretch(rows, first, len(rows))))

    return make


def spliced(folder: Path) -> Callable[[int], Made]:
    """Parts of the real runs: the robot is carried from the end of one to the beginning of the next."""

    def make(seed: int) -> Made:
        rng, parts, scene = np.random.default_rng(seed), [], None
        runs = [_real(folder, name) for name in REAL]
        while len(parts) < SPLICED:
            scene, rows = runs[rng.integers(len(runs))]
            count = int(rng.integers(*SPLICED_ROWS))
            first = int(rng.integers(len(rows) - count))
            part = stretch(rows, first, first + count)
            if not parts or math.dist(parts[-1].truth[-1, :2], part.truth[0, :2]) >= SPLICED_M:
                parts.append(part)
        return Made(scene, _stamped(joined(parts)), tuple(np.cumsum([len(part) for part in parts[:-1]]).tolist()))

    return make


def _stamped(rows: Observations) -> Observations:
    return rounded(replace(rows, t_s=(np.arange(len(rows)) + 1) * ROW_S))


def recordings_option(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--data",
        type=Path,
        default=os.environ.get(RECORDINGS),
        metavar="DIR",
        help=f"recordings of others, as DIR/thymio/random_1 (default: ${RECORDINGS})",
    )


def all_families(recordings: Path | None) -> dict[str, Family]:
    """Those of recordings only where these are."""
    found = {name: Family(group, maker(start, draw), folds) for name, (group, start, draw, folds) in DRAWN.items()}
    for name, (start, draw) in GREY.items():
        found[name] = Family("grey ground", maker(start, draw))
        found[name.replace("clean", "grey")] = Family("grey ground", maker(start, draw, padded), seed_of=name)
    if recordings is not None:
        found |= {f"real {name}": Family("real", real(recordings, name)) for name in REAL}
        found["real, kidnaps"] = Family("real", spliced(recordings))
    return found
