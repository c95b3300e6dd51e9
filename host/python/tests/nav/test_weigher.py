"""Weights for filters of other libraries: the library's own likelihood, row by row."""

import math

import numpy as np

from crunchbot.nav.filters import Filter
from crunchbot.nav.weigher import Weigher
from crunchbot_lab import scenes


def test_the_true_pose_weighs_more_than_any_other_place():
    made = scenes.make("anchor", 4, rows=200)
    weigher, rng = Weigher(made.scene), np.random.default_rng(1)
    ahead = []
    for k in range(200):
        if not weigher.take(made.observations, k)[1]:
            continue
        anywhere = rng.uniform((0, 0, -math.pi), (2.5, 2.5, math.pi), (50, 3))
        loglik = weigher.weigh(np.vstack([made.observations.truth[k], anywhere]))
        ahead.append(np.mean(loglik[1:] <= loglik[0]))
        assert np.isfinite(loglik[0])
        blocked = [not made.scene.arena.is_free(x, y, made.scene.robot.body_radius_m) for x, y, _ in anywhere]
        assert np.array_equal(np.isneginf(loglik[1:]), blocked)
    assert len(ahead) > 100 and np.mean(ahead) > 0.85


def test_motion_is_the_odometry_and_a_repeated_row_says_nothing():
    made = scenes.make("anchor", 4, rows=5)
    weigher = Weigher(made.scene)
    motion, news = weigher.take(made.observations, 3)
    assert news and np.array_equal(motion.step, made.observations.odometry[3])
    motion, news = weigher.take(made.observations, 3)
    assert not news and not motion.step.any()
    assert weigher.weigh(made.observations.truth[3:4])[0] == 0.0


def test_particles_weighed_from_outside_find_what_the_filter_finds():
    made = scenes.make("anchor", 4, rows=60)
    inside = Filter("particle", made.scene, {"particle.count": 4000.0}, seed=1)
    table, _ = inside.replay(made.observations, 0, 60)
    weigher, rng, count = Weigher(made.scene), np.random.default_rng(2), 4000
    poses = rng.normal(made.scene.prior.mean, made.scene.prior.sigma, (count, 3))
    for k in range(60):
        motion, _ = weigher.take(made.observations, k)
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        dx, dy, turn = motion.step
        poses += np.column_stack([c * dx - s * dy, s * dx + c * dy, np.full(count, turn)])
        poses += rng.normal(0, (motion.sigma_m, motion.sigma_m, motion.sigma_rad), (count, 3))
        weights = np.exp(weigher.weigh(poses))
        poses = poses[rng.choice(count, count, p=weights / weights.sum())]
    assert np.hypot(*(poses.mean(axis=0) - table["pose"][-1])[:2]) < 0.01
