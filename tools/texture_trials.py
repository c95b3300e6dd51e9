"""Data for bench_texture.py: simulated drives and strips of floor, faults, and public recordings given by the user."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from whisker.demo.scenes import make_scene
from whisker.demo.simulation import World
from whisker.demo.training import MOVES, flat

SURFACES = ("VINYL", "SMOOTH", "ROUGH")
SPEEDS_M_S = (0.05, 0.1, 0.15, 0.2)
TICK_S = 5e-4
LOOK = 20  # ticks between looks at the truth
TILE_M, STRIP_M, WIDTH_M = 0.5, 12.0, 2.0


def drives(seed: int, seconds: float = 8.0, surfaces=SURFACES) -> dict[str, list[np.ndarray]]:
    """One recording (n, 2) for each surface, speed and floor whisker, of the demo's robot."""
    from signals.recordings import surface_drive  # sim/ is on the path since whisker.demo.simulation

    robot, out = flat(make_scene(seed)[0]), {}
    for n, surface in enumerate(surfaces):
        seeds = [seed * 1000 + 50 * n + k for k in range(len(SPEEDS_M_S))]
        runs = [surface_drive(robot, surface, v, seconds, s, MOVES) for v, s in zip(SPEEDS_M_S, seeds, strict=True)]
        out[surface] = [counts.astype(float) for run in runs for counts in run.values()]
    return out


@dataclass
class Strip:
    """One whisker's drive over many tiles: counts (n, 2), and every LOOK ticks the surface and how far inside its tile."""

    counts: np.ndarray
    surface: np.ndarray
    inside_m: np.ndarray
    metres: float


def strips(seed: int, speed_m_s: float) -> list[Strip]:
    """A straight drive along a strip of random tiles; one for each floor whisker."""
    rng = np.random.default_rng([seed, 7])
    across, along = round(WIDTH_M / TILE_M), round((STRIP_M + 1.0) / TILE_M)
    rows = ["floor " + "".join(SURFACES[i][0] for i in rng.integers(3, size=along)) for _ in range(across)]
    robot = [line for line in flat(make_scene(seed)[0]).splitlines() if line.split("_")[0] in ("body", "texture")]
    scene = [
        f"size_m {STRIP_M + 1.0} {WIDTH_M}",
        f"tile_m {TILE_M}",
        *(f"texture {s}" for s in SURFACES),
        *rows,
        *robot,
    ]
    world = World("\n".join([*scene, f"start 0.4 {WIDTH_M / 2 + 0.03} 0.0"]) + "\n", seed)
    world.drive(speed_m_s, 0.0)
    world.run(400)
    blocks, truth = [], []
    for _ in range(int((STRIP_M - 0.4) / speed_m_s / TICK_S / LOOK)):
        blocks.append(world.run(LOOK))
        truth.append([world.tip(lane) for lane in range(2)])
    counts = np.concatenate(blocks).astype(float)
    return [
        Strip(
            counts[:, lane],
            np.array([SURFACES.index(t[lane].texture) for t in truth]),
            np.array([t[lane].inside_m for t in truth]),
            STRIP_M - 0.4,
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
    """Terrain, and the six inertial, two current and two wheel channels of every run at 100 Hz; FOLDER is data/borealtc."""
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
        "as trained": lambda x: x, "saturated channel": saturated, "stuck channel": stuck,
        "swapped channels": lambda x: x[:, ::-1].copy(), "sign-flipped channel": flipped,
        "offset drift": lambda x: x + np.linspace(0, 200, len(x))[:, None], "catches of 0.1-1 s": catches,
        "1 % random bad records": bad_records,
    }  # fmt: skip
    return {name: each(change) for name, change in changes.items()}
