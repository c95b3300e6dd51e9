"""The whole robot in lock-step, the same to the last bit; a paced world that goes on without its host."""

import csv
import json
import os
import re
import signal
import socket
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from chainrun import BUILD, END_S, running, simulation, write_flat_scene
from quickmodels import quick_models

from crunchbot import scene as scenes
from crunchbot.bridge.ring import Reader
from crunchbot.nav import localise
from crunchbot.nav.observations import read_observations
from crunchbot_lab.demo.chain import ChainRun, SpiLink, run_chain
from crunchbot_lab.report.run import FILTERS
from crunchbot_lab.simulation.scenes import make_scene

SEED, SECONDS = 3, 5.0


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    return quick_models(tmp_path_factory.mktemp("models"), SEED)


def fly(folder, models, create: int, seconds: float = SECONDS, build: Path = BUILD) -> ChainRun:
    made = ChainRun(folder, build, SEED, seconds, 6, SpiLink(6, 30, 5), create, "bytes")
    scene, start = make_scene(SEED)
    scenes.write(made.scene, scene)
    (made.scene / "scene.flat").write_text(scene.flat(start))
    (made.out / "models").symlink_to(models)
    run_chain(made, lambda tick: None)
    return made


@pytest.fixture(scope="module")
def flown(tmp_path_factory, models):
    return fly(tmp_path_factory.mktemp("run"), models, create=1)


def test_the_same_seed_gives_the_same_bytes(flown, models, tmp_path):
    again = fly(tmp_path / "again", models, create=1)
    names = ["truth.csv", "traces.csv", "bad.csv", "faults.csv", "scene/observations.csv"]
    for name in [*names, *(f"est_{name}.csv" for name in FILTERS)]:
        assert (again.out / name).read_bytes() == (flown.out / name).read_bytes(), name


def test_the_odometry_of_the_bases_bytes_follows_the_truth(flown):
    with open(flown.out / "truth.csv", newline="") as file:
        truth = [[float(row[key]) for key in ("x_m", "y_m")] for row in csv.DictReader(file)]
    with open(flown.scene / "observations.csv", newline="") as file:
        moved = [[float(row[key]) for key in ("odo_x_m", "odo_y_m")] for row in csv.DictReader(file)]
    driven, reported = (np.hypot(*np.diff(truth, axis=0).T).sum(), np.hypot(*np.array(moved).T).sum())
    assert driven > 0.2
    assert reported == pytest.approx(driven, rel=0.1), "5 % of scale, whole millimetres, and what is on its way"


def test_nothing_is_lost_between_netbook_and_desktop(flown):
    pilot, navigator = (json.loads((flown.out / f"{name}.json").read_text()) for name in ("pilot", "navigator"))
    rows = round(SECONDS * 10)
    assert (pilot["rows"], navigator["weighed"], navigator["missed"], navigator["skipped"]) == (rows, rows, 0, 0)
    base = pilot["base"]
    assert (base["corrupt"], base["missed"], base["commander_stops"], base["mode_losses"]) == ("0",) * 4
    assert int(base["frames"]) > 0.9 * SECONDS / 0.015


def test_a_create_2_flies_as_well(models, tmp_path):
    made = fly(tmp_path / "run", models, create=2, seconds=2.0)
    assert json.loads((made.out / "pilot.json").read_text())["base"]["angle_source"] == "encoders"


def lifting(folder: Path) -> Path:
    """The programs, but that of the bridge: there the base is lifted for 0.3 s."""
    folder.mkdir()
    for path in BUILD.rglob("whisker*"):
        if path.is_file() and os.access(path, os.X_OK):
            (folder / path.name).symlink_to(path)
    bridge = folder / "whisker-bridge-sim"
    lifted = " ".join(f"--create-event drop-{side}@2+0.3" for side in ("left", "right"))
    script = f'#!/bin/sh\nexec "{bridge.readlink()}" {lifted} "$@"\n'
    bridge.unlink()
    bridge.write_text(script)
    bridge.chmod(0o755)
    return folder


