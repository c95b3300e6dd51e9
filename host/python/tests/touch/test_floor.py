"""Floor whiskers: the rest follows the sensor's drift, and a drifted rest costs no recognition."""

import numpy as np

from crunchbot.touch.floor import STEP_COUNTS, WINDOW_SAMPLES, FloorWhisker, centred, dithered, floor_whisker
from crunchbot.touch.texture.model import TextureModel
from crunchbot.touch.texture.train import train

SPREAD = {"VINYL": 12.0, "SMOOTH": 40.0, "ROUGH": 90.0}
MIDDLE = np.array([32768.0, 32768.0])


def sensed(name: str, n: int, rng, drift: float = 0.0) -> np.ndarray:
    """Counts as the sensor gives them: in steps of 16."""
    return np.round((MIDDLE + drift + rng.normal(0, SPREAD[name], (n, 2))) / STEP_COUNTS) * STEP_COUNTS


def trained(rng) -> TextureModel:
    recordings = {name: [centred(sensed(name, 4000, rng, d), MIDDLE, rng) for d in (-20, 0, 20)] for name in SPREAD}
    return TextureModel.train(recordings, rest=MIDDLE)


def test_dither_fills_the_steps_and_keeps_the_mean():
    spread = dithered(np.full(100_000, 48.0), np.random.default_rng(1)) - 48.0
    assert abs(spread.mean()) < 0.1
    assert STEP_COUNTS / 2 - 0.1 < spread.max() <= STEP_COUNTS / 2
    assert -STEP_COUNTS / 2 <= spread.min() < 0.1 - STEP_COUNTS / 2


def test_recordings_are_centred_each_for_itself():
    rng = np.random.default_rng(2)
    assert np.allclose(centred(sensed("ROUGH", 5000, rng, 300.0), MIDDLE, rng).mean(axis=0), MIDDLE, atol=0.5)


def test_rest_follows_drift_and_one_block_moves_it_little():
    rng = np.random.default_rng(3)
    whisker = FloorWhisker(trained(rng), rng)
    whisker.follow(np.tile(MIDDLE + 100, (40, 1)))
    assert np.all(np.abs(whisker.rest - MIDDLE) < 3.0)
    for _ in range(1000):
        whisker.follow(np.tile(MIDDLE + 100, (40, 1)))
    assert np.allclose(whisker.rest, MIDDLE + 100, atol=2.5)
    rest = whisker.rest.copy()
    whisker.follow(np.empty((0, 2)))
    assert np.array_equal(whisker.rest, rest)


def test_surfaces_are_reported_apart_about_a_drifted_rest():
    rng = np.random.default_rng(4)
    whisker = FloorWhisker(trained(rng), rng)
    drift = 27.0  # not a multiple of the step, and more than vinyl's own spread
    for _ in range(1000):
        whisker.follow(sensed("VINYL", 40, rng, drift))
    for index, name in enumerate(SPREAD):
        right = [whisker.loglik(sensed(name, 200, rng, drift)).argmax() == index for _ in range(50)]
        assert np.mean(right) >= 0.98, name


def test_a_window_with_too_few_good_samples_says_nothing():
    rng = np.random.default_rng(5)
    whisker = floor_whisker(trained(rng), rng)
    window = sensed("ROUGH", WINDOW_SAMPLES, rng)
    window[:40] = np.nan
    assert whisker.look(window).argmax() == 2
    window[:60] = np.nan
    assert whisker.look(window) is None


def rubbed(name: str, n: int, rng, drift: float = 0.0) -> np.ndarray:
    """Surfaces that differ in spectrum, not only in spread."""
    keep = {"VINYL": 0.0, "SMOOTH": 0.7, "ROUGH": 0.95}[name]
    noise = rng.normal(0, 40, (n + 200, 2))
    for k in range(1, len(noise)):
        noise[k] += keep * noise[k - 1]
    return np.round((MIDDLE + drift + noise[200:]) / STEP_COUNTS) * STEP_COUNTS


def test_the_spectral_way_needs_no_rest():
    rng = np.random.default_rng(6)
    model = train({name: [rubbed(name, 4000, rng) for _ in range(3)] for name in SPREAD}, 2000.0)
    whisker = floor_whisker(model, rng)
    for index, name in enumerate(SPREAD):
        whisker.pause()
        right = [whisker.look(rubbed(name, WINDOW_SAMPLES, rng, 500.0)).argmax() == index for _ in range(30)]
        assert np.mean(right) >= 0.95, name
    assert whisker.look(np.full((WINDOW_SAMPLES, 2), np.nan)) is None


def test_a_floor_never_trained_is_no_evidence_for_any_that_was():
    rng = np.random.default_rng(7)
    model = train({name: [rubbed(name, 4000, rng) for _ in range(3)] for name in ("VINYL", "ROUGH")}, 2000.0)
    whisker = floor_whisker(model, rng)
    assert [whisker.look(rubbed("SMOOTH", WINDOW_SAMPLES, rng)) for _ in range(9)][4:] == [None] * 5
    assert not whisker.silent  # or the pilot would take it for a catch
    assert whisker.look(np.full((WINDOW_SAMPLES, 2), 32768.0)) is None and whisker.silent
    whisker.pause()
    assert whisker.look(rubbed("VINYL", WINDOW_SAMPLES, rng)).argmax() == 0
