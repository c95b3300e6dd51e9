"""Files that anybody may have written: nested, huge, with a byte-order mark, or with numbers that nothing can have. Each is
read, or refused in one line that names file, field and remedy."""

# ruff: noqa: F811 - fixtures are taken by their names

import json

import numpy as np
import pytest
from commandkit import run
from folders import folder, recorded  # noqa: F401 - fixtures
from models import model

from crunchbot.fields import Fields
from crunchbot.nav import localise
from crunchbot.scene import OBSTACLES_MOST, WHISKERS_MOST, SceneError, load
from crunchbot.tables import TableError, read_columns
from crunchbot.touch.radial import model as radial
from crunchbot.touch.texture import model as texture
from crunchbot_lab.simulation.bridge import SimulationError, read_faults

DEEP = 100_000
BOM = b"\xef\xbb\xbf"
NESTED_TOML = [f"x = {'[' * 5000}", f"x = {'{a=' * 5000}", f"x = {'9' * 5000}", f"{'a.' * 5000}b = 1"]
LINE = {"format": radial.FORMAT, "a1": -0.011, "a0": 181.5, "sigma_mm": 2.5, "low_mm": 90.0, "high_mm": 138.0}
PLAIN = {"format": texture.FORMAT, "classes": ["A", "B"], "rest": [0.0], "low": [-1.0], "high": [1.0]}
PLAIN["loglik"] = [[[-1.0, -1.0]], [[-2.0, -0.5]]]


def one_line(error, *parts: str) -> None:
    text = str(error)
    assert "\n" not in text and len(text) < 1000 and all(part in text for part in parts), text


@pytest.mark.parametrize("text", NESTED_TOML)
@pytest.mark.parametrize("name", ["arena.toml", "robot.toml", "prior.toml"])
def test_toml_that_is_too_deep_or_too_long_is_one_line(capsys, folder, name, text):
    (folder / name).write_text(text + "\n" + (folder / name).read_text())
    code, out, err = run(capsys, "localise", folder)
    assert code == 2 and out == ""
    one_line(err.rstrip("\n"), f"{folder / name}", ";")


@pytest.mark.parametrize(
    "text", [*NESTED_TOML, "fault = [1]", "fault = [[]]", '[[fault]]\ntick=1\nkind="a"\nlane=1\nerror=[]']
)
def test_faults_that_are_none_are_one_line(tmp_path, text):
    (tmp_path / "f.toml").write_text(text)
    with pytest.raises(SimulationError) as error:
        read_faults(tmp_path / "f.toml", 2000)
    one_line(error.value, f"{tmp_path / 'f.toml'}")


def test_toml_with_a_byte_order_mark_and_carriage_returns_is_read(folder):
    before = load(folder)
    for name in ("arena.toml", "robot.toml", "prior.toml"):
        (folder / name).write_bytes(BOM + (folder / name).read_bytes().replace(b"\n", b"\r\n"))
    assert load(folder) == before


def test_faults_with_a_byte_order_mark_are_read(tmp_path):
    (tmp_path / "f.toml").write_bytes(BOM + b'[[fault]]\r\ntick = 3\r\nkind = "host_away"\r\n')
    assert read_faults(tmp_path / "f.toml", 2000) == "usb 3 host_away\n"


def test_a_key_of_two_lines_is_reported_in_one(folder):
    (folder / "arena.toml").write_text('"a\\nb" = 1\n' + (folder / "arena.toml").read_text())
    with pytest.raises(SceneError) as error:
        load(folder)
    one_line(error.value, "is unknown; remove it")


@pytest.mark.parametrize(
    ("name", "table", "most"),
    [
        ("robot.toml", '[[whisker]]\nname = "w{n}x"\nrole = "texture"\ntip_m = [0.1, 0.0]\n', WHISKERS_MOST),
        ("arena.toml", "[[obstacle]]\nmin_m = [0.1, 0.1]\nmax_m = [0.2, 0.2]\n", OBSTACLES_MOST),
    ],
)
def test_more_tables_than_anything_has_are_refused(folder, name, table, most):
    text = (folder / name).read_text()
    (folder / name).write_text(text + "".join(table.replace("{n}", str(n)) for n in range(most + 1)))
    with pytest.raises(SceneError) as error:
        load(folder)
    one_line(error.value, f"{folder / name}", f"{most} are the most")


def test_a_csv_with_a_byte_order_mark_is_read(folder):
    path = folder / "observations.csv"
    before = localise.read_observations(path, load(folder))
    path.write_bytes(BOM + path.read_bytes().replace(b"\n", b"\r\n"))
    again = localise.read_observations(path, load(folder))
    assert again.t_text == before.t_text and np.array_equal(again.odometry, before.odometry)


class Counted(str):
    """A column's name that counts how often it is compared."""

    __slots__ = ()
    compared = 0

    def __eq__(self, other):
        Counted.compared += 1
        return str.__eq__(self, other)

    __hash__ = str.__hash__


