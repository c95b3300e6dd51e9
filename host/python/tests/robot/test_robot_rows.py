"""Rows on their way: as the file has them, and no motion lost whatever was skipped, missed or begun anew."""

import math
from dataclasses import astuple, replace

import numpy as np
import pytest
from robotkit import to_rows

from whisker import scenes
from whisker.nav import localise
from whisker.nav.observations import cell
from whisker.pilot.pilot import compose
from whisker.robot import messages as m
from whisker.robot.inbox import Received
from whisker.robot.rows import Follower, RowPublisher, Step, between, to_message, to_row
from whisker.robot.streams import Envelope


class Sink:
    """A link whose streams keep what is sent."""

    def __init__(self):
        self.sent = []

    def publish(self, topic):
        assert topic == "observation"
        return self

    def send(self, message):
        self.sent.append(m.decode(m.Observation, m.encode(message)))

    def end(self, stamp_ns, reason):
        self.sent.append((stamp_ns, reason))


@pytest.fixture(scope="module")
def made():
    return scenes.make("robot", 4, 120)


def messages_of(rows, kinds=None) -> list[m.Observation]:
    sink = Sink()
    publisher = RowPublisher(sink)
    for n, row in enumerate(rows):
        publisher.send(row, kinds[n] if kinds else m.EXPLORING)
    return sink.sent


def received(messages, stream: int = 1) -> list[Received]:
    return [Received("observation", row, Envelope(stream, n, 0)) for n, row in enumerate(messages)]


def motions(count: int, seed: int = 3) -> list[dict]:
    rng = np.random.default_rng(seed)
    return [
        {"t_s": round(0.1 * (n + 1), 4)} | dict(zip(localise.ODOMETRY, rng.normal(0.0, 0.1, 3), strict=True))
        for n in range(count)
    ]


def summed(steps) -> np.ndarray:
    total = np.zeros(3)
    for step in steps:
        total = compose(total, step.motion)
    return total


def test_motion_between_is_the_inverse_of_composing():
    rng = np.random.default_rng(1)
    for start, motion in rng.normal(0.0, 2.0, (20, 2, 3)):
        assert between(start, compose(start, motion)) == pytest.approx(motion, abs=1e-12)


def test_a_row_survives_its_message():
    row = {"t_s": 12.3, "odo_x_m": 0.0123456789, "odo_y_m": -1e-5, "odo_theta_rad": 0.0}
    row |= {
        "l_VINYL": -3.14159265,
        "l_ROUGH": None,
        "r_mm": math.nan,
        "s_mm": None,
        "t_mm": 171.23456789,
        "u_mm": -math.inf,
    }
    message = m.decode(m.Observation, m.encode(to_message(row, m.RELEASE, 5, np.array([1.0, 0.0, math.pi / 2]))))
    again = to_row(message)
    assert {k: cell(v) for k, v in again.items()} == {k: cell(v) for k, v in row.items()}
    assert again["odo_x_m"] == 0.0123457 and again["t_s"] == 12.3
    assert message.pose == pytest.approx([1.00001, 0.0123457, math.pi / 2])
    assert (message.seq, message.kind, message.header.stamp.ns) == (5, m.RELEASE, 12_300_000_000)
    assert list(message.cells) == [m.VALUE, m.EMPTY, m.NOT_READ, m.EMPTY, m.VALUE, m.VALUE]


def test_the_publisher_counts_sums_and_ends():
    sink = Sink()
    publisher = RowPublisher(sink)
    for row in motions(5):
        publisher.send(row, m.EXPLORING)
    publisher.end("over")
    assert [row.seq for row in sink.sent[:-1]] == list(range(5)) and publisher.sent == 5
    assert sink.sent[-1] == (500_000_000, "over")
    assert publisher.pose == pytest.approx(summed(Follower().take(received(sink.sent[:-1]))))


def test_in_lock_step_every_row_is_a_step_as_it_was():
    rows = messages_of(motions(30))
    follower = Follower()
    steps = [step for n in range(0, 30, 7) for step in follower.take(received(rows[n : n + 7]))]
    assert [step.row.seq for step in steps] == list(range(30)) and all(step.rows == 1 for step in steps)
    assert all(np.array_equal(step.motion, row.motion) for step, row in zip(steps, rows, strict=True))
    assert (follower.weighed, follower.skipped, follower.missed, follower.first_seq) == (30, 0, 0, 0)


@pytest.mark.parametrize(("most", "weighed"), [(math.inf, 54), (1, 11), (3, 33)])
def test_missed_rows_are_integrated(most, weighed):
    rows = messages_of(motions(60))
    kept = [row for row in rows if row.seq not in (4, 5, 6, 20, 41, 42)]
    follower, steps = Follower(), []
    for n in range(0, len(kept), 5):
        steps += follower.take(received(kept[n : n + 5]), most)
    assert summed(steps) == pytest.approx(rows[-1].pose, abs=1e-12)
    assert sum(step.rows for step in steps) == 60 and follower.missed == 6
    assert follower.weighed + follower.skipped == len(kept) and follower.weighed == weighed


