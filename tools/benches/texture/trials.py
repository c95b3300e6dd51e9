"""Data of the bench: simulated drives and strips of floor, faults, and public recordings given by the user."""

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from crunchbot_lab.demo.training import MOVES, flat
from crunchbot_lab.signals import World
from crunchbot_lab.simulation.scenes import make_scene

SURFACES = ("VINYL", "SMOOTH", "ROUGH")
SPEEDS_M_S = (0.05, 0.1, 0.15, 0.2)
TICK_S = 5e-4
LOOK = 20  # ticks between looks at the truth
HELD_LOOK = 2  # ... and at whether an edge holds the tip, which a low one does for 2 ms
TILE_M, STRIP_M, WIDTH_M = 0.5, 12.0, 2.0


@cache
def drives(seed: int, robot: int, seconds: float = 8.0, surfaces=SURFACES) -> dict[str, list[np.ndarray]]:
    """One recording (n, 2) for each surface, speed and floor whisker, of the demo's robot of a seed on floors of
    another."""
    from crunchbot_lab.signals.recordings import surface_drive

    robot, out = flat(make_scene(robot, "modes")[0]), {}
    for n, surface in enumerate(surfaces):
        seeds = [seed * 1000 + 50 * n + k for k in range(len(SPEEDS_M_S))]
        runs = [surface_drive(robot, surface, v, seconds, s, MOVES) for v, s in zip(SPEEDS_M_S, seeds, strict=True)]
        out[surface] = [counts.astype(float) for run in runs for counts in run.values()]
    return out


def closer(recordings: dict[str, list[np.ndarray]], rng: np.random.Generator) -> dict[str, list[np.ndarray]]:
    """Surfaces harder to tell apart: the second's own vibration, of another moment, added to every recording."""
    common = recordings[SURFACES[1]]

    def mixed(x, other):
        return x + np.roll(other[: len(x)], int(rng.integers(1000, len(x) - 1000)), axis=0) - other.mean(axis=0)

    return {name: [mixed(x, y) for x, y in zip(group, common, strict=True)] for name, group in recordings.items()}


@dataclass
class Strip:
    """One whisker's drive over many tiles: counts (n, 2), and every LOOK ticks the surface under the tip were it free,
    how far inside its tile that is, and whether an edge holds it."""

    counts: np.ndarray
    surface: np.ndarray
    inside_m: np.ndarray
    caught: np.ndarray
    metres: float

    def left(self) -> np.ndarray:
        """Where the tip was on another tile, later than where it met it if the edge held it; in samples."""
        met = np.flatnonzero(np.diff(self.surface)) + 1
        left = []
        for at in met:
            held = next((k for k in range(at - 2, at + 3) if 0 <= k < len(self.caught) and self.caught[k]), None)
            free = np.flatnonzero(~self.caught[held:]) if held is not None else []
            left.append(held + free[0] if len(free) else at)
        return np.array(left, dtype=int) * LOOK


def strips(seed: int, robot: int, speed_m_s: float) -> list[Strip]:
    """A straight drive along a strip of random tiles; one for each floor whisker."""
    rng = np.random.default_rng([seed, 7])
    across, along = round(WIDTH_M / TILE_M), round((STRIP_M + 1.0) / TILE_M)
    rows = [[SURFACES[i] for i in rng.integers(3, size=along)] for _ in range(across)]
    return _drive_along(rows, seed, robot, speed_m_s, STRIP_M - 0.4)


