"""A robot learns the floor while it drives over known tiles, and knows it on another drive."""

import json
import threading

import numpy as np
import pytest
from commandkit import run, signals_as_before  # noqa: F401 - a fixture
from known_drive import floor_scene, frames_of, record, wander, write_scene, write_way
from rings import ring_name

from crunchbot.bridge.ring import Writer
from crunchbot.scene import load
from crunchbot.touch.texture.drive import INSIDE_M, Drive, Way, over_tiles
from crunchbot.touch.texture.lacking import lacking
from crunchbot.touch.texture.model import read_recording

SPEED_M_S = 0.15


@pytest.fixture(scope="module")
def drives(tmp_path_factory):
    """Two drives of a minute and a half of one robot: folders with drive.mcap, way.csv and a scene with odometry."""
    place, scene = tmp_path_factory.mktemp("drives"), floor_scene(1)
    for seed in (1, 2):
        folder = place / str(seed)
        counts, poses, odometry = wander(scene, seed, 70.0, SPEED_M_S)
        (folder / "scene").mkdir(parents=True)
        record(folder / "drive.mcap", counts)
        write_scene(folder / "scene", scene, poses[0], odometry)
        write_way(folder / "way.csv", poses)
        np.save(folder / "poses.npy", poses)
    return place


@pytest.mark.parametrize("way", ["--way", ""])
def test_what_was_learnt_on_a_drive_over_known_tiles_knows_them_on_another(capsys, tmp_path, drives, way):
    """Poses of another source, or by odometry alone from a known start: then fewer tiles are sure to have been driven over."""
    learnt = ["texture", "train", "--overwrite", "--out", tmp_path / "m.json"]
    for seed in ("1", "2"):
        given = ["--drive", drives / seed / "drive.mcap", "--scene", drives / seed / "scene"]
        given += [way, drives / seed / "way.csv"] if way else []
        code, out, error = run(capsys, *learnt, tmp_path / seed, *given)
        assert code == 0, error
        assert all(f"{tmp_path / seed}/{name}: " in out for name in ("VINYL", "SMOOTH", "ROUGH"))
    code, out, _ = run(capsys, "texture", "classify", tmp_path / "m.json", tmp_path / "1", "--json")
    rows = [json.loads(line) for line in out.splitlines()]
    assert code == 0 and len(rows) == 3
    right = sum(row[row["surface"]] for row in rows) / sum(row["decisions"] for row in rows)
    assert right > 0.9


def test_stretches_keep_clear_of_borders_of_breaks_and_of_standing(drives):
    scene, poses = load(drives / "1" / "scene"), np.load(drives / "1" / "poses.npy")
    t_s = 5e-4 * np.arange(1, 20_001)
    drive = Drive(np.delete(t_s, slice(3000, 3400)), np.zeros((len(t_s) - 400, 2, 2)))
    times = 0.1 * np.arange(101)
    zeros = np.zeros(101)
    whiskers = dict(enumerate(scene.robot.whiskers))
    sure = over_tiles(drive, Way(times, poses[:101], zeros, zeros), whiskers, scene.arena, 0.1)
    blurred = over_tiles(drive, Way(times, poses[:101], zeros + 0.04, zeros + 0.02), whiskers, scene.arena, 0.1)
    assert sum(len(s.t_s) for s in blurred) < 0.8 * sum(len(s.t_s) for s in sure)
    floor = scene.arena.floor_indices()
    for s in sure:
        assert np.diff(s.t_s).max() < 6e-4 and len(s.t_s) * 5e-4 >= 0.1 - 1e-9
        x, y, theta = (np.interp(s.t_s, times, part) for part in poses[:101].T)
        tip = next(w.tip_m for w in scene.robot.whiskers if w.name == s.whisker)
        place = np.array(
            [x + np.cos(theta) * tip[0] - np.sin(theta) * tip[1], y + np.sin(theta) * tip[0] + np.cos(theta) * tip[1]]
        )
        tile = np.unique(np.floor(place / 0.5).astype(int), axis=1)
        assert tile.shape == (2, 1) and scene.arena.textures[floor[tile[1, 0], tile[0, 0]]] == s.surface
        off = place % 0.5
        assert np.minimum(off, 0.5 - off).min() >= INSIDE_M - 1e-9
    still = over_tiles(drive, Way(times, np.repeat(poses[:1], 101, axis=0), zeros, zeros), whiskers, scene.arena, 0.1)
    assert still == []


