"""What a whisker felt, carried on with the robot."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from whisks import whisks

from crunchbot.pilot.feel import LEAST_TICKS, Drives, Feeler, Felt
from crunchbot.scene import Whisker
from crunchbot.touch.contact_filter import Reports
from crunchbot.touch.radial import model as radial


def test_motion_is_that_of_the_orders_in_effect():
    drives = Drives()
    drives.order(101, (0.2, 0.0))
    drives.order(101, (0.2, 0.0))
    drives.order(301, (0.0, math.pi))
    assert drives.at(np.array([50, 101, 300, 301]))[:, 0].tolist() == [0.0, 0.2, 0.2, 0.0]
    assert drives.since(0, 300) == pytest.approx([0.02, 0.0, 0.0])  # 200 ticks of 0.5 ms
    assert drives.since(200, 1300) == pytest.approx([0.01, 0.0, math.pi / 2])
    assert drives.since(300, 300).tolist() == [0.0, 0.0, 0.0]


def test_motion_along_an_arc_ends_where_the_circle_does():
    drives = Drives()
    drives.order(1, (0.1, 1.0))
    assert drives.since(0, 2000) == pytest.approx([0.1 * math.sin(1.0), 0.1 * (1.0 - math.cos(1.0)), 1.0], abs=1e-8)


def test_what_was_felt_stays_where_it_is_while_the_robot_moves():
    felt = Felt(0, (0.2, 0.1), 0.001, math.pi, 0.05, 1.0)
    after = felt.after(np.array([0.05, 0.0, math.pi / 2]), 200)
    assert after.point == pytest.approx((0.1, -0.15)) and after.tick == 200
    assert after.normal == pytest.approx(math.pi / 2) and after.point_sd == felt.point_sd


def report(**known: float) -> Reports:
    """One report of a corner 0.1 m along the whisker."""
    made = {name: np.zeros(1) for name in Reports._fields} | {name: np.full(1, value) for name, value in known.items()}
    cov = 1e-6 * np.eye(2)[None] * made.pop("variance", np.ones(1))
    return Reports(**made | {"sample": np.zeros(1, int), "point": np.array([[0.1, 0.0]]), "point_cov": cov})


@pytest.fixture
def feeler(monkeypatch) -> tuple[Feeler, list[Reports]]:
    """A whisker that touches from tick 0, and what its filter will report."""
    made = Feeler(
        Whisker("front", "object", None, (0.0, 0.0), 0.0, 0.14),
        1.0,
        radial.fit(whisks(np.random.default_rng(3), 5), "linear").model.plug,
        1.0,
    )
    to_come: list[Reports] = []
    made._filter = SimpleNamespace(begin=lambda: None, run=lambda *_: to_come.pop(0))
    return made, to_come


def touched(feeler: Feeler, bend: float) -> None:
    ticks, contact = LEAST_TICKS + np.arange(20), SimpleNamespace(touching=True, onset=0, rest=np.zeros(2))
    feeler.block(ticks, np.full((20, 2), bend), np.ones(20, bool), contact, Drives())


def test_what_is_not_sure_is_not_felt_but_does_not_undo_what_was(feeler):
    felt, to_come = feeler
    to_come += [report(), report(variance=100.0)]
    touched(felt, 0.0)
    assert felt.felt is not None and felt.last == felt.felt and math.isnan(felt.felt.normal)
    touched(felt, 100.0)
    assert felt.felt is None and felt.last is not None


def test_a_contact_that_nothing_explains_any_more_is_undone(feeler):
    felt, to_come = feeler
    to_come += [report(), report(other=0.9)]
    touched(felt, 0.0)
    touched(felt, 500.0)
    assert felt.felt is None and felt.last is None


@pytest.mark.parametrize(("sd", "known"), [(0.1, True), (0.2, False)])
def test_a_normal_is_told_where_it_is_known(feeler, sd, known):
    felt, to_come = feeler
    to_come.append(report(tip=1.0, normal_sd=sd))
    touched(felt, 100.0)
    assert math.isfinite(felt.felt.normal) == known
