"""The driver of the base in step with the simulation: simulated wheels, emulated Create, serial line, whisker-base, client."""

import csv
import math
import os
import subprocess
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from chainrun import BLOCK_TICKS, END_S, FAST_LINK, TICKS_PER_S, program, running, simulation

from crunchbot.pilot.base import Base
from crunchbot.robot.simulation_link import SimLink

SECONDS = 1.6
X_M, Y_M = 1.5, 1.5
SCENE = f"""\
size_m 3 3
tile_m 3
texture SMOOTH
floor S
body_radius_m 0.165
texture_whisker left -0.02 0.21
start {X_M} {Y_M} 0
"""
WHEELS_ERROR = 0.09  # at most, of distance and angle counted (sim/world/base.h)
SPEED_M_S, TURN_RAD_S = 0.2, 1.0
STRAIGHT_BLOCKS = round(SECONDS / 2 * TICKS_PER_S / BLOCK_TICKS)


def course(block: int) -> tuple[float, float]:
    """Straight, then on the spot."""
    return (SPEED_M_S, 0.0) if block < STRAIGHT_BLOCKS else (0.0, TURN_RAD_S)


def connect(path: Path, process: subprocess.Popen) -> SimLink:
    """The simulation's socket, as soon as it is there."""
    while True:
        try:
            return SimLink(str(path))
        except OSError:
            assert process.poll() is None, process.stderr.read()
            os.sched_yield()


@contextmanager
def driver(folder: Path, model: int):
    """whisker-base on the simulation's serial port, and a client; its log is checked to be clean at the end."""
    path = folder / "base.sock"
    words = [program("whisker-base"), "--port", folder / "create", "--socket", path, "--model", model]
    words += ["--clock", "stream", "--verbose"]
    with running([str(word) for word in words]) as process:
        assert "open" in process.stderr.readline()
        with Base(str(path)) as base:
            yield base


def drive(link: SimLink, base: Base, blocks: int) -> list:
    """Answers every block by the course; what the base said each time."""
    reported = []
    for block in range(blocks):
        tick = (block + 1) * BLOCK_TICKS - 1
        after = link.bytes_sent(tick)
        if after is None:
            break
        reported.append((after, base.odometry(after)))
        link.base(tick, base.drive(*course(block), after).byte_count)
    while link.ended_after is None:  # the last block's answer is still to be taken
        assert link._receive()
    return reported


def run(folder: Path, model: int, *options) -> tuple[list, list[dict]]:
    """What the driver said block by block, and the true path."""
    folder.mkdir()
    (folder / "scene.flat").write_text(SCENE)
    words = ["--socket", folder / "sock", "--followers", 1, "--level", "bytes", "--truth", folder / "truth.csv"]
    words += ["--create", model, "--create-link", folder / "create", *options]
    ring = f"whisker-test-base-{os.getpid()}"
    command = simulation(folder, folder / "scene.flat", SECONDS, 3, ring, *words, link=FAST_LINK)
    with running(command) as process, connect(folder / "sock", process) as link, driver(folder, model) as base:
        reported = drive(link, base, round(SECONDS * TICKS_PER_S / BLOCK_TICKS))
        assert process.wait(END_S) == 0, process.stderr.read()
    with (folder / "truth.csv").open() as file:
        return reported, list(csv.DictReader(file))


@pytest.mark.parametrize("options", [(), ("--create-lose-bytes", 0.01, "--create-drop-remainder")])
def test_the_same_seed_gives_the_same_odometry_to_the_last_bit(tmp_path, options):
    assert run(tmp_path / "one", 1, *options) == run(tmp_path / "two", 1, *options)


@pytest.mark.parametrize("model", [1, 2])
def test_odometry_and_truth_differ_by_no_more_than_the_wheels_count_wrong(tmp_path, model):
    reported, truth = run(tmp_path / "run", model)
    distance = sum(motion.x_m for _, motion in reported)
    angle = sum(motion.theta_rad for _, motion in reported)
    true_distance = math.hypot(float(truth[-1]["x_m"]) - X_M, float(truth[-1]["y_m"]) - Y_M)
    true_angle = float(truth[-1]["theta_rad"])
    grain_m, grain_rad = 0.004, 0.05  # reported in units, up to a frame ago
    assert distance == pytest.approx(true_distance, rel=WHEELS_ERROR, abs=grain_m)
    assert angle == pytest.approx(true_angle, rel=WHEELS_ERROR, abs=grain_rad)
    for _, motion in reported:
        assert np.linalg.eigvalsh(np.array(motion.covariance)).min() >= -1e-12