def test_a_surface_that_was_told_needs_no_map_and_another_drive_adds_to_it(capsys, tmp_path, drives):
    counts, _, _ = wander(floor_scene(1), 3, 6.0, SPEED_M_S)
    record(tmp_path / "a.mcap", counts)
    record(tmp_path / "b.mcap", counts, first_tick=10**6)
    command = ["texture", "train", tmp_path / "set", "--out", tmp_path / "m.json", "--lanes", "0,1", "--overwrite"]
    code, out, error = run(capsys, *command, "--drive", tmp_path / "a.mcap", "--surface", "FELT=0.5-2.5")
    assert code == 0 and "one surface so far; drive over another" in out and not (tmp_path / "m.json").exists()
    assert f"{tmp_path / 'set'}/FELT: 2 recordings added, 4.0 s" in out
    code, out, error = run(
        capsys, *command, "--drive", tmp_path / "a.mcap", "--surface", "FELT=0-2", "--surface", "CORK=3-6"
    )
    assert code == 0 and len(list((tmp_path / "set/FELT").iterdir())) == 2  # a drive that is added again is there once
    assert "FELT: 2 recordings, 17 needed for a refusal level of 10 %: drive over it 15 times more" in out
    assert run(capsys, *command, "--drive", tmp_path / "b.mcap", "--surface", "CORK")[0] == 0
    assert len(list((tmp_path / "set/CORK").iterdir())) == 4


WRONG = {
    "neither --scene nor --lanes": ["--surface", "A"],
    "neither --scene nor --surface": ["--lanes", "0"],
    "--live without --surface": ["--live", "--lanes", "0"],
    "--drive with --live": ["--live", "--surface", "A"],
    "no surface with times": ["--surface", "A=5-3", "--lanes", "0"],
    "no window of samples at these times": ["--surface", "A=90-95", "--lanes", "0"],
}


@pytest.mark.parametrize("complaint", WRONG)
def test_what_is_missing_for_a_drive_is_one_clear_line(capsys, tmp_path, drives, complaint):
    source = [] if complaint == "--live without --surface" else ["--drive", drives / "1" / "drive.mcap"]
    try:
        code, _, error = run(
            capsys, "texture", "train", tmp_path / "set", "--out", tmp_path / "m.json", *source, *WRONG[complaint]
        )
    except SystemExit as end:
        code, error = end.code, capsys.readouterr().err
    assert code == 2 and complaint in error and error.count("\n") == 1


def test_a_surface_without_the_speeds_of_the_others_is_named():
    many = {"A": [""] * 20, "B": [""] * 20}
    assert lacking(many, {"A": [0.1, 0.2], "B": [0.12, 0.19]}) == []
    lines = lacking(many, {"A": [0.1, 0.2], "B": [0.2, 0.2]})
    assert lines == ["B: no pass slower than 0.20 m/s, but others at 0.10: drive over it at that"]
    assert lacking({"A": [""] * 30, "B": [""] * 4}, {}) == []  # so many of both bear the level out


def test_passes_over_one_tile_are_one_and_a_surface_of_one_tile_is_named_always():
    tiles = [f"c{n}r0" for n in range(40)]
    assert lacking({"A": tiles, "B": ["c0r1"] * 40}, {}) == [
        "B: 1 places, 17 needed for a refusal level of 10 %: drive over 16 more of its tiles"
    ]
    assert len(lacking({"A": tiles[:5] * 8, "B": ["c0r1", "c1r1"] * 20}, {})) == 2


def test_a_drive_is_learnt_from_the_ring_as_it_comes(capsys, tmp_path):
    frames, name, ended = frames_of(wander(floor_scene(1), 4, 60.0, SPEED_M_S)[0]), ring_name(), threading.Event()

    def publish():
        with Writer(name, 4096) as ring:
            for start in range(0, len(frames), 200):
                ring.publish(frames[start : start + 200])
                if ended.wait(0.005):
                    return

    thread = threading.Thread(target=publish)
    thread.start()
    command = [
        "texture",
        "train",
        tmp_path / "set",
        "--out",
        tmp_path / "m.json",
        "--live",
        "--ring",
        name,
        "--wait",
        20,
    ]
    code, out, error = run(capsys, *command, "--surface", "CORK", "--lanes", "0,1", "--seconds", "2")
    ended.set()
    thread.join()
    assert code == 0 and "one surface so far" in out, error
    assert sum(len(read_recording(file)[0]) for file in (tmp_path / "set/CORK").iterdir()) >= 2 * 0.9 * 4000
