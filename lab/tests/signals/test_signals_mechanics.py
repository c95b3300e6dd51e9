"""Contacts and sweeps with real mechanics, as studies use them."""

import math

import numpy as np
import pytest

from crunchbot_lab.signals import mechanics
from crunchbot_lab.signals.mechanics import CLOSED, LARGE, VIBRATION, WHOLE, Whisker, contact, sweep, touch

WHISK = math.pi / 24
COUNT_RAD = math.pi / 65536


def peak(**options):
    defaults = {"whisker": Whisker(friction=0.0), "radius_m": 0.11, "speed_rad_s": WHISK, "angle_rad": 0.087, "seed": 1}
    return contact(**(defaults | options))


def test_equal_arguments_give_equal_counts_and_other_seeds_other_noise():
    first, again, other = peak(), peak(), peak(seed=2)
    assert np.array_equal(first.counts, again.counts)
    assert not np.array_equal(first.counts, other.counts)
    assert np.array_equal(first.tilt_rad, other.tilt_rad)


def test_peak_falls_with_radius_as_the_closed_form_says():
    radii = np.arange(0.09, 0.1351, 0.01)
    whisker = Whisker(friction=0.0, creep=0.0)
    end = round((mechanics.LEAD_S + 0.02 / WHISK + 0.35) / mechanics.TICK_S)
    tilts = [contact(whisker, r, WHISK, 0.02, hold_s=0.35, seed=1).tilt_rad[end - 100 : end, 0].mean() for r in radii]
    wanted = 0.02 * (1 - radii / whisker.cone)  # kappa = 1
    assert np.allclose(tilts, wanted, rtol=0.01)


def test_counts_are_the_field_of_the_tilt():
    whisker = Whisker()
    series = contact(whisker, 0.11, WHISK, 0.087, seed=3)
    field = (series.counts[:, 0] - 32768.0) * COUNT_RAD
    assert np.abs(field - 2.75 * series.tilt_rad[:, 0]).max() < 0.02 * 2.75 * series.tilt_rad.max() + math.radians(0.3)


def test_contact_to_the_other_side_is_the_mirror_image():
    left, right = peak(), peak(angle_rad=-0.087)
    assert np.allclose(left.tilt_rad[:, 0], -right.tilt_rad[:, 0], atol=1e-12)


def test_slip_off_rings_and_ends_the_contact():
    whisker = Whisker(friction=0.0, creep=0.0)
    series = contact(whisker, 0.13, WHISK, 0.6, seed=1)
    tilt = series.tilt_rad[:, 0]
    top = int(np.flatnonzero(series.what)[-1])
    after = tilt[top : top + 400]
    assert after.min() < -0.3 * tilt.max()  # swings to the other side
    swings = np.flatnonzero(np.diff(np.sign(after)))
    assert 1 / (2 * np.diff(swings).mean() * mechanics.TICK_S) == pytest.approx(16.3, rel=0.15)
    assert not tilt[-200:].any()  # rest, though the mount still turns


def test_levels_differ_a_little_in_a_whisk():
    whole = peak().tilt_rad
    assert np.array_equal(whole, peak(level=WHOLE).tilt_rad)
    for level in (CLOSED, LARGE, VIBRATION):
        other = peak(level=level).tilt_rad
        assert 0.0 < np.abs(other - whole).max() < 0.05 * whole.max()  # how the whisk's end swings


def test_sample_rate_is_a_parameter():
    fine = peak(tick_s=250e-6).tilt_rad.max()
    assert peak(tick_s=500e-6).tilt_rad.max() == pytest.approx(fine, rel=2e-3)
    assert peak(tick_s=10e-3).tilt_rad.max() == pytest.approx(fine, rel=4e-2)


def test_pile_hooks_and_lets_go():
    series = sweep(Whisker(), ["VINYL", "ROUGH"], 0.1, 0.3, seed=2, step_m=0.001, behind=0.0)
    hooked = series.what & 3 == mechanics.HOOKED
    assert hooked.any() and not hooked[: round(0.3 / 0.1 / mechanics.TICK_S) - 1].any()
    assert hooked.sum() * mechanics.TICK_S == pytest.approx(math.sqrt(0.14**2 - 0.08**2) / 0.1, rel=0.02)
    flat = sweep(Whisker(), ["VINYL", "ROUGH"], 0.1, 0.3, seed=2)
    assert (flat.what & 3 < mechanics.HOOKED).all()


@pytest.mark.parametrize("level", [CLOSED, VIBRATION])
def test_step_without_a_pile_is_slid_over(level):
    series = sweep(Whisker(), ["VINYL", "SMOOTH"], 0.1, 0.3, seed=2, step_m=0.001, level=level)
    held = (series.what & 3 == mechanics.EDGE).sum() * mechanics.TICK_S
    assert 47.6e-3 / 1.5 < held < 47.6e-3 * 1.5  # a chain of 20 links on a flat floor: 47.6 ms
    assert (series.what & 3 != mechanics.HOOKED).all()


def test_floors_differ_as_their_roughness_does():
    spread = [sweep(Whisker(), [name], 0.1, 2.0, seed=5).tilt_rad[2000:, 1].std() for name in mechanics.FLOORS]
    assert spread[0] < 0.3 * spread[1] < 0.3 * spread[2]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: Whisker(kapa=1.0), "no parameter 'kapa'"),
        (lambda: Whisker(kappa=-1.0), "must be above 0"),
        (lambda: Whisker(length=0.2), "must be below cone"),
        (lambda: sweep(Whisker(), ["GRASS"], 0.1, 1.0, seed=1), "no floor is called 'GRASS'"),
        (lambda: sweep(Whisker(), ["VINYL"], 0.1, 0.1, seed=1, hight=0.1), "no 'hight'"),
        (lambda: touch(Whisker(), 0.1, 0.1, seed=1), "one value a tick"),
    ],
)
def test_bad_calls_say_what_is_wrong(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_nonsense_is_no_touch():
    bad = np.array([np.nan, np.inf, -np.inf, 0.1, np.nan])
    series = touch(Whisker(), np.array([0.1, 0.1, 0.1, np.nan, np.nan]), bad, bad, seed=1)
    assert np.isfinite(series.tilt_rad).all()


def test_unknowns_have_ranges():
    listed = mechanics.unknowns()
    assert {"friction", "damping", "kappa", "creep"} <= set(listed)
    assert all(u.low < u.typical < u.high for u in listed.values())
