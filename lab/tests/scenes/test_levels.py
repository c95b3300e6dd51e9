"""Level 0 and level 1 agree: texture confusions, distances, misses and the timing of contacts of the `robot` family
agree with signal-level runs of the same robot in the same arenas. Tolerances are stated where they are used.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from crunchbot.pilot.pilot import Pilot
from crunchbot.pilot.states import PLAIN
from crunchbot.robot.models import load_models
from crunchbot_lab import scenes
from crunchbot_lab.demo import kept_models
from crunchbot_lab.demo.level1 import explore
from crunchbot_lab.scenes import geometry
from crunchbot_lab.simulation.scenes import make_scene

SEEDS = (31, 32, 33, 34)
ROWS = 1200
TICKS_PER_ROW = 200
CLASSES = 3


@dataclass
class Reported:
    """What one level says of a run: texture (n, tips, classes), radial_m (n, rays), odometry and truth (n, 3)."""

    scene: object
    texture: np.ndarray
    radial_m: np.ndarray
    odometry: np.ndarray
    truth: np.ndarray


@pytest.fixture(scope="module")
def signals(tmp_path_factory):
    """Signal-level runs. One robot: what it learnt once serves in every arena."""
    folder = tmp_path_factory.mktemp("models")
    scene = robot_in(SEEDS[0])[0]
    kept_models.learn_or_copy(folder, scene, SEEDS[0], lambda: None)
    return [signal_run(seed, folder) for seed in SEEDS]


def robot_in(seed):
    """The seed's arena and start, with the whiskers of the first."""
    scene, start = make_scene(seed)
    return replace(scene, simulated=make_scene(SEEDS[0])[0].simulated), start


def signal_run(seed, folder):
    scene, start = robot_in(seed)
    pilot = Pilot(scene.robot, *load_models(folder, scene.robot), seed, habits=PLAIN)  # as level 0 behaves
    rows, truth = explore(scene, start, pilot, seed, ROWS * TICKS_PER_ROW)
    nan = math.nan
    tips, rays = scene.robot.of_role("texture"), scene.robot.of_role("object")
    keys = [[f"{w.name}_{t}" for t in scene.arena.textures] for w in tips]
    texture = [[[nan if r[k] is None else r[k] for k in names] for names in keys] for r in rows]
    radial = [[math.inf if r[f"{w.name}_mm"] is None else r[f"{w.name}_mm"] / 1000 for w in rays] for r in rows]
    odometry = [[r[k] for k in ("odo_x_m", "odo_y_m", "odo_theta_rad")] for r in rows]
    poses = [[t[k] for k in ("x_m", "y_m", "theta_rad")] for t in truth]
    return Reported(scene, *map(np.array, (texture, radial, odometry, poses)))


@pytest.fixture(scope="module")
def drawn():
    """Level-0 runs of the `robot` family."""
    made = [scenes.make("robot", seed, ROWS) for seed in SEEDS]
    return [
        Reported(
            m.scene, m.observations.texture, m.observations.radial_m, m.observations.odometry, m.observations.truth
        )
        for m in made
    ]


def confusion(runs):
    """Counts by true and reported texture, and lengths of runs of wrong windows."""
    counts, lengths = np.zeros((CLASSES, CLASSES)), []
    for reported in runs:
        for n, whisker in enumerate(reported.scene.robot.of_role("texture")):
            true = geometry.textures(reported.scene.arena, reported.truth, whisker)[0]
            read = np.isfinite(reported.texture[:, n]).all(axis=1)
            said = np.argmax(np.nan_to_num(reported.texture[:, n], nan=-np.inf), axis=1)
            np.add.at(counts, (true[read], said[read]), 1)
            wrong = np.diff(np.concatenate([[0], (read & (said != true)).astype(int), [0]]))
            lengths += (np.nonzero(wrong < 0)[0] - np.nonzero(wrong > 0)[0]).tolist()
    return counts, lengths