def _drive_along(rows: list[list[str]], seed: int, robot: int, speed_m_s: float, metres: float) -> list[Strip]:
    lines = flat(make_scene(robot, "modes")[0]).splitlines()
    scene = [f"size_m {TILE_M * len(rows[0])} {WIDTH_M}", f"tile_m {TILE_M}", *(f"texture {s}" for s in SURFACES)]
    scene += ["floor " + "".join(name[0] for name in row) for row in rows]
    scene += [line for line in lines if re.match("body_|texture_w|mechanics|batch", line)]
    world = World("\n".join([*scene, f"start 0.4 {WIDTH_M / 2 + 0.03} 0.0"]) + "\n", seed)
    world.drive(speed_m_s, 0.0)
    world.run(400)
    blocks, truth, caught = [], [], []
    for _ in range(int(metres / speed_m_s / TICK_S / LOOK)):
        held = np.zeros(2, bool)
        for _ in range(LOOK // HELD_LOOK):
            blocks.append(world.run(HELD_LOOK))
            held |= [world.tip(lane).caught for lane in range(2)]
        truth.append([world.tip(lane) for lane in range(2)])
        caught.append(held)
    counts = np.concatenate(blocks).astype(float)
    return [
        Strip(
            counts[:, lane],
            np.array([SURFACES.index(t[lane].texture) for t in truth]),
            np.array([t[lane].inside_m for t in truth]),
            np.array([c[lane] for c in caught]),
            metres,
        )
        for lane in range(2)
    ]


def fabricslide(folder: Path) -> list[tuple[str, dict, np.ndarray]]:
    """Fabric, what may be left out (repeat, speed, force), and 16 taxels of every trial; FOLDER is its data/fabric."""
    found = []
    for path in sorted(folder.glob("*.csv")):
        name, force, speed, repeat = re.fullmatch(r"(\w+)_F(\d+)_V(-?\d+)mmps_(\d+)", path.stem).groups()
        rows = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)[:, 3:]
        found.append((name, {"repeat": int(repeat), "speed": abs(int(speed)), "force": int(force)}, rows))
    return found


def borealtc(folder: Path) -> list[tuple[str, np.ndarray]]:
    """Terrain and channels of every run at 100 Hz, but of terrains with one run: it cannot be held out."""
    found = terrain_runs(folder)
    names = [name for name, _ in found]
    return [run for run in found if names.count(run[0]) > 1]


def vulpi(folder: Path) -> list[tuple[str, np.ndarray]]:
    """Terrain and channels of every run at 50 Hz; the one run of a terrain is cut in five."""
    found = terrain_runs(folder)
    names = [name for name, _ in found]
    return [(n, part) for n, x in found for part in (np.array_split(x, 5) if names.count(n) == 1 else [x])]


def terrain_runs(folder: Path) -> list[tuple[str, np.ndarray]]:
    """Terrain, and the six inertial, two current and two wheel channels of every run; FOLDER is BorealTC's
    data/borealtc or data/vulpi."""
    found = []
    for path in sorted(folder.glob("*/imu_*.csv")):
        slow = path.with_name(path.name.replace("imu", "pro"))
        if not slow.exists():
            continue
        inertial, motors = (np.loadtxt(p, delimiter=",", skiprows=1, ndmin=2) for p in (path, slow))
        resampled = [np.interp(inertial[:, 0], motors[:, 0], motors[:, c]) for c in range(1, 5)]
        found.append((path.parent.name, np.column_stack([inertial[:, 1:7], *resampled])))
    return found


def faults(recordings: dict[str, list[np.ndarray]], rng: np.random.Generator) -> dict[str, dict[str, list[np.ndarray]]]:
    """The recordings as they are, and spoiled in every way of the stability table."""

    def each(change) -> dict[str, list[np.ndarray]]:
        return {name: [change(r.copy()) for r in group] for name, group in recordings.items()}

    def saturated(x):
        middle = x[:, 1].mean()
        x[:, 1] = np.clip((x[:, 1] - middle) * 2000 + middle, 0, 65535)
        return x

    def stuck(x):
        x[:, 0] = x[0, 0]
        return x

    def flipped(x):
        x[:, 0] = 2 * x[:, 0].mean() - x[:, 0]
        return x

    def catches(x):
        at = 200
        while at < len(x) - 2400:
            length = int(rng.uniform(200, 2000))
            x[at : at + length, 0] += rng.uniform(400, 900) * np.sin(np.linspace(0, np.pi, length))
            at += length + 400
        return x

    def bad_records(x):
        bad = rng.random(len(x)) < 0.01
        x[bad] = rng.uniform(0, 65535, (bad.sum(), x.shape[1]))
        return x

    changes = {
        "as trained": lambda x: x,
        "saturated channel": saturated,
        "stuck channel": stuck,
        "swapped channels": lambda x: x[:, ::-1].copy(),
        "sign-flipped channel": flipped,
        "offset drift": lambda x: x + np.linspace(0, 200, len(x))[:, None],
        "catches of 0.1-1 s": catches,
        "1 % random bad records": bad_records,
    }
    return {name: each(change) for name, change in changes.items()}
