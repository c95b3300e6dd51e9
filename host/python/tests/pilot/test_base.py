"""whisker-base and its client against a scripted base: orders, odometry, and what makes wheels stop.

No test waits by the clock: each waits for bytes on the line, for an answer, or for the end of a process.
"""

import ctypes
import fcntl
import math
import os
import pty
import resource
import signal
import socket
import subprocess
import sys
import termios
import time
from contextlib import closing
from pathlib import Path

import pytest
from createpeer import (
    FIRM_STOP,
    FULL,
    FULL_MODE,
    PAUSE,
    SAFE,
    SAFE_MODE,
    START,
    STOP,
    Driver,
    Heart,
    drive_order,
)
from hostile_clients import attacked, serve_honest

from crunchbot.pilot import base
from crunchbot.pilot.base import BaseError, BaseLost
from crunchbot.programs import program

SILENCES = 100  # by the driver's count: more than it needs to tell the cause of one
ENDED = STOP + bytes([PAUSE, 0, START])  # last words: stopped, silent, passive


@pytest.fixture
def start(tmp_path):
    """Starts whisker-base with options; the base has entered its mode when this returns."""
    drivers = []

    def begin(*options, mode=SAFE, **more):
        driver = Driver(tmp_path, *options, **more)
        drivers.append(driver)
        assert driver.peer.await_start().endswith(STOP)
        driver.enter(mode)
        if "stream" not in options:
            driver.peer.keep_telling(p35=SAFE_MODE if mode == SAFE else FULL_MODE)
        return driver

    yield begin
    for driver in drivers:
        driver.close()


def await_frame(client, driver, **values):
    """Sends one frame and waits until the driver has taken it."""
    client.odometry(after=driver.peer.tell(driver.peer.frame(**values)))


def test_starts_stopped_and_ends_stopped_passive_and_gone(start):
    driver = start()
    assert {7, 9, 12, 19, 20, 35, 41, 42} <= set(driver.peer.asked)
    assert 43 not in driver.peer.asked
    with driver.client() as client:
        client.drive(0.1, 0)
        driver.peer.await_order(drive_order(100, 100))
        assert driver.end() == 0
        assert driver.peer.await_order(ENDED) == b""
        with pytest.raises(BaseLost, match="whisker-base has gone"):
            client.health()
    assert not driver.socket.exists()


def test_create_2_is_asked_for_encoders_and_full_mode_is_entered(start):
    driver = start("--model", "2", "--mode", "full", mode=FULL)
    assert {43, 44} <= set(driver.peer.asked)


def test_drive_says_what_the_wheels_really_do(start):
    driver = start("--model", "2", "--clock", "stream")
    with driver.client() as client:
        started = client.stop()
        sent = client.drive(0, math.pi / 24)
        driver.peer.await_order(STOP + drive_order(-29, 29))
        assert sent.byte_count == started.byte_count + len(STOP)
        assert sent.v_m_s == 0
        assert sent.omega_rad_s == pytest.approx(2 * 0.0285 / 0.235)
        health = client.health()
        assert (health["left_mm_s"], health["right_mm_s"]) == ("-29", "29")


def test_odometry_is_of_the_frames_up_to_a_byte_and_of_each_client(start):
    driver = start("--clock", "stream", "--odometry", "reported")
    peer = driver.peer
    with driver.client() as client, driver.client() as other:
        assert client.odometry(after=0).bits == 0
        one = peer.tell(peer.frame(p19=20))
        two = peer.tell(peer.frame(p19=30, p7=base.BUMP_LEFT, p9=1))
        first = client.odometry(after=one)
        assert (first.x_m, first.y_m, first.theta_rad) == (0.02, 0, 0)
        assert first.covariance[0][0] == pytest.approx(0.001**2 + 2 * 0.001**2 / 12)
        second = client.odometry(after=two)
        assert second.x_m == 0.03
        assert second.bits == base.BUMP_LEFT | base.CLIFF_LEFT
        assert other.odometry().x_m == pytest.approx(0.05)
        peer.tell(peer.frame(p20=5))
        third = client.odometry(after=peer.reported)
        assert third.theta_rad == pytest.approx(math.radians(5))
        assert client.health()["frames"] == "5"  # two before it was in its mode


