"""whisker-base on the emulator that people without a robot use: real time, real faults, both models.

Waiting is done by the stream: `odometry(after=...)` answers when so many more bytes have come.
"""

import math
import subprocess
import time

import pytest
from patience import PATIENCE_S

from crunchbot.pilot.base import BUMP_LEFT, CLIFF_FRONT_LEFT, IDLE, Base
from crunchbot.programs import program

FRAME_BYTES = 38  # of what whisker-base asks a Create 1 for
WHISK_RAD_S = math.pi / 24
FRAME_BY_FRAME = ("--clock", "stream")  # it takes in no frame before the client asks for it, however late that is


class Robot:
    """Emulator, driver and a client."""

    def __init__(self, folder, simulated=(), driver=()):
        link, path = folder / "port", folder / "sock"
        self._emulator = self._start("stdout", "whisker-create-sim", "--link", link, *simulated)
        words = ("--port", link, "--socket", path, "--verbose", *driver)
        self._driver = self._start("stderr", "whisker-base", *words)
        self.base = Base(str(path))
        self.log = ""

    def _start(self, output: str, name: str, *words) -> subprocess.Popen:
        """Starts a program and waits for its first line."""
        command = [program(name), *map(str, words)]
        process = subprocess.Popen(command, text=True, **{output: subprocess.PIPE})
        assert getattr(process, output).readline()
        return process

    def count(self, key: str) -> int:
        return int(self.base.health()[key])

    def wait_frame(self):
        """Motion since the last call, when at least one more frame's bytes have come."""
        return self.base.odometry(after=self.count("bytes") + FRAME_BYTES)

    def drive_until(self, v_m_s: float, omega_rad_s: float, done) -> list:
        """Drives until done(motions so far); returns them, and leaves in `frames` how many there were at each."""
        motions, self.frames = [], []
        while not done(motions):
            self.base.drive(v_m_s, omega_rad_s)
            motions.append(self.wait_frame())
            self.frames.append(self.count("frames"))
        self.base.stop()
        return motions

    def close(self):
        if self._driver.stderr.closed:
            return
        self.base.close()
        self._driver.terminate()
        self.log = self._driver.communicate()[1]
        assert self._driver.returncode == 0, self.log
        self._emulator.terminate()
        self._emulator.communicate()


@pytest.fixture
def robot(tmp_path):
    made = []

    def begin(*simulated, driver=()):
        made.append(Robot(tmp_path, simulated, driver))
        return made[-1]

    yield begin
    for one in made:
        one.close()


def turned(angle_rad):
    return lambda motions: abs(sum(motion.theta_rad for motion in motions)) >= angle_rad


def turning(robot: Robot, motions: list) -> tuple[float, int]:
    """Angle (rad) and frames after the first motion that shows a turn: before it the order may not have been obeyed."""
    first = next(n for n, motion in enumerate(motions) if motion.theta_rad)
    return sum(motion.theta_rad for motion in motions[first + 1 :]), robot.frames[-1] - robot.frames[first]


def driven(distance_m):
    return lambda motions: abs(sum(motion.x_m for motion in motions)) >= distance_m


@pytest.mark.parametrize("options, remainder", [((), "kept"), (("--drop-remainder",), "dropped")])
def test_a_create_1_shows_how_it_counts_and_the_whisk_is_seen_either_way(robot, options, remainder):
    it = robot(*options, driver=FRAME_BY_FRAME)
    it.drive_until(0.1, 0, driven(0.25))
    assert it.base.health()["remainder"] == remainder
    seen, frames = turning(it, it.drive_until(0, WHISK_RAD_S, turned(0.1)))
    asked = frames * 0.015 * 2 * 0.017 / 0.258  # what so many frames are worth
    assert asked == pytest.approx(seen, abs=0.04)  # one degree, 0.017, at each end, and wheels that are not exact


