"""The pilot's choices by name, and a belief that odometry moves on."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from crunchbot.observation import EXPLORING, Quantity, Row
from crunchbot.planning.choices import Planned
from crunchbot.robot.policy import AGE_ROWS, POLICIES, FollowedBelief, choices_of, expected, taker_of
from crunchbot_lab.simulation.scenes import make_scene


class Line:
    """A link whose inbox gives what it is handed."""

    def __init__(self):
        self.waiting = []

    def subscribe(self, topic):
        assert topic == "belief"
        return self

    def take(self, timeout_s):
        assert timeout_s == 0.0
        came, self.waiting = self.waiting, []
        return came

    def send(self, seq, *poses, over=False):
        x, y, theta = np.array(poses, "f4").reshape(-1, 3).T
        weight = np.full(len(x), 1.0 / max(len(x), 1), "f4")
        belief = SimpleNamespace(observation_seq=seq, x=x, y=y, theta=theta, weight=weight)
        self.waiting.append(SimpleNamespace(over=over, message=belief))


def test_a_belief_is_moved_by_what_was_driven_since_its_row():
    line = Line()
    belief = FollowedBelief(line)
    belief.row(0, (1.0, 2.0, math.pi / 2), None)
    line.send(0, (0.5, 0.5, 0.0), (1.0, 1.0, math.pi))
    belief.row(1, (1.0, 2.3, math.pi), None)  # 0.3 m ahead, then a quarter turn
    got = belief()
    assert got["pose"] == pytest.approx(np.array([[0.8, 0.5, math.pi / 2], [0.7, 1.0, 1.5 * math.pi]]), abs=1e-6)
    assert got["mass"].sum() == pytest.approx(1.0)


def test_without_a_belief_of_late_there_is_none():
    line = Line()
    belief = FollowedBelief(line)
    belief.row(0, np.zeros(3), None)
    assert belief() is None
    line.send(0, (0.5, 0.5, 0.0))
    assert belief() is not None
    for seq in range(1, AGE_ROWS + 1):
        belief.row(seq, np.zeros(3), None)
    assert belief() is None
    line.send(AGE_ROWS)
    assert belief() is None
    line.send(AGE_ROWS, (0.5, 0.5, 0.0), over=True)
    assert belief() is None


def test_every_name_is_a_policy():
    scene, _ = make_scene(1)
    random = object()
    made = [choices_of(name, scene, taker_of(name, scene, Line(), 1), random) for name in POLICIES]
    assert made[0] is random and isinstance(made[1], Planned) and len({type(one) for one in made}) == len(POLICIES)


def rows_of(scene, count):
    """Rows of a robot that drives straight on over ROUGH and meets nothing."""
    textures, names = scene.layout.of(Quantity.TEXTURE), scene.layout.names
    cells = [(1.0 if name.endswith("ROUGH") else -1.0) if name in textures else None for name in names]
    return [
        Row.made(EXPLORING, round(0.1 * (n + 1), 4), np.array([0.015, 0.0, 0.0]), names, cells) for n in range(count)
    ]


def test_a_map_of_the_pilots_own_follows_its_rows():
    scene, _ = make_scene(1)
    own = taker_of("map", scene, Line(), 1)
    assert own.pose() is None
    for seq, row in enumerate(rows_of(scene, 40)):
        own.row(seq, np.zeros(3), row)
    assert own.pose() == pytest.approx((0.6, 0.0, 0.0), abs=0.02)
    assert own.map().grid.occupied.size and own.map().frame == 0


def test_a_belief_is_taken_around_its_heaviest_component():
    scene, _ = make_scene(1)
    line = Line()
    taker = taker_of("check", scene, line, 1)
    assert taker.estimate() is None
    checking = choices_of("check", scene, taker, object(), (2, 1))
    taker.row(0, np.zeros(3), rows_of(scene, 1)[0])
    line.send(0, (1.0, 1.0, 3.1), (1.02, 1.0, -3.1), (1.0, 1.02, 3.1), (2.0, 2.0, 0.0))
    pose, covariance, mass = taker.estimate()
    assert (
        pose[:2] == pytest.approx((1.0067, 1.0067), abs=1e-3)
        and abs(math.remainder(pose[2] - 3.128, 2 * math.pi)) < 0.01
    )
    assert mass == pytest.approx(0.75) and covariance[0, 0] < 1e-3
    assert expected(checking) == {"tile": "2,1: not known yet", "expects": "no pose yet"}
    with pytest.raises(ValueError, match="outside the floor's 5 x 5"):
        choices_of("check", scene, taker, object(), (5, 1))


def test_what_is_expected_is_said_of_a_planner_alone():
    scene, _ = make_scene(1)
    line = Line()
    belief = FollowedBelief(line)
    planned = choices_of("plan", scene, belief, object())
    assert expected(object()) == {} and expected(planned) == {"expects": "no belief yet"}
    belief.row(0, np.zeros(3), None)
    rng = np.random.default_rng(1)
    line.send(0, *rng.uniform((0.3, 0.3, -3.0), (2.2, 2.2, 3.0), (200, 3)))
    nowhere = SimpleNamespace(place=(0.0, 0.0), things=lambda: np.zeros((0, 2)), been=lambda: np.zeros((0, 3)))
    planned.turn(SimpleNamespace(whereabouts=nowhere), 0, 25.0, 90.0)
    assert planned.plan.bits > 0.0 and expected(planned)["expects"].startswith(f"{planned.plan.bits:.1f} bits in ")
