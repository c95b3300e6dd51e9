"""A Thymio's recording becomes a scene: cells of the image, motions that add up, readings as likelihoods, errors in one line."""

import math

import numpy as np
import pytest
from commandkit import run
from thymiologs import write_log

from crunchbot.nav import localise
from crunchbot.scene import load
from crunchbot.tables import TableError
from crunchbot_lab import scenes
from crunchbot_lab.scenes import geometry

CELLS = np.array([[0, 255, 0], [255, 255, 0], [0, 0, 255], [255, 0, 255]], np.uint8)  # [x][y], cells of 2 cm
PATH = np.array([[0.02, 0.02, 0.1], [0.03, 0.022, 0.2], [0.04, 0.03, 3.1], [0.035, 0.03, -3.1]])


@pytest.fixture
def recording(tmp_path):
    """Four lines along PATH: left on black, right on white, but for the last row's left."""
    folder = tmp_path / "run"
    write_log(folder, np.kron(CELLS, np.ones((2, 2))), PATH, [60, 60, 60, 405], [750] * 4)
    return folder


def test_the_scene_has_the_images_cells_and_the_recordings_motion(recording, tmp_path, capsys):
    code, _, error = run(capsys, "scene", "from", "thymio", recording, "--out", tmp_path / "scene")
    assert (code, error) == (0, "")
    scene = load(tmp_path / "scene")
    assert scene.arena.size_m == (0.08, 0.06) and scene.arena.tile_m == 0.02 and scene.prior.kind == "uniform"
    assert (scene.arena.floor_indices() == CELLS.T // 255).all()
    rows = localise.read_observations(localise.observations_path(tmp_path / "scene"), scene)
    assert len(rows) == 3 and np.allclose(rows.truth, PATH[1:], atol=1e-6)
    pose = PATH[0]
    for step, wanted in zip(rows.odometry, PATH[1:], strict=True):
        pose = geometry.compose(pose, step)
        assert np.allclose(pose[:2], wanted[:2], atol=1e-5)
        assert math.remainder(pose[2] - wanted[2], 2 * math.pi) == pytest.approx(0.0, abs=1e-5)
    left, right = rows.texture[:, 0], rows.texture[:, 1]
    assert (left[:2, 0] > left[:2, 1] + 2).all() and (right[:, 1] > right[:, 0] + 2).all()
    assert left[2, 0] == pytest.approx(left[2, 1]), "half way carries no information"


def test_a_recording_without_the_truth_is_one_too(recording):
    (recording / "gt.txt").unlink()
    assert scenes.read_recording(recording)[1].truth is None


def spoil(name: str, text: str):
    return lambda folder: (folder / name).write_text(text)


@pytest.mark.parametrize(
    "damage, reported",
    [
        (spoil("gt.txt", "1 2 3\n1 2\n"), r"gt\.txt, line 2: 2 numbers where 3 belong"),
        (spoil("sensor_left.txt", "60\n"), r"sensor_left\.txt: 1 lines, other files have 4"),
        (lambda folder: (folder.parent / "map.png").unlink(), r"map\.png: cannot be read"),
        (
            lambda folder: (folder.parent / "map.png").write_bytes(b"\x89PNG\r\n"),
            r"map\.png: cannot be read \(no whole",
        ),
    ],
)
def test_what_is_wrong_is_one_line_with_file_and_remedy(recording, damage, reported):
    damage(recording)
    with pytest.raises(TableError, match=reported) as caught:
        scenes.read_recording(recording, kind="thymio")
    assert "\n" not in str(caught.value) and ("give" in str(caught.value) or "put" in str(caught.value))


def test_a_cell_that_is_no_number_is_counted_by_the_filter(recording):
    (recording / "odom_pose.txt").write_text("0 0\nx 0\n0 0\n0 0\n")
    scene, rows = scenes.read_recording(recording)
    assert localise.run("odometry", scene, rows).bad_cells > 0


@pytest.mark.parametrize(
    "kind, reported", [("bag", "no recording of kind bag"), ("film", "choose one of run, scene, bag, thymio")]
)
def test_a_kind_that_is_none_is_named(recording, tmp_path, capsys, kind, reported):
    code, _, error = run(capsys, "scene", "from", kind, recording, "--out", tmp_path / "scene")
    assert code == 2 and reported in error and error.count("\n") == 1