def test_texture_confusions_agree(signals, drawn):
    """Share right overall within 0.03, of each texture within 0.06; runs of wrong windows as long but for a factor 1.6."""
    (one, runs), (other, lengths) = confusion(signals), confusion(drawn)
    right = [np.diag(c) / c.sum(axis=1) for c in (one, other)]
    assert np.trace(one) / one.sum() == pytest.approx(np.trace(other) / other.sum(), abs=0.03)
    assert right[0] == pytest.approx(right[1], abs=0.06)
    assert 1 / 1.6 < np.mean(runs) / np.mean(lengths) < 1.6


def test_windows_are_as_far_apart(signals, drawn):
    """The margin of the best over the second class: median but for a factor 1.5."""

    def margins(runs):
        ordered = np.sort(np.concatenate([t.texture[np.isfinite(t.texture).all(axis=2)] for t in runs]), axis=1)
        return np.median(ordered[:, -1] - ordered[:, -2])

    assert 1 / 1.5 < margins(signals) / margins(drawn) < 1.5


def distances(runs):
    """Errors in m of the distances reported, against the true range with a little longer whisker; nan where it meets nothing."""
    errors = []
    for reported in runs:
        for n, whisker in enumerate(reported.scene.robot.of_role("object")):
            true = geometry.ranges(
                reported.scene.arena, reported.truth, replace(whisker, length_m=whisker.length_m + 0.03)
            )
            contact = np.isfinite(reported.radial_m[:, n])
            errors += (reported.radial_m[contact, n] - true[contact]).tolist()
    return np.array(errors)


def test_radial_errors_agree(signals, drawn):
    """Median size of the error within 1 mm, at most 2 mm on both levels; one in ten may miss its object or be a corner."""
    one, other = (np.abs(distances(runs)) for runs in (signals, drawn))
    assert abs(np.median(one) - np.median(other)) < 0.001
    for errors in (one, other):
        assert np.median(errors) < 0.002
        assert np.mean(errors < 0.008) > 0.85


def test_misses_agree(signals, drawn):
    """No level says "no contact" of a whisker that is pressed by more than 3 mm, but in one row of a hundred such."""
    for runs in (signals, drawn):
        pressed = missed = 0
        for reported in runs:
            for n, whisker in enumerate(reported.scene.robot.of_role("object")):
                deep = geometry.ranges(reported.scene.arena, reported.truth, whisker) < whisker.length_m - 0.003
                pressed += deep.sum()
                missed += (deep & np.isposinf(reported.radial_m[:, n])).sum()
        assert pressed > 100
        assert missed <= 0.01 * pressed


def test_timing_of_contacts_agrees(signals, drawn):
    """Distances reported per minute but for a factor 1.5; shares of rows read, held back and unread within 0.08."""

    def rates(runs):
        reported = sum(np.isfinite(t.radial_m).sum() for t in runs)
        held = np.mean([np.mean(~t.odometry.any(axis=1)) for t in runs])
        windows = np.mean([np.mean(np.isfinite(t.texture).all(axis=2)) for t in runs])
        unread = np.mean([np.mean(np.isnan(t.radial_m)) for t in runs])
        return reported, np.array([held, windows, unread])

    (reported, shares), (drawn_reported, drawn_shares) = rates(signals), rates(drawn)
    assert 1 / 1.5 < reported / drawn_reported < 1.5
    assert shares == pytest.approx(drawn_shares, abs=0.08)


def test_odometry_errors_agree(signals, drawn):
    """Relative error of distances over 5 s: root mean square but for a factor 2."""

    def relative(runs):
        out = []
        for reported in runs:
            for first in range(0, ROWS - 50, 50):
                true = np.hypot(*np.diff(reported.truth[first : first + 51, :2], axis=0).T).sum()
                said = np.hypot(*reported.odometry[first + 1 : first + 51, :2].T).sum()
                if true > 0.5:
                    out.append(said / true - 1.0)
        return np.sqrt(np.mean(np.square(out)))

    assert 0.5 < relative(signals) / relative(drawn) < 2.0
