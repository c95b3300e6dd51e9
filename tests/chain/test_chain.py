"""From field to ring, through firmware, RTL, USB, libusb, daemon and shared memory."""

import csv
import json
import os
import subprocess
import sys

import numpy as np
import pytest
from chainrun import BLOCK_TICKS, BUILD, DECISION_TICKS, TICKS_PER_S, is_last, record, write_flat_scene

from crunchbot.nav import localise
from crunchbot.scene import load
from crunchbot_lab.report.run import FILTERS
from crunchbot_lab.signals import World  # noqa: E402
from whisker_protocol import CODES, LANES, STATUS_CODE_SHIFT

SEED = 11
SECONDS = 2.0
WHISKERS = 6
HARDWARE_LINK = ("--sck-divider", "16", "--word-gap", "180", "--sample-point", "8")


def meander(block: int) -> tuple[float, float]:
    """A drive that moves every whisker: forward, and turning to and fro."""
    return 0.15, 0.8 if block // 10 % 2 else -0.6


def signals(folder, seconds: float) -> np.ndarray:
    """The same drive at level 1: counts (ticks, lanes, 2), no bit and no byte involved."""
    _, flat = write_flat_scene(folder, SEED)
    world = World(flat, SEED)
    ticks = round(seconds * TICKS_PER_S)
    counts = [world.run(BLOCK_TICKS + DECISION_TICKS)]
    for block in range((ticks - DECISION_TICKS) // BLOCK_TICKS - 1):
        world.drive(*meander(block))
        counts.append(world.run(BLOCK_TICKS))
    return np.concatenate(counts)


@pytest.fixture(scope="module")
def clean(tmp_path_factory) -> np.ndarray:
    return record(tmp_path_factory.mktemp("clean") / "run", SECONDS, SEED, meander)


def test_every_tick_arrives_once_and_in_order(clean):
    assert np.array_equal(clean["tick"], np.arange(SECONDS * TICKS_PER_S))
    assert np.array_equal(np.diff(clean["sequence"].astype(np.int64)), np.ones(len(clean) - 1))
    assert np.array_equal(clean["time_cycles"], clean["tick"] * 30000)
    assert [is_last(frame) for frame in clean[-2:]] == [False, True]


def test_rtl_delivers_the_counts_of_the_signal_level_bit_for_bit(clean, tmp_path):
    expected = signals(tmp_path, SECONDS)
    lanes = clean["lane"][:, :WHISKERS]
    assert np.array_equal(lanes["status"], np.zeros_like(lanes["status"]))
    assert np.array_equal(lanes["alpha"], expected[:, :, 0])
    assert np.array_equal(lanes["beta"], expected[:, :, 1])
    assert len({lane.tobytes() for lane in lanes["alpha"].T}) == WHISKERS, "lanes differ, or a swap would not show"


def test_lanes_without_a_node_are_reported_absent(clean):
    empty = clean["lane"]["status"][:, WHISKERS:]
    assert empty.shape[1] == LANES - WHISKERS
    assert np.all(empty == CODES["absent"] << STATUS_CODE_SHIFT)


def test_hardware_bus_settings_deliver_the_same(clean, tmp_path):
    slow = record(tmp_path / "run", SECONDS, SEED, meander, link=HARDWARE_LINK)
    assert np.array_equal(slow, clean)


def test_usb_faults_change_no_byte_and_lane_faults_only_their_records(clean, tmp_path):
    folder = tmp_path / "run"
    faults, usb = folder / "faults.csv", folder / "usb.csv"
    spoilt = record(folder, SECONDS, SEED, meander, "--faults", faults, "--usb-faults", usb)
    with open(faults) as file:
        injected = {(int(row["lane"]), int(row["tick"])) for row in csv.DictReader(file)}
    assert len(injected) >= 3
    assert len(usb.read_text().splitlines()) > 1
    different = spoilt["lane"][:, :WHISKERS] != clean["lane"][:, :WHISKERS]
    assert {(int(lane), int(tick)) for tick, lane in np.argwhere(different)} == injected
    reported = np.argwhere(spoilt["lane"]["status"][:, :WHISKERS] != 0)
    assert {(int(lane), int(tick)) for tick, lane in reported} == injected
    for name in ("tick", "sequence", "time_cycles", "dropped", "flags"):
        assert np.array_equal(spoilt[name], clean[name])


def demo(out, seed: int, **environment: str) -> dict:
    command = [sys.executable, "-m", "crunchbot_lab.demo", "--out", out, "--build-dir", BUILD]
    command += ["--seed", seed, "--seconds", 4, "--spread", 2]
    words = [str(word) for word in command]
    done = subprocess.run(words, capture_output=True, text=True, env=os.environ | environment)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[-1] == str(out / "report.html")
    assert len(lines) >= 4
    return json.loads((out / "summary.json").read_text())


def live_navigation_equals_localising_the_recording(out) -> None:
    scene = load(out / "scene")
    observations = localise.read_observations(localise.observations_path(out / "scene"), scene)
    for name in FILTERS:
        again = out / f"again_{name}.csv"
        localise.write_estimates(again, localise.run(name, scene, observations), observations)
        assert again.read_bytes() == (out / f"est_{name}.csv").read_bytes(), name


def test_same_seed_gives_the_same_summary_and_another_seed_another(tmp_path):
    """Models that are kept from an earlier run are those that are learnt anew, in an empty cache."""
    first, other = (demo(tmp_path / name, seed) for name, seed in (("a", 1), ("c", 3)))
    again = demo(tmp_path / "b", 1, XDG_CACHE_HOME=str(tmp_path / "cache"))
    assert [path.name for path in (tmp_path / "cache/crunchbot/models").iterdir()], "it has learnt, and kept it"
    untimed = [{key: v for key, v in s.items() if "wall" not in key} for s in (first, again, other)]
    assert untimed[0] == untimed[1] != untimed[2]
    for name in (
        "est_grid.csv",
        "est_foveal.csv",
        "est_odometry.csv",
        "bad.csv",
        "faults.csv",
        "usb_faults.csv",
        "truth.csv",
    ):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    live_navigation_equals_localising_the_recording(tmp_path / "a")
    assert first["frames_lost"] == 0
    assert first["records_bad_match"] is True
    assert first["frames_sent"] == first["frames_received"] == 8000
