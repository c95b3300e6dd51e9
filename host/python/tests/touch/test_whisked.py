"""What the pilot makes of whole whisks: corner or face, caught or too strong, and the bending on the way back."""

import math

import numpy as np
import pytest
from whisks import COUNTS, RATE, whisk, whisks

from whisker.simulation.scenes import make_robot
from whisker.touch.mount import Mount, retreat
from whisker.touch.radial import model as radial

OUTER, INNER = (Mount.of(whisker) for whisker in make_robot().of_role("object")[:2])
CORNER_MM, TIP_MM = 110.0, 140.0


@pytest.fixture(scope="module")
def model():
    return radial.fit(whisks(np.random.default_rng(1), 5), "whisk").model


def shown(model, radius_mm=CORNER_MM, **options):
    """Shape of a whisk against a corner at this radius."""
    return model.shape_of(whisk(radius_mm, np.random.default_rng(2), **options))


def per_metre_at_corner(model, mount, radius_mm):
    """Of a corner under the shaft: h(a) times the motion across the shaft over the radius, in calibration's direction."""
    return -mount.calibrated_turn * model.share(radius_mm) * math.sin(mount.yaw_rad) / (1e-3 * radius_mm)


def per_metre_at_face(model, mount, normal_rad):
    """Of a face at the tip with this normal: h(L) times the motion along the normal over the tip's lever."""
    sine = math.sin(normal_rad - mount.yaw_rad)
    return mount.calibrated_turn * model.share(TIP_MM) * math.cos(normal_rad) / (sine * 1e-3 * mount.length_mm)


def test_share_and_counts_are_those_of_the_whisk(model):
    assert model.share_of(shown(model)) == pytest.approx(model.share(CORNER_MM), rel=0.1)
    assert model.counts_per_rad(RATE) == pytest.approx(COUNTS, rel=0.3)  # gain and the plug's stiffness trade
    assert model.along(np.array([[80.0, -60.0]]))[0] == pytest.approx(100.0, rel=0.01)


def test_a_corner_is_told_where_it_is(model):
    per_metre = per_metre_at_corner(model, INNER, CORNER_MM)
    assert INNER.whisked(model, shown(model), INNER.corner_turn, per_metre) == pytest.approx(CORNER_MM, abs=5.0)
    assert INNER.whisked(model, shown(model), -INNER.corner_turn, per_metre) == pytest.approx(TIP_MM)


def test_a_corner_on_the_side_that_was_not_calibrated_is_not_told(model):
    """Driving forward, an outer whisker meets corners on its right; its post stood on its left."""
    per_metre = per_metre_at_corner(model, OUTER, CORNER_MM)
    assert per_metre < 0.0
    assert OUTER.whisked(model, shown(model, gain=-1.0), OUTER.corner_turn, per_metre) is None


def test_a_face_that_bends_it_like_a_corner_is_told_at_the_tip(model):
    """Driving towards them bends the whisker differently, that is what tells."""
    shape, length_m = shown(model), 1e-3 * OUTER.length_mm
    tip = np.array(OUTER.base_m) + length_m * np.array([math.cos(OUTER.yaw_rad), math.sin(OUTER.yaw_rad)])
    normals = np.linspace(
        0.5, 1.0, 1000
    )  # beyond the whisker, which leans to the left by 0.2: it bends as in calibration
    lever = tip[0] * np.sin(normals) - tip[1] * np.cos(normals)
    bends = model.share(TIP_MM) * lever / (np.sin(normals - OUTER.yaw_rad) * length_m)
    bends *= OUTER.calibrated_turn * OUTER.corner_turn
    nearest = np.argmin(np.abs(bends - model.share_of(shape)))
    assert bends[nearest] == pytest.approx(model.share_of(shape), abs=0.01)
    per_metre = per_metre_at_face(model, OUTER, normals[nearest])
    assert OUTER.whisked(model, shape, OUTER.corner_turn, per_metre) == pytest.approx(TIP_MM)
    surface = OUTER.surface(model, per_metre, model.share_of(shape), OUTER.corner_turn)
    assert surface["face"] > 0.99 and surface["normal_rad"] == pytest.approx(normals[nearest], abs=0.05)


def test_a_tip_dragged_along_a_face_bends_little_and_is_told(model):
    weak = shown(model, 138.0, gain=0.3)
    assert model.estimate(weak).confidence < 0.5  # none of those calibrated
    for mount in (OUTER, INNER):
        assert mount.whisked(model, weak, mount.corner_turn, math.nan) == pytest.approx(TIP_MM)


def test_what_bends_more_than_any_corner_or_to_the_other_side_is_not_told(model):
    for gain in (1.8, -1.0):
        caught = shown(model, 90.0, gain=gain)
        for turn in (1.0, -1.0):
            assert INNER.whisked(model, caught, turn, 3.0) is None
    flat = radial.Contact(np.arange(500) / 2000, np.full((500, 2), 32768.0))
    assert INNER.whisked(model, model.shape_of(flat), 1.0, 3.0) is None


def test_without_the_way_back_an_outer_whisker_is_sure_only_of_its_tip(model):
    assert OUTER.whisked(model, shown(model), OUTER.corner_turn, math.nan) is None
    assert INNER.whisked(model, shown(model), INNER.corner_turn, math.nan) == pytest.approx(CORNER_MM, abs=5.0)


def test_retreat_lays_a_line_over_the_middle_of_the_way():
    gone = np.arange(400) * 15e-6
    tilt = np.maximum(0.0, 0.02 - 5.0 * gone) + np.random.default_rng(1).normal(0, 1e-4, 400)
    assert retreat(gone, tilt) == pytest.approx(5.0, rel=0.02)
    assert retreat(gone, -tilt) == pytest.approx(-5.0, rel=0.02)
    assert math.isnan(retreat(gone[:30], tilt[:30]))
    assert math.isnan(retreat(gone, np.full(400, 0.02)))
