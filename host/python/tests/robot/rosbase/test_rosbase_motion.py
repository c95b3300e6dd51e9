"""Messages of odometry made into motion: by hand, at any rate, over gaps, resets and nonsense."""

import math

import numpy as np
import pytest

from crunchbot.base_table import BaseTable
from crunchbot.robot.rosbase.motion import Judge, Said, Way

BASE = BaseTable(0.25, 0.5)
SIGMA = 0.05
ZERO = np.zeros((3, 3))
STILL = (0.0, 0.0)


def on_arc(seconds: float, v: float, omega: float, begin=(1.0, -2.0, 0.4)) -> tuple[float, float, float]:
    """Where a base is that drives on one arc, by closed form."""
    x, y, heading = begin
    turned = omega * seconds
    radius = v / omega if omega else 0.0
    if not omega:
        return x + v * seconds * math.cos(heading), y + v * seconds * math.sin(heading), heading
    return (
        x + radius * (math.sin(heading + turned) - math.sin(heading)),
        y - radius * (math.cos(heading + turned) - math.cos(heading)),
        math.remainder(heading + turned, math.tau),  # as an orientation gives it
    )


def said(
    stamp_s: float, pose, twist=STILL, publisher: int = 1, covariance=ZERO, arrived_s: float | None = None
) -> Said:
    return Said(
        stamp_s, stamp_s if arrived_s is None else arrived_s, publisher, tuple(pose), twist, np.asarray(covariance)
    )


def heard(messages, asked=STILL, base=BASE) -> tuple[Judge, Way, list[dict]]:
    judge, way, steps = Judge(base, SIGMA), Way(), []
    for message in messages:
        for step in judge.take(message, asked):
            way.add(step)
            steps.append(step)
    return judge, way, steps


@pytest.mark.parametrize("rate_hz", [8.0, 20.0, 62.0, 1.0])  # 1: gaps of a second
@pytest.mark.parametrize(("v", "omega"), [(0.3, 0.0), (0.2, 0.7), (-0.2, 0.7), (0.0, -1.5), (0.05, 2.9)])
def test_an_arc_is_the_same_at_any_rate(rate_hz, v, omega):
    times = np.arange(0.0, 4.01, 1.0 / rate_hz).tolist()
    judge, way, _ = heard([said(t, on_arc(t, v, omega), (v, omega)) for t in times], (v, omega))
    x, y, theta = on_arc(times[-1], v, omega, (0.0, 0.0, 0.0))
    assert way.take()[:3] == pytest.approx((x, y, omega * times[-1]), abs=1e-9)
    assert (judge.carried, judge.covariance) == (0, "assumed")


def test_a_way_of_two_arcs_that_was_missed_is_kept_whole():
    """Straight on, then a quarter to the left on the spot: no arc, but the pose says where it came to."""
    _, way, _ = heard([said(0.0, (0.0, 0.0, 0.0)), said(1.2, (0.3, 0.0, math.pi / 2))], (0.3, 1.5))
    assert way.take()[:3] == pytest.approx((0.3, 0.0, math.pi / 2), abs=1e-12)


def test_scale_errors_add_up_along_the_way():
    _, way, _ = heard([said(t, (0.3 * t, 0.0, 0.0)) for t in np.arange(0.0, 2.01, 0.05)], (0.3, 0.0))
    _, _, _, xx, *_ = way.take()
    assert math.sqrt(xx) == pytest.approx(SIGMA * 0.6)
    assert way.take()[:4] == (0.0, 0.0, 0.0, 0.0)


def test_a_reset_is_bridged_by_the_twist():
    v, omega, period = 0.3, 0.4, 0.125
    begin, messages = (5.0, 1.0, 2.0), []
    for n in range(33):
        anew = (0.0, 0.0, 0.0) if n >= 16 else None
        pose = on_arc((n - 16) * period, v, omega, anew) if anew else on_arc(n * period, v, omega, begin)
        messages.append(said(n * period, pose, (v, omega)))
    judge, way, steps = heard(messages, (v, omega))
    assert way.take()[:3] == pytest.approx(on_arc(32 * period, v, omega, (0.0, 0.0, 0.0)), abs=1e-9)
    assert (judge.resets, judge.carried) == (1, 0)
    assert sum(step.get("loose_distance", 0.0) for step in steps) == 0.0  # the twist has not changed


@pytest.mark.parametrize("rate_hz", [8.0, 20.0, 62.0])
@pytest.mark.parametrize("seed", range(20))
def test_a_reset_anywhere_costs_no_more_than_the_wheels_do_meanwhile(rate_hz, seed):
    """However near to its beginning the base was: it drives about for a while, and is set anew."""
    rng, period = np.random.default_rng(seed), 1.0 / rate_hz
    pose, true, messages = (0.0, 0.0, 0.0), Way(), []
    for n in range(round(8.0 * rate_hz)):
        if n % round(rate_hz) == 0:
            v, omega = rng.choice([(0.15, 0.0), (0.0, 0.7), (0.0, -0.7), (0.2, 0.4), (-0.03, 0.0)]).tolist()
        pose = on_arc(period, v, omega, (0.0, 0.0, 0.0) if n == round(5.3 * rate_hz) else pose)
        messages.append(said(n * period, pose, (v, omega)))
        if n:
            true.add({"distance": v * period, "angle": omega * period})
    judge, way, _ = heard(messages, (0.2, 0.4))
    off = np.subtract(way.take()[:3], true.take()[:3])
    assert abs(off[2]) <= 0.55 * (0.03 + period / 4.0) / 0.125
    assert judge.carried == 0 and (judge.resets == 0 or np.abs(off).max() < 1e-9)