def test_nothing_is_taken_beyond_what_a_client_asks_for(start):
    driver = start("--clock", "stream", "--odometry", "reported")
    peer = driver.peer
    with driver.client() as client:
        client.odometry(after=0)
        one = peer.tell(peer.frame(p19=20))
        peer.tell(peer.frame(p19=30))
        assert client.odometry(after=one).x_m == 0.02
        assert client.odometry().x_m == 0
        assert client.health()["bytes"] == str(one)


def test_damaged_bytes_cost_one_frame_and_are_counted(start):
    driver = start("--clock", "stream")
    peer = driver.peer
    with driver.client() as client:
        frame = peer.frame()
        peer.tell(frame + frame[:9] + frame[10:] + frame)
        client.odometry(after=peer.reported)
        health = client.health()
    assert {key: health[key] for key in ("frames", "corrupt", "skipped", "resyncs", "missed")} == {
        "frames": "4",
        "corrupt": "1",
        "skipped": str(len(frame) - 1),
        "resyncs": "1",
        "missed": "1",
    }


# ---------------------------------------------------------------------------------------------------- what stops wheels

COMMANDER = """
import sys
from crunchbot.pilot.base import Base
base = Base(sys.argv[1])
while True:
    base.drive(0.2, 0)
"""


def test_a_killed_commander_stops_the_wheels(start):
    driver = start()
    commander = subprocess.Popen([sys.executable, "-c", COMMANDER, str(driver.socket)])
    driver.peer.await_order(drive_order(200, 200))
    commander.kill()
    commander.wait()
    driver.peer.await_order(STOP)


def test_a_silent_commander_stops_the_wheels(start):
    driver = start()
    with driver.client() as client:
        client.drive(0.2, 0)
        driver.peer.await_order(drive_order(200, 200))
        driver.peer.await_order(STOP)
        assert client.health()["commander_stops"] == "1"
        assert client.drive(0.1, 0).v_m_s == 0.1  # and drives on when it is back
        driver.peer.await_order(drive_order(100, 100))


def test_by_the_streams_clock_a_silent_commander_has_twenty_frames(start):
    driver = start("--clock", "stream")
    peer = driver.peer
    with driver.client() as client:
        before = client.drive(0.2, 0)
        peer.tell(peer.frame() * 19)
        client.odometry(after=peer.reported)
        assert client.health()["commander_stops"] == "0"
        peer.tell(peer.frame())
        client.odometry(after=peer.reported)
        assert client.health()["commander_stops"] == "1"
        assert client.stop().byte_count == before.byte_count + 2 * len(STOP)
        peer.tell(peer.frame() * 40)  # wheels that stand are not stopped again
        client.odometry(after=peer.reported)
        assert client.health()["commander_stops"] == "1"


def test_a_killed_driver_stops_the_wheels_and_another_takes_over(start):
    driver = start("--clock", "stream")
    with driver.client() as client:
        client.drive(0.2, 0)
        driver.peer.await_order(drive_order(200, 200))
        os.kill(int(client.health()["driver_pid"]), signal.SIGKILL)
        assert driver.peer.await_order(FIRM_STOP) == b""  # the guard's
        assert driver.peer.await_start() == FIRM_STOP  # the next driver's
        driver.enter()
        with pytest.raises(BaseLost):
            client.health()
    with driver.client() as client:
        assert client.health()["restarts"] == "1"
        client.drive(0.1, 0)
        driver.peer.await_order(drive_order(100, 100))


def test_a_driver_that_hangs_is_replaced(start):
    driver = start()
    with driver.client() as client:
        pid = int(client.health()["driver_pid"])
        client.drive(0.2, 0)
        driver.peer.await_order(drive_order(200, 200))
        os.kill(pid, signal.SIGSTOP)
        driver.peer.await_order(FIRM_STOP)  # it hangs
        assert driver.peer.await_start() == 2 * FIRM_STOP  # it was ended; the next one starts
    with driver.client() as client:
        assert client.health()["restarts"] == "1"


def test_a_killed_guard_stops_the_wheels_and_ends_the_driver(start):
    driver = start("--clock", "stream")
    with driver.client() as client:
        client.drive(0.2, 0)
        driver.peer.await_order(drive_order(200, 200))
        assert driver.end(signal.SIGKILL) == -signal.SIGKILL
        assert driver.peer.await_order(ENDED) == STOP
        with pytest.raises(BaseLost):
            client.health()
    driver.start()  # what was left behind is no hindrance
    driver.peer.await_start()


