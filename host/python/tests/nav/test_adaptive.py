"""The default filter on drawn scenes: found from nothing, followed, found again, honest, replayed bit by bit."""

from dataclasses import replace

import numpy as np
import pytest

from crunchbot.nav import filters
from crunchbot_lab.scenes import make

SEEDS = range(4000, 4004)
NEAR_M = 0.15


def rows_of(name: str, scene, observations, settings=None, seed=0):
    """The estimates of every row, as a table."""
    made = filters.Filter(name, scene, settings, seed=seed)
    return np.array([(*e.pose, e.confidence, e.evaluations) for e in steps(made, observations)])


def steps(made, observations):
    for k in range(len(observations.t_s)):
        yield made.step_values(
            observations.t_s[k], observations.odometry[k], observations.texture[k], observations.radial_m[k]
        )


def errors(rows, observations) -> np.ndarray:
    return np.hypot(*(rows[:, :2] - observations.truth[:, :2]).T)


def test_it_is_the_default():
    assert filters.default_filter() == "adaptive"


@pytest.mark.parametrize("family", ["anchor+global", "free+global", "anchor+wrong-1m"])
def test_the_robot_is_found_and_followed(family):
    for seed in SEEDS:
        made = make(family, seed)
        rows = rows_of("adaptive", made.scene, made.observations)
        error = errors(rows, made.observations)[-100:]
        assert error.max() < NEAR_M, (family, seed)
        assert rows[-100:, 3].min() > 0.8


def test_a_carried_robot_is_found_again():
    for seed in SEEDS:
        made = make("anchor+kidnap", seed, rows=600)
        rows = rows_of("adaptive", made.scene, made.observations)
        assert errors(rows, made.observations)[-100:].max() < NEAR_M, seed


def test_the_same_seed_gives_the_same_bytes():
    made = make("anchor+kidnap", 4010, rows=450)
    one, same, other = (rows_of("adaptive", made.scene, made.observations, seed=s) for s in (1, 1, 2))
    assert one.tobytes() == same.tobytes() != other.tobytes()


def test_a_dead_whisker_and_a_wrong_tile_do_not_lose_it():
    for fault in ("dead", "map-tile"):
        for seed in SEEDS:
            made = make(f"anchor+{fault}", seed, rows=400)
            rows = rows_of("adaptive", made.scene, made.observations)
            assert np.median(errors(rows, made.observations)) < 0.03, (fault, seed)


def without(observations, lost):
    """The rows that came."""
    keep = np.flatnonzero(~lost)
    columns = {name: getattr(observations, name)[keep] for name in ("t_s", "odometry", "texture", "radial_m", "truth")}
    return replace(observations, t_text=[observations.t_text[k] for k in keep], **columns)


def test_gaps_of_many_seconds_do_not_lose_it_for_good():
    k = np.arange(900)
    lost = (k >= 150) & (k < 280) | (k >= 400) & (k < 500)
    for seed in SEEDS:
        made = make("anchor", seed, rows=len(k))
        observations = without(made.observations, lost)
        rows = rows_of("adaptive", made.scene, observations)
        assert errors(rows, observations)[-100:].max() < NEAR_M, seed
        assert rows[-100:, 3].min() > 0.8, seed


def test_after_a_gap_it_is_not_sure_of_a_wrong_place():
    """The robot drives on for 5 s whose odometry is lost with their rows: nobody can know where it is at first."""
    k = np.arange(500)
    lost = (k >= 200) & (k < 250)
    wrong = []
    for seed in SEEDS:
        made = make("anchor", seed, rows=len(k))
        observations = without(made.observations, lost)
        rows = rows_of("adaptive", made.scene, observations)
        error = errors(rows, observations)[200:]
        assert error.max() > NEAR_M and error[-100:].max() < NEAR_M, seed
        wrong.append(np.mean((rows[200:, 3] > 0.9) & (error > 0.25)))
    assert np.mean(wrong) < 0.01, wrong
