"""Scene folders: round trip, the simulator's flat text, and one clear line for every way to break one."""

import dataclasses

import pytest

from crunchbot import scene as scenes
from crunchbot.base_table import Topics

ARENA_TOML = """\
size_m = [1.0, 1.5]
tile_m = 0.5
textures = ["VINYL", "SMOOTH"]
floor = ["VS", "SV", "VV"]

[[obstacle]]
min_m = [0.0, 0.0]
max_m = [0.2, 0.3]

[[obstacle]]
min_m = [0.5, 0.5]
max_m = [0.7, 1.0]
"""
ROBOT_TOML = """\
body_radius_m = 0.17
odometry_relative_sigma = 0.05
radial_sigma_m = 0.005

[[whisker]]
name = "floor_left"
role = "texture"
tip_m = [0.1, 0.2]

[[whisker]]
name = "front"
role = "object"
base_m = [0.16, 0.0]
yaw_rad = -0.25
length_m = 0.14
"""
PRIOR_TOML = """\
kind = "gaussian"
mean = [0.5, 1.2, 0.0]
sigma = [0.1, 0.2, 0.3]
"""
FILES = {"arena.toml": ARENA_TOML, "robot.toml": ROBOT_TOML, "prior.toml": PRIOR_TOML}


@pytest.fixture
def folder(tmp_path):
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def test_what_is_written_reads_back_equal(folder, tmp_path):
    scene = scenes.load(folder)
    scenes.write(tmp_path / "again", scene)
    assert scenes.load(tmp_path / "again") == scene
    uniform = dataclasses.replace(scene, prior=scenes.Prior("uniform"))
    scenes.write(tmp_path / "uniform", uniform)
    assert scenes.load(tmp_path / "uniform") == uniform


def test_a_gyroscope_may_be_stated(folder, tmp_path):
    text = ROBOT_TOML.replace("radial_sigma_m", "odometry_turn_sigma_rad = 0.0035\nradial_sigma_m", 1)
    (folder / "robot.toml").write_text(text)
    scene = scenes.load(folder)
    assert scene.robot.odometry_turn_sigma_rad == 0.0035
    scenes.write(tmp_path / "again", scene)
    assert scenes.load(tmp_path / "again") == scene
    (folder / "robot.toml").write_text(text.replace("0.0035", "0"))
    with pytest.raises(scenes.SceneError, match="line 3: 'odometry_turn_sigma_rad' must be a number"):
        scenes.load(folder)


def test_faces_may_have_textures(folder, tmp_path):
    text = ARENA_TOML.replace("max_m = [0.7, 1.0]", 'max_m = [0.7, 1.0]\nsurface = "ROUGH"')
    (folder / "arena.toml").write_text(text.replace("[[obstacle]]", 'wall = "SMOOTH"\n\n[[obstacle]]', 1))
    scene = scenes.load(folder)
    assert (scene.arena.wall, scene.arena.surfaces) == ("SMOOTH", (((0.5, 0.5, 0.7, 1.0), "ROUGH"),))
    scenes.write(tmp_path / "again", scene)
    assert scenes.load(tmp_path / "again") == scene
    flat = scene.flat((0.5, 1.2, 0.1)).splitlines()
    assert "wall SMOOTH" in flat and "obstacle 0.5 0.5 0.7 1.0 ROUGH" in flat and "obstacle 0.0 0.0 0.2 0.3" in flat


def test_floor_rows_run_from_the_largest_y(folder):
    assert scenes.load(folder).arena.floor_indices().tolist() == [[0, 0], [1, 0], [0, 1]]


def test_flat_text_has_one_item_a_line_and_lanes_in_the_files_order(folder):
    assert scenes.load(folder).flat((0.5, 1.2, 0.1)).splitlines() == [
        "size_m 1.0 1.5",
        "tile_m 0.5",
        "texture VINYL",
        "texture SMOOTH",
        "floor VS",
        "floor SV",
        "floor VV",
        "obstacle 0.0 0.0 0.2 0.3",
        "obstacle 0.5 0.5 0.7 1.0",
        "body_radius_m 0.17",
        "texture_whisker floor_left 0.1 0.2",
        "object_whisker front 0.16 0.0 -0.25 0.14",
        "start 0.5 1.2 0.1",
    ]


