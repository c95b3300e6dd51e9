"""Occupancy maps: boxes cover the cells, thresholds and modes as map servers have them, frames there and back, bad files."""

import numpy as np
import pytest
from PIL import Image

from crunchbot import images, occupancy, scene
from crunchbot.images import Grey, read_grey
from crunchbot.occupancy import FREE, SOLID, UNKNOWN, boxes_of, cells_of, from_map, placed, read_map, to_map
from crunchbot.scene_table import SceneError

YAML = (
    "image: {image}\nresolution: 0.1\norigin: [-1.0, 0.5, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
)
ROOM = np.array([[0, 0, 0, 0], [0, 254, 205, 0], [0, 254, 254, 0]], np.uint8)  # walls left, top and right, one unknown


def write(folder, cells=ROOM, text=YAML, name="room.pgm"):
    Image.fromarray(cells).save(folder / name)
    (folder / "room.yaml").write_text(text.format(image=name))
    return folder / "room.yaml"


def test_boxes_cover_each_true_cell_once_and_no_other():
    rng = np.random.default_rng(3)
    for cells in (rng.random((30, 40)) < 0.4, np.ones((5, 6), bool), np.zeros((5, 6), bool)):
        count = np.zeros(cells.shape, int)
        for a, b, c, d in boxes_of(cells):
            count[b:d, a:c] += 1
        assert (count == cells).all()
    assert boxes_of(np.ones((5, 6), bool)) == [(0, 0, 6, 5)]


def test_a_map_is_read_with_its_first_row_at_the_top(tmp_path):
    got = read_map(write(tmp_path))
    assert got.size_m == (0.4, 0.3) and got.origin == (-1.0, 0.5, 0.0) and got.unknown == ((0.2, 0.1, 0.3, 0.2),)
    assert sorted(got.solid) == [(0.0, 0.0, 0.1, 0.2), (0.0, 0.2, 0.4, 0.3), (0.3, 0.0, 0.4, 0.2)]


LEVELS = np.array([[0, 60, 89, 90, 150, 205, 206, 255]], np.uint8)


@pytest.mark.parametrize(
    "mode, negate, kinds",
    [
        ("trinary", False, "SSSUUUFF"),
        ("scale", False, "SSSUUFFF"),  # 205 is 0.02 % up the scale, which is a 0
        ("trinary", True, "FUUUUSSS"),
        ("raw", False, "FUSSUUUU"),
    ],
)
def test_thresholds_and_modes_are_those_of_map_servers(mode, negate, kinds):
    wanted = [{"S": SOLID, "U": UNKNOWN, "F": FREE}[kind] for kind in kinds]
    assert cells_of(Grey(LEVELS), mode, negate, 0.196, 0.65)[0].tolist() == wanted


def test_a_pixel_to_look_through_is_unknown_in_mode_scale_only(tmp_path):
    bands = np.zeros((1, 2, 4), np.uint8)
    bands[..., 3] = (255, 128)
    Image.fromarray(bands).save(tmp_path / "map.png")
    grey = read_grey(tmp_path / "map.png")
    assert cells_of(grey, "scale", False, 0.2, 0.65).tolist() == [[SOLID, UNKNOWN]]
    assert cells_of(grey, "trinary", False, 0.2, 0.65).tolist() == [[SOLID, SOLID]]


@pytest.mark.parametrize("depth, level", [(np.uint8, 77), (np.uint16, 77 << 8)])
def test_grey_levels_of_8_and_16_bits_and_of_colours_are_read(tmp_path, depth, level):
    Image.fromarray(np.full((2, 3), level, depth)).save(tmp_path / "grey.png")
    assert (read_grey(tmp_path / "grey.png").level == 77).all()
    Image.fromarray(np.tile(np.array([30, 60, 90], np.uint8), (2, 3, 1))).save(tmp_path / "colour.png")
    grey = read_grey(tmp_path / "colour.png")
    assert (grey.level == 60).all() and grey.level.shape == (2, 3) and grey.opaque is None


def test_frames_are_left_and_entered_again():
    poses = np.random.default_rng(5).uniform(-3.0, 3.0, (20, 3))
    for origin in ((0.0, 0.0, 0.0), (-4.0, 2.0, 0.7)):
        assert np.allclose(from_map(to_map(poses, origin), origin), poses)
    assert np.allclose(to_map(np.array([[1.0, 0.0, 0.0]]), (2.0, 3.0, np.pi / 2)), [[2.0, 4.0, np.pi / 2]])


