"""Figures whose answers are known by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from crunchbot.nav import localise, scoring
from crunchbot.nav.filters import Filter
from crunchbot.nav.localise import judged_rows
from crunchbot_lab import scenes


def test_lock_is_the_first_hundred_near_rows_kept_to_the_end():
    far, near = np.full(30, 0.2), np.full(100, 0.1)
    assert scoring.lock_row(np.concatenate([far, near])) == 30
    assert scoring.lock_row(np.concatenate([near[:99], far, near, near])) == 129
    assert scoring.lock_row(np.concatenate([near, near, far])) is None
    assert scoring.lock_row(near[:99]) is None


def test_pose_errors_skip_rows_without_truth_and_wrap_headings():
    poses = np.array([[0.0, 0.0, 3.1], [3.0, 4.0, 0.0], [9.0, 9.0, 9.0]])
    truth = np.array([[0.0, 0.0, -3.1], [0.0, 0.0, 0.0], [np.nan, 0.0, 0.0]])
    out = scoring.pose_errors(poses, truth)
    assert out["pose_error_median_m"] == 2.5
    assert out["heading_error_median_rad"] == pytest.approx((2 * np.pi - 6.2) / 2)


def test_auc_counts_pairs_in_order_and_ties_by_half():
    score, event = np.array([0.1, 0.4, 0.4, 0.8]), np.array([False, False, True, True])
    assert scoring.auc(score, event) == pytest.approx(3.5 / 4)
    assert scoring.auc(-score, event) == pytest.approx(0.5 / 4)
    assert scoring.auc(score, np.ones(4, bool)) is None


@pytest.mark.parametrize(("most", "rows"), [(0, []), (1, [2]), (2, [2, 10]), (3, [2, 6, 10]), (50, list(range(2, 11)))])
def test_rows_to_be_judged_are_spread_evenly_over_those_whose_truth_is_known(most, rows):
    truth = np.full((13, 3), np.nan)
    truth[2:11] = 1.0
    assert judged_rows(SimpleNamespace(truth=truth), most) == rows
    assert judged_rows(SimpleNamespace(truth=None), most) == []


def test_a_large_belief_is_judged_less_often(monkeypatch):
    made = scenes.make("anchor+global", 3, 40)
    often = localise.run("foveal", made.scene, made.observations, regions=40)
    filter = Filter("foveal", made.scene)  # as many components in each row
    filter.replay(made.observations, 0, 40)
    count = filter.component_count
    assert count == len(filter.components())
    monkeypatch.setattr(localise, "JUDGED_MOST", count // 4)
    seldom = localise.run("foveal", made.scene, made.observations, regions=40)
    judged = np.isfinite(seldom.levels)
    assert np.isfinite(often.levels).all() and 5 <= judged.sum() <= 20
    assert np.array_equal(seldom.levels[judged], often.levels[judged])
    assert "coverage_90" in localise.summary(seldom, made.observations.truth)