def test_a_robot_that_is_lifted_may_be_anywhere_live_and_from_its_rows(models, tmp_path):
    made = fly(tmp_path / "run", models, 2, 3.0, lifting(tmp_path / "bin"))
    scene, _ = make_scene(SEED)
    rows = read_observations(made.scene / "observations.csv", scene)
    lifted = np.flatnonzero(np.isinf(rows.odometry).all(axis=1))
    assert 2 <= len(lifted) <= 5 and 19 <= lifted[0] <= 21
    for name in FILTERS:
        live = confidence(made.out / f"est_{name}.csv")
        assert live[lifted[-1]] <= 0.3 < 0.5 <= live[lifted[0] - 1]
        assert live == pytest.approx(localise.run(name, scene, rows).table["confidence"], abs=1e-5)


def confidence(path: Path) -> np.ndarray:
    with path.open(newline="") as file:
        return np.array([float(row["confidence"]) for row in csv.DictReader(file)])


# ---------------------------------------------------------------------------------------------------------------------
# live


def test_under_a_pace_the_world_goes_on_without_its_bridge(tmp_path):
    scene, _ = write_flat_scene(tmp_path, SEED)
    path, ring = tmp_path / "sim.sock", f"whisker-test-pace-{os.getpid()}"
    command = simulation(tmp_path, scene, 3600, SEED, ring, "--socket", path, "--pace", 1, "--level", "bytes")
    with running(command) as process, Reader(ring, wait_s=END_S) as reader, watching(path) as server:
        reader.wait(10.0)
        server.send(b"unplug")
        while reader.stats is None or reader.stats.connected:
            assert process.poll() is None
            reported(server)
        published, ticks = reader.info.published, [reported(server) for _ in range(3)]
        assert np.diff(ticks).tolist() == [200, 200] and reader.info.published == published
        server.send(b"plug")
        while reader.info.published == published:
            reported(server)
        process.terminate()
        process.wait(END_S)
    assert not Path("/dev/shm", ring).exists()


@pytest.mark.parametrize("level", ["bytes", "rtl"])
def test_under_a_pace_the_world_goes_on_while_its_host_is_stopped(tmp_path, level):
    """As on hardware: the FIFO overflows, what it has no room for is counted, and the ticks show the gap."""
    scene, _ = write_flat_scene(tmp_path, SEED)
    path, ring = tmp_path / "sim.sock", f"whisker-test-stopped-{os.getpid()}"
    command = simulation(tmp_path, scene, 3600, SEED, ring, "--socket", path, "--pace", 1, "--level", level)
    with running(command) as process, Reader(ring, wait_s=END_S) as reader, watching(path) as server:
        reader.wait(10.0)
        host = reader.info.writer_pid
        os.kill(host, signal.SIGSTOP)
        ticks = [reported(server) for _ in range(12)]
        os.kill(host, signal.SIGCONT)
        assert np.diff(ticks).tolist() == [200] * 11
        frames = []
        for view in reader.frames():
            frames.append(view.copy())
            if view["dropped"][-1]:
                break
        frames = np.concatenate(frames)
        lost = np.diff(frames["tick"]).sum() - (len(frames) - 1)
        assert lost == frames["dropped"][-1] > 1000
        os.kill(host, signal.SIGSTOP)
        for _ in range(12):
            reported(server)
        os.kill(host, signal.SIGTERM)
        os.kill(host, signal.SIGCONT)
        assert process.wait(END_S) == 1
        assert re.search(r"the run ended after \d+ of 7200000 ticks$", process.stderr.read())
    assert not Path("/dev/shm", ring).exists()


@contextmanager
def watching(path):
    """The simulation's socket, watched for true poses."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as server:
        server.connect(str(path))
        server.settimeout(END_S)
        server.send(b"watch")
        yield server


def reported(server) -> int:
    """The tick of the next true pose."""
    word, tick, *pose = server.recv(256).split()
    assert word == b"truth" and len(pose) == 3
    return int(tick)
