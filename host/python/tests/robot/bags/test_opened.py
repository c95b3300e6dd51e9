"""crunchbot.open: one object for the rows of a folder, a bag and a running robot."""

import inspect
import shutil
import subprocess
import sys
import threading
from importlib.resources import as_file, files

import numpy as np
import pytest
from folders import folder, recorded  # noqa: F401 - fixtures
from linkkit import free_endpoint

import crunchbot
from crunchbot.errors import UserError
from crunchbot.nav.filters import Filter
from crunchbot.observation import Row
from crunchbot.robot.network.link import Link
from crunchbot.robot.network.rows import RowPublisher
from crunchbot.robot.opened import opened

SENT = 12


def test_a_folders_rows_are_those_of_its_file_and_a_filter_takes_them_one_by_one(folder):  # noqa: F811
    run = crunchbot.open(folder)
    rows = list(run)
    assert len(rows) == len(run) > 20 and all(isinstance(row, Row) for row in rows)
    made, whole = Filter("ekf", run.scene), run.localise("ekf")
    stepped = [made.step(row).pose for row in rows]
    assert np.allclose(stepped, whole.poses, atol=1e-9)


def test_a_folder_in_pandas_has_the_columns_of_the_file(folder):  # noqa: F811
    pandas = pytest.importorskip("pandas")
    table, read = crunchbot.open(folder).to_pandas(), pandas.read_csv(folder / "observations.csv")
    assert [*table.columns] == [name for name in read.columns if name != "note"] and len(table) == len(read)
    assert np.allclose(table["odo_x_m"], read["odo_x_m"])


def test_a_bags_rows_come_with_its_scene():
    with as_file(files("crunchbot") / "data/first_minute.mcap") as bag:
        run = crunchbot.open(bag)
    assert len(run) == 600 and run.scene.robot.of_role("object")
    assert np.median(np.hypot(*(run.localise().poses - run.observations.truth).T[:2])) < 0.1


def test_a_plan_shows_both_paths_and_says_what_they_are(folder):  # noqa: F811
    shown = crunchbot.open(folder).show("ekf")._repr_html_()
    assert shown.count("<polyline") == 2 and "ekf: " in shown and "mm median" in shown


def test_its_types_are_one_line():
    assert len(str(inspect.signature(crunchbot.open))) < 160 and len(str(inspect.signature(opened))) < 160


def test_rows_of_a_running_robot_come_until_it_ends(folder, tmp_path, monkeypatch):  # noqa: F811
    shutil.copytree(
        folder, tmp_path / "robot-run/scene"
    )  # as `whisker robot --simulated` leaves it where it is started
    monkeypatch.chdir(tmp_path)
    endpoint, rows = free_endpoint(), list(crunchbot.open(folder))[:SENT]
    with Link("pilot", listen=[endpoint]) as pilot:
        publisher = RowPublisher(pilot)
        pilot.announce()

        def send():
            pilot.wait_for(["reader"])
            for row in rows:
                publisher.send(row)
            publisher.end()

        with crunchbot.open("robot", wait_s=60.0, connect=[endpoint]) as run:
            sender = threading.Thread(target=send)
            sender.start()
            taken = run.take(SENT + 5)
            sender.join()
    assert len(taken) == SENT
    assert np.allclose(taken.columns()["odo_x_m"], [row.motion[0] for row in rows], atol=1e-6)


def test_a_run_goes_into_a_file_of_rerun(folder, tmp_path):  # noqa: F811
    pytest.importorskip("rerun", reason="rerun-sdk is not installed: pip install 'crunchbot[rerun]'")
    run, file = crunchbot.open(folder), tmp_path / "run.rrd"
    run.to_rerun(file, "ekf")
    printed = subprocess.check_output([sys.executable, "-m", "rerun", "rrd", "print", file], text=True)
    for entity in ("arena", "ekf/pose", "ekf/path", "ekf/confidence", "truth/pose", "whiskers/"):
        assert f"/{entity}" in printed


@pytest.mark.parametrize(
    ("source", "options", "complaint"),
    [
        ("no/such", {}, "give a scene folder"),
        ("robot", {}, "give scene=FOLDER"),
        (".", {}, "give a scene folder"),
    ],
)
def test_what_holds_no_rows_is_one_line(tmp_path, monkeypatch, source, options, complaint):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match=complaint) as raised:
        crunchbot.open(source, **options)
    assert "\n" not in str(raised.value)


def test_a_robot_that_does_not_run_is_said(folder):  # noqa: F811
    with pytest.raises(UserError, match="no pilot answered"):
        crunchbot.open("robot", scene=folder, wait_s=0.0, connect=[free_endpoint()])


def test_importing_the_package_imports_no_more():
    program = (
        "import sys, crunchbot; print(sorted(m for m in sys.modules if m.startswith('crunchbot') or m == 'numpy'))"
    )
    assert subprocess.check_output([sys.executable, "-c", program], text=True).strip() == "['crunchbot']"
