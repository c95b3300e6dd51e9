"""A scene folder with recorded rows, as fixtures."""

import level0
import numpy as np
import pytest

from crunchbot import scene
from crunchbot.nav import localise


def write_observations(path, made, observations):
    arena, robot = made.arena, made.robot
    header = ["t_s", *localise.ODOMETRY, "note"]
    header += [f"{w.name}_{t}" for w in robot.of_role("texture") for t in arena.textures]
    header += [f"{w.name}_mm" for w in robot.of_role("object")] + list(localise.TRUTH)
    lines = [",".join(header)]
    for k, t in enumerate(observations.t_text):
        cells = [t, *map(repr, map(float, observations.odometry[k])), "x"]
        cells += ["" if np.isnan(v) else f"{v:.3f}" for v in observations.texture[k].ravel()]
        cells += ["" if np.isinf(v) else f"{v * 1000:.3f}" for v in observations.radial_m[k]]
        lines.append(",".join(cells + [repr(float(v)) for v in observations.truth[k]]))
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def recorded():
    return level0.record(3, rows=40)


@pytest.fixture
def folder(tmp_path, recorded):
    scene.write(tmp_path / "s", recorded[0])
    write_observations(tmp_path / "s" / "observations.csv", *recorded)
    return tmp_path / "s"
