"""What stops the wheels of a base that speaks ROS 2: each row of the table of docs/another_base.md, by real processes.

The orders are taken down by the base at the time they come. No time is judged but that nothing is sent in the end.
"""

import contextlib
import os
import signal
import subprocess
import sys

import pytest
from patience import PATIENCE_S
from rosbasekit import (
    STILL,
    Driving,
    Peer,
    Running,
    TwistStamped,
    scene_folder,
    wait_for,
)

from crunchbot.base_table import Topics
from crunchbot.pilot.base import BUMP_LEFT, CLIFF_LEFT, IDLE, Base, BaseError, BaseLost
from crunchbot.robot.rosbase.signing import FILE, note, why_untrusted

DRIVE = (0.2, 0.0)
TOUCH = '[base.ros2.touch]\nbump_left = "/bumper"\ncliff_left = "/cliff"\n'


@pytest.fixture
def made(tmp_path):
    """Makes a base and its driver; both end with the test."""
    kept = []

    def make(more: str = "", heart: bool = False, **peer):
        base = Peer(**peer)
        kept.append(base)
        running = Running(scene_folder(tmp_path / "scene", more), base, tmp_path / "base.sock", heart)
        kept.append(running)
        return base, running

    yield make
    for one in reversed(kept):
        one.close()


@contextlib.contextmanager
def driven(base: Peer, running: Running):
    """Somebody drives, whatever happens to the driver; the number of the driver's process."""
    running.ready().close()
    driver = running.driver
    driving = Driving(running)
    try:
        base.await_order(DRIVE, len(base.orders))
        yield driver
    finally:
        driving.close()


def stops(base: Peer, since: int) -> None:
    """Zero comes behind the first `since` orders, again and again, and then nothing. Where processes are kept waiting for
    the processor they may stop the wheels before that, too, and drive on."""
    base.await_order(STILL, since)
    base.await_silence(1.5)
    assert [tuple(speeds) for _, *speeds in base.orders[since:]][-2:] == [STILL, STILL]


@pytest.mark.parametrize("kind", ["Twist", "TwistStamped"])
def test_orders_are_of_the_type_that_the_base_takes(made, kind):
    base, running = made(**({"kind": TwistStamped} if kind == "TwistStamped" else {}))
    with running.ready() as client:
        assert client.health()["command_type"] == kind
        sent = client.drive(*DRIVE)
        assert (sent.byte_count, sent.v_m_s, sent.omega_rad_s) == (1, *DRIVE)
        base.await_order(DRIVE)
        client.stop()
        stops(base, 1)
        assert 0.0 < client.odometry().x_m == pytest.approx(base.x, abs=0.05)


def test_a_commander_that_is_silent_and_one_that_goes(made):
    base, running = made()
    with running.ready() as client:
        client.drive(*DRIVE)
        base.await_order(DRIVE)
        stops(base, 1)
        since = len(base.orders)
        client.drive(*DRIVE)
        base.await_order(DRIVE, since)
    stops(base, since)


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP, signal.SIGTERM])
def test_the_driver_ends_or_hangs_and_another_drives_on(made, how):
    base, running = made()
    with driven(base, running) as driver:  # up to here, so that no other driver has anything to stop
        os.kill(driver, how)
    since = len(base.orders)
    base.await_order(STILL, since)
    wait_for(lambda: is_another(running, driver), "no other driver")
    with driven(base, running):
        pass
    stops(base, len(base.orders))


def is_another(running: Running, driver: int) -> bool:
    try:
        return running.driver != driver
    except BaseError:
        return False


def test_the_guard_dies(made):
    base, running = made()
    with driven(base, running):
        running.process.kill()
        running.process.wait()
        stops(base, len(base.orders) - 1)
    with pytest.raises(BaseLost):
        Base(str(running.socket))


def test_the_guard_hangs_and_goes_on(made):
    base, running = made()
    with driven(base, running):
        os.kill(running.process.pid, signal.SIGSTOP)
        stops(base, len(base.orders) - 1)
        os.kill(running.process.pid, signal.SIGCONT)
        base.await_order(DRIVE, len(base.orders))


@pytest.mark.parametrize("dies", [True, False])
def test_the_supervisor_dies_or_hangs(made, dies):
    base, running = made(heart=True)
    with driven(base, running):
        since = len(base.orders)
        running.leave() if dies else running.fall_silent()
        stops(base, since)
    if dies:
        assert running.process.wait(PATIENCE_S) == 0 and not running.socket.exists()


def test_both_killed_leave_it_to_the_base(made):
    base, running = made(timeout_s=0.5)
    with driven(base, running) as driver:
        os.kill(running.process.pid, signal.SIGSTOP)  # so that it cannot take the driver's part
        os.kill(driver, signal.SIGKILL)
        os.kill(running.process.pid, signal.SIGKILL)
        base.await_silence(1.0)
    x = base.x
    base.await_silence(1.5)
    assert base.x == x  # its own time-out


