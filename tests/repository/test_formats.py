"""docs/formats.md: the names in its tables are those that the code reads and writes."""

import csv
import dataclasses
import inspect
import io
import json
import re
import tomllib
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from crunchbot import occupancy
from crunchbot import scene as scene_files
from crunchbot.base_table import TOUCHES, BaseTable, Topics
from crunchbot.bridge import nodes, ring
from crunchbot.commands import info, radial, stream, texture
from crunchbot.nav import localise, observations
from crunchbot.observation import NORMAL, POINT, SURFACE
from crunchbot.robot import rowfiles, track
from crunchbot.sensor_tables import SensorTable
from crunchbot.touch import calibration
from crunchbot.touch.radial import model as radial_models
from crunchbot.touch.radial import press
from crunchbot.touch.radial.curve import CurveModel
from crunchbot.touch.radial.plug import Plug
from crunchbot.touch.texture import model as texture_model
from crunchbot.touch.texture import spectral
from crunchbot_lab import scenes
from crunchbot_lab.demo import level1, training
from crunchbot_lab.scenes import thymio
from crunchbot_lab.simulation import bridge

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs/formats.md").read_text()
SEPARATOR = re.compile(r"^\|[-| ]+\|$")


def tables(heading: str) -> list[list[list[str]]]:
    """The tables of a section, up to the next heading: rows of cells, the header first."""
    part = re.search(rf"^#+ {re.escape(heading)}\n(.*?)(?=^#|\Z)", PAGE, re.MULTILINE | re.DOTALL)[1]
    found: list[list[list[str]]] = [[]]
    for line in part.splitlines():
        if not line.startswith("|"):
            found.append([])
        elif not SEPARATOR.match(line):
            found[-1].append([cell.strip() for cell in line.strip("|").split(" | ")])
    return [table for table in found if table]


def names(cells) -> set[str]:
    """What stands in these cells between back quotes."""
    return {name for cell in cells for name in re.findall(r"`([^`]+)`", cell)}


def column(heading: str, table: int = 0, at: int = 0) -> set[str]:
    return names(row[at] for row in tables(heading)[table][1:])


def row_of(heading: str, first: str, table: int = 0, at: int = 1) -> set[str]:
    """The names in a cell of the row that begins with this name."""
    return names(row[at] for row in tables(heading)[table] if f"`{first}`" in row[0])