def test_a_header_of_many_columns_is_looked_at_once_each(tmp_path, monkeypatch):
    columns = 40_000
    (tmp_path / "t.csv").write_text(",".join(f"c{n}" for n in range(columns)) + "\n")
    monkeypatch.setattr("crunchbot.tables._name", lambda cell: Counted(cell.strip()))
    assert len(read_columns(tmp_path / "t.csv", ["c7", "c39999"])) == columns
    assert Counted.compared < 4 * columns
    (tmp_path / "t.csv").write_text(",".join(["x", *(f"c{n}" for n in range(columns)), "x"]) + "\n")
    with pytest.raises(TableError) as error:
        read_columns(tmp_path / "t.csv", [])
    one_line(error.value, "column 'x' appears twice")


@pytest.mark.parametrize(
    "text", ["[" * DEEP, '{"a":' * DEEP, "9" * 5000, f'{{"format": {"9" * 5000}}}', "null", "\x00"]
)
@pytest.mark.parametrize("read", [radial.load, texture.load])
def test_json_that_is_no_model_is_one_line(tmp_path, read, text):
    (tmp_path / "m.json").write_text(text)
    with pytest.raises(TableError) as error:
        read(tmp_path / "m.json")
    one_line(error.value, f"{tmp_path / 'm.json'}", "make one with")


def refused(path, content: dict, read, field: str) -> None:
    path.write_text(json.dumps(content))
    with pytest.raises(TableError) as error:
        read(path)
    one_line(error.value, f"{path}: ", f"'{field}'", "; make one with 'whisker ")


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("sigma_mm", -1.0),
        ("a1", 1e308),
        ("a0", float("nan")),
        ("a0", float("-inf")),
        ("a1", True),
        ("a1", "1"),
        ("a1", None),
        ("a1", [1.0]),
        ("low_mm", -1),
        ("high_mm", 1e308),
        ("high_mm", 80.0),
        ("node", -1),
        ("node", 1.5),
        ("node", 2**32),
        ("format", "whisker radial model 9"),
        ("format", ["x"]),
        ("a1", 10**400),
    ],
)
def test_a_radial_model_with_nonsense_is_one_line_that_names_the_field(tmp_path, field, value):
    refused(tmp_path / "m.json", LINE | {field: value}, radial.load, field)


@pytest.mark.parametrize("field", ["rate_hz", "window_ms", "doubt", "hazard"])
@pytest.mark.parametrize("value", [-1, 1e308, "1", None, True, [1.0], float("nan")])
def test_a_texture_model_with_nonsense_is_one_line_that_names_the_field(tmp_path, field, value):
    model().save(tmp_path / "m.json")
    content = json.loads((tmp_path / "m.json").read_text())
    refused(tmp_path / "m.json", content | {field: value}, texture.load, field)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("classes", [-1, -1, -1]),
        ("classes", ["A", "A", "B"]),
        ("classes", []),
        ("classes", "ABC"),
        ("classes", ["A", "B", ""]),
        ("figures", 7),
        ("figures", "none"),
        ("figures", [1]),
        ("classifiers", {}),
        ("classifiers", [1]),
        ("limits", [1]),
        ("novelty", 3),
    ],
)
def test_parts_of_a_texture_model_of_another_type_are_named(tmp_path, field, value):
    model().save(tmp_path / "m.json")
    content = json.loads((tmp_path / "m.json").read_text())
    path = tmp_path / "m.json"
    path.write_text(json.dumps(content | {field: value}))
    with pytest.raises(TableError) as error:
        texture.load(path)
    one_line(error.value, f"{path}: ", field)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("classes", [-1, -1]),
        ("rest", [1e308]),
        ("low", "x"),
        ("loglik", [[[1.0, 1.0]], [[1.0, 1.0]]]),
        ("loglik", [[1]]),
    ],
)
def test_a_plain_texture_model_with_nonsense_is_one_line_that_names_the_field(tmp_path, field, value):
    (tmp_path / "m.json").write_text(json.dumps(PLAIN))
    assert texture.load(tmp_path / "m.json").classes == ["A", "B"]
    refused(tmp_path / "m.json", PLAIN | {field: value}, texture.load, field)


def test_a_wrong_value_is_shown_short():
    fields = Fields({"a": "x" * 10_000, "b": 10**5000, "c": [[1.0] * 1000]})
    for name in "abc":
        with pytest.raises(ValueError) as error:
            fields.number(name)
        assert len(str(error.value)) < 200


def test_a_file_larger_than_any_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("crunchbot.files.BYTES_MOST", 1 << 20)
    (tmp_path / "m.json").write_text(" " * (1 << 20) + " ")
    with pytest.raises(TableError) as error:
        radial.load(tmp_path / "m.json")
    one_line(error.value, "more than 1 MiB")