def test_beside_an_arena_what_the_map_does_not_show_is_unknown(tmp_path):
    text = YAML.replace("[-1.0, 0.5, 0.0]", "[0.1, -0.1, 0.0]")
    solid, unknown = placed(read_map(write(tmp_path, text=text)), (0.6, 0.4))
    inside = np.zeros((4, 6), int)  # 10 cm cells: 1 solid, 2 unknown
    for kind, boxes in ((1, solid), (2, unknown)):
        for box in boxes:
            x0, y0, x1, y1 = np.round(np.array(box) * 10).astype(int)
            inside[y0:y1, x0:x1] = kind
    assert inside[3].tolist() == [2] * 6 and inside[:, 0].tolist() == [2] * 4 == inside[:, 5].tolist()
    assert inside[:3, 1:5].tolist() == [[1, 0, 2, 1], [1, 1, 1, 1], [2, 2, 2, 2]]


BROKEN = {
    "resolution: 0.1": ("resolution: -1", "field 'resolution'"),
    "origin: [-1.0, 0.5, 0.0]": ("origin: [1]", "field 'origin' must be x, y and yaw"),
    "negate: 0": ("negate: 7", "field 'negate'"),
    "occupied_thresh: 0.65": ("occupied_thresh: 0.1", "field 'free_thresh' is above"),
    "free_thresh: 0.196": ("free_thresh: .nan", "field 'free_thresh'"),
    "image: {image}": ("image: nothing.png", "nothing.png: cannot be read"),
    "\n": (": [", "not YAML"),
}


@pytest.mark.parametrize("old, new, reported", [(old, *pair) for old, pair in BROKEN.items()])
def test_what_is_wrong_is_one_line_with_file_and_field(tmp_path, old, new, reported):
    with pytest.raises(SceneError, match=reported) as caught:
        read_map(write(tmp_path, text=YAML.replace(old, new, 1)))
    assert "\n" not in str(caught.value) and "room.yaml" in str(caught.value)


def test_images_and_maps_are_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr(images, "PIXELS_MOST", 11)
    with pytest.raises(SceneError, match="4 x 3 pixels, 11 are the most"):
        read_map(write(tmp_path))
    monkeypatch.setattr(images, "PIXELS_MOST", 12)
    monkeypatch.setattr(occupancy, "BOXES_MOST", 2)
    with pytest.raises(SceneError, match="more than 2 boxes"):
        read_map(write(tmp_path))
    (tmp_path / "room.pgm").write_bytes(b"P5 30000 30000 255\n")
    with pytest.raises(SceneError, match="pixels"):
        read_map(tmp_path / "room.yaml")


ARENA = 'size_m = [0.4, 0.3]\ntile_m = 0.1\ntextures = ["A", "B", "C"]\nfloor = "floor.png"\n'
ROBOT = "body_radius_m = 0.0\nodometry_relative_sigma = 0.1\nradial_sigma_m = 0.01\n"


def test_a_floor_is_an_image_with_a_pixel_for_each_tile(tmp_path):
    (tmp_path / "arena.toml").write_text(ARENA)
    (tmp_path / "robot.toml").write_text(ROBOT)
    grey = np.array([[0, 63, 65, 127], [128, 191, 192, 255], [255, 0, 0, 0]], np.uint8)
    opaque = np.full_like(grey, 255)
    opaque[2, 3] = 0
    Image.fromarray(np.dstack([grey, grey, grey, opaque])).save(tmp_path / "floor.png")
    read = scene.load(tmp_path)
    assert read.arena.floor == ("AABB", "BBCC", "CAA?")
    assert read.arena.floor_indices().tolist() == [[2, 0, 0, 255], [1, 1, 2, 2], [0, 0, 1, 1]]
    with pytest.raises(SceneError, match="unknown"):
        read.flat((0.0, 0.0, 0.0))
    Image.fromarray(grey[:2]).save(tmp_path / "floor.png")
    with pytest.raises(SceneError, match="has 2 rows"):
        scene.load(tmp_path)
    (tmp_path / "floor.png").write_bytes(b"no image")
    with pytest.raises(SceneError, match="line 4: 'floor'.*no whole PNG"):
        scene.load(tmp_path)
    (tmp_path / "arena.toml").write_text(ARENA.replace("tile_m = 0.1", "tile_m = 1e-5"))
    with pytest.raises(SceneError, match="line 2: 'tile_m' asks for 40000 x 30000 tiles"):
        scene.load(tmp_path)