def test_a_killed_guard_and_a_driver_that_hangs_stand_with_the_next_start(start):
    """As the supervisor goes about it: what is left of a program that ended is killed, and another started."""
    driver = start("--clock", "stream")
    with driver.client() as client:
        client.drive(0.2, 0)
        driver.peer.await_order(drive_order(200, 200))
        left = int(client.health()["driver_pid"])
        os.kill(left, signal.SIGSTOP)
        assert driver.end(signal.SIGKILL) == -signal.SIGKILL
        os.kill(left, signal.SIGKILL)
    driver.start()
    driver.peer.await_start()


def test_a_driver_that_hangs_is_no_hindrance_to_an_end(start):
    driver = start("--clock", "stream")
    with driver.client() as client:
        client.drive(0.2, 0)
        driver.peer.await_order(drive_order(200, 200))
        os.kill(int(client.health()["driver_pid"]), signal.SIGSTOP)
        driver.process.terminate()
        driver.peer.await_order(FIRM_STOP)
        assert driver.process.wait() == 0


def drive_until_held(client):
    """A commander that says so all the time drives, until the wheels are kept stopped."""
    assert client.drive(0.2, 0).v_m_s == 0.2
    while client.health()["held"] != "heartbeat":
        client.drive(0.2, 0)
    assert client.health()["commander_stops"] == "0"
    assert client.drive(0.2, 0).v_m_s == 0
    assert client.odometry().bits & base.IDLE


def drive_again(client):
    while client.drive(0.1, 0).v_m_s == 0:
        pass


def test_a_supervisor_that_hangs_stops_the_wheels_until_it_is_back(start):
    heart = Heart()
    driver = start(heart=heart)
    with driver.client() as client:
        heart.hang()
        drive_until_held(client)
        driver.peer.await_order(drive_order(200, 200))
        driver.peer.await_order(STOP)
        heart.go_on()
        drive_again(client)
        driver.peer.await_order(drive_order(100, 100))
    assert "no heartbeat" in driver.log.read_text()


def test_a_supervisor_that_ends_stops_the_wheels_and_ends_the_driver(start):
    for options in ((), ("--clock", "stream")):
        heart = Heart()
        driver = start(*options, heart=heart)
        with driver.client() as client:
            client.drive(0.2, 0)
            driver.peer.await_order(drive_order(200, 200))
            heart.end()
            driver.peer.await_order(ENDED)
            assert driver.process.wait() == 0
        driver.peer.link.unlink()
        assert not driver.socket.exists()


def test_a_supervisor_that_ends_and_a_driver_that_hangs_stop_the_wheels(start):
    heart = Heart()
    driver = start(heart=heart)
    with driver.client() as client:
        client.drive(0.2, 0)
        driver.peer.await_order(drive_order(200, 200))
        os.kill(int(client.health()["driver_pid"]), signal.SIGSTOP)
        heart.end()
        driver.peer.await_order(FIRM_STOP)
        assert driver.process.wait() == 0


def test_by_the_streams_clock_a_supervisor_may_hang(start):
    heart = Heart()
    heart.hang()
    driver = start("--clock", "stream", heart=heart, WATCHDOG_USEC="1000")
    with driver.client() as client:
        assert client.drive(0.2, 0).v_m_s == 0.2
        assert client.health()["held"] == "no"


def test_a_guard_that_hangs_stops_the_wheels_until_it_is_back(start):
    driver = start()
    with driver.client() as client:
        driver.process.send_signal(signal.SIGSTOP)
        drive_until_held(client)
        driver.process.send_signal(signal.SIGCONT)
        drive_again(client)


def test_a_heartbeat_that_is_none_is_refused(tmp_path):
    for number in ("x", "-1", "", "999", "99999999999999999999"):
        with_heartbeat = {**os.environ, "WHISKER_HEARTBEAT_FD": number}
        code, text = refused("--port", "p", "--socket", tmp_path / "s", env=with_heartbeat)
        assert (code, f"WHISKER_HEARTBEAT_FD={number}: no open descriptor" in text) == (2, True), text


