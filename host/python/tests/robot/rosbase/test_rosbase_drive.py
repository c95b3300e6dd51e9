"""Orders to a base that speaks ROS 2, and what stops them: each row of docs/another_base.md that needs no process."""

import pytest

from crunchbot.base_table import BaseTable
from crunchbot.robot.rosbase.drive import Drive

LONG = 1e9


class Peer:
    """What the wire gets, by a clock that the test turns."""

    def __init__(self, **base):
        self.now, self.orders, self.lines = 100.0, [], []
        self.drive = Drive(BaseTable(0.25, 0.5, **base), self._take, self.lines.append)
        self.drive.lease_s, self.drive.is_heard = LONG, True
        self.hear()

    def _take(self, v: float, omega: float) -> bool:
        self.orders.append((round(self.now, 6), v, omega))
        return True

    def hear(self) -> None:
        self.drive.heard_s = self.now

    def order(self, v: float = 0.2, omega: float = 0.0) -> None:
        self.drive.drive(v, omega, self.now)

    def run(self, seconds: float, hears: bool = True, commands: bool = False) -> list:
        """Lets time pass; the orders of meanwhile."""
        self.orders.clear()
        end = self.now + seconds
        while self.now < end:
            self.now += 0.01
            if hears:
                self.hear()
            if commands:
                self.order()
            self.drive.step(self.now)
        return list(self.orders)

    def assert_stops(self, orders: list) -> float:
        """Zero for a second, at most 0.1 s apart, and then nothing; when it began."""
        zeros = [at for at, v, omega in orders if (v, omega) == (0.0, 0.0)]
        assert orders[-len(zeros) :] == [(at, 0.0, 0.0) for at in zeros], "it drove again"
        assert 0.9 <= zeros[-1] - zeros[0] <= 1.0 and max(b - a for a, b in zip(zeros, zeros[1:], strict=False)) < 0.1
        assert self.run(3.0) == []
        return zeros[0]


@pytest.fixture
def peer() -> Peer:
    return Peer()


def test_nothing_is_sent_to_a_base_that_nobody_drives(peer):
    peer.drive.stop(peer.now)
    assert peer.run(2.0) == []


def test_an_order_is_repeated_until_its_commander_is_silent(peer):
    peer.order(0.2, 0.1)
    began, orders = peer.now, peer.run(2.0)
    driven = [at for at, v, omega in orders if (v, omega) == (0.2, 0.1)]
    assert max(b - a for a, b in zip(driven, driven[1:], strict=False)) <= 0.06
    assert peer.assert_stops(orders) == pytest.approx(began + 0.3, abs=0.011)
    assert peer.drive.stops == 1 and "the commander is silent; wheels stopped" in peer.lines


def test_the_newest_order_goes_at_the_pace_of_the_line(peer):
    for n in range(1000):
        peer.order(0.1 + 1e-4 * n, 0.0)
    assert len(peer.orders) == 1
    peer.run(0.03)
    assert peer.orders[0][1] == pytest.approx(0.1999)


@pytest.mark.parametrize("reason", ["odometry", "heartbeat", "subscriber"])
def test_wheels_are_held_stopped(peer, reason):
    def hold() -> None:
        if reason == "odometry":
            peer.drive.heard_s = peer.now - 0.45
        elif reason == "heartbeat":
            peer.drive.lease_s = peer.now
        else:
            peer.drive.is_heard = False

    peer.order()
    hold()
    orders = peer.run(1.5, hears=reason != "odometry")
    peer.assert_stops(orders)
    fate = "wheels stopped" if reason == "heartbeat" else "ordered to stop, but not seen to: the wheels may turn"
    assert orders[0][1:] == (0.0, 0.0) and peer.lines == [f"held: {reason}; {fate}"]
    hold()
    assert peer.drive.held(peer.now) == reason
    peer.order()
    assert peer.run(0.5, hears=reason != "odometry") == [] and peer.drive.ordered == (0.0, 0.0)


def test_without_odometry_the_wheels_stand_within_half_a_second(peer):
    peer.order()
    began, orders = peer.now, peer.run(2.0, hears=False, commands=True)
    assert 0.3 < peer.assert_stops(orders) - began <= 0.5


def test_no_wheel_turns_before_the_first_odometry():
    peer = Peer()
    peer.drive.heard_s = float("-inf")
    peer.order()
    assert peer.run(1.0, hears=False) == []


def test_a_cliff_stops_until_the_commander_says_so(peer):
    peer.order()
    peer.drive.touched(peer.now)
    peer.assert_stops(peer.orders + peer.run(1.2))
    peer.order()
    assert peer.run(0.3) == [] and peer.drive.held(peer.now) == "touch"
    peer.drive.set_mode("safe", peer.now)
    peer.order()
    assert peer.orders[-1][1] == 0.2


def test_in_full_mode_a_cliff_is_the_commanders(peer):
    peer.drive.set_mode("full", peer.now)
    peer.order()
    peer.drive.touched(peer.now)
    assert peer.drive.driving


def test_in_passive_mode_nothing_is_driven(peer):
    peer.order()
    peer.drive.set_mode("passive", peer.now)
    peer.assert_stops(peer.orders[1:] + peer.run(1.2))
    peer.order()
    assert peer.run(0.3) == []


def test_no_wheel_is_ordered_faster_than_it_turns_and_the_curve_stays(peer):
    peer.order(2.0, 4.0)
    (_, v, omega) = peer.orders[-1]
    assert v + omega * 0.125 == pytest.approx(0.5) and v / omega == pytest.approx(0.5)


def test_speeds_change_as_fast_as_the_wheels_can_and_a_stop_is_at_once():
    peer = Peer(acceleration_m_s2=0.5)
    peer.order()
    orders = peer.run(0.6, commands=True)
    speeds = [(at, v) for at, v, _ in orders]
    assert all(b - a <= 0.5 * 0.1 + 1e-9 for (_, a), (_, b) in zip(speeds, speeds[1:], strict=False))
    assert 0.25 < next(at for at, v in speeds if v >= 0.2 - 1e-9) - 100.0 < 0.5
    peer.drive.stop(peer.now)
    assert peer.orders[-1][1:] == (0.0, 0.0)


def test_the_fastest_order_since_the_last_message_is_what_was_asked_for(peer):
    peer.order(0.4, 0.0)
    peer.drive.stop(peer.now)
    assert peer.drive.fetch_asked() == (0.4, 0.0) and peer.drive.fetch_asked() == (0.0, 0.0)
