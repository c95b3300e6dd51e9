"""The demo's scene: the paper's arena and robot, with floor, blocks, start and wrong prior drawn from the seed."""

import math

import numpy as np

from crunchbot.scene import Arena, Prior, Robot, Scene, Whisker

ARENA_M = 2.5
TILE_M = 0.5
TILES = 5
BLOCKS = 3
TEXTURES = ("VINYL", "SMOOTH", "ROUGH")

BODY_RADIUS_M = 0.165  # iRobot Create
TEXTURE_TIP_M = {"floor_left": (-0.02, 0.21), "floor_right": (-0.02, -0.21)}
OBJECT_TIP_DEG = {"object_1": 60.0, "object_2": 20.0, "object_3": -20.0, "object_4": -60.0}
ARM_M = 0.16  # from the robot's centre to a whisker's base; the whisker stands perpendicular to it
WHISKER_M = 0.14  # outside the follicle

# What the filters are given. The demo's odometer errs by 1 % a run and 2 % a move; the paper says below 5 %.
ODOMETRY_RELATIVE_SIGMA = 0.03
RADIAL_SIGMA_M = 0.005

# Of sim/world (sim_scene.h); the first is the default.
MECHANICS = ("static", "modes")
SENSORS = ("mlx90333", "tmag5170")

PRIOR_OFF_M = 0.2
PRIOR_OFF_RAD = math.radians(10)
PRIOR_SIGMA = (0.2, 0.2, math.radians(10))
START_CLEARANCE_M = 0.3


def make_robot() -> Robot:
    """Lanes 0 and 1: floor whiskers; 2 to 5: object whiskers from left to right."""
    floor = [Whisker(name, "texture", tip_m=tip) for name, tip in TEXTURE_TIP_M.items()]
    objects = [_object_whisker(name, math.radians(deg)) for name, deg in OBJECT_TIP_DEG.items()]
    return Robot(BODY_RADIUS_M, ODOMETRY_RELATIVE_SIGMA, RADIAL_SIGMA_M, (*floor, *objects))


def _object_whisker(name: str, tip_angle: float) -> Whisker:
    """Whisker with its tip in this direction from the centre; its base further out on the same side."""
    outwards = math.copysign(1.0, tip_angle)
    base_angle = tip_angle + outwards * math.atan2(WHISKER_M, ARM_M)
    base = (ARM_M * math.cos(base_angle), ARM_M * math.sin(base_angle))
    return Whisker(name, "object", base_m=base, yaw_rad=base_angle - outwards * math.pi / 2, length_m=WHISKER_M)


def simulated(mechanics: str, seed: int, sensor: str = SENSORS[0]) -> tuple[str, ...]:
    """What the simulated world is given beside a scene: how whiskers bend (one of MECHANICS), which whiskers, and what reads
    their magnets (one of SENSORS).
    """
    return (f"mechanics {mechanics}", f"batch {seed % 2**32}", *([f"sensor {sensor}"] if sensor != SENSORS[0] else []))


def make_scene(
    seed: int, mechanics: str = MECHANICS[0], sensor: str = SENSORS[0]
) -> tuple[Scene, tuple[float, float, float]]:
    """The seed's scene, its prior included, and the true start pose (x, y, theta)."""
    random = np.random.default_rng([seed, 1])
    arena = _make_arena(random)
    start = draw_start(arena, random)
    direction = random.uniform(-math.pi, math.pi)
    turn = PRIOR_OFF_RAD if random.random() < 0.5 else -PRIOR_OFF_RAD
    mean = (
        start[0] + PRIOR_OFF_M * math.cos(direction),
        start[1] + PRIOR_OFF_M * math.sin(direction),
        start[2] + turn,
    )
    prior = Prior("gaussian", mean, PRIOR_SIGMA)
    return Scene(arena, make_robot(), prior, simulated(mechanics, seed, sensor)), start


def _make_arena(random: np.random.Generator) -> Arena:
    letters = [name[0] for name in TEXTURES]
    drawn = [letters[k % len(letters)] for k in range(len(letters))]
    drawn += [letters[k] for k in random.integers(len(letters), size=TILES * TILES - len(letters))]
    random.shuffle(drawn)
    rows = tuple("".join(drawn[TILES * k : TILES * (k + 1)]) for k in range(TILES))
    tiles = random.choice(TILES * TILES, size=BLOCKS, replace=False)
    boxes = [_tile_box(int(tile) % TILES, int(tile) // TILES) for tile in tiles]
    return Arena((ARENA_M, ARENA_M), TILE_M, TEXTURES, rows, tuple(boxes))


def _tile_box(column: int, row: int) -> tuple[float, float, float, float]:
    return (TILE_M * column, TILE_M * row, TILE_M * (column + 1), TILE_M * (row + 1))


def draw_start(arena: Arena, random: np.random.Generator) -> tuple[float, float, float]:
    """A pose somewhere, START_CLEARANCE_M clear of everything."""
    while True:
        x, y = random.uniform(START_CLEARANCE_M, ARENA_M - START_CLEARANCE_M, size=2)
        if arena.is_free(x, y, START_CLEARANCE_M):
            return (float(x), float(y), float(random.uniform(-math.pi, math.pi)))
