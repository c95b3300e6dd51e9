"""What a pilot publishes: odometry and its covariance, contacts, joint angles."""

from types import SimpleNamespace

import numpy as np
import pytest

from crunchbot.observation import Row
from crunchbot.pilot.behaviour import BLOCK_TICKS
from crunchbot.pilot.states import State
from crunchbot.pilot.wheels import NO_BUMPS
from crunchbot.robot.network.ros import PLANAR
from crunchbot.robot.publisher import TICK_NS, Publisher
from crunchbot.robot.wheels import Report

ROW_BLOCKS = 5
ROW = Row.of({"t_s": 0.1, "odo_x_m": 0.0, "odo_y_m": 0.0, "odo_theta_rad": 0.0})
COVARIANCE = np.array([[4e-6, 1e-7, 2e-7], [1e-7, 1e-6, 3e-7], [2e-7, 3e-7, 9e-6]])


class Heard:
    """A link that keeps what is sent, by topic."""

    def __init__(self):
        self.topics = {}

    def publish(self, topic: str):
        return SimpleNamespace(send=self.topics.setdefault(topic, []).append)


def pilot_with(**parts) -> SimpleNamespace:
    """A pilot that drives forward, without whiskers but for these parts."""
    behaviour = SimpleNamespace(state=State.FORWARD, since=0, reason="", whisking=False)
    return SimpleNamespace(
        **{"contacts": {}, "whisks": [], "names": {}, "object_lanes": [], "behaviour": behaviour} | parts
    )


@pytest.fixture
def reported():
    """A call: the odometry messages after these motions, 0.1 s each, all of the same covariance."""
    pilot = pilot_with()

    def after(*motions, rows_before=0):
        link = Heard()
        publisher, samples = Publisher(link, pilot), np.zeros(0, [("alpha", "u2"), ("beta", "u2"), ("status", "u1")])
        for n, motion in enumerate(motions, start=1 + rows_before):
            publisher.block(n * ROW_BLOCKS * BLOCK_TICKS - 1)
            publisher.row(ROW, Report(motion, COVARIANCE, NO_BUMPS), samples)
        return link.topics["odometry"]

    return after


def test_the_twist_is_the_motion_by_its_time_with_the_bases_covariance(reported):
    last = reported((0.01, 0.0, 0.0), (0.02, 0.001, -0.03))[-1]
    assert last.header.stamp.ns == 200_000_000
    linear, angular = last.twist.twist.linear, last.twist.twist.angular
    assert (linear.x, linear.y, angular.z) == pytest.approx((0.2, 0.01, -0.3))
    assert last.twist.covariance.reshape(6, 6)[PLANAR] == pytest.approx(COVARIANCE * 100.0)


def test_a_pilot_that_begins_in_mid_run_moves_no_slower(reported):
    assert reported((0.01, 0.0, 0.0), rows_before=500)[0].twist.twist.linear.x == pytest.approx(0.1)


def test_the_pose_is_the_sum_of_the_motions_and_pretends_no_covariance(reported):
    last = reported((0.0, 0.0, np.pi / 2), (0.02, 0.0, 0.0))[-1]
    assert last.pose.pose.xytheta == pytest.approx((0.0, 0.02, np.pi / 2))
    assert not last.pose.covariance.any()


def test_a_contact_is_reported_once_as_it_begins_and_once_as_it_ends():
    contact = SimpleNamespace(onset=-1, release=-1, touching=False)
    pilot = pilot_with(contacts={2: contact}, names={2: "left"}, object_lanes=[2])
    link = Heard()
    publisher = Publisher(link, pilot)
    changes = {2: {"onset": 90, "touching": True}, 4: {"release": 170, "touching": False}}
    for n in range(6):
        vars(contact).update(changes.get(n, {}))
        publisher.block((n + 1) * BLOCK_TICKS - 1)
    reported = [(c.whisker, c.touching, c.onset.ns, c.release.ns, c.header.stamp.ns) for c in link.topics["contact"]]
    ends = [(n + 1) * BLOCK_TICKS * TICK_NS for n in changes]
    assert reported == [("left", True, 90 * TICK_NS, 0, ends[0]), ("left", False, 90 * TICK_NS, 170 * TICK_NS, ends[1])]


def test_an_angle_that_was_not_read_is_nan():
    pilot = pilot_with(names={0: "left", 2: "right"})
    link, kind = Heard(), [("alpha", "u2"), ("beta", "u2"), ("status", "u1")]
    samples = np.array([(32768 + 16384, 32768, 0), (1, 2, 1)], kind)
    publisher = Publisher(link, pilot)
    publisher.block(BLOCK_TICKS - 1)
    publisher.row(ROW, Report((0.0, 0.0, 0.0), COVARIANCE, NO_BUMPS), samples)
    (joints,) = link.topics["joints"]
    assert joints.name == ["left/alpha", "left/beta", "right/alpha", "right/beta"]
    assert joints.position == pytest.approx([np.pi / 4, 0.0, np.nan, np.nan], nan_ok=True)
