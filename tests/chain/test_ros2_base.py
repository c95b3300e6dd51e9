"""The simulated base that speaks ROS 2, by real DDS: from a client's orders to the emulated Create's wheels and back; and a
whole robot on it."""

import contextlib
import csv
import math
import os
import signal
import subprocess
import sys
import uuid

import pytest
from chainrun import END_S, program
from linkkit import free_port
from rosbasekit import ROBOT, SIGNED, VARIABLE, Running, apart, wait_for

from crunchbot.pilot.base import BUMP_LEFT, Base

DOMAIN = 99
TOUCH = '[base.ros2.touch]\nbump_left = "/bumper/left"\n'
STANDS = 40  # looks at a base in a row that show no motion


class Way:
    """What a client of a base is given of its motion, summed up."""

    def __init__(self, base: Base):
        self.base, self.pose, self.still = base, [0.0, 0.0, 0.0], 0
        base.odometry()

    def look(self) -> list[float]:
        one = self.base.odometry()
        c, s = math.cos(self.pose[2]), math.sin(self.pose[2])
        moved = (c * one.x_m - s * one.y_m, s * one.x_m + c * one.y_m, one.theta_rad)
        self.pose = [a + b for a, b in zip(self.pose, moved, strict=True)]
        self.still = 0 if any(moved) else self.still + 1
        return self.pose

    def drive(self, v: float, omega: float, far: float) -> None:
        """Until it went or turned so far."""
        begin = list(self.look())

        def is_far() -> bool:
            self.base.drive(v, omega)
            return math.dist(begin, self.look()) >= far

        wait_for(is_far, "it does not drive")

    def settled(self) -> list[float]:
        wait_for(lambda: self.look() and self.still >= STANDS, "it never stands")
        return self.pose


class Robot:
    """Emulator, whisker-base, the simulated base between it and the wire, and `whisker base`."""

    def __init__(self, folder, *emulator: str, rate: float = 20.0):
        self.scene, port, socket = folder / "scene", folder / "port", folder / "create.sock"
        self.scene.mkdir()
        (self.scene / "robot.toml").write_text(ROBOT + TOUCH)
        (self.scene / "base_stops.toml").write_text(SIGNED)
        self.variables = os.environ | {VARIABLE: apart(str(uuid.uuid4())), "ROS_DOMAIN_ID": str(DOMAIN)}
        self._all, self._open = [], contextlib.ExitStack()
        try:
            self._begin(folder, port, socket, emulator, rate)
        except BaseException:
            self.close()
            raise

    def _begin(self, folder, port, socket, emulator, rate: float) -> None:
        self._start("Create 2", program("whisker-create-sim"), "--model", 2, "--link", port, *emulator)
        self._start("", program("whisker-base"), "--model", 2, "--port", port, "--socket", socket)
        module = ("-m", "crunchbot_lab.simulation.ros2_base")
        words = (self.scene, "--base", socket, "--rate", rate)
        self.base = self._start("simulated base: is up", sys.executable, *module, *words)
        driver = self._open.enter_context(contextlib.closing(Running(self.scene, self, folder / "base.sock")))
        self.client = self._open.enter_context(driver.ready())
        self.create = self._open.enter_context(Base(str(socket)))

    def _start(self, first: str, *words: object) -> subprocess.Popen:
        """A process; it has printed this line when this returns."""
        process = subprocess.Popen(list(map(str, words)), stdout=subprocess.PIPE, text=True, env=self.variables)
        self._all.append(process)
        assert not first or process.stdout.readline().startswith(first)
        return process

    def close(self) -> None:
        self._open.close()
        for process in reversed(self._all):
            process.terminate()
            process.communicate(timeout=END_S)


@pytest.fixture
def robot(tmp_path):
    kept = []

    def make(*emulator, **options):
        kept.append(Robot(tmp_path, *emulator, **options))
        return kept[-1]

    yield make
    for one in kept:
        one.close()


@pytest.mark.parametrize(("rate", "falls_silent"), [(8.0, False), (62.0, False), (20.0, True)])
def test_the_motion_is_the_creates(robot, rate, falls_silent):
    """At any rate, and over a second without odometry, for which the wheels stand."""
    made = robot(rate=rate)
    way, truth = Way(made.client), Way(made.create)
    way.drive(0.15, 0.0, 0.1)
    if falls_silent:
        made.base.send_signal(signal.SIGUSR2)
        wait_for(lambda: made.client.drive(0.15, 0.0) and made.client.health()["held"] == "odometry", "it hears on")
    way.drive(0.1, 0.6, 0.3)
    way.drive(0.0, -0.5, 0.2)
    made.client.stop()
    assert way.settled() == pytest.approx(truth.settled(), abs=1e-6) and way.pose[0] > 0.1
    assert made.client.health()["carried"] == "0"


def test_a_reset_of_its_odometry_costs_little(robot):
    made = robot()
    way, truth = Way(made.client), Way(made.create)
    way.drive(0.2, 0.0, 1.0)
    made.base.send_signal(signal.SIGUSR1)
    wait_for(lambda: way.drive(0.2, 0.0, 0.01) or made.client.health()["resets"] == "1", "no leap")
    made.client.stop()
    assert made.client.health()["carried"] == "0"
    assert way.settled()[0] == pytest.approx(truth.settled()[0], rel=0.05)


def test_a_bump_comes_through(robot):
    made = robot("--event", "bump-left@0+600")
    wait_for(lambda: made.client.odometry().bits & BUMP_LEFT, "no bump")


def test_a_whole_robot_drives_on_it(tmp_path):
    """`whisker robot --simulated --base ros2`: the pilot's orders reach the wheels of the world."""
    variables = os.environ | {VARIABLE: apart(str(uuid.uuid4())), "ROS_DOMAIN_ID": str(DOMAIN)}
    ring, first = f"whisker-test-ros2-{os.getpid()}", free_port(3)
    words = [sys.executable, "-m", "crunchbot.cli", "robot", "--simulated", "--base", "ros2", "--ring", ring]
    words += ["--first-port", str(first), "--seconds", "30", "--pace", "0.5", "--out", str(tmp_path / "run")]
    ran = subprocess.run(words, capture_output=True, text=True, env=variables, timeout=4 * END_S)
    assert ran.returncode == 0 and "starting bridge, create, simulated-base, whiskerd, base, pilot" in ran.stdout, ran
    logs = {log.name: log.read_text() for log in (tmp_path / "run/logs").rglob("*.log")}
    with open(tmp_path / "run/wheels.csv", newline="") as file:
        orders = list(csv.reader(file))[1:]
    assert any(any(map(float, order[2:4])) for order in orders), logs
    assert "odometry comes" in logs["base.log"]
