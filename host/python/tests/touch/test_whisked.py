"""What the pilot makes of whole whisks: caught or too strong, where it is by the kind of its object."""

import math

import numpy as np
import pytest
from whisks import COUNTS, RATE, whisk, whisks

from crunchbot.touch.mount import Mount
from crunchbot.touch.radial import model as radial
from crunchbot_lab.simulation.scenes import make_robot

OUTER, INNER = (Mount.of(whisker) for whisker in make_robot().of_role("object")[:2])
CORNER_MM, TIP_MM = 110.0, 140.0


@pytest.fixture(scope="module")
def model():
    return radial.fit(whisks(np.random.default_rng(1), 5), "whisk").model


def shown(model, radius_mm=CORNER_MM, **options):
    """Shape of a whisk against a corner at this radius."""
    return model.shape_of(whisk(radius_mm, np.random.default_rng(2), **options))


def test_share_and_counts_are_those_of_the_whisk(model):
    assert model.share_of(shown(model)) == pytest.approx(model.share(CORNER_MM), rel=0.1)
    assert model.counts_per_rad(RATE) == pytest.approx(COUNTS, rel=0.3)  # gain and the plug's stiffness trade
    assert model.along(np.array([[80.0, -60.0]]))[0] == pytest.approx(100.0, rel=0.01)


def test_a_corner_is_reported_where_it_is(model):
    assert INNER.whisked(model, shown(model), INNER.corner_turn, 0.02) == pytest.approx(CORNER_MM, abs=5.0)
    assert INNER.whisked(model, shown(model), -INNER.corner_turn, 0.02) == pytest.approx(TIP_MM)


def test_a_corner_on_the_side_that_was_not_calibrated_is_not_reported(model):
    """Driving forward, an outer whisker meets corners on its right; its post stood on its left."""
    assert OUTER.whisked(model, shown(model, gain=-1.0), OUTER.corner_turn, 0.02) is None


def test_a_face_that_bends_it_like_a_corner_is_reported_at_the_tip(model):
    for mount in (OUTER, INNER):
        assert mount.whisked(model, shown(model), mount.corner_turn, 0.98) == pytest.approx(TIP_MM)


def test_a_tip_dragged_along_a_face_bends_little_and_is_reported(model):
    weak = shown(model, 138.0, gain=0.3)
    assert model.estimate(weak).confidence < 0.5  # none of those calibrated
    for mount in (OUTER, INNER):
        assert mount.whisked(model, weak, mount.corner_turn, math.nan) == pytest.approx(TIP_MM)


def test_what_bends_more_than_any_corner_or_to_the_other_side_is_not_reported(model):
    for gain in (1.8, -1.0):
        caught = shown(model, 90.0, gain=gain)
        for turn in (1.0, -1.0):
            assert INNER.whisked(model, caught, turn, 0.02) is None
    flat = radial.Contact(np.arange(500) / 2000, np.full((500, 2), 32768.0))
    assert INNER.whisked(model, model.shape_of(flat), 1.0, 0.02) is None


def test_where_the_kind_is_not_known_an_outer_whisker_is_sure_only_of_its_tip(model):
    assert OUTER.whisked(model, shown(model), OUTER.corner_turn, 0.5) is None
    assert OUTER.whisked(model, shown(model), OUTER.corner_turn, math.nan) is None
    assert INNER.whisked(model, shown(model), INNER.corner_turn, math.nan) == pytest.approx(CORNER_MM, abs=5.0)