def test_a_create_2_whisks_at_the_speed_it_says(robot):
    it = robot("--model", "2", driver=("--model", "2", *FRAME_BY_FRAME))
    while it.wait_frame().bits & IDLE:
        pass
    sent = it.base.drive(0, WHISK_RAD_S)
    seen, frames = turning(it, it.drive_until(0, WHISK_RAD_S, turned(0.15)))
    expected = frames * 0.015 * sent.omega_rad_s
    assert sent.omega_rad_s == pytest.approx(2 * 0.0285 / 0.235)
    assert seen == pytest.approx(expected, abs=0.03)  # it begins and ends within a frame or two
    assert it.base.health()["angle_source"] == "encoders"


def test_a_bad_line_costs_frames_and_nothing_else(robot):
    it = robot("--lose-bytes", "0.005", "--flip-bytes", "0.005", "--extra-bytes", "0.005")
    it.drive_until(0.1, 0, driven(0.15))
    while it.count("corrupt") < 5:
        it.wait_frame()
    health = it.base.health()
    counts = {key: int(health[key]) for key in ("bytes", "frames", "skipped", "resyncs", "restarts")}
    held = counts["bytes"] - counts["skipped"] - counts["frames"] * FRAME_BYTES
    assert 0 <= held < FRAME_BYTES
    assert counts["resyncs"] >= 3
    assert counts["restarts"] == 0


def test_a_cliff_makes_it_passive_until_the_commander_goes_on(robot):
    it = robot("--event", "cliff-front-left@0.6+1000", driver=FRAME_BY_FRAME)
    while it.wait_frame().bits & IDLE:
        pass
    stopped = IDLE | CLIFF_FRONT_LEFT
    it.drive_until(0.1, 0, lambda motions: motions and motions[-1].bits == stopped)
    assert it.wait_frame().bits == stopped
    assert it.base.health()["mode"] == "passive"
    it.base.mode("safe")
    while it.wait_frame().bits & IDLE:
        pass
    assert it.base.health()["mode_losses"] == "1"


def test_a_line_that_is_silent_for_a_second_is_back(robot):
    it = robot("--event", "silent@0.5+1")
    while it.count("silences") == 0 or it.base.health()["mode"] != "safe":
        it.wait_frame()


def test_a_base_that_neither_reported_nor_heard_went_on_as_it_did(robot):
    """Driving, and 2.8 s in which it hears no order to stop, and reports it in its first frame after."""
    it = robot("--event", "silent@1.5+2.8")
    far, began_s = 0.0, time.monotonic()
    while it.count("silences") == 0:
        it.base.drive(0.15, 0)
    while it.base.health()["mode"] != "safe" or far == 0.0:
        far += it.wait_frame().x_m
    assert 0.38 < far < 1.1 * 0.15 * (time.monotonic() - began_s), "more than wheels that are not exact can have gone"


def test_a_firmware_that_reports_modes_one_too_high_is_understood(robot):
    it = robot("--mode-plus-one")
    while it.wait_frame().bits & IDLE:
        pass
    assert it.base.health()["mode"] == "safe"


def test_a_bump_is_reported(robot):
    it = robot("--event", "bump-left@0.3+1000")
    it.drive_until(0.1, 0, lambda motions: motions and motions[-1].bits & BUMP_LEFT)


def test_a_low_battery_is_reported(robot):
    it = robot("--battery-low")
    it.wait_frame()
    assert it.base.health()["low_battery"] == "1"
    it.close()
    assert "the battery is low" in it.log


def test_the_emulator_takes_the_place_of_no_link_but_an_emulators(tmp_path):
    link, words = tmp_path / "port", [program("whisker-create-sim"), "--link", tmp_path / "port"]
    link.symlink_to(tmp_path / "data")
    done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode != 0 and "File exists" in done.stderr and link.readlink() == tmp_path / "data"
    link.unlink()
    link.symlink_to("/dev/pts/987654")
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as emulator:
        assert str(link) in emulator.stdout.readline()
        emulator.terminate()
    assert not link.is_symlink()
