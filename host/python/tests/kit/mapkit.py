"""The mapper over several drawn scenes of a family. A test of it holds for the median scene, or for a number of scenes:
one scene may be lucky."""

from functools import lru_cache

import numpy as np

from crunchbot.nav import mapping
from crunchbot_lab.scenes import map_scoring
from crunchbot_lab.scenes.making import Made, make

SEEDS = range(40, 45)
MANY = range(40, 52)  # for what happens in some scenes only


def map_made(made: Made) -> mapping.Mapped:
    """Its map, by the mapper's defaults."""
    return mapping.run(made.scene.robot, made.scene.arena.textures, made.observations)


@lru_cache(2 * len(MANY))
def mapped(family: str, seed: int, rows: int) -> tuple[Made, mapping.Mapped]:
    made = make(family, seed, rows)
    return made, map_made(made)


def errors_of(run: mapping.Mapped) -> tuple[float, float]:
    """Medians over the rows in m, of the mapper's poses and of odometry alone, each after the best rigid motion."""
    truth = run.rows.truth
    paths = run.table["pose"], map_scoring.odometry_path(run.rows.odometry)
    mine, wheels = (map_scoring.trajectory(path, truth)["error_median_m"] for path in paths)
    return mine, wheels


def errors(family: str, rows: int, seeds: range = SEEDS) -> tuple[np.ndarray, np.ndarray]:
    """errors_of for each seed."""
    mine, wheels = zip(*(errors_of(mapped(family, seed, rows)[1]) for seed in seeds), strict=True)
    return np.array(mine), np.array(wheels)
