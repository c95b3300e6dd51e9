"""Scores of any engine's estimates: figures from the rows given, starts found where a robot was carried, CSV read strictly."""

import math

import numpy as np
import pytest

from crunchbot.nav.estimates import Estimates, read_estimates
from crunchbot.nav.judging import bits_reported, bits_wanted, carried_rows, judge, starts_of, travel_of
from crunchbot.nav.observations import Observations
from crunchbot.scene import Arena, Robot, Scene, Whisker
from crunchbot.tables import TableError

ROWS = 400
STEP_M = 0.01


def straight(kidnap: int | None = None) -> Observations:
    """A robot that drives along x; from row `kidnap` on it is 1 m to the left."""
    times = (np.arange(ROWS) + 1) * 0.1
    truth = np.column_stack([(np.arange(ROWS) + 1) * STEP_M, np.zeros(ROWS), np.zeros(ROWS)])
    if kidnap is not None:
        truth[kidnap:, 1] = 1.0
    odometry = np.tile([STEP_M, 0.0, 0.0], (ROWS, 1))
    return Observations(times, [], odometry, np.empty((ROWS, 0, 0)), np.empty((ROWS, 0)), truth)


def engine(poses: np.ndarray, **reported) -> Estimates:
    return Estimates("engine", np.arange(len(poses)), poses, **reported)


def test_the_figures_are_those_of_the_rows():
    rows = straight()
    poses = rows.truth.copy()
    poses[:40, 1] += 0.5  # far for the first 40 rows, 20 of them after 20 cm
    poses[40:, 1] += 0.03
    confidence = np.full(ROWS, 0.95)
    confidence[:10] = 0.1
    score = judge(engine(poses, confidence=confidence, step_us=np.full(ROWS, 7.0)), rows)
    assert score["near_share"] == pytest.approx(360 / 400)
    assert score["near_share_after_20cm"] == pytest.approx(360 / 381)
    assert score["error_median_m"] == pytest.approx(0.03) and score["heading_error_median_rad"] == 0.0
    assert score["sure_wrong_share"] == pytest.approx(30 / 400)
    assert score["brier"] == pytest.approx((10 * 0.1**2 + 30 * 0.95**2 + 360 * 0.05**2) / 400)
    assert score["rows_to_lock"] == 40 and score["rows_to_find"] == [40]
    assert score["step_us_mean"] == 7.0 and score["coverage_90"] is None


def test_a_heading_that_is_wrong_is_wrong_and_no_number_is_never_near():
    rows = straight()
    turned = rows.truth + [0.0, 0.0, 0.6]
    assert judge(engine(turned, confidence=np.ones(ROWS)), rows)["sure_wrong_share"] == 1.0
    lost = np.full((ROWS, 3), np.nan)
    score = judge(engine(lost, confidence=np.full(ROWS, np.nan)), rows)
    assert score["near_share"] == 0.0 and score["error_median_m"] == math.inf and score["rows_to_lock"] is None


@pytest.mark.parametrize("carry_rows", [1, 15])
def test_a_robot_that_is_carried_starts_anew(carry_rows):
    rows = straight(200)
    rows.truth[200 : 200 + carry_rows, 1] = np.linspace(0.0, 1.0, carry_rows + 1)[1:]
    starts = starts_of(rows)
    assert len(starts) == 2 and abs(starts[1] - (199 + carry_rows)) <= 2
    assert travel_of(rows, starts)[starts[1]] == pytest.approx(STEP_M) and travel_of(rows, starts)[-1] < 2.01
    poses = rows.truth.copy()
    poses[200 : starts[1] + 50, 1] = 0.0  # goes on where it was, found after 50 rows
    score = judge(engine(poses, confidence=np.ones(ROWS)), rows)
    assert score["rows_to_find"] == [0, 50] and score["rows_to_lock"] == 50
    left_out = 30 + starts[1] - carried_rows(rows)[0][0]  # while it is carried, and 30 of the 50 wrong rows after it
    assert score["sure_wrong_share"] == pytest.approx(20 / (400 - left_out))