def test_the_newest_row_counts_and_a_measured_distance_too():
    kinds = [m.RELEASE if n in (3, 8) else m.EXPLORING for n in range(10)]
    rows = received(messages_of(motions(10), kinds))
    steps = Follower().take(rows, 1)
    assert [step.row.seq for step in steps] == [3, 8, 9] and [step.rows for step in steps] == [4, 5, 1]
    assert [step.row.seq for step in Follower().take(rows, 3)] == [3, 7, 8, 9]


def test_a_pilot_that_begins_anew_loses_no_motion_that_was_told():
    first, then = messages_of(motions(10)), messages_of(motions(7, seed=9))
    follower = Follower()
    steps = follower.take(received(first[:4]), 1)
    steps += follower.take([*received(first[4:]), *received(then[2:4], stream=2)], 1)
    steps += follower.take(received(then[4:], stream=2), 1)
    assert summed(steps) == pytest.approx(compose(first[-1].pose, then[-1].pose), abs=1e-12)
    assert (follower.restarts, follower.missed) == (1, 2)


def test_the_filters_time_never_goes_back():
    follower = Follower()
    rows = messages_of(motions(3))
    steps = follower.take([*received(rows), *received(rows, stream=2)])
    assert [step.t_ns // 10**8 for step in steps] == [1, 2, 3, 4, 5, 6]
    assert [step.cells()["t_s"] for step in steps] == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]


def test_joining_in_mid_run():
    rows = messages_of(motions(9))
    follower = Follower()
    step = follower.take(received(rows[5:6]))[0]
    assert follower.first_seq == 5 and np.array_equal(step.motion, rows[5].motion) and follower.missed == 0


def test_ends_are_passed_over():
    end = Received("observation", m.End(m.Header(), 3), Envelope(1, 3, 0, True))
    follower = Follower()
    assert [s.row.seq for s in follower.take([*received(messages_of(motions(3))), end], 1)] == [2]
    assert follower.take([end]) == []


def fed(name, scene, steps) -> localise.Estimate:
    """What a filter says after these steps."""
    made = localise.Filter(name, scene)
    return [made.step(row) for step in steps for row in (*step.lead(), step.cells())][-1]


def test_motion_of_rows_that_were_not_weighed_comes_in_as_many_rows():
    rows = messages_of(motions(40))
    follower = Follower()
    follower.take(received(rows[:5]))
    (step,) = follower.take(received(rows[30:31]))
    lead = step.lead()
    assert [row["t_s"] for row in lead] == pytest.approx([0.1 * n for n in range(6, 31)], abs=1e-9)
    assert all(math.isnan(row[name]) for row in lead for name in rows[0].names)
    total = np.zeros(3)
    for row in (*lead, step.cells()):
        total = compose(total, [row[key] for key in localise.ODOMETRY])
    assert total == pytest.approx(between(rows[4].pose, rows[30].pose), abs=1e-9)


def test_a_gap_in_time_within_a_stream_is_no_gap_in_motion():
    """The bridge was away for 5 s: no row is missing, and what the robot moved is in the next one."""
    rows = messages_of(motions(4))
    late = [m.Observation(m.Header.at(r.header.stamp.ns + 5 * 10**9, ""), *astuple(r)[1:]) for r in rows[2:]]
    steps = Follower().take(received([*rows[:2], *late]))
    assert [len(step.lead()) for step in steps] == [0, 0, 50, 0] and [step.rows for step in steps] == [1] * 4


def test_what_another_pilot_did_not_tell_stays_a_gap():
    rows = messages_of(motions(9))
    follower = Follower()
    follower.take(received(rows[:3]))
    (step,) = follower.take(received(rows[8:], stream=2))
    assert step.within_ns == 0 and step.lead()[0]["t_s"] > step.t_ns / 1e9 - 0.01


def test_the_way_of_a_minute_and_more_leaves_the_rest_a_gap():
    row = messages_of(motions(1))[0]
    lead = Step(row, np.array([1.0, 0.0, 0.0]), 200 * 10**9, 1, received([row])[0].envelope, 100 * 10**9).lead()
    assert len(lead) == 599 and lead[0]["t_s"] == pytest.approx(140.1) and lead[-1]["t_s"] == pytest.approx(199.9)


@pytest.mark.parametrize("name", ["adaptive", "grid", "particle"])
def test_rows_that_are_missing_make_a_filter_no_surer_nor_much_less_sure(made, name):
    """Summed motion over 5 s is as good as 50 rows of odometry: no more is unknown after it than without the gap."""
    rows = messages_of(to_rows(made.observations, made.scene))
    blind = [replace(row, cells=np.full_like(row.cells, m.NOT_READ)) for row in rows[60:110]]
    told = fed(name, made.scene, Follower().take(received([*rows[:60], *blind, rows[110]])))
    missed = fed(name, made.scene, Follower().take(received([*rows[:60], rows[110]])))
    width, other = (np.sqrt(np.trace(e.covariance[:2, :2])) for e in (told, missed))
    assert 0.5 * width < other < 1.5 * width
