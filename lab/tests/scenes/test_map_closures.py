"""Loops that close by faces, corners and tiles: rates over seeds, held against what the mapper itself says of them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from crunchbot.nav import mapping
from crunchbot.nav.mapper import LOOP, LOOP_KINDS
from crunchbot_lab.scenes import map_events, map_meetings
from crunchbot_lab.scenes.making import make

SEEDS = range(60, 66)
DOUBT = 0.02  # of a closure, at most: NAV_CLOSURE_FALSE in host/nav/mapping/loops/closure.h
SIGMAS = 3.0  # of a count


def mapped(family: str, seed: int, rows: int = 3000):
    made = make(family, seed, rows)
    return made, mapping.run(made.scene.robot, made.scene.arena.textures, made.observations, seed)


@pytest.fixture(scope="module")
def runs():
    return [mapped(family, seed) for family in ("anchor", "free") for seed in SEEDS]


def counted(runs, kind: str) -> tuple[int, int, float]:
    """Closures of a kind, how many are false, and how many the mapper expects to be."""
    count, false, stated = 0, 0, 0.0
    for made, run in runs:
        mine = map_events.judged(run, made.scene.arena, kind)
        loops = run.touched.loops[run.touched.loops["kind"] == LOOP_KINDS.index(kind)]
        count, false = count + len(mine), false + sum(not one.right for one in mine)
        stated += float((1.0 - loops["probability"]).sum())
    return count, false, stated


@pytest.mark.parametrize(
    ("kind", "least", "share"), [("face", 120, 0.015), ("corner", 2, 0.01), ("texture", 250, 0.0075)]
)
def test_false_closures_are_as_rare_as_they_are_said_to_be(runs, kind, least, share):
    """share: of false ones, on other seeds of more families; a sample may exceed it by chance, and no mapper may say that
    it is far smaller."""
    count, false, stated = counted(runs, kind)
    assert count >= least and share * count / 2 < stated <= DOUBT * count
    assert false <= stated + SIGMAS * math.sqrt(stated + 1.0)
    assert false <= share * count + SIGMAS * math.sqrt(share * count + 1.0)


def test_meetings_are_closed(runs):
    scores = [map_events.closures_score(run, made.scene.arena) for made, run in runs]
    known = {key: [s[key] for s in scores if s[key] is not None] for key in scores[0]}
    assert np.mean(known["closures_recall"]) > 0.2 and np.mean(known["texture_closures_recall"]) > 0.75
    assert np.mean(known["corner_closures_recall"]) > 0.02


def test_closures_come_in_order_and_are_of_one_time_each(runs):
    for _, run in runs:
        loops = run.touched.loops
        assert (np.diff(loops["to"]) >= 0).all() and (loops["from"] < loops["to"]).all()
        assert (loops["probability"] > 1.0 - DOUBT).all() and set(loops["kind"]) <= {0, 1, 2}
        for kind in range(3):
            mine = loops[loops["kind"] == kind]
            assert len({(loop["from"], loop["x"], loop["y"]) for loop in mine}) == len(mine)


@pytest.mark.parametrize("kind", LOOP_KINDS)
def test_closures_of_another_thing_are_counted_as_false(runs, kind):
    made, run = max(runs, key=lambda both: (both[1].touched.loops["kind"] == LOOP_KINDS.index(kind)).sum())
    loops = run.touched.loops.copy()
    for name in ("from", "from_x", "from_y"):
        loops[name] = np.roll(loops[name], 3)
    found = map_events.judged(replace(run, touched=replace(run.touched, loops=loops)), made.scene.arena, kind)
    assert found and np.mean([one.right for one in found]) < 0.6
    none = replace(run, touched=replace(run.touched, loops=np.zeros(0, LOOP)))
    before = "" if kind == "face" else f"{kind}_"
    scored = map_events.closures_score(none, made.scene.arena)
    assert scored[f"{before}closures"] == 0.0 and scored[f"{before}closures_right"] is None
    assert scored[f"{before}closures_recall"] == 0.0


def test_the_folder_has_the_kind_of_each(runs, tmp_path):
    made, run = runs[0]
    mapping.write_map(tmp_path, run)
    head, *lines = (tmp_path / "closures.csv").read_text().splitlines()
    assert head == "kind,t_s,from_t_s,x_m,y_m,from_x_m,from_y_m,probability"
    assert [line.split(",")[0] for line in lines] == [LOOP_KINDS[n] for n in run.touched.loops["kind"]]


def test_corners_of_the_truth_are_where_faces_meet():
    made = make("anchor", 1, 10)
    arena = made.scene.arena
    found = map_meetings.corners(arena)
    assert {(0.0, 0.0), (2.5, 0.0), (0.0, 2.5), (2.5, 2.5)} <= {(x, y) for x, y, _, _ in found}
    x0, y0, x1, y1 = arena.obstacles[0]
    assert {(x0, y0), (x1, y0), (x0, y1), (x1, y1)} <= {(x, y) for x, y, _, _ in found}
