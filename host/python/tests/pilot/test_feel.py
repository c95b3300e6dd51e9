"""What a whisker felt, carried on with the robot."""

import math

import numpy as np
import pytest

from crunchbot.pilot.feel import Drives, Felt


def test_motion_is_that_of_the_orders_in_effect():
    drives = Drives()
    drives.order(101, (0.2, 0.0))
    drives.order(101, (0.2, 0.0))
    drives.order(301, (0.0, math.pi))
    assert drives.at(np.array([50, 101, 300, 301]))[:, 0].tolist() == [0.0, 0.2, 0.2, 0.0]
    assert drives.since(0, 300) == pytest.approx([0.02, 0.0, 0.0])  # 200 ticks of 0.5 ms
    assert drives.since(200, 1300) == pytest.approx([0.01, 0.0, math.pi / 2])
    assert drives.since(300, 300).tolist() == [0.0, 0.0, 0.0]


def test_motion_along_an_arc_ends_where_the_circle_does():
    drives = Drives()
    drives.order(1, (0.1, 1.0))
    assert drives.since(0, 2000) == pytest.approx([0.1 * math.sin(1.0), 0.1 * (1.0 - math.cos(1.0)), 1.0], abs=1e-8)


def test_what_was_felt_stays_where_it_is_while_the_robot_moves():
    felt = Felt(0, (0.2, 0.1), 0.001, math.pi, 0.05, 1.0)
    after = felt.after(np.array([0.05, 0.0, math.pi / 2]), 200)
    assert after.point == pytest.approx((0.1, -0.15)) and after.tick == 200
    assert after.normal == pytest.approx(math.pi / 2) and after.point_sd == felt.point_sd