@pytest.fixture
def manager(tmp_path):
    """The datagram socket of a service manager."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(tmp_path / "notify"))
        yield manager


def test_the_watchdog_is_fed_also_by_the_streams_clock(start, manager):
    start("--clock", "stream", NOTIFY_SOCKET=manager.getsockname(), WATCHDOG_USEC="200000")
    fed = 0
    while fed < 5:
        fed += manager.recv(256) == b"WATCHDOG=1"


def test_a_service_manager_that_hangs_is_no_hindrance(start, manager):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as full, pytest.raises(BlockingIOError):
        full.setblocking(False)
        while True:
            full.sendto(b"full", manager.getsockname())
    driver = start(NOTIFY_SOCKET=manager.getsockname(), WATCHDOG_USEC="100000")
    with driver.client() as client:
        client.drive(0.2, 0)
        driver.peer.await_order(drive_order(200, 200))
    assert driver.end() == 0


def test_a_base_that_leaves_its_mode_waits_for_its_commander(start):
    driver = start("--clock", "stream")
    peer = driver.peer
    with driver.client() as client:
        client.drive(0.2, 0)
        await_frame(client, driver)
        assert client.odometry().bits == 0
        peer.await_order(drive_order(200, 200))
        await_frame(client, driver, p35=1, p10=1)
        health = client.health()
        assert (health["mode"], health["mode_losses"], health["left_mm_s"]) == ("passive", "1", "0")
        assert client.odometry().bits == base.IDLE | base.CLIFF_FRONT_LEFT
        assert client.drive(0.2, 0).v_m_s == 0
        peer.tell(peer.frame(p35=1) * 100)
        client.odometry(after=peer.reported)
        client.mode("safe")
        assert peer.await_start() == 2 * STOP + STOP + FIRM_STOP  # it was asked for nothing before that
        await_frame(client, driver, p35=1)
        peer.await_order(bytes([SAFE]))
        assert client.health()["mode"] == "passive"
        await_frame(client, driver)
        assert client.health()["mode"] == "safe"
    assert "has left its mode: a cliff" in driver.log.read_text()


def test_a_firmware_that_reports_modes_one_too_high_is_understood(tmp_path):
    driver = Driver(tmp_path, "--clock", "stream")
    peer = driver.peer
    peer.await_start()
    with driver.client() as client:
        for times in range(4):  # asked to rest, again and again
            if times:
                peer.await_start()
            assert client.health()["mode"] == "unknown"
            peer.tell(peer.frame(p35=2) * 5)
            client.odometry(after=peer.reported)
            assert client.odometry().bits & base.IDLE
        assert client.health()["mode"] == "passive"
        peer.await_order(bytes([SAFE]))
        await_frame(client, driver, p35=3)
        assert client.health()["mode"] == "safe"
        assert not client.odometry().bits & base.IDLE
        await_frame(client, driver, p35=2)
        assert client.health()["mode_losses"] == "1"
    driver.close()


def test_a_mode_lasts_as_long_as_its_commander(start):
    driver = start("--clock", "stream")
    peer = driver.peer
    with driver.client() as observer:
        with driver.client() as commander:
            commander.mode("full")
            peer.await_start()
            commander.odometry(after=peer.tell(peer.frame(p35=1)))
            peer.await_order(bytes([FULL]))
            commander.odometry(after=peer.tell(peer.frame(p35=3)))
            assert commander.health()["mode"] == "full"
        peer.await_start()
        observer.odometry(after=peer.tell(peer.frame(p35=1)))
        peer.await_order(bytes([SAFE]))
        assert observer.health()["wanted_mode"] == "safe"


def test_a_line_that_goes_and_comes_back(start):
    driver = start()
    with driver.client() as client:
        client.drive(0.2, 0)
        driver.peer.await_order(drive_order(200, 200))
        driver.peer.vanish()
        driver.peer.come_back()
        assert driver.peer.await_start().endswith(STOP)
        health = client.health()
        assert (health["reconnects"], health["port"], health["left_mm_s"]) == ("1", "open", "0")
        assert (health["mode"], health["voltage_mv"], health["orders"]) == ("unknown",) * 3  # of another connection
        assert client.drive(0.1, 0).v_m_s == 0
        driver.enter()
        driver.peer.keep_telling()
        client.drive(0.1, 0)
        driver.peer.await_order(drive_order(100, 100))
    assert driver.log.read_text().count("plug it in again") == 1


def test_without_a_line_orders_say_so(start):
    driver = start("--clock", "stream")
    with driver.client() as client:
        await_frame(client, driver)
        driver.peer.vanish()
        while client.health()["port"] == "open":
            pass
        assert client.drive(0.1, 0) == base.Sent(0, 0.0, 0.0)
        assert client.health()["left_mm_s"] == "0"
        assert client.odometry().bits & base.IDLE
        assert client.odometry(after=10**9).x_m == 0  # nothing more will come: answered at once
        driver.peer.come_back()


def test_a_silent_line_is_asked_for_its_stream_again(start):
    driver = start()
    with driver.client() as client:
        driver.peer.fall_silent()
        before = client.health()["silences"]
        while client.health()["silences"] == before:
            assert driver.peer.await_start().endswith(STOP)
        await_frame(client, driver)
        assert int(client.health()["missed"]) >= 450 // 15 - 1


def test_wheels_are_not_driven_blind(start):
    driver = start()
    with driver.client() as client:
        driver.peer.fall_silent()
        while client.health()["silences"] == "0":
            assert driver.peer.await_start().endswith(STOP)
        sent = client.drive(0.2, 0)
        assert (sent.v_m_s, sent.omega_rad_s) == (0, 0)
        assert client.odometry().bits & base.IDLE
        driver.enter()
        client.odometry()
        assert not client.odometry().bits & base.IDLE


def test_a_silent_line_is_not_put_back_into_a_mode_that_it_left(start):
    driver = start()
    peer = driver.peer
    peer.fall_silent()
    peer.tell(peer.frame(p35=1, p9=1))
    assert peer.await_start().endswith(STOP)
    with driver.client() as client:
        peer.tell(peer.frame(p35=1))
        while client.health()["mode"] != "passive":
            pass
        assert SAFE not in peer.heard


def test_a_low_battery_is_reported_once(start):
    driver = start("--clock", "stream")
    with driver.client() as client:
        await_frame(client, driver)
        assert client.health()["low_battery"] == "0"
        await_frame(client, driver, p25=200)
        await_frame(client, driver, p25=200)
        assert client.health()["low_battery"] == "1"
    assert driver.log.read_text().count("the battery is low: 14500 mV, 200 of 2700 mAh; charge it") == 1


# --------------------------------------------------------------------------------------------------- clients and people


def test_one_commands_and_everybody_may_stop(start):
    driver = start("--clock", "stream")
    with driver.client() as observer:
        with driver.client() as commander:
            commander.drive(0.2, 0)
            with pytest.raises(BaseError, match="another client commands"):
                observer.drive(0.1, 0)
            with pytest.raises(BaseError, match="another client commands"):
                observer.mode("full")
            observer.stop()
            driver.peer.await_order(drive_order(200, 200) + STOP)
        driver.peer.await_order(STOP)  # the commander has gone
        assert observer.health()["commander"] == "0"
        observer.drive(0.1, 0)
        driver.peer.await_order(drive_order(100, 100))


def connections(driver, count):
    """So many clients that say nothing."""
    made = []
    for _ in range(count):
        made.append(socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET))
        made[-1].connect(str(driver.socket))
    return made


def await_log(driver, text):
    while text not in driver.log.read_text():
        assert driver.process.poll() is None, driver.log.read_text()


def test_too_few_descriptors_to_wait_for_end_the_driver_with_a_line(start):
    driver = start()
    with driver.client() as client:
        client.drive(0.2, 0)
        driver.peer.await_order(drive_order(200, 200))
        resource.prlimit(int(client.health()["driver_pid"]), resource.RLIMIT_NOFILE, (8, 8))
        driver.peer.await_order(ENDED)
    assert driver.process.wait() == 1
    assert "descriptors: Invalid argument; wheels stopped, ending; allow more (ulimit -n)" in driver.log.read_text()


def sleeps(pid: int) -> int:
    """How often a process has gone to sleep by itself: one that spins does not."""
    status = dict(line.split(":\t", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines())
    return int(status["voluntary_ctxt_switches"])


def test_a_client_for_whom_there_is_no_descriptor_waits_and_costs_nothing(start):
    driver = start("--clock", "stream")
    with driver.client() as client:
        pid = int(client.health()["driver_pid"])
        resource.prlimit(pid, resource.RLIMIT_NOFILE, (68, 68))  # as many as it waits for
        others = connections(driver, 62)
        await_log(driver, "cannot take a client: Too many open files; allow more (ulimit -n)")
        slept = sleeps(pid)
        while sleeps(pid) < slept + 3:
            assert driver.process.poll() is None
        waiting = driver.client()
        for other in others:
            other.close()
        assert waiting.health()["restarts"] == "0"
        waiting.close()
    assert driver.log.read_text().count("cannot take a client") <= 5


def test_silent_clients_give_their_places_to_new_ones(start):
    driver = start()
    with driver.client() as commander:
        commander.drive(0, 0)
        silent = connections(driver, 200)
        with driver.client() as client:
            assert client.health()["commander"] == "1"
        commander.drive(0, 0)
        for one in silent:
            one.close()


def test_honest_clients_are_served_beside_hostile_ones(start):
    driver = start()
    rounds = iter(range(100))
    with attacked(str(driver.socket), 200, seed=1):
        orders, visits = serve_honest(str(driver.socket), lambda: next(rounds, None) is not None)
    assert len(orders) == len(visits) == 100  # and none was turned away


def test_clients_that_come_and_go_fill_no_log(start):
    driver = start("--clock", "stream")
    for _ in range(100):
        with driver.client() as client:
            client.drive(0, 0)
    with driver.client() as client:
        client.health()
    assert driver.log.read_text().count("the commander has gone") == 5


def test_messages_that_are_none_are_refused(start):
    driver = start("--clock", "stream")
    with driver.client() as client:
        for message in ("drive 1", "drive nan 0", "drive 1 2 3", "hello", "mode sleepy", "odometry after x", "drive"):
            with pytest.raises(BaseError, match="say: "):
                client._ask(message, "sent", None, print)
        with pytest.raises(BaseError, match="message too long; 255 letters are the most"):
            client._ask("drive 0.2 0." + 300 * "0" + "1e300", "sent", None, print)  # without its end another number
        with pytest.raises(BaseError, match="zero byte"):
            client._ask("stop\0 drive", "sent", None, print)
        assert client.drive(0.2, 0.0).v_m_s == 0.2


def refused(*words, **more) -> tuple[int, str]:
    done = subprocess.run([program("whisker-base"), *map(str, words)], capture_output=True, text=True, **more)
    assert done.stderr.count("\n") == 1, done.stderr
    return done.returncode, done.stderr


def test_wrong_use_is_reported_in_one_line(tmp_path):
    socket = tmp_path / "s"
    for words, expected in (
        (["--socket", socket], "--port PATH is missing"),
        (["--port", "p", "--socket", "s", "--model", "3"], "--model 3: give 1 or 2"),
        (["--port", "p", "--socket", "s", "--baud", "57601"], "--baud 57601: give 57600"),
        (["--port", "p", "--socket", "s", "--odometry", "encoders"], "a Create 1 has no encoders"),
        (["--port", "p", "--socket", "s", "--wheel-base", "-1"], "--wheel-base -1: give a positive number"),
        (["--port", "p", "--socket", "s", "more"], "a word too many"),
    ):
        code, text = refused(*words)
        assert (code, expected in text) == (2, True), text
    for port, expected in ((tmp_path / "none", "plug the adapter in"), ("/dev/null", "it is no serial port")):
        code, text = refused("--port", port, "--socket", socket)
        assert (code, expected in text) == (1, True), text
    code, text = refused("--port", "/dev/null", "--socket", "/nowhere/s")
    assert (code, "in a folder that can be written" in text) == (1, True), text


def test_two_drivers_do_not_share_a_base(start, tmp_path):
    driver = start()
    code, text = refused("--port", driver.peer.link, "--socket", tmp_path / "other")
    assert (code, "another process drives it" in text) == (1, True), text
    code, text = refused("--port", driver.peer.link, "--socket", driver.socket)
    assert (code, "stop the whisker-base that has it" in text) == (1, True), text


def test_a_port_that_a_program_has_for_itself_is_refused(tmp_path):
    """As a terminal program or ModemManager does (TIOCEXCL), which has no lock that a driver would see."""
    base_end, other = pty.openpty()
    fcntl.ioctl(other, termios.TIOCEXCL)
    code, text = refused("--port", os.ttyname(other), "--socket", tmp_path / "s", preexec_fn=be_no_superuser)
    assert (code, "has it for itself, as a terminal program or ModemManager; end that" in text) == (1, True), text
    fcntl.ioctl(other, termios.TIOCNXCL)
    os.close(other)
    os.close(base_end)


def be_no_superuser() -> None:
    """What is started by this process opens no port that another has for itself."""
    drop_from_bounding_set, sys_admin = 24, 21  # linux/prctl.h, linux/capability.h
    ctypes.CDLL(None).prctl(drop_from_bounding_set, sys_admin, 0, 0, 0)


def test_a_socket_is_made_where_nothing_else_is(start, tmp_path):
    """A file, a folder, somebody's socket and somebody's lock stay as they are."""
    data, folder, taken = tmp_path / "data", tmp_path / "folder", tmp_path / "taken"
    data.write_text("a year of measurements")
    folder.mkdir()
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as other:
        other.bind(str(taken))
        other.listen()
        for path in (data, folder, taken):
            code, text = refused("--port", "/dev/null", "--socket", path)
            assert (code, "choose a path where nothing is" in text) == (1, True), text
            assert not Path(f"{path}.lock").exists()
        assert data.read_text() == "a year of measurements" and taken.is_socket()
    (tmp_path / "s.lock").write_text("of another program")
    code, text = refused("--port", "/dev/null", "--socket", tmp_path / "s")
    assert (code, "s.lock: File exists" in text) == (1, True), text
    assert (tmp_path / "s.lock").read_text() == "of another program"


def test_at_the_end_only_its_own_socket_is_removed(start):
    driver = start()
    driver.socket.unlink()
    driver.socket.write_text("of somebody else")
    assert driver.end() == 0
    assert driver.socket.read_text() == "of somebody else"
    assert not Path(f"{driver.socket}.lock").exists()


def test_a_whisker_base_that_hangs_keeps_its_socket(start, tmp_path):
    """Also with as many that wait to be taken as there is room for."""
    driver = start("--clock", "stream")
    with driver.client() as client:
        pid = int(client.health()["driver_pid"])
        driver.process.send_signal(signal.SIGSTOP)
        os.kill(pid, signal.SIGSTOP)
        waiting = []
        with pytest.raises(BlockingIOError):
            while True:
                waiting.append(socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET | socket.SOCK_NONBLOCK))
                waiting[-1].connect(str(driver.socket))
        code, text = refused("--port", "/dev/null", "--socket", driver.socket)
        assert (code, "stop the whisker-base that has it" in text) == (1, True), text
        for one in waiting:
            one.close()
        os.kill(pid, signal.SIGCONT)
        driver.process.send_signal(signal.SIGCONT)
        assert client.health()["restarts"] == "0"


def test_without_a_stop_it_says_that_the_wheels_may_turn(start):
    driver = start("--clock", "stream")
    with driver.client() as client:
        client.drive(0.2, 0)
        driver.peer.await_order(drive_order(200, 200))
        driver.peer.vanish()
        while client.health()["port"] == "open":
            pass
        assert driver.end() == 1
    assert "no stop could be written: the wheels may turn" in driver.log.read_text()
    driver.peer.come_back()


def test_why_a_base_is_silent(start, tmp_path):
    """One sentence a cause, by what comes instead of frames."""
    garbage = bytes(range(160, 250)) * 20
    for number, (options, data, cause) in enumerate(
        (
            ((), b"", "nothing comes: it is off or asleep"),
            ((), b"\r\nbattery 14200 mV\r\n" * 9, "it sends text"),
            ((), b"\xfe" * 99, "its boot loader starts again and again"),
            ((), garbage, "what comes is no frame; check --baud"),
            (("--model", "2"), bytes([19, 35]) * 9, "it sends what the other model would"),
            ((), bytes([19, 35]) * 9, "it does not hear; check the wire to it"),
        )
    ):
        (tmp_path / str(number)).mkdir()
        with closing(Driver(tmp_path / str(number), *options)) as driver:
            driver.peer.await_start()
            with driver.client() as client:
                while cause not in (said := driver.log.read_text()):
                    assert int(client.health()["silences"]) < SILENCES, said
                    driver.peer.tell(data)  # as such a base does, again and again
                    time.sleep(0.1)


def test_help_has_examples():
    done = subprocess.run([program("whisker-base"), "--help"], capture_output=True, text=True)
    assert done.returncode == 0
    assert done.stdout.count("Example: whisker-base --port") == 2


def test_a_client_without_a_driver_says_what_to_start(tmp_path):
    with pytest.raises(BaseLost, match="start whisker-base"):
        base.Base(str(tmp_path / "none"))
