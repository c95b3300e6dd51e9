"""Level 1 and the RTL-level chain give the pilot the same samples: their observation rows are equal, cell by cell.

Without a Create: level 1 has its wheels' numbers, not its bytes.
"""

import csv
import os
from pathlib import Path

import numpy as np
import pytest

from crunchbot import scene as scenes
from crunchbot.observation import cell
from crunchbot.pilot.pilot import Pilot
from crunchbot.robot.models import load_models
from crunchbot_lab.demo import kept_models
from crunchbot_lab.demo.chain import ChainRun, SpiLink, run_chain
from crunchbot_lab.demo.level1 import explore
from crunchbot_lab.demo.summary import read_pairs
from crunchbot_lab.simulation.scenes import make_scene

ROOT = Path(__file__).resolve().parents[3]
SEED, SECONDS, LANES = 3, 8.0, 6


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    build = ROOT / os.environ.get("WHISKER_BUILD", "build/release")
    if not (build / "sim" / "robot" / "whisker-bridge-sim").exists():
        pytest.skip(f"{build}: the simulated bridge is not built; run 'make build'")
    made = ChainRun(tmp_path_factory.mktemp("run"), build, SEED, SECONDS, LANES, SpiLink(6, 30, 5), create=None)
    scene, start = make_scene(SEED)
    scenes.write(made.scene, scene)
    (made.scene / "scene.flat").write_text(scene.flat(start))
    kept_models.learn_or_copy(made.out / "models", scene, SEED, lambda: None)
    run_chain(made, lambda tick: None)
    return made


def test_rows_and_truth_are_equal(run):
    scene, start = make_scene(SEED)
    ticks = round(SECONDS * 2000)
    bad = np.zeros((ticks, LANES), np.uint16)
    for lane, tick in read_pairs(run.out / "bad.csv"):
        bad[tick, lane] = 1
    assert bad.any()
    pilot = Pilot(scene.robot, *load_models(run.out / "models", scene.robot), SEED)
    rows, truth = explore(scene, start, pilot, SEED, ticks, status=lambda first: bad[first : first + 40])
    with open(run.scene / "observations.csv", newline="") as file:
        chain_rows = list(csv.DictReader(file))
    assert [{key: cell(value) for key, value in row.items()} for row in rows] == chain_rows
    with open(run.out / "truth.csv", newline="") as file:
        chain_truth = list(csv.DictReader(file))
    assert [row["tick"] for row in truth] == [int(row["tick"]) for row in chain_truth]
    for key in ("x_m", "y_m", "theta_rad"):
        assert [float(row[key]) for row in chain_truth] == pytest.approx([row[key] for row in truth], abs=1e-6)
