"""Level-0 scenes: the same seed gives the same scene, files keep every bit, true poses stand clear."""

import numpy as np
import pytest

from whisker import localise, scenes
from whisker.scene import load

FIELDS = ("t_s", "odometry", "texture", "radial_m", "truth")


@pytest.mark.parametrize("family", ["anchor", "anchor+global", "anchor+kidnap"])
def test_a_written_scene_reads_back_bit_by_bit(family, tmp_path):
    made = scenes.make(family, 5)
    scenes.write_scene(tmp_path, made.scene, made.observations)
    scene = load(tmp_path)
    observations = localise.read_observations(localise.observations_path(tmp_path), scene)
    assert scene == made.scene
    assert observations.t_text == made.observations.t_text
    for field in FIELDS:
        assert np.array_equal(getattr(observations, field), getattr(made.observations, field), equal_nan=True)


def test_one_seed_draws_one_world_whatever_the_modifiers():
    one, other = scenes.make("anchor", 6), scenes.make("anchor+global", 6)
    assert one.scene.arena == other.scene.arena and other.scene.prior.kind == "uniform"
    for field in FIELDS:
        assert np.array_equal(getattr(one.observations, field), getattr(other.observations, field), equal_nan=True)


def test_a_kidnap_carries_the_robot_far_and_odometry_does_not_know():
    made = scenes.make("anchor+kidnap", 7)
    row = made.kidnaps[0]
    truth = made.observations.truth[:, :2]
    assert np.hypot(*(truth[row] - truth[row - 1])) > 0.75
    assert np.hypot(*made.observations.odometry[row, :2]) < 0.05


def test_an_unknown_family_is_named():
    with pytest.raises(scenes.FamilyError, match="anchor"):
        scenes.make("nowhere", 1)
    with pytest.raises(scenes.FamilyError, match="global"):
        scenes.make("anchor+nothing", 1)
