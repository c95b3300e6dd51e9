"""Rows on their way: as the file has them, and no motion lost whatever was skipped, missed or begun anew."""

import math
from dataclasses import astuple, replace

import numpy as np
import pytest
from robotkit import to_rows

from crunchbot import observation as o
from crunchbot.base_table import CREATE, BaseTable
from crunchbot.nav import localise
from crunchbot.observation import Row, cell
from crunchbot.pilot.pilot import compose
from crunchbot.robot.network import messages as m
from crunchbot.robot.network.inbox import Received
from crunchbot.robot.network.row_checks import ANY, RowChecks
from crunchbot.robot.network.rows import PIECES_MOST, Follower, RowPublisher, Step, between, to_message, to_row
from crunchbot.robot.network.streams import Envelope
from crunchbot_lab import scenes


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
        publisher.send(Row.of(row, kinds[n] if kinds else o.EXPLORING))
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
    message = m.decode(
        m.Observation, m.encode(to_message(Row.of(row, o.RELEASE), 5, np.array([1.0, 0.0, math.pi / 2])))
    )
    again = to_row(message)
    assert {k: cell(v) for k, v in again.items()} == {k: cell(v) for k, v in row.items()}
    assert again["odo_x_m"] == 0.0123457 and again["t_s"] == 12.3
    assert message.pose == pytest.approx([1.00001, 0.0123457, math.pi / 2])
    assert (message.seq, message.kind, message.header.stamp.ns) == (5, o.RELEASE, 12_300_000_000)
    assert list(message.cells) == [o.VALUE, o.EMPTY, o.NOT_READ, o.EMPTY, o.VALUE, o.VALUE]


def test_the_publisher_counts_sums_and_ends():
    sink = Sink()
    publisher = RowPublisher(sink)
    for row in motions(5):
        publisher.send(Row.of(row))
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
    kinds = [o.RELEASE if n in (3, 8) else o.EXPLORING for n in range(10)]
    rows = received(messages_of(motions(10), kinds))
    steps = Follower().take(rows, 1)
    assert [step.row.seq for step in steps] == [3, 8, 9] and [step.rows for step in steps] == [4, 5, 1]
    assert [step.row.seq for step in Follower().take(rows, 3)] == [3, 7, 8, 9]


def test_a_robot_that_was_carried_is_a_row_of_its_own():
    moved = motions(10)
    moved[6] |= dict.fromkeys(("odo_x_m", "odo_y_m", "odo_theta_rad"), math.inf)
    rows = [m.decode(m.Observation, m.encode(row)) for row in messages_of(moved)]
    assert [row.kind == o.CARRIED for row in rows] == [n == 6 for n in range(10)]
    assert np.isfinite([row.pose for row in rows]).all()
    steps = Follower().take(received(rows), 1)
    assert [step.row.seq for step in steps] == [6, 9]
    assert np.isinf(steps[0].last().motion).all() and np.isfinite(steps[1].last().motion).all()
    assert all(np.isfinite(row.motion).all() for row in steps[0].lead())


def test_a_pilot_that_begins_anew_loses_no_motion_that_was_reported():
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
    assert [step.last()["t_s"] for step in steps] == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]


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
    return [made.step(row) for step in steps for row in (*step.lead(), step.last())][-1]


def test_motion_of_rows_that_were_not_weighed_comes_in_as_many_rows():
    rows = messages_of(motions(40))
    follower = Follower()
    follower.take(received(rows[:5]))
    (step,) = follower.take(received(rows[30:31]))
    lead = step.lead()
    assert [row["t_s"] for row in lead] == pytest.approx([0.1 * n for n in range(6, 31)], abs=1e-9)
    for name in rows[0].names:  # not read, as a row of cells says it
        assert all(math.isnan(row[name]) if name.endswith("_mm") else row[name] is None for row in lead)
    total = np.zeros(3)
    for row in (*lead, step.last()):
        total = compose(total, [row[key] for key in localise.ODOMETRY])
    assert total == pytest.approx(between(rows[4].pose, rows[30].pose), abs=1e-9)


def test_a_gap_in_time_within_a_stream_is_no_gap_in_motion():
    """The bridge was away for 5 s: no row is missing, and what the robot moved is in the next one."""
    rows = messages_of(motions(4))
    late = [m.Observation(m.Header.at(r.header.stamp.ns + 5 * 10**9, ""), *astuple(r)[1:]) for r in rows[2:]]
    steps = Follower().take(received([*rows[:2], *late]))
    assert [len(step.lead()) for step in steps] == [0, 0, 50, 0] and [step.rows for step in steps] == [1] * 4


def test_what_another_pilot_did_not_report_stays_a_gap():
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
    blind = [replace(row, cells=np.full_like(row.cells, o.NOT_READ)) for row in rows[60:110]]
    reported = fed(name, made.scene, Follower().take(received([*rows[:60], *blind, rows[110]])))
    missed = fed(name, made.scene, Follower().take(received([*rows[:60], rows[110]])))
    width, other = (np.sqrt(np.trace(e.covariance[:2, :2])) for e in (reported, missed))
    assert 0.5 * width < other < 1.5 * width


@pytest.mark.parametrize("motion", [(1e5, 0.0, 0.0), (0.0, -1e300, 0.0), (0.0, 0.0, 1e7), (3e4, 0.0, -2.5e6)])
@pytest.mark.parametrize("within_ns", [0, 10**8, 2**62])
def test_the_pieces_of_any_motion_are_bounded(motion, within_ns):
    row = messages_of(motions(1))[0]
    step = Step(row, np.array(motion), 10**10, 1, received([row])[0].envelope, within_ns)
    assert len(step.lead()) < PIECES_MOST
    angles = sum(r[localise.ODOMETRY[2]] for r in (*step.lead(), step.last()))
    assert math.cos(angles) == pytest.approx(math.cos(motion[2]), abs=1e-6)


