"""`whisker calibrate` end to end: body whisks of the simulated bridge against a post, live and from a recording."""

import math
import subprocess
import sys
from contextlib import ExitStack

import numpy as np
import pytest
from chainrun import BUILD, END_S

from crunchbot import scene as scenes
from crunchbot.pilot.behaviour import WHISK_RAD_S
from crunchbot.touch.mount import Mount
from crunchbot.touch.radial.model import read_whisks
from crunchbot.touch.radial.push import presses_of
from crunchbot_lab.signals.recordings import radial_contacts
from crunchbot_lab.simulation.scenes import make_robot

LANE, RADIUS_MM, WHISKS = 3, 110.0, 2  # object_2
SEED = 3
SIDE_M, POST_M, GAP_RAD, TOWARDS_RAD = 4.0, 0.03, 0.02, math.radians(10.0)
COURSE_S, LAST_S, PUSH_S = 3.8, 2.6, 0.6  # of the simulated bridge's whisks: one to the side of the post in each


def scene_with_post() -> scenes.Scene:
    """The whisker just beside the corner of a post that turning to its side presses at RADIUS_MM."""
    robot = make_robot()
    whisker = robot.whiskers[LANE]
    side = Mount.of(whisker).calibrated_turn
    heading = side * TOWARDS_RAD - whisker.yaw_rad
    middle, (x, y) = SIDE_M / 2, whisker.base_m
    corner = [
        middle + x * math.cos(heading) - y * math.sin(heading) + 1e-3 * RADIUS_MM * math.cos(TOWARDS_RAD),
        middle + x * math.sin(heading) + y * math.cos(heading) + 1e-3 * RADIUS_MM * side * math.sin(TOWARDS_RAD),
    ]
    low, high = sorted((corner[1], corner[1] + side * POST_M))
    arena = scenes.Arena((SIDE_M, SIDE_M), SIDE_M, ("VINYL",), ("V",), ((corner[0] - POST_M, low, corner[0], high),))
    start = scenes.Prior("gaussian", (middle, middle, heading - side * GAP_RAD), (0.1, 0.1, 0.1))
    return scenes.Scene(arena, robot, start)


def command(*arguments):
    return [sys.executable, "-m", "crunchbot.cli", *map(str, arguments)]


def calibrate(ring, folder, out) -> list[str]:
    words = ["--ring", ring, "--wait", END_S, "--backlog", "--yes", "--scene", folder, "--out", out, "--lane", LANE]
    words += ["--radii", RADIUS_MM, "--repeats", WHISKS, "--rest-seconds", 0.5, "--whisk-rad-s", WHISK_RAD_S]
    return command("calibrate", *words)


def finished(process) -> str:
    out, _ = process.communicate(timeout=END_S)
    assert process.returncode == 0, out
    return out


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory):
    """Folder with the scene, and calibrations `live` and `replayed`; what each said."""
    folder = tmp_path_factory.mktemp("calibrated")
    scenes.write(folder / "scene", scene_with_post())
    said = {}
    with ExitStack() as stack, pytest.MonkeyPatch.context() as patch:
        patch.setenv("WHISKER_BUILD", str(BUILD))

        def started(words):
            process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            stack.callback(process.kill)
            return process

        ring, drive = "whisker-test-calibrate", folder / "drive.mcap"
        live = started(calibrate(ring, folder / "scene", folder / "live"))
        recorder = started(command("record", drive, "--ring", ring, "--wait", END_S))
        words = ["--ring", ring, "--scene", folder / "scene", "--drive", "whisk", "--seed", SEED]
        finished(started(command("bridge-sim", *words, "--seconds", (WHISKS - 1) * COURSE_S + LAST_S)))
        said["live"] = finished(live)
        finished(recorder)
        again = started(calibrate(ring, folder / "scene", folder / "replayed"))
        finished(
            started(command("replay", drive, "--ring", ring, "--speed", "max", "--lead", 5, "--ring-frames", 1 << 15))
        )
        said["replayed"] = finished(again)
    return folder, said


def test_every_whisk_is_cut_out_and_reported(calibrated):
    folder, said = calibrated
    assert (
        f"{WHISKS} of {WHISKS}, {RADIUS_MM:g} mm: pushed for 0.6" in said["live"]
        and "no whole whisk" not in said["live"]
    )
    whisks = read_whisks(folder / "live/object_2.csv", with_radius=True)
    assert whisks.radius_mm.tolist() == [RADIUS_MM] * WHISKS and whisks.bad_rows == 0
    for contact in whisks.recorded:
        assert contact.whisk_rad_s == pytest.approx(WHISK_RAD_S)
        assert np.diff(contact.t_s) == pytest.approx(500e-6, abs=1e-4)


def test_the_peak_per_angle_is_that_of_the_signals(calibrated):
    """The same post without bridge, bus and daemon: peaks differ by repeatability, here by no more than three of it."""
    folder, _ = calibrated
    live, _ = presses_of(read_whisks(folder / "live/object_2.csv", with_radius=True).recorded)
    flat = scene_with_post().flat((SIDE_M / 2, SIDE_M / 2, 0.0))
    peaks = [
        np.hypot(*(c.counts - c.counts[:300].mean(axis=0)).T).max()
        for c in radial_contacts(flat, "object_2", SEED, 5, PUSH_S, (RADIUS_MM,))
    ]
    ours = np.mean([np.linalg.norm(push.deflection[-1]) / push.depth[-1] for push in live])
    assert ours == pytest.approx(np.mean(peaks) / (PUSH_S * WHISK_RAD_S), rel=0.12)


def test_a_replayed_recording_gives_the_same_files(calibrated):
    folder, said = calibrated
    for name in ("object_2.csv", "rest.toml"):
        assert (folder / "replayed" / name).read_bytes() == (folder / "live" / name).read_bytes()
    assert said["replayed"].replace("replayed", "live") == said["live"]