def test_wheels_that_slip_are_no_carrying():
    rows = straight()
    rows.truth[100:140, 0], rows.truth[140:, 0] = rows.truth[100, 0], rows.truth[140:, 0] - 0.4
    assert starts_of(rows) == [0]


def write(path, header: str, lines: list[str]):
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


def test_a_file_of_another_engine_is_read_by_order_or_by_time(tmp_path):
    rows = straight()
    full = write(tmp_path / "a.csv", "x_m,y_m,theta_rad", [f"{x},{y},{t}" for x, y, t in rows.truth])
    assert judge(read_estimates(full, "a", rows), rows)["near_share"] == 1.0
    some = write(
        tmp_path / "b.csv", "t_s,x_m,y_m,theta_rad", [f"{0.1 * k:.3f},{STEP_M * k},0.0,0" for k in (30, 60, 90)]
    )
    read = read_estimates(some, "b", rows)
    assert read.rows.tolist() == [29, 59, 89] and judge(read, rows)["near_share"] == 1.0
    header = "x_m,y_m,theta_rad,xx_m2,xy_m2,yy_m2"
    wide = [f"{x + 0.025},{y},{t},{0.01**2 if n < 100 else 0.02**2},0,1" for n, (x, y, t) in enumerate(rows.truth)]
    inside = read_estimates(write(tmp_path / "c.csv", header, wide), "c", rows).inside_90
    assert inside.tolist() == [n >= 100 for n in range(ROWS)]  # 2.15 sigma are the limit
    far = [f"{x + 0.03},{y},{t},0.0001,0,0.0001" for x, y, t in rows.truth]
    assert not read_estimates(write(tmp_path / "d.csv", header, far), "d", rows).inside_90.any()


@pytest.mark.parametrize(
    "header, lines, reported",
    [
        ("x_m,y_m", ["1,2"], "line 1: column 'theta_rad' is missing"),
        ("x_m,y_m,theta_rad", ["1,2,3"], "1 rows, the scene has 400"),
        ("t_s,x_m,y_m,theta_rad", ["0.1,0,0,0", "0.15,0,0,0"], "line 3: t_s 0.15 is no row's"),
        ("t_s,x_m,y_m,theta_rad", ["0.2,0,0,0", "0.1,0,0,0"], "line 3: t_s is not later"),
        ("t_s,x_m,y_m,theta_rad", ["nan,0,0,0"], "line 2: t_s nan is no row's"),
        ("t_s,x_m,y_m,theta_rad", [], "no rows"),
    ],
)
def test_a_file_that_cannot_be_matched_is_reported_in_a_line(tmp_path, header, lines, reported):
    with pytest.raises(TableError, match=reported):
        read_estimates(write(tmp_path / "est.csv", header, lines), "est", straight())


def test_the_bound_counts_each_tile_once_and_holds_for_floor_sensors_only():
    arena = Arena((4.2, 0.6), 0.3, ("BLACK", "WHITE"), ("B" * 14,) * 2, ())
    rows = straight()
    one = Scene(arena, Robot(0.0, 0.1, 0.01, (Whisker("a", "texture", tip_m=(0.0, 0.0)),)))
    two = Scene(arena, Robot(0.0, 0.1, 0.01, tuple(Whisker(n, "texture", tip_m=(0.0, 0.0)) for n in "ab")))
    blind = Scene(arena, Robot(0.0, 0.1, 0.01, (Whisker("a", "object", base_m=(0, 0), yaw_rad=0.0, length_m=0.1),)))
    reported = bits_reported(one, rows)
    assert reported[0] == 1.0 and reported[-1] == 14.0 and (np.diff(reported) >= 0).all()
    assert np.array_equal(reported, bits_reported(two, rows))
    assert bits_reported(blind, rows) is None
    assert bits_wanted(one, 0.06) == pytest.approx(math.log2(4.2 * 0.6 / (math.pi * 0.06**2)))
