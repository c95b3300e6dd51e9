"""The observation row: names that cannot be mistaken, and one row as arrays and as cells."""

import math

import numpy as np
import pytest

from crunchbot import observation as o
from crunchbot.scene import SceneError, load
from crunchbot_lab import scenes

CELLS = {
    "t_s": 0.1,
    "odo_x_m": 0.01,
    "odo_y_m": 0.0,
    "odo_theta_rad": -0.2,
    "l_VINYL": -1.5,
    "r_mm": None,
    "s_mm": math.nan,
}


def test_a_row_is_its_cells():
    row = o.Row.of(CELLS, o.WHISK)
    assert repr(dict(row)) == repr(CELLS) and list(row) == list(CELLS) and len(row) == len(CELLS)
    assert row.kind == o.WHISK and row.cells.tolist() == [o.VALUE, o.EMPTY, o.NOT_READ]
    with pytest.raises(KeyError, match="t_mm"):
        row["t_mm"]
    with pytest.raises(KeyError, match="odo_y_m"):
        o.Row.of({name: value for name, value in CELLS.items() if name != "odo_y_m"})


def test_values_are_read_by_name():
    row = o.Row.of(CELLS)
    assert np.array_equal(
        row.read(["s_mm", "r_mm", "l_VINYL"], empty=math.inf), [math.nan, math.inf, -1.5], equal_nan=True
    )
    assert np.array_equal(row.find(["l_VINYL", "nobody_mm", "r_mm"]), [-1.5, math.nan, math.nan], equal_nan=True)
    with pytest.raises(KeyError, match="nobody_mm"):
        row.read(["nobody_mm"])


def test_a_layout_finds_names_that_an_underscore_makes_unclear():
    columns = [*o.textures("front_left", ["deep_pile"]), o.distance("a_normal"), *o.normal("a"), *o.point("a")]
    layout = o.Layout([*columns, o.Column(o.Quantity.READING, "", "light_mm")])
    assert layout.get("front_left_deep_pile").whisker == "front_left"
    assert layout.get("light_mm").quantity is o.Quantity.READING
    assert layout.of(o.Quantity.NORMAL, "a") == ["a_normal_rad", "a_normal_sd_rad"] and layout.get("b_mm") is None
    assert layout.of(o.Quantity.READING) == ["light_mm"]
    assert all(layout.get(name).name == name for name in layout.names)


@pytest.mark.parametrize("column", [*o.normal("a_b"), *o.point("a_b"), o.distance("a_b"), *o.textures("a_b", ["c"])])
def test_without_a_layout_the_ending_decides(column):
    assert o.parse(column.name) == column


@pytest.mark.parametrize(
    "columns",
    [[*o.textures("a", ["b_c"]), *o.textures("a_b", ["c"])], o.textures("t", ["s"]), o.textures("true_x", ["m"])],
)
def test_a_name_with_two_meanings_is_refused(columns):
    with pytest.raises(ValueError, match=f"'{columns[-1].name}' has two meanings"):
        o.Layout(columns)


def test_a_scene_with_such_names_is_refused(tmp_path):
    made = scenes.make("robot", 1, 5)
    scenes.write_scene(tmp_path, made.scene, made.observations)
    first, _, third = made.scene.arena.textures
    tip = made.scene.robot.of_role("texture")[0].name
    arena, robot = tmp_path / "arena.toml", tmp_path / "robot.toml"
    arena.write_text(arena.read_text().replace(f'"{third}"', f'"{third}_{first}"'))
    added = f'\n[[whisker]]\nname = "{tip}_{third}"\nrole = "texture"\ntip_m = [0.0, 0.0]\n'
    robot.write_text(robot.read_text() + added)
    with pytest.raises(SceneError, match="robot.toml: the column .* has two meanings.*rename"):
        load(tmp_path)
