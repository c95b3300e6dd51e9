"""Closed loops: paired by seed, causal, and the same twice."""

import math

import numpy as np
import pytest

from crunchbot.planning.choices import Planned
from crunchbot.planning.ground import ArenaMap, Ground
from crunchbot.planning.planner import Planner
from crunchbot_lab.scenes.closed import Loop, RandomStroll
from crunchbot_lab.scenes.families import KIDNAP_LEAST_M
from crunchbot_lab.scenes.making import make, streams


def as_it_is(loop, random):
    return random


def planned(loop, random):
    return Planned(Planner(Ground.of(ArenaMap(loop.arena), loop.robot), loop.vehicle), loop.belief, random)


@pytest.mark.parametrize("family", ["anchor+global", "robot+global"])
@pytest.mark.parametrize("policy", [as_it_is, planned])
def test_a_seed_is_the_same_run_twice(family, policy):
    first, second = (Loop(family, 31, policy, 150).run() for _ in range(2))
    assert first.truth == pytest.approx(second.truth, abs=0.0) and first.lock_rows == second.lock_rows


@pytest.mark.parametrize("family", ["anchor", "raw", "robot"])
def test_readings_depend_on_nothing_later(family):
    """What the filter was given while the robot drove is what the whole path reads."""
    seen = []

    class Watched(Loop):
        def _observations(self):
            rows = super()._observations()
            seen.append((len(self._mover.path) - 1, rows))
            return rows

    Watched(family, 32, as_it_is, 120).run(until_locked=False)
    last = seen[-1][1]
    for done, rows in seen[:-1]:
        assert np.array_equal(rows.odometry[:done], last.odometry[:done])
        assert np.array_equal(rows.texture[:done], last.texture[:done], equal_nan=True)
        assert np.array_equal(rows.radial_m[:done], last.radial_m[:done], equal_nan=True)
    assert len(seen) > 3


def test_policies_of_a_seed_share_arena_and_start():
    random, other = Loop("anchor", 33, as_it_is, 60), Loop("anchor", 33, planned, 60)
    assert random.arena == other.arena == make("anchor", 33, 1).scene.arena
    assert random.run(False).truth[0, :2] == pytest.approx(other.run(False).truth[0, :2], abs=0.05)


def test_a_kidnapped_robot_is_carried_and_drives_on():
    out = Loop("anchor+kidnap", 34, as_it_is, 100).run(until_locked=False)
    assert out.begun == 300 and out.rows == 400
    jumps = np.hypot(*np.diff(out.truth[:, :2], axis=0).T)
    assert jumps.argmax() == 299 and jumps.max() > KIDNAP_LEAST_M - 0.1 and np.sort(jumps)[-2] < 0.05


def test_random_strolls_turn_as_the_walk_does():
    stroll = RandomStroll(streams(1)["path"])
    turns = np.array([stroll.turn(None, 0, 0.0, 0.0) for _ in range(200)])
    assert (np.abs(turns) >= math.pi / 3).all() and (np.abs(turns) <= math.pi).all()
    assert 60 < (turns > 0).sum() < 140 and stroll.distance(None, 0) == math.inf


def test_faults_of_rows_are_refused():
    with pytest.raises(ValueError, match="drawn beforehand"):
        Loop("anchor+dead", 1, as_it_is, 60)