def test_sigterm_ends_it_with_standing_wheels(made):
    base, running = made()
    with running.ready() as client:
        client.drive(*DRIVE)
        base.await_order(DRIVE)
        running.process.terminate()
        assert running.process.wait(PATIENCE_S) == 0
        stops(base, 1)
    assert not running.socket.exists() and not running.socket.with_name("base.sock.lock").exists()


def test_no_odometry_stops_and_some_lets_it_drive_again(made):
    base, running = made()
    with driven(base, running):
        since, base.speaks = len(base.orders), False
        stops(base, since)
        base.speaks = True
        base.await_order(DRIVE, len(base.orders))


def test_bumpers_are_told_and_a_cliff_stops(made):
    base, running = made(TOUCH)
    with running.ready() as client:
        base.touch("rt/bumper", True)
        wait_for(lambda: client.odometry().bits == BUMP_LEFT, "no bump")
        base.touch("rt/bumper", False)
        wait_for(lambda: client.odometry().bits == 0, "the bump stays")
        driving = Driving(running)
        base.await_order(DRIVE)
        base.touch("rt/cliff", True)
        stops(base, len(base.orders))
        wait_for(lambda: client.odometry().bits == CLIFF_LEFT | IDLE, "no cliff")
        assert client.health()["held"] == "touch"
        driving.close()
        wait_for(lambda: client.health()["commander"] == "0", "there is a commander")
        client.mode("safe")
        client.drive(*DRIVE)
        base.await_order(DRIVE, len(base.orders) - 1)


def test_a_base_that_nobody_saw_stop_is_not_driven(tmp_path):
    base = Peer()
    scene = scene_folder(tmp_path / "scene", signed=None)
    running = Running(scene, base, tmp_path / "base.sock")
    try:
        with running.ready() as client:
            with pytest.raises(
                BaseError, match=f"nobody has seen this base stop .*whisker base {scene} --trial; or sign"
            ):
                client.drive(*DRIVE)
            assert client.odometry().x_m == 0.0 and base.orders == []
    finally:
        words = running.close()
        base.close()
    assert "nobody has seen this base stop by itself" in words


@pytest.mark.parametrize("timeout_s", [0.3, None])
def test_the_trial_sees_whether_a_base_stops_by_itself(tmp_path, timeout_s):
    base = Peer(timeout_s=timeout_s)
    scene = scene_folder(tmp_path / "scene", signed=None)
    command = [sys.executable, "-m", "crunchbot.cli", "base", str(scene), "--trial"]
    ran = subprocess.run(command, capture_output=True, text=True, env=base.variables, timeout=120)
    base.await_silence(0.5)
    base.close()
    driven = [order for order in base.orders if order[1:] != STILL]
    assert len(driven) == 1 and base.order == STILL
    if timeout_s is None:
        assert ran.returncode == 1 and "THE WHEELS TURN ON" in ran.stderr
        assert not (scene / "base_stops.toml").exists()
    else:
        assert ran.returncode == 0 and "noted in" in ran.stdout, ran.stderr
        text = (scene / "base_stops.toml").read_text()
        assert "stands_after_s = " in text and 'command = "/cmd_vel"' in text


def test_one_driver_for_a_socket_and_what_is_left_is_taken_over(made, tmp_path):
    base, running = made()
    running.ready().close()
    again = Running(tmp_path / "scene", base, running.socket)
    assert again.process.wait(PATIENCE_S) == 1
    assert f"{running.socket}: another driver has it; stop that one first" in again.close()
    os.kill(running.process.pid, signal.SIGKILL)
    running.process.wait()
    third = Running(tmp_path / "scene", base, running.socket)
    try:
        third.ready().close()
    finally:
        third.close()


def test_one_commands_and_all_may_stop(made):
    base, running = made()
    with running.ready() as client, running.client() as other:
        client.drive(*DRIVE)
        with pytest.raises(BaseError, match="another client commands; end that one first"):
            other.drive(0.1, 0.0)
        with pytest.raises(BaseError, match="say: drive V OMEGA"):
            other.drive(float("nan"), 0.0)
        with pytest.raises(BaseError, match="after N is of a Create's serial line"):
            other.odometry(after=3)
        assert other.stop().v_m_s == 0.0
        base.await_order(STILL, 1)
        assert client.health()["commander"] == "1"


def test_a_trial_keeps_what_a_person_signed(tmp_path):
    (tmp_path / FILE).write_text('# tried on the bench\nsigned_by = "A. Person"\n')
    note(tmp_path, Topics(), 0.5)
    note(tmp_path, Topics(), 0.6)
    assert [path.read_text().startswith("# tried") for path in tmp_path.iterdir() if path.name != FILE] == [True]
    assert why_untrusted(tmp_path, Topics()) == "" and "0.60" in (tmp_path / FILE).read_text()