def test_a_twist_that_never_agreed_with_the_pose_is_left_out():
    """Some bases give it in the frame of the odometry, or in other units."""
    messages = [said(0.05 * n, (0.0, 0.02 * n, math.pi / 2), (0.0, 3.0)) for n in range(40)]
    judge, way, _ = heard(messages, (0.4, 0.0))
    assert judge.carried == 0 and way.take()[0] == pytest.approx(0.78)


@pytest.mark.parametrize("change", [{"publisher": 2}, {"stamp_s": -5.0}])
def test_a_publisher_that_begins_anew_is_no_motion_however_near(change):
    after = {"stamp_s": 0.1, "pose": (0.0, 0.0, 0.0), "arrived_s": 0.1} | change
    judge, way, _ = heard([said(0.0, (0.02, 0.0, 0.0)), said(**after)])
    assert way.take()[:3] == (0.0, 0.0, 0.0) and judge.carried == 1


def test_without_a_twist_that_can_be_what_was_ordered_counts_in_doubt():
    for twist in (STILL, (math.nan, 0.0), (40.0, 0.0)):
        judge, way, steps = heard([said(0.0, (9.0, 0.0, 0.0), twist), said(0.1, (0.0, 0.0, 0.0), twist)], (0.2, 0.0))
        assert way.take()[:3] == pytest.approx((0.02, 0.0, 0.0)), twist
        assert steps[0]["loose_distance"] == pytest.approx(1.1 * 0.5 * 0.1) and judge.carried == 1


def test_a_leap_over_a_gap_may_be_a_person():
    """The twist knows nothing of a gap: the base may be anywhere."""
    messages = [said(0.1 * n, (0.03 * n, 0.0, 0.0), (0.3, 0.0)) for n in range(20)]
    judge, *_ = heard([*messages, said(3.0, (9.0, 0.0, 0.0), (0.3, 0.0))], (0.3, 0.0))
    assert (judge.resets, judge.carried) == (0, 1)


def test_a_push_is_believed_and_in_doubt_by_its_size():
    judge, way, _ = heard([said(0.0, (0.0, 0.0, 0.0)), said(0.1, (0.15, 0.0, 0.0))])
    x, _, _, xx, *_ = way.take()
    assert (x, judge.carried) == (pytest.approx(0.15), 0)
    assert math.sqrt(xx) == pytest.approx(0.15, rel=0.01)


def test_a_base_that_can_do_more_is_believed_more():
    fast = BaseTable(0.5, 3.0)
    messages = [said(0.0, (0.0, 0.0, 0.0)), said(0.1, (0.35, 0.0, 0.0))]
    assert heard(messages, (3.0, 0.0))[0].carried == 1
    judge, way, _ = heard(messages, (3.0, 0.0), fast)
    assert judge.carried == 0 and way.take()[3] < 0.02**2


def test_a_stamp_far_ahead_gives_no_time_for_a_leap():
    """As when a clock is set."""
    judge, *_ = heard([said(0.0, (0.0, 0.0, 0.0)), said(3600.0, (30.0, 0.0, 0.0), arrived_s=0.1)], (0.4, 0.0))
    assert judge.carried == 1


def test_messages_that_come_in_one_burst_are_judged_by_their_stamps():
    messages = [said(0.05 * n, (0.02 * n, 0.0, 0.0), arrived_s=3.0) for n in range(5)]
    judge, way, _ = heard(messages, (0.4, 0.0))
    assert judge.carried == 0 and way.take()[0] == pytest.approx(0.08)


def test_a_covariance_that_grows_with_the_motion_counts():
    grown = [np.diag([1e-4 * n, 2e-4 * n, 4e-4 * n]) for n in range(2)]
    judge, _, steps = heard([said(0.1 * n, (0.03 * n, 0.0, 0.0), covariance=grown[n]) for n in range(2)], (0.3, 0.0))
    assert judge.covariance == "odometry"
    assert steps[1]["loose_distance"] == pytest.approx(0.01) and steps[1]["loose_angle"] == pytest.approx(0.02)
    assert steps[1]["scale_distance"] == pytest.approx(SIGMA * 0.03)


@pytest.mark.parametrize("constant", [ZERO, np.diag([1e-3, 1e-3, 1e-2]), np.full((3, 3), math.nan), -np.eye(3)])
def test_a_covariance_that_does_not_grow_says_nothing(constant):
    messages = [said(0.1 * n, (0.03 * n, 0.0, 0.0), covariance=constant) for n in range(3)]
    judge, _, steps = heard(messages, (0.3, 0.0))
    assert judge.covariance == "assumed" and "loose_distance" not in steps[1]
