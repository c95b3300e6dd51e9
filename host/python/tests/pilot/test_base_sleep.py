"""whisker-base and a machine that goes to sleep: a real message bus, and a stand-in for logind on it."""

import os
import shutil
import signal
import subprocess

import pytest
from createpeer import SAFE_MODE, STOP, Driver, drive_order

from crunchbot.errors import UserError
from crunchbot.pilot.base import IDLE
from crunchbot.programs import program

BUS = """\
<busconfig>
  <listen>unix:path={path}</listen>
  <policy context="default">
    <allow user="*"/>
    <allow own="*"/>
    <allow send_destination="*"/>
    <allow receive_sender="*"/>
  </policy>
</busconfig>
"""
LOCK = "lock sleep whisker-base delay"


class Spoken:
    """A process that is spoken to by lines."""

    def __init__(self, *words, **environment: str):
        self.process = subprocess.Popen(
            [str(word) for word in words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
            env={**os.environ, **environment},
        )

    def await_line(self, line: str) -> None:
        while (said := self.process.stdout.readline().strip()) != line:
            assert said, f"ended before {line!r}"

    def say(self, line: str) -> None:
        self.process.stdin.write(line + "\n")

    def end(self) -> None:
        if not self.process.stdin.closed:
            self.process.stdin.close()
            self.process.terminate()
            self.process.wait()
            self.process.stdout.close()


class Machine:
    """A bus, and a logind on it when one is wanted."""

    def __init__(self, folder):
        self._folder, self.address = folder, f"unix:path={folder / 'bus'}"
        (folder / "bus.conf").write_text(BUS.format(path=folder / "bus"))
        self.start_bus()

    def start_bus(self) -> None:
        self.bus = Spoken(
            "dbus-daemon", "--nofork", "--nopidfile", "--print-address", f"--config-file={self._folder}/bus.conf"
        )
        assert self.bus.process.stdout.readline().startswith(self.address)

    def start_logind(self) -> Spoken:
        self.logind = Spoken(program("fake_logind"), DBUS_SYSTEM_BUS_ADDRESS=self.address)
        self.logind.await_line("ready")
        return self.logind

    def end(self) -> None:
        self.logind.end()
        self.bus.end()


@pytest.fixture
def machine(tmp_path):
    if not shutil.which("dbus-daemon"):
        pytest.skip("no dbus-daemon; run tools/setup.sh")
    try:
        program("fake_logind")
    except UserError:
        pytest.skip("built without libsystemd")
    made = Machine(tmp_path)
    yield made
    made.end()


@pytest.fixture
def driver(tmp_path, machine):
    machine.start_logind()
    driver = Driver(tmp_path, DBUS_SYSTEM_BUS_ADDRESS=machine.address)
    hear(driver)
    machine.logind.await_line(LOCK)
    yield driver
    driver.close()


def hear(driver: Driver) -> None:
    """Until the driver has heard a base in safe mode, which goes on telling."""
    driver.peer.await_start()
    driver.enter()
    driver.peer.keep_telling(p35=SAFE_MODE)


def keep_driving(client, until) -> None:
    """A commander that is never silent drives until the wheels are held, or no more."""
    while client.health()["held"] != until:
        client.drive(0.2, 0)


@pytest.mark.parametrize("notice", ["PrepareForSleep", "PrepareForShutdown"])
def test_the_wheels_stop_before_the_machine_sleeps_and_may_turn_when_it_is_awake(driver, machine, notice):
    with driver.client() as client:
        assert client.drive(0.2, 0).v_m_s == 0.2
        driver.peer.await_order(drive_order(200, 200))
        machine.logind.say(f"{notice} 1")
        keep_driving(client, "sleep")
        machine.logind.await_line("released")
        driver.peer.await_order(STOP)
        assert client.health()["commander_stops"] == "0"
        assert client.drive(0.2, 0).v_m_s == 0
        assert client.odometry().bits & IDLE
        driver.peer.await_order(STOP)
        machine.logind.say(f"{notice} 0")
        machine.logind.await_line(LOCK)
        keep_driving(client, "no")
        assert client.drive(0.1, 0).v_m_s == 0.1
        driver.peer.await_order(drive_order(100, 100))


def test_a_machine_that_is_frozen_after_the_notice_stands(driver, machine):
    with driver.client() as client:
        client.drive(0.2, 0)
        driver.peer.await_order(drive_order(200, 200))
        pid = int(client.health()["driver_pid"])
        machine.logind.say("PrepareForSleep 1")
        keep_driving(client, "sleep")
        machine.logind.await_line("released")  # from now on logind lets the machine sleep
        os.kill(driver.process.pid, signal.SIGSTOP)
        os.kill(pid, signal.SIGSTOP)
        driver.peer.await_order(STOP)
        driver.process.send_signal(signal.SIGCONT)
        os.kill(pid, signal.SIGCONT)


def test_a_bus_that_goes_is_no_hindrance_and_ends_the_hold(driver, machine):
    with driver.client() as client:
        machine.logind.say("PrepareForSleep 1")
        keep_driving(client, "sleep")
        machine.end()
        keep_driving(client, "no")
        assert client.drive(0.2, 0).v_m_s == 0.2


def test_a_bus_that_answers_nothing_is_no_hindrance(tmp_path, machine):
    os.kill(machine.bus.process.pid, signal.SIGSTOP)
    driver = Driver(tmp_path, DBUS_SYSTEM_BUS_ADDRESS=machine.address)
    try:
        hear(driver)
        with driver.client() as client:
            assert client.drive(0.2, 0).v_m_s == 0.2
        assert driver.end() == 0
    finally:
        os.kill(machine.bus.process.pid, signal.SIGCONT)
        machine.start_logind()
        driver.close()


def test_without_a_logind_there_is_no_lock_and_one_line(tmp_path, machine):
    driver = Driver(tmp_path, "--verbose", DBUS_SYSTEM_BUS_ADDRESS=machine.address)
    hear(driver)
    with driver.client() as client:
        while "no notice from logind" not in driver.log.read_text():
            assert client.drive(0.2, 0).v_m_s == 0.2
    driver.close()
    assert driver.log.read_text().count("no notice from logind before the machine sleeps: ") == 1
    machine.start_logind()
