"""A public driver, pycreate2, on the emulator: what it reads is what the wheels did."""

import math
import os
import signal
import subprocess

import pytest
from patience import PATIENCE_S

SIMULATION = os.environ.get("WHISKER_CREATE_SIM", "")
MM_PER_COUNT = math.pi * 72.0 / 508.8  # Create 2's encoders and wheels
WHEEL_BASE_MM = 235.0
SAFE, FULL = 2, 3

pytestmark = pytest.mark.skipif(not SIMULATION, reason="run by CTest, which knows where the program is")
pycreate2 = pytest.importorskip("pycreate2", reason="pycreate2 is not installed")


class Emulator:
    """whisker-create-sim at a link of its own."""

    def __init__(self, folder, *options):
        self.link = folder / "create"
        command = [SIMULATION, "--model", "2", "--link", str(self.link), *options]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline() == f"Create 2 at {self.link}\n"

    def end(self) -> list[str]:
        """Stops it; the modes it has printed."""
        self.process.send_signal(signal.SIGTERM)
        output, _ = self.process.communicate(timeout=PATIENCE_S)
        assert self.process.returncode == 0
        assert not self.link.is_symlink()
        return [line.split()[-1] for line in output.splitlines() if not line.endswith("rad")]


@pytest.fixture
def emulator(tmp_path):
    started = Emulator(tmp_path)
    yield started
    if started.process.poll() is None:
        started.process.kill()


def turned(count: int, before: int) -> int:
    """Counts between two readings of an encoder of 16 bits."""
    return (count - before + 0x8000) % 0x10000 - 0x8000


class Way:
    """What sensor readings add up to: by packets 19 and 20, and by the encoders."""

    def __init__(self, sensors):
        self.last = sensors
        self.mm = self.degrees = self.left_mm = self.right_mm = 0.0

    def add(self, sensors):
        self.mm += sensors.distance
        self.degrees += sensors.angle
        self.left_mm += MM_PER_COUNT * turned(sensors.encoder_counts_left, self.last.encoder_counts_left)
        self.right_mm += MM_PER_COUNT * turned(sensors.encoder_counts_right, self.last.encoder_counts_right)
        self.last = sensors


def go(robot, right: int, left: int, until) -> Way:
    way = Way(robot.get_sensors())
    robot.drive_direct(right, left)
    while not until(way):
        way.add(robot.get_sensors())
    robot.drive_stop()
    way.add(robot.get_sensors())
    return way


def test_it_drives_and_reads(emulator):
    robot = pycreate2.Create2(str(emulator.link))
    robot.start()
    robot.safe()
    straight = go(robot, 285, 285, lambda way: way.mm >= 200)
    assert straight.mm == pytest.approx((straight.left_mm + straight.right_mm) / 2, abs=2)
    assert abs(straight.degrees) <= 1
    turn = go(robot, 114, -114, lambda way: way.degrees >= 60)
    assert turn.degrees == pytest.approx(math.degrees((turn.right_mm - turn.left_mm) / WHEEL_BASE_MM), abs=2)
    assert abs(turn.mm) <= 1
    sensors = robot.get_sensors()
    assert sensors.open_interface_mode == SAFE
    assert 12000 < sensors.voltage < 17000
    assert sensors.battery_charge < sensors.battery_capacity
    assert sensors.velocity_left == sensors.velocity_right == 0
    robot.drive_direct(100, -57)
    while robot.get_sensors().velocity_left == 0:
        pass
    assert (robot.get_sensors().velocity_right, robot.get_sensors().velocity_left) == (100, -57)
    robot.full()
    assert robot.get_sensors().open_interface_mode == FULL
    del robot  # stops the wheels and the interface
    assert emulator.end() == ["passive", "safe", "full", "off"]


def test_wrong_use_is_refused():
    for options in (["--model", "3"], ["--lose-bytes", "2"], ["--event", "kick@1"], ["--nothing"], ["word"]):
        done = subprocess.run([SIMULATION, *options], capture_output=True, text=True, timeout=PATIENCE_S)
        assert done.returncode == 2
        assert done.stderr.startswith("whisker-create-sim: ") and done.stderr.count("\n") == 1


def test_help_has_examples():
    done = subprocess.run([SIMULATION, "--help"], capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0
    assert done.stdout.count("Example: ") == 3


def test_an_arena_that_cannot_be_read(tmp_path):
    command = [SIMULATION, "--arena", str(tmp_path / "none.flat")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 1
    assert "none.flat" in done.stderr
