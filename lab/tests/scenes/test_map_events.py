"""Kidnaps while mapping: noticed when they are, not said when they are not; the map of before is kept, and found again."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from mapkit import MANY, SEEDS, mapped

from crunchbot import cli
from crunchbot.nav import mapping
from crunchbot.nav.mapper import Mapper, OneMap
from crunchbot.nav.observations import stretch
from crunchbot.scene import load
from crunchbot_lab.scenes import map_scoring, own_map, write_scene

ROWS, CARRIED = 3000, "free+carried"
NOTICED = 8  # of MANY scenes, at least
FOUND = 28 / 50  # old places, of ten maps with the filter's seeds 0 to 4
CHANCE = 1e-3  # that the test fails where so many are found
DRAWS = range(2)  # seeds of the filter


def fewest(runs: int, share: float, chance: float) -> int:
    """Most successes of which fewer have at most this chance. The maps of a test are given, and most are found with every
    seed or with none: successes vary less than independent ones do."""
    below = 0.0
    for n in range(runs + 1):
        below += math.comb(runs, n) * share**n * (1.0 - share) ** (runs - n)
        if below > chance:
            return n
    return runs


def noticed():
    """Scene, map and seed of those in which the kidnap was noticed."""
    runs = [(*mapped(CARRIED, seed, ROWS), seed) for seed in MANY]
    return [(made, run, seed) for made, run, seed in runs if len(run.parts) == 2 and run.parts[1].noticed >= 1500]


def test_a_kidnap_is_noticed():
    runs = [(made.kidnaps[0], run.parts[1:]) for made, run in (mapped(CARRIED, seed, ROWS) for seed in MANY)]
    late = [next((part.noticed - row for part in parts if part.noticed >= row), ROWS) for row, parts in runs]
    assert sum(rows < ROWS for rows in late) >= NOTICED and np.median(late) < 300.0
    assert not [part for row, parts in runs for part in parts if part.noticed < row]


def test_a_new_map_begins_in_a_frame_of_its_own():
    made, run, _ = noticed()[0]
    old, new = run.parts
    assert (old.number, old.first, new.number) == (0, 0, 1) and 1400 <= new.first <= new.noticed
    assert run.touched.frame == 1 and not run.frame[: new.noticed].any() and run.frame[new.noticed :].all()
    known = np.isfinite(run.poses()).all(axis=1)
    assert not known[: new.noticed].any() and known[new.noticed :].all()
    (before,) = run.before()
    known = np.isfinite(before.poses()).all(axis=1)
    assert known[: new.first].all() and not known[new.first :].any()
    first, truth = made.kidnaps[0], made.observations.truth
    assert map_scoring.trajectory(before.poses()[:first], truth[:first])["error_median_m"] < 0.1


def test_a_map_that_is_lost_is_the_one_of_before_and_takes_no_more():
    made, run, _ = noticed()[0]
    rows, until = made.observations, run.parts[1].noticed + 1
    one = OneMap(made.scene.robot, made.scene.arena.textures)
    one.replay(rows, 0, until - 1)
    assert one.lost is None
    table, _ = one.replay(rows, until - 1, 11)
    assert one.lost == (run.parts[1].first, run.parts[1].noticed)
    assert (table["confidence"] == 0.0).all() and len(np.unique(table["pose"], axis=0)) == 1
    assert np.array_equal(one.map().faces, run.parts[0].touched.faces)


def test_rows_one_by_one_give_the_same_maps():
    made, run, _ = noticed()[0]
    mapper, rows = Mapper(made.scene.robot, made.scene.arena.textures), made.observations
    poses = np.concatenate([mapper.replay(rows, row, 1)[0]["pose"] for row in range(ROWS)])
    assert np.array_equal(poses, run.table["pose"])
    for one, other in zip(mapper.parts(), run.parts, strict=True):
        assert (one.first, one.noticed) == (other.first, other.noticed)
        assert np.array_equal(one.touched.faces, other.touched.faces)
    assert (mapper.bad_cells, mapper.bad_rows) == (run.bad_cells, run.bad_rows)


@pytest.mark.parametrize(
    ("family", "most"),
    [
        ("anchor", 0),
        ("anchor+slip", 1),
        ("anchor+moving-box", 0),
        ("anchor+renamed", 1),
        ("anchor+silent-minute", 0),
    ],
)
def test_nothing_is_noticed_where_nobody_was_carried(family, most):
    found = [mapped(family, seed, ROWS)[1] for seed in SEEDS]
    assert sum(run.frame.any() for run in found) <= most


def test_the_old_place_is_found_in_the_map_that_was_kept(tmp_path):
    """From the folder of the map before the kidnap, start unknown."""
    found = []
    for made, run, seed in noticed():
        mapping.write_map(tmp_path / str(seed), run)
        own = own_map.OwnMap.of(run.before()[0])
        assert load(tmp_path / str(seed) / "part-0").arena == own.arena
        since = replace(made, observations=stretch(made.observations, made.kidnaps[0], ROWS))
        places = own.places(since.observations.truth)
        found += [own_map.located(own.arena, since, places, draws) for draws in DRAWS]
    near = sum(one.rows_to_lock is not None and one.error_m < 0.1 for one in found)
    assert near >= fewest(len(found), FOUND, CHANCE)


def test_the_folder_says_when_and_the_command_too(tmp_path, capsys):
    made, run, _ = noticed()[0]
    write_scene(tmp_path / "scene", made.scene, made.observations)
    assert cli.main(["map", str(tmp_path / "scene"), "--out", str(tmp_path / "map"), "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    first, at = run.parts[1].first, run.parts[1].noticed
    assert reported["parts"] == 2 and reported["lost_s"] == [round(float(made.observations.t_s[at]), 3)]
    lines = (tmp_path / "map/parts.csv").read_text().splitlines()
    assert lines == ["part,first_row,noticed_row", "0,0,0", f"1,{first},{at}"]
    assert {"arena.toml", "faces.csv", "map.yaml"} <= {path.name for path in (tmp_path / "map/part-0").iterdir()}


def test_a_drive_is_located_in_the_map_that_the_robot_made():
    _, run = mapped("anchor", 4, ROWS)
    (drive,) = own_map.score(run, "anchor", 4, 1)
    assert drive.own.rows_to_lock is not None and drive.true.rows_to_lock is not None
    assert drive.own.error_m < 0.06 and drive.true.error_m < 0.02