def test_prior_may_be_absent_and_a_mean_in_an_obstacle_is_a_warning(folder):
    assert scenes.load(folder).warnings() == []
    (folder / "prior.toml").write_text(PRIOR_TOML.replace("0.5, 1.2", "0.6, 0.7"))
    assert "clipped to free space" in scenes.load(folder).warnings()[0]
    (folder / "prior.toml").unlink()
    assert scenes.load(folder).prior is None


def test_a_body_that_leans_against_a_wall_or_a_block_is_free(folder):
    """The simulated world lets it come so near too (move_body of sim/world/sim_world.c)."""
    arena = scenes.load(folder).arena
    leaning = [(0.25, 1.0), (0.75, 1.25), (0.25, 1.25), (0.75, 0.25), (0.25, 0.75)]  # walls; the block at (0.5, 0.5)
    assert all(arena.is_free(x, y, 0.25) for x, y in leaning)
    assert not any(arena.is_free(x, y, 0.2500001) for x, y in leaning)
    corners = [(x, y) for x in (0.0, 1.0) for y in (0.0, 1.5)]
    assert [arena.is_free(x, y, 0.0) for x, y in corners] == [False, True, True, True], "a block stands in the first"


BROKEN = [
    ("arena.toml", "size_m = [1.0, 1.5]", "size_m = [0.0, 1.5]", "line 1: 'size_m' must be numbers from"),
    ("arena.toml", "size_m = [1.0, 1.5]", "size_m = [1.0]", "line 1: 'size_m' must be a list of 2"),
    ("arena.toml", "tile_m = 0.5", 'tile_m = "wide"', "line 2: 'tile_m' must be a number"),
    ("arena.toml", "tile_m = 0.5", "tile_m = nan", "line 2: 'tile_m' must be a number"),
    ("arena.toml", "tile_m = 0.5", "tile_m = true", "line 2: 'tile_m' must be a number"),
    ("arena.toml", "tile_m = 0.5", "tile_m = 0.5\ncolour = 1", "line 3: 'colour' is unknown; remove it"),
    ("arena.toml", "tile_m = 0.5\n", "", "'tile_m' is missing; add it"),
    ("arena.toml", '"SMOOTH"', '"VELVET"', "line 3: 'textures' has two names that begin with 'V'"),
    ("arena.toml", '"SMOOTH"', '"SMOOTH,"', "line 3: 'textures' has the name"),
    ("arena.toml", '"SMOOTH"', "7", "line 3: 'textures' must be a list of strings"),
    ("arena.toml", '"SV"', '"S"', "line 4: 'floor' row 2 has 1 tiles"),
    ("arena.toml", '"SV"', '"SX"', "line 4: 'floor' row 2 has the letter 'X'"),
    ("arena.toml", '"SV", ', "", "line 4: 'floor' has 2 rows"),
    (
        "arena.toml",
        "max_m = [0.7, 1.0]",
        'max_m = [0.7, 1.0]\nsurface = "a b"',
        "'surface' has the name 'a b'; use letters",
    ),
    ("arena.toml", "[[obstacle]]", "wall = 3\n[[obstacle]]", "'wall'"),
    ("arena.toml", "[0.7, 1.0]", "[0.7, 1.6]", "line 12: 'max_m' is outside the arena"),
    ("arena.toml", "[0.7, 1.0]", "[0.4, 1.0]", "line 12: 'max_m' must be larger than min_m"),
    ("arena.toml", "max_m = [0.7", "most_m = [0.7", "'max_m' is missing in [[obstacle]] number 2"),
    ("arena.toml", "[[obstacle]]\nmin_m = [0.0, 0.0]\nmax_m = [0.2, 0.3]", "obstacle = 3", "not TOML"),
    ("arena.toml", "tile_m = 0.5", "tile_m 0.5", "not TOML"),
    ("robot.toml", "radial_sigma_m = 0.005", "radial_sigma_m = 0.0", "line 3: 'radial_sigma_m' must be a number"),
    ("robot.toml", 'role = "texture"', 'role = "nose"', "line 7: 'role' must be 'texture' or 'object'"),
    ("robot.toml", 'name = "front"', 'name = "floor_left"', "'whisker' has the name 'floor_left' twice"),
    ("robot.toml", 'name = "front"', 'name = "front left"', "line 11: 'name' is 'front left'"),
    ("robot.toml", "length_m = 0.14", "length_m = 0.14\ntip_m = [0, 0]", "line 16: 'tip_m' is unknown"),
    ("robot.toml", "length_m = 0.14", "length_m = -0.14", "line 15: 'length_m' must be a number"),
    ("robot.toml", "tip_m = [0.1, 0.2]", "", "'tip_m' is missing in [[whisker]] number 1"),
    ("prior.toml", 'kind = "gaussian"', 'kind = "sharp"', "line 1: 'kind' must be 'gaussian' or 'uniform'"),
    ("prior.toml", "0.1, 0.2, 0.3", "0.1, 0.0, 0.3", "line 3: 'sigma' must be numbers"),
    ("prior.toml", "0.1, 0.2, 0.3", "0.1, inf, 0.3", "line 3: 'sigma' must be numbers"),
    ("prior.toml", 'kind = "gaussian"', 'kind = "uniform"', "line 2: 'mean' is unknown"),
]


