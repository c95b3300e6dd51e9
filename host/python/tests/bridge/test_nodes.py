"""Calibrations belong to nodes: lists of nodes, what a calibration keeps of them, and whose model is refused."""

import numpy as np
import pytest
from commandkit import run, signals_as_before  # noqa: F401 - a fixture
from rings import make_frames, ring_name
from whisks import whisks

from crunchbot.bridge.nodes import NodeError, read_nodes
from crunchbot.bridge.ring import Writer
from crunchbot.robot.models import check_nodes
from crunchbot.tables import TableError
from crunchbot.touch.calibration import ContactsFile, Whisk
from crunchbot.touch.radial import model as radial
from crunchbot_lab.simulation.scenes import make_robot

TABLE = """lane  serial      version  options  wire  chip    loader  state
   0  4711        1.2      0x0001   3     0x0629  1       runs
   2  23          1.2      0x0001   3     0x0629  1       runs
   3  none        1.2      0x0001   3     0x0629  1       runs
"""
LOG = "whiskerd: 2 nodes answer\nwhiskerd: lane 2: serial 24, version 1.2, wire 3, runs\n"


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "nodes.txt"
    path.write_text(TABLE)
    return path


def contacts(path, node):
    """A calibration file of whisks by the formula, as `whisker calibrate` writes it."""
    made = whisks(np.random.default_rng(1), 2)
    file = ContactsFile(path, None, node)
    for contact, radius_mm in zip(made.recorded, made.radius_mm, strict=True):
        file.add(radius_mm, Whisk(contact.t_s, contact.samples))
    file.close()
    return path


def test_nodes_of_a_table_and_of_a_log(table, tmp_path):
    assert read_nodes(table) == {0: 4711, 2: 23}
    log = tmp_path / "log"
    log.write_text(TABLE + LOG)
    assert read_nodes(log) == {0: 4711, 2: 24}
    (tmp_path / "empty").write_text("lane  serial\n")
    for path, complaint in ((tmp_path / "empty", "lists no node"), (tmp_path / "none", "cannot be read")):
        with pytest.raises(NodeError, match=complaint):
            read_nodes(path)


@pytest.mark.parametrize("name", ["paper", "rational", "default"])
def test_a_model_keeps_its_node_and_is_refused_for_another(capsys, tmp_path, name):
    mine, other, unknown = (contacts(tmp_path / f"{n}.csv", n) for n in (23, 24, None))
    model = tmp_path / "m.json"
    assert run(capsys, "radial", "fit", mine, "--out", model, "--model", name)[0] == 0
    assert radial.load(model).node == 23
    for path in (mine, unknown):
        code, out, _ = run(capsys, "radial", "predict", model, path)
        assert code == 0 and len(out.splitlines()) == 12
    code, out, err = run(capsys, "radial", "predict", model, other)
    assert code == 2 and out == "" and "node 23, but this is node 24's" in err and err.count("\n") == 1
    assert run(capsys, "radial", "fit", unknown, "--overwrite", "--out", model, "--model", name)[0] == 0
    assert radial.load(model).node is None and run(capsys, "radial", "predict", model, other)[0] == 0


def test_a_file_of_two_nodes_or_of_none_is_one_line(tmp_path):
    for cells, complaint in ((("1", "2"), "nodes 1 and 2"), (("x", "x"), "'x' is no serial number")):
        path = tmp_path / "c.csv"
        rows = [f"{n},100,{t},{32768 + t},{cells[n]}" for n in range(2) for t in range(30)]
        path.write_text("\n".join(["contact,radius_mm,t_s,x,node", *rows]) + "\n")
        with pytest.raises(TableError, match=complaint):
            radial.read_whisks(path, with_radius=True)


def test_calibrate_asks_for_a_node_that_is_there(capsys, tmp_path, table):
    with Writer(ring_name(), 1 << 12) as ring:
        ring.publish(make_frames(2000))
        options = ["--ring", ring.name, "--out", tmp_path, "--yes", "--radii", "90", "--nodes", table]
        code, _, err = run(capsys, "calibrate", *options, "--lane", 3)
    assert code == 2 and "lane 3 has no node with a serial number" in err and err.count("\n") == 1


def test_the_pilot_refuses_models_of_other_nodes(tmp_path, table):
    robot = make_robot()
    model = radial.RadialModel(-0.03, 180.0, 3.0, 90.0, 138.0)
    models = {whisker.name: model for whisker in robot.of_role("object")}
    check_nodes(table, robot, models)  # none says whose it is
    models["object_1"] = radial.RadialModel(-0.03, 180.0, 3.0, 90.0, 138.0)  # lane 2
    models["object_1"].node = 23
    check_nodes(table, robot, models)
    models["object_1"].node = 24
    with pytest.raises(NodeError, match="object_1: is of the whisker of node 24, but this is node 23's"):
        check_nodes(table, robot, models)