def test_a_clock_that_leaps_has_begun_anew():
    rows = messages_of(motions(4))
    rows[2].header.stamp = m.Time(10**9 - 1)
    steps = Follower().take(received(rows))
    assert [step.t_ns // 10**8 for step in steps] == [1, 2, 3, 4]


def test_two_rows_of_one_stamp_are_two_steps_in_time():
    """No clock that goes on gives one twice; a filter takes no row that is not later than the one before."""
    rows = messages_of(motions(4))
    rows[2].header.stamp = rows[1].header.stamp
    times = [step.t_ns // 10**8 for step in Follower().take(received(rows))]
    assert times == [1, 2, 3, 5]


def slow_rows(count: int) -> list[m.Observation]:
    """At 0.15 m/s and 0.7 rad/s."""
    cells = {"l_VINYL": -1.0, "r_mm": None}
    return messages_of(
        {"t_s": round(0.1 * (n + 1), 4)} | dict(zip(localise.ODOMETRY, (0.015, 0.0, 0.07), strict=True)) | cells
        for n in range(count)
    )


def fault_after(rows, row, base: BaseTable = CREATE) -> str:
    checks = RowChecks()
    checks._base = base
    assert not any(map(checks, received(rows)))
    return checks(Received("observation", row, received(rows)[-1].envelope))


@pytest.mark.parametrize(
    ("seconds", "motion", "why"),
    [
        (0.1, (0.099, 0.0, 0.0), ""),
        (0.1, (0.101, 0.0, 0.0), "field pose: 0.101 m and 0 rad in 0.1 s"),
        (0.1, (0.0, 0.0, 0.52), ""),
        (0.1, (0.0, 0.0, 0.54), "field pose: 0 m and 0.54 rad in 0.1 s"),
        (1.0, (0.5, 0.0, 0.0), ""),
        (-5.0, (0.101, 0.0, 0.0), "field pose"),
        (1e6, (0.101, 0.0, 0.0), "field pose"),
    ],
)
def test_a_robot_moves_no_more_than_it_can_in_its_time(seconds, motion, why):
    rows = slow_rows(10)
    stamp_ns = rows[-1].header.stamp.ns + round(seconds * 1e9)
    row = replace(rows[-1], seq=10, header=m.Header.at(stamp_ns), motion=np.array(motion))
    reported = fault_after(rows, replace(row, pose=compose(rows[-1].pose, motion)))
    assert reported.startswith(why) and bool(reported) == bool(why)


@pytest.mark.parametrize(
    ("motion", "why"),
    [
        ((0.54, 0.0, 0.0), ""),
        ((0.56, 0.0, 0.0), "field pose: 0.56 m"),
        ((0.0, 0.0, 3.1), ""),
        ((0.0, 0.0, 3.3), "field pose: 0 m and 3.3 rad"),
    ],
)
def test_without_a_scene_a_robot_moves_no_more_than_any_base(motion, why):
    rows = slow_rows(10)
    stamp = m.Header.at(rows[-1].header.stamp.ns + 10**8)
    row = replace(rows[-1], seq=10, header=stamp, motion=np.array(motion), pose=compose(rows[-1].pose, motion))
    reported = fault_after(rows, row, ANY)
    assert reported.startswith(why) and bool(reported) == bool(why)
    assert RowChecks()._base == ANY


def test_motion_that_a_whisk_held_back_is_none_too_much():
    rows = slow_rows(10)
    for n in range(10, 30):
        still = replace(rows[9], seq=n, kind=o.WHISK, header=m.Header.at((n + 1) * 10**8), motion=np.zeros(3))
        rows.append(still)
    motion = np.array([0.3, 0.0, 1.0])
    row = replace(rows[9], seq=30, kind=o.RELEASE, header=m.Header.at(31 * 10**8), motion=motion)
    assert fault_after(rows, replace(row, pose=compose(rows[9].pose, motion))) == ""


def test_motion_and_its_sum_must_agree():
    rows = slow_rows(10)
    row = replace(rows[-1], seq=10, header=m.Header.at(11 * 10**8))
    assert fault_after(rows, replace(row, pose=rows[-1].pose)).startswith("field motion: not what leads from")
    assert fault_after(rows, replace(row, seq=9)).startswith("field seq: 9 after 9")


def test_after_rows_that_were_refused_the_next_good_one_is_taken():
    rows, checks = slow_rows(60), RowChecks()
    checks._base = CREATE
    bad = [replace(row, pose=row.pose + [5.0, 0.0, 0.0]) for row in rows[10:40]]
    reported = list(map(checks, received([*rows[:10], *bad, *rows[40:]])))
    assert [bool(fault) for fault in reported] == [10 <= n < 40 for n in range(60)] and reported[10].startswith(
        "field "
    )


def test_rows_of_a_scene_have_its_cells(made):
    rows = messages_of(to_rows(made.observations, made.scene))
    checks = RowChecks(made.scene)
    assert not any(map(checks, received(rows)))
    whisker = made.scene.robot.whiskers[0].name
    more = replace(rows[0], names=[*rows[0].names, f"{whisker}_ASPHALT"])
    assert "cell" in checks(received([replace(rows[0], names=rows[0].names[1:])])[0])
    assert checks._names_fault(more.names) == ""
    assert checks._names_fault([*rows[0].names, "tail_mm"]) == (
        "field names: no whisker has the cell tail_mm; give both sides the scene of this robot"
    )
