"""The mapper over loopback: what `whisker map` gives, again after it was killed, and a map folder at the end."""

import numpy as np
import pytest
from patience import PATIENCE_S
from robotkit import Robot, take_until, to_rows

from crunchbot import scene as scene_folder
from crunchbot.nav import localise, mapping
from crunchbot.robot.journal import RECORD, Journal
from crunchbot.robot.network.ranges import GRID_MOST
from crunchbot_lab import scenes

ROWS = 400


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A scene folder without an arena, its rows, and what `whisker map` makes of them."""
    folder = tmp_path_factory.mktemp("scene")
    made = scenes.make("anchor", 4, ROWS)
    scenes.write_scene(folder, made.scene, scenes.files.rounded(made.observations))
    scene = scene_folder.load(folder)
    rows = to_rows(localise.read_observations(localise.observations_path(folder), scene), scene)
    (folder / "arena.toml").unlink()
    return folder, rows, mapping.run(*mapping.read(folder), quiet=True)


def poses_of(got) -> np.ndarray:
    return np.array([r.message.pose.pose.xytheta for r in got if r.topic == "pose" and not r.over])


def all_over(count: int):
    return lambda got: sum(r.over for r in got) == count


def assert_same(poses: np.ndarray, expected: np.ndarray) -> None:
    """Rows on the network have six digits."""
    assert np.abs(poses[:, :2] - expected[:, :2]).max() < 1e-3
    assert np.abs(np.remainder(poses[:, 2] - expected[:, 2] + np.pi, 2 * np.pi) - np.pi).max() < 1e-3


def test_the_process_gives_what_map_gives_and_writes_the_folder(made, tmp_path):
    folder, rows, alone = made
    answers = ("pose", "localisation", "belief", "map", "touch_map")
    with Robot(*answers) as robot, robot.started("mapper", folder, "--out", tmp_path / "map") as child:
        robot.send(rows)
        robot.rows.end("enough")
        got = take_until(robot.inbox, all_over(len(answers)), PATIENCE_S)
        assert child.wait(PATIENCE_S) == 0
    assert_same(poses_of(got), alone.table["pose"])
    reported = [r.message for r in got if r.topic == "localisation" and not r.over]
    assert {(x.filter, x.prior, x.rows_missed) for x in reported} == {("mapper", "origin", 0)}
    maps = [r.message for r in got if r.topic == "touch_map" and not r.over]
    assert [x.observation_seq for x in maps] == list(range(0, ROWS, 10))
    assert len(maps[-1].face_x0) > len(maps[0].face_x0) == 0
    assert maps[-1].textures == ["VINYL", "SMOOTH", "ROUGH"]
    grids = [r.message for r in got if r.topic == "map" and not r.over]
    assert grids[-1].info.width * grids[-1].info.height == len(grids[-1].data) < GRID_MOST
    assert {-1} < set(grids[-1].data.tolist()) and grids[-1].data.max() > 60 and (grids[-1].data == 0).any()
    assert scene_folder.load(tmp_path / "map").arena.textures == ("VINYL", "SMOOTH", "ROUGH")
    assert len((tmp_path / "map/est.csv").read_text().splitlines()) == ROWS + 1


def test_one_that_was_killed_goes_on_with_the_same_map(made, tmp_path):
    folder, rows, alone = made
    options = ["--journal", tmp_path / "journal", "--out", tmp_path / "map"]
    with Robot("localisation") as robot:
        with robot.started("mapper", folder, *options):
            robot.send(rows[:200])
            take_until(robot.inbox, lambda got: sum(r.topic == "localisation" for r in got) == 200, PATIENCE_S)
        assert robot.link.wait_gone("mapper", PATIENCE_S)
        with robot.started("mapper", folder, *options) as child:
            robot.send(rows[200:])
            robot.rows.end()
            got = take_until(robot.inbox, all_over(1), PATIENCE_S)
            assert child.wait(PATIENCE_S) == 0
    later = [r.message for r in got if not r.over and r.message.observation_seq >= 200]
    assert_same(np.array([x.pose.pose.xytheta for x in later]), alone.table["pose"][200:])
    assert {x.prior for x in later} == {"checkpoint"}
    assert len((tmp_path / "map/est.csv").read_text().splitlines()) == ROWS + 1


def test_a_damaged_journal_is_gone_on_from_where_it_is_whole(made, tmp_path):
    folder, rows, _ = made
    robot_of_folder = mapping.read(folder)[0]
    path = tmp_path / "journal"
    with Robot("pose") as robot, robot.started("mapper", folder, "--journal", path):
        robot.send(rows[:20])
        take_until(robot.inbox, lambda got: len(got) == 20, PATIENCE_S)
    whole = path.read_bytes()
    first = Journal(path, robot_of_folder)
    first.close()
    assert [one.message.seq for one in first.taken] == list(range(20)) and not first.note
    path.write_bytes(whole[:-1])
    cut = Journal(path, robot_of_folder)
    cut.close()
    assert len(cut.taken) == 19 and path.read_bytes() == whole[: path.stat().st_size]
    head = whole.index(b"\n") + 1
    length, _ = RECORD.unpack_from(whole, head)
    path.write_bytes(whole[: head + RECORD.size + 5] + b"\0" + whole[head + RECORD.size + 6 :])
    spoilt = Journal(path, robot_of_folder)
    spoilt.close()
    assert not spoilt.taken and path.stat().st_size == head and length
    path.write_bytes(b"something else")
    other = Journal(path, robot_of_folder)
    other.close()
    assert not other.taken and "no journal of this robot" in other.note


def test_a_row_of_another_robot_is_refused(made):
    folder, rows, _ = made
    with Robot("pose", "health/*") as robot, robot.started("mapper", folder):
        robot.send([{name: value for name, value in rows[0].items() if name != "object1_mm"}])
        got = take_until(robot.inbox, lambda got: any(getattr(r.message, "last_error", "") for r in got), PATIENCE_S)
    assert not [r for r in got if r.topic == "pose"]
    assert "cell object1_mm is missing" in got[-1].message.last_error