def keys(value, inside: str = "") -> set[str]:
    """Of a TOML file: its keys and those of its tables, [name] for a table and [[name]] for a list of tables."""
    found = set()
    for key, part in value.items():
        if isinstance(part, dict):
            found |= {f"[{inside}{key}]"} | keys(part, f"{inside}{key}.")
            continue
        is_tables = isinstance(part, list) and part and isinstance(part[0], dict)
        found |= {f"[[{key}]]"} if is_tables else {key}
        for one in part if is_tables else ():
            found |= keys(one)
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A scene folder with everything that one can hold."""
    path = tmp_path_factory.mktemp("scene")
    made = scenes.make("anchor+normals+gyro", 1, 40)
    arena, robot = made.scene.arena, made.scene.robot
    box = arena.obstacles[0]
    arena = dataclasses.replace(arena, wall=arena.textures[0], surfaces=((box, arena.textures[0]),))
    arena = dataclasses.replace(arena, unknown=((0.1, 0.1, 0.2, 0.2),))
    cells = np.zeros((10, 10), np.uint8)
    sensor = SensorTable("light", (0.0, 0.0), 0.0, 0.0, cells, 0.3, np.array([0.0, 1.0]), np.array([[1.0]]))
    prior = scene_files.Prior("gaussian", (-0.6, 3.36, 0.0), (0.1, 0.1, 0.1))
    topics = Topics(command_type="Twist", touch={name: f"/{name}" for name in TOUCHES})
    base = BaseTable(wheel_base_m=0.2, acceleration_m_s2=1.0, topics=topics)
    robot = dataclasses.replace(robot, sensors=(sensor,), base=base)
    whole = scene_files.Scene(arena, robot, prior, origin=(-1.0, 2.0, 0.5))
    rows = made.observations
    rows = dataclasses.replace(rows, own=np.zeros((len(rows), 1)), point=np.full((*rows.normal.shape[:2], 3), np.nan))
    scenes.write_scene(path, whole, rows)
    return path


@pytest.mark.parametrize("file", ["arena.toml", "robot.toml", "prior.toml"])
def test_keys_of_a_scene_are_those_that_are_written_and_no_other_is_read(folder, tmp_path, file):
    text = (folder / file).read_text()
    assert column(file) == keys(tomllib.loads(text))
    for path in folder.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / file).write_text(f"of_no_table = 1\n{text}")
    with pytest.raises(scene_files.SceneError, match="of_no_table"):
        scene_files.load(tmp_path)


def test_columns_of_observations(folder):
    own = {"t_s", *observations.ODOMETRY, "NAME_TEXTURE", "NAME_mm", "NAME", *observations.TRUTH}
    own |= {f"NAME_{name}" for name in (*NORMAL, *POINT, f"{SURFACE}TEXTURE")}
    assert column("observations.csv") == own
    scene = scene_files.load(folder)
    with open(folder / "observations.csv", newline="") as file:
        header = next(csv.reader(file))
    written = set()
    for name in header:
        for whisker in scene.robot.whiskers:
            name = re.sub(rf"^{whisker.name}_", "NAME_", name)
        for kind in scene.arena.textures:
            name = re.sub(rf"^NAME_{kind}$", "NAME_TEXTURE", name)
        written.add("NAME" if name == "light" else name)
    assert written == own - {f"NAME_{SURFACE}TEXTURE"}  # which the pilot alone writes


def test_cells_of_observations_that_are_empty_or_nan(folder, tmp_path):
    """Each row of the table as it says, by what the reader makes of one cell."""
    scene = scene_files.load(folder)
    tip, ray = scene.robot.of_role("texture")[0].name, scene.robot.of_role("object")[0].name
    kind = scene.arena.textures[0]
    places = {
        "NAME_TEXTURE": (f"{tip}_{kind}", lambda rows: rows.texture[0, 0, 0]),
        "NAME_mm": (f"{ray}_mm", lambda rows: rows.radial_m[0, 0]),
        "NAME": ("light", lambda rows: rows.own[0, 0]),
        "NAME_normal_rad": (f"{ray}_normal_rad", lambda rows: rows.normal[0, 0, 0]),
        "NAME_point_x_m": (f"{ray}_point_x_m", lambda rows: rows.point[0, 0, 0]),
        "true_x_m": ("true_x_m", lambda rows: rows.truth[0, 0]),
    }
    table = {name: row for row in tables("observations.csv")[0][1:] for name in names(row[:1])}
    for name, (cell, value) in places.items():
        for at, text in ((3, ""), (4, "nan")):
            with open(folder / "observations.csv", newline="") as file:
                lines = list(csv.reader(file))
            lines[1][lines[0].index(cell)] = text
            with open(tmp_path / "observations.csv", "w", newline="") as file:
                csv.writer(file).writerows(lines)
            found = value(localise.read_observations(tmp_path / "observations.csv", scene))
            if np.isnan(found):
                meaning = "not known" if name == "true_x_m" else "not read"
            else:
                meaning = "no contact" if found == np.inf and name == "NAME_mm" else "bad cell"
            assert table[name][at] == meaning, (name, text)


def test_keys_of_an_occupancy_map():
    source = inspect.getsource(occupancy)
    read = re.findall(r'fields\.\w+\("(\w+)"', source) + re.findall(r'"(\w+_thresh)"', source)
    assert column("Occupancy map") == set(read)
    assert row_of("Occupancy map", "mode") == set(occupancy.MODES)


def test_columns_of_estimates():
    assert column("Estimates") == set(localise.ESTIMATE_HEADER.split(","))


def run_file(name: str) -> set[str]:
    return row_of("Folder of a run", name)


def test_files_of_a_run(folder, tmp_path):
    assert run_file("covariance_FILTER.csv") == set(dict(track.FILES)["covariance"].split(","))
    scene = scene_files.load(folder)
    tip = SimpleNamespace(texture="X", inside_m=0.0, travelled_m=0.0)
    world = SimpleNamespace(pose=(0.0, 0.0, 0.0), tip=lambda _lane: tip)
    tips = [w.name for w in scene.robot.of_role("texture")]
    row = level1.Truth(scene).row(0, world)
    assert {re.sub(rf"^({'|'.join(tips)})_", "NAME_", key) for key in row} == run_file("truth.csv")
    text = io.StringIO()
    rowfiles.Traces(text, SimpleNamespace(texture_lanes=[0], names=["NAME"]))
    assert set(text.getvalue().strip().split(",")) == run_file("traces.csv")
    training.write_radial_points(tmp_path, {}, {})
    assert set((tmp_path / "radial_points.csv").read_text().strip().split(",")) == run_file("radial_points.csv")


def test_keys_of_a_summary():
    """As the runs that are stored have them."""
    demo = json.loads((ROOT / "bench/results/demo.json").read_text())
    assert column("Folder of a run", 1) == demo.keys()
    runs = json.loads((ROOT / "bench/results/robot_long.json").read_text())
    long = next(run for name, run in runs.items() if name.startswith("bytes"))
    added = long.keys() - demo.keys()
    table = {row[0]: row for row in tables("Folder of a run")[2][1:]}
    assert names(table) == added
    assert names([table["`filters`"][2]]) == set(next(iter(long["filters"].values())))


def test_files_of_a_thymio():
    files = names(row[0] for row in tables("Recording of a Thymio on a printed floor")[0][1:])
    assert files == {*thymio.FILES, thymio.MAP}


def test_fields_of_texture_models():
    fields = {field.name for field in dataclasses.fields(spectral.SpectralModel)}
    assert column("Texture models") == fields | {"format"}
    assert row_of("Texture models", "format") == {spectral.FORMAT}
    assert row_of("Texture models", "limits") - {"[C]"} == set(spectral.LIMITS)
    naive = re.search(r"The naive Bayes.*?\n\n", PAGE, re.DOTALL)[0]
    saved = set(re.findall(r'"(\w+)"', inspect.getsource(texture_model.TextureModel.save)))
    assert names([naive]) >= saved | {texture_model.FORMAT}


def test_columns_of_radial_recordings(tmp_path):
    assert column("Radial recordings") == set(radial_models.NO_CHANNEL)
    file = calibration.ContactsFile(tmp_path / "contacts.csv", 0.1, 7)
    file.close()
    header = set((tmp_path / "contacts.csv").read_text().strip().split(","))
    assert header - column("Radial recordings") == {"x", "y"}
    rest = calibration.Rest(0, np.zeros(2), np.zeros(2), 1, 0)
    calibration.write_rest(tmp_path / "rest.toml", [rest], ["FL"])
    assert column("Radial recordings", 1) == keys(tomllib.loads((tmp_path / "rest.toml").read_text()))


def test_fields_of_radial_models():
    fields = {
        radial_models.FORMAT: {*radial_models.FIELDS},
        radial_models.CURVE_FORMAT: {*CurveModel.NUMBERS},
        radial_models.PRESS_FORMAT: {"unit", "axes", *press.PressModel.NUMBERS, "stages", "curve"},
    }
    assert {name: row_of("Radial models", name) for name in column("Radial models")} == fields
    stage = re.search(r"A stage of a press model has.*?\. ", PAGE, re.DOTALL)[0]
    assert names([stage]) == {"direction_deg", *press.Stage.NAMES}
    plug = re.search(r"A plug has.*?\. ", PAGE, re.DOTALL)[0]
    assert names([plug]) == {"unit", *Plug.NUMBERS, "direction"}


def test_keys_of_a_fault(tmp_path):
    path = tmp_path / "faults.toml"
    path.write_text("[[fault]]\nof_no_table = 1\n")
    with pytest.raises(bridge.SimulationError) as refused:
        bridge.read_faults(path, 2000)
    known = set(re.findall(r"\w+", str(refused.value).partition("use ")[2])) - {"or"}
    assert column("Faults of the simulated bridge") == known
    kinds = row_of("Faults of the simulated bridge", "kind")
    log = (ROOT / "protocol/whisker.toml").read_text() + "".join(
        file.read_text() for file in (ROOT / "sim").rglob("*fault*.cpp")
    )
    assert all(kind in log for kind in kinds)


def test_lines_of_a_list_of_nodes(tmp_path):
    assert "`lane N: serial N,`" in PAGE
    path = tmp_path / "nodes.txt"
    path.write_text("  2    7  1.0 mlx90333\nlane 3: serial 8, more\n  4 none  1.0 x\nlane 3: serial 9, later\n")
    assert nodes.read_nodes(path) == {2: 7, 3: 9}


def test_keys_of_localise(folder):
    scene = scene_files.load(folder)
    rows = localise.read_observations(folder / "observations.csv", scene)
    shown = localise.summary(localise.run("adaptive", scene, rows, {}, 0, 10), rows.truth)
    assert column("whisker localise --json") == shown.keys()


def test_keys_of_texture_classify():
    fields = {field.name for field in dataclasses.fields(texture_model.Decision)}
    assert column("whisker texture classify --json") == fields
    shown = json.loads(texture.rows({"CARPET": Counter(A=1)}, ["A", "unknown"])[0])
    line = re.search(r"Of a folder, one object a surface:.*", PAGE)[0]
    assert names([line]) == {"surface", "decisions", "unknown"} <= shown.keys()


def test_keys_of_radial_predict_and_follow(capsys):
    assert column("whisker radial predict --json") == {"contact", "t_s", *radial_models.Estimate._fields}
    size = {"point": (1, 2), "point_cov": (1, 2, 2), "velocity": (1, 2), "velocity_cov": (1, 2, 2)}
    arrays = {name: np.ones(size.get(name, (1,))) for name in radial.Reports._fields}
    radial._follow(SimpleNamespace(json=True), "1", 0.1, radial.Reports(**arrays | {"motion": ["base"]}), 0)
    assert column("whisker radial follow --json") == json.loads(capsys.readouterr().out).keys()


def test_keys_of_info():
    def of(kind) -> set[str]:
        return {field.name for field in dataclasses.fields(kind)}

    heading = "whisker info --json"
    assert row_of(heading, "ring") == {"name", "state"} | of(ring.ReaderInfo)
    assert row_of(heading, "clock") == of(ring.Clock)
    bridge = SimpleNamespace(node="n", product="p", serial="s", speed=480)
    assert row_of(heading, "usb") == info.describe_usb(bridge).keys()
    assert row_of(heading, "host") == {"wire_version"}
    assert {"lanes", "up_s"} <= row_of(heading, "daemon")
    declared = (ROOT / "host/libwhisker/include/whisker/stats.h").read_text()
    assert all(re.search(rf"\b{name}\b", declared) for name in of(ring.DaemonStats))


def test_columns_of_streams_and_logs():
    fixed = {"tick", "t_s", "sequence"}
    assert row_of("Streams and logs", "whisker stream") == fixed | {f"laneN_{name}" for name in stream.FIELDS}
    assert row_of("Streams and logs", "whisker stream --json") == {*fixed, "lanes"}
    log = (ROOT / "host/apps/whisker_log.c").read_text()
    written = set(re.findall(r'\\"(\w+)\\":', log))
    assert row_of("Streams and logs", "whisker-log --summary") == written
    assert "lane,tick,code,errors" in log
    assert row_of("Streams and logs", "whisker-log --bad") == {"lane", "tick", "code", "errors"}


def test_an_entry_of_the_ring_has_the_offsets_of_the_page():
    at = {next(iter(names([row[2]]))): (int(row[0]), int(row[1])) for row in tables("The ring")[0][1:]}
    assert at == {name: (ring.FRAME.fields[name][1], ring.FRAME.fields[name][0].itemsize) for name in ring.FRAME.names}
    assert names(tables("The ring")[0][-1][3:]) == set(ring.SAMPLE.names)
