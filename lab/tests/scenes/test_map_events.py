"""Kidnaps while mapping: said when they are, not said when they are not, and judged right."""

from dataclasses import replace

import numpy as np
import pytest
from mapkit import MANY, SEEDS, map_made, mapped

from crunchbot_lab.scenes import map_events, own_map
from crunchbot_lab.scenes.map_scoring import best_motion

ROWS, CARRIED = 3000, "free+carried"
JOINED = 8  # of MANY scenes, in which both maps become one, at least


def kidnaps(family: str, seeds: range) -> list[dict[str, float | None]]:
    """The score of each scene's kidnaps."""
    runs = [mapped(family, seed, ROWS) for seed in seeds]
    return [map_events.kidnaps_score(run, made.kidnaps) for made, run in runs]


def one_joined(family: str = CARRIED):
    """The first scene whose maps were joined at the right place, and its map."""
    found = (mapped(family, seed, ROWS) for seed in SEEDS)
    return next((m, r) for m, r in found if map_events.kidnaps_score(r, m.kidnaps)["joined"] == 1.0)


@pytest.fixture(scope="module")
def carried():
    return one_joined()


def test_a_kidnap_is_noticed_and_both_maps_become_one():
    found = kidnaps(CARRIED, MANY)
    assert sum(score["joined"] for score in found) >= JOINED
    assert sum(score["joined_false"] for score in found) <= 1.0
    assert sum(score["alarms_false"] for score in found) == 0.0
    assert np.median([score["noticed_rows"] or ROWS for score in found]) < 300.0


def test_after_both_maps_became_one_poses_are_of_the_first(carried):
    made, run = carried
    part = run.parts[1]
    assert part.into == 0 and part.first <= part.noticed <= part.joined
    assert not run.frame.any() and run.touched.frame == 0
    motion = best_motion(run.table["pose"][:1500, :2], made.observations.truth[:1500, :2])
    off = np.hypot(*(motion.points(run.table["pose"][:, :2]) - made.observations.truth[:, :2]).T)
    assert np.median(off[part.noticed :]) < 0.1


def test_until_maps_meet_estimates_are_in_a_frame_of_their_own(carried):
    made, whole = carried
    rows, stop = made.observations, (whole.parts[1].noticed + whole.parts[1].joined) // 2
    cut = {name: getattr(rows, name)[:stop] for name in ("t_s", "odometry", "texture", "radial_m", "truth")}
    run = map_made(replace(made, observations=replace(rows, t_text=rows.t_text[:stop], **cut)))
    assert len(run.parts) == 2 and run.parts[1].joined is None
    assert run.touched.frame == 1 and run.frame[-1] == 1 and run.frame[0] == 0
    known = np.isfinite(run.poses()).all(axis=1)
    assert not known[:1500].any() and known[-1]
    assert np.abs(run.table["pose"][-1, :2]).max() < 2.0  # near the new origin
    assert run.scene().arena.size_m[0] < 4.0


@pytest.mark.parametrize(
    ("family", "most"),
    [
        ("anchor", 0),
        ("anchor+slip", 1),
        ("anchor+moving-box", 0),
        ("anchor+renamed", 0),
        ("anchor+silent-minute", 0),
    ],
)
def test_nothing_is_noticed_where_nobody_was_carried(family, most):
    found = [mapped(family, seed, ROWS)[1] for seed in SEEDS]
    assert sum(run.frame.any() for run in found) <= most


def test_maps_that_fit_in_two_ways_are_not_joined():
    assert sum(score["joined_false"] for score in kidnaps("symmetric2+carried", SEEDS)) == 0.0


def test_a_join_at_the_wrong_place_is_counted_as_false(carried):
    made, run = carried
    table = run.table.copy()
    table["pose"][run.parts[1].joined :, 0] += 1.0
    found = map_events.kidnaps_score(replace(run, table=table), made.kidnaps)
    assert found["joined_false"] == 1.0 and found["joined"] == 0.0
    assert map_events.kidnaps_score(run, (2900,))["alarms_false"] == 1.0


def test_a_drive_is_located_in_the_map_that_the_robot_made():
    _, run = mapped("anchor", 4, ROWS)
    (drive,) = own_map.score(run, "anchor", 4, 1)
    assert drive.own.rows_to_lock is not None and drive.true.rows_to_lock is not None
    assert drive.own.error_m < 0.06 and drive.true.error_m < 0.02