@pytest.mark.parametrize(("name", "old", "new", "complaint"), BROKEN)
def test_a_broken_scene_is_one_clear_line(folder, name, old, new, complaint):
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new, 1))
    with pytest.raises(scenes.SceneError) as error:
        scenes.load(folder)
    assert complaint in str(error.value)
    assert str(folder / name) in str(error.value) and "\n" not in str(error.value)


def test_a_missing_file_or_folder_is_one_clear_line(folder):
    (folder / "robot.toml").unlink()
    with pytest.raises(scenes.SceneError, match="robot.toml: cannot be read"):
        scenes.load(folder)
    with pytest.raises(scenes.SceneError, match="no such folder"):
        scenes.load(folder / "nowhere")


BASE_TOML = """
[base]
wheel_base_m = 0.16
wheel_most_m_s = 0.22
wheel_step_m_s = 0.01
acceleration_m_s2 = 1.5

[base.ros2]
odometry = "/wheels/odom"
command_type = "TwistStamped"

[base.ros2.touch]
bump_left = "/bumper/left"
"""


def test_the_base_may_be_another_than_a_create(folder, tmp_path):
    assert scenes.load(folder).robot.base.topics is None
    (folder / "robot.toml").write_text(ROBOT_TOML + BASE_TOML)
    base = scenes.load(folder).robot.base
    assert (base.wheel_base_m, base.wheel_most_m_s, base.acceleration_m_s2) == (0.16, 0.22, 1.5)
    assert base.topics == Topics("/cmd_vel", "/wheels/odom", "TwistStamped", touch={"bump_left": "/bumper/left"})
    assert base.turn_most_rad_s == pytest.approx(2.75)
    assert base.reached(0.22, -2.75) == pytest.approx((0.11, -1.375))
    scenes.write(tmp_path / "again", scenes.load(folder))
    assert scenes.load(tmp_path / "again") == scenes.load(folder)


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("wheel_base_m = 0.16", "wheel_base_m = 160", "'wheel_base_m' must be a number from 0.001 to 5, not 160"),
        ("wheel_base_m = 0.16", "", "'wheel_base_m' is missing; add it"),
        ("0.22", "0.22\nmost = 1", "'most' is unknown; remove it"),
        ('"/wheels/odom"', '"odom"', "'odometry' is 'odom', no topic; begin with /"),
        ('"TwistStamped"', '"Stamped"', "'command_type' must be 'Twist' or 'TwistStamped'"),
        ("bump_left", "bump_up", "'bump_up' is unknown; remove it"),
        ("[base.ros2.touch]", "touch = 1", "'touch' must be a table; write it as \\[touch\\]"),
    ],
)
def test_a_wrong_base_is_one_line(folder, old, new, line):
    (folder / "robot.toml").write_text(ROBOT_TOML + BASE_TOML.replace(old, new, 1))
    with pytest.raises(scenes.SceneError, match=line):
        scenes.load(folder)
