"""Contacts that are cut, delayed, started in contact or slip on purpose, bent by sim/mechanics with its ringing and creep, in
calibration and afterwards: their onsets are found, sure answers are right, and most are sure."""

import math

import numpy as np
import pytest

from crunchbot.touch.radial import model as radial
from crunchbot.touch.radial.press import PressModel, press_of
from crunchbot.touch.radial.push import Contact, presses_of
from crunchbot_lab.signals.mechanics import Whisker, contact
from crunchbot_lab.signals.pushes import spoilt

RADII_MM = (90.0, 100.0, 110.0, 120.0, 130.0, 138.0)
RATE, PUSH_S, SPREAD = math.pi / 24, 0.6, 0.026  # the paper's whisk, and of its whiskers the steadiest
LEAD = 200  # samples before the touch, in which the whisker rings from the base's start
SURE, OFF_MM = 0.5, 10.0
HOWS = ("cut", "delayed", "started in contact", "slipped")


def pushes(repeats: int, rng: np.random.Generator) -> tuple[list[Contact], np.ndarray, np.ndarray]:
    """Whisks of one whisker, their radii, and the angles they push by; angle and gain vary from whisk to whisk."""
    made, radii = [], np.repeat(RADII_MM, repeats)
    angles = RATE * PUSH_S * (1.0 + SPREAD * rng.normal(size=len(radii)))
    for radius, angle in zip(radii, angles, strict=True):
        counts = contact(Whisker(), 1e-3 * radius, RATE, angle, seed=int(rng.integers(1 << 31))).counts
        counts = counts + rng.normal(0.0, 11.0, counts.shape)
        made.append(Contact(5e-4 * np.arange(len(counts)), counts, np.full(len(counts), RATE)))
    return made, radii, angles


@pytest.fixture(scope="module")
def recorded():
    rng = np.random.default_rng(1)
    return pushes(5, rng), pushes(4, rng)


@pytest.mark.parametrize("how", ["delayed", "slipped"])
def test_the_touch_is_found(recorded, how):
    (contacts, _, _), (held, _, angles) = recorded
    window = presses_of(contacts)[1]
    depths = [press_of(one, window).depth[-1] for one in spoilt(held, LEAD, how, np.random.default_rng(3), each=2)]
    off = np.array(depths) / angles - 1.0
    whole = off[1::2] if how == "slipped" else off  # one that slips may be bent most before it does
    assert off.max() < 0.06 and whole.min() > -0.06


@pytest.mark.parametrize("each", [0, 3])
@pytest.mark.parametrize("how", HOWS)
def test_sure_answers_are_right_and_most_are_sure(recorded, how, each):
    """`each`: of so many contacts of calibration one is such, too."""
    (contacts, radii, _), (held, truth, _) = recorded
    rng = np.random.default_rng(2)
    model = PressModel.fit(spoilt(contacts, LEAD, how, rng, each), radii)
    answers = [radial.estimate(model, one) for one in spoilt(held, LEAD, how, rng)]
    off = np.abs([answer.radius_mm for answer in answers] - truth)
    sure = np.array([answer.confidence > SURE for answer in answers])
    assert sure.mean() >= 0.9
    assert off[sure].max() < OFF_MM


def test_a_press_that_slips_in_part_of_the_calibration_leaves_the_others_their_depth(recorded):
    contacts, radii, angles = recorded[0]
    model = PressModel.fit(spoilt(contacts, LEAD, "slipped", np.random.default_rng(4), 3), radii)
    assert model.stages[None][-1].depth > 0.9 * angles.min()
