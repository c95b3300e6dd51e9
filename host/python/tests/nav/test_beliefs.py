"""What every registered filter guarantees: components whose masses sum to 1, and no certainty out of nothing."""

import numpy as np
import pytest

from crunchbot.nav import localise
from crunchbot_lab import scenes

ROWS, BLIND = 200, 60


@pytest.fixture(scope="module")
def made():
    return scenes.make("raw+global", 21, ROWS + BLIND)


@pytest.mark.parametrize("name", localise.filter_names())
def test_masses_sum_to_one(name, made):
    running = localise.Filter(name, made.scene, seed=3)
    for first in range(0, ROWS, 20):
        running.replay(made.observations, first, 20)
        components = running.components()
        assert components["mass"].sum() == pytest.approx(1.0, abs=1e-3)
        assert (components["mass"] >= 0.0).all() and np.isfinite(components["pose"]).all()


@pytest.mark.parametrize("name", localise.filter_names())
def test_nothing_read_makes_nothing_surer(name, made):
    """Six seconds at a standstill with no reading: confidence falls or stays, but for what resampling and rounding may
    move. (A robot that drives on may grow surer of its place: going back undoes what an uncertain heading spread.)"""
    rows = made.observations
    rows.odometry[ROWS:] = 0.0
    rows.texture[ROWS:], rows.radial_m[ROWS:] = np.nan, np.nan
    table, _ = localise.Filter(name, made.scene, seed=3).replay(rows, 0, ROWS + BLIND)
    after = table["confidence"][ROWS - 1 :]
    assert (after - np.minimum.accumulate(after)).max() <= 0.02
    assert after[-1] <= after[0] + 1e-6
