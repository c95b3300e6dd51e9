"""systemd units of a real robot: one for each process of the process table, sound, and fed while the process lives."""

import os
import shutil
import signal
import subprocess
import sys
import time
from configparser import ConfigParser
from dataclasses import replace
from pathlib import Path

import pytest
from linkkit import free_endpoint
from patience import PATIENCE_S

from crunchbot import scene as scenes_of
from crunchbot.cli import main
from crunchbot.robot.network.notify import Notify
from crunchbot.robot.processes import parts
from crunchbot.robot.processes.units import TARGET, WATCHDOG_S
from crunchbot.robot.processes.watchdog import Watchdog
from crunchbot_lab import scenes

FEEDINGS = 10  # of a watchdog, by a program that does not hang


@pytest.fixture(scope="module")
def robot(tmp_path_factory) -> tuple[Path, Path]:
    """A scene without whiskers, and a folder where models would be."""
    folder = tmp_path_factory.mktemp("units")
    made = scenes.make("robot", 1, 5)
    scenes_of.write(folder / "my scene", replace(made.scene, robot=replace(made.scene.robot, whiskers=())))
    return folder / "my scene", folder


def read(path: Path) -> ConfigParser:
    parser = ConfigParser(strict=False, interpolation=None, delimiters=("=",))
    parser.optionxform = str
    parser.read(path)
    return parser


def written(robot, out: Path, *more: str) -> dict[str, ConfigParser]:
    scene, models = robot
    words = ["robot", str(scene), "--models", str(models), "--port", "/dev/ttyUSB3", "--units", str(out), *more]
    assert main(words) == 0
    return {path.name: read(path) for path in out.iterdir()}


@pytest.fixture
def trained(monkeypatch):
    """Models are not what is tried here."""
    monkeypatch.setattr("crunchbot.commands.robot.load_models", lambda folder, robot: ({}, {}))


def test_every_process_of_the_table_has_a_unit(trained, robot, tmp_path, capsys):
    found = written(robot, tmp_path, "--desktop")
    body, meeting = parts.Body(*robot, 1, Path("/dev/ttyUSB3"), 1), parts.Meeting("whisker", tmp_path)
    table = parts.netbook(body, meeting, parts.NAVIGATOR) + parts.desktop(body, meeting, tmp_path / "bag", 8028)
    names = {program.name for program in table} - {"base"}  # cmake --install brings that of the base, and whiskerd's
    assert found.keys() == {f"whisker-{name}.service" for name in names} | {TARGET}
    wanted = found[TARGET]["Unit"]["Wants"].split()
    assert set(wanted) == {"whiskerd.service", "whisker-base@ttyUSB3.service", *found} - {TARGET}
    for name in names:
        service = found[f"whisker-{name}.service"]["Service"]
        assert service.get("WatchdogSec") == (str(WATCHDOG_S[name]) if name in WATCHDOG_S else None)
        assert service["Restart"] == "on-failure" and sys.executable in service["ExecStart"]
    pilot = found["whisker-pilot.service"]
    assert "whisker-base@ttyUSB3.service" in pilot["Unit"]["After"] and '"' in pilot["Service"]["ExecStart"]
    assert "--base /run/whisker-base/ttyUSB3/base.sock" in pilot["Service"]["ExecStart"]
    assert "--ring-owner whisker" in pilot["Service"]["ExecStart"] and TARGET in capsys.readouterr().out


def test_a_mapper_takes_the_navigators_place(trained, robot, tmp_path):
    found = written(robot, tmp_path, "--map")
    assert "whisker-navigator.service" not in found
    mapper = found["whisker-mapper.service"]["Service"]
    assert "--journal /var/lib/whisker-mapper/mapper.journal" in mapper["ExecStart"]
    assert "--out /var/lib/whisker-mapper/map" in mapper["ExecStart"] and mapper["WatchdogSec"] == "10"
    assert "--await mapper" in found["whisker-pilot.service"]["Service"]["ExecStart"]


def test_systemd_finds_nothing_wrong(trained, robot, tmp_path):
    if not (analyze := shutil.which("systemd-analyze")):
        pytest.skip("systemd-analyze is not installed")
    units = tmp_path / "units"
    written(robot, units, "--desktop")
    for name in ("whiskerd.service", "whisker-base@ttyUSB3.service"):
        (units / name).write_text("[Service]\nExecStart=/bin/true\n")
    paths = sorted(path for path in units.iterdir() if path.name.startswith("whisker-"))
    environment = os.environ | {"SYSTEMD_UNIT_PATH": f"{units}:"}
    done = subprocess.run([analyze, "verify", *paths], env=environment, capture_output=True, text=True)
    assert done.returncode == 0 and "whisker-" not in done.stderr, done.stderr


def test_a_simulated_robot_has_no_units(tmp_path, capsys):
    assert main(["robot", "--simulated", "--units", str(tmp_path / "units")]) == 2
    assert "--units without SCENE" in capsys.readouterr().err and not (tmp_path / "units").exists()


def test_a_navigator_feeds_its_watchdog_until_it_hangs(robot, tmp_path):
    watchdog = Watchdog()
    words = [sys.executable, "-m", "crunchbot.cli", "navigator", str(robot[0]), "--stay", "--filter", "odometry"]
    words += ["--listen", free_endpoint(), "--connect", free_endpoint()]
    process = subprocess.Popen(words, env=os.environ | watchdog.variables)
    try:
        end = time.monotonic() + PATIENCE_S
        while not watchdog._armed and time.monotonic() < end:
            assert not watchdog.bites(time.monotonic())
            time.sleep(0.02)
        assert watchdog._armed, "it said that it is ready"
        fed, end = 0, time.monotonic() + PATIENCE_S
        while fed < FEEDINGS:
            assert time.monotonic() < end, f"it fed {fed} times"
            fed += not watchdog.bites(time.monotonic()) and watchdog._silent_s == 0.0
            time.sleep(0.02)
        process.send_signal(signal.SIGSTOP)
        end = time.monotonic() + PATIENCE_S
        while not watchdog.bites(time.monotonic()):
            assert time.monotonic() < end, "it hangs, and nobody notices"
            time.sleep(0.02)
    finally:
        process.kill()
        process.wait()
        watchdog.close()


def test_without_a_manager_nothing_is_sent(monkeypatch):
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    Notify().alive()
    monkeypatch.setenv("NOTIFY_SOCKET", "@nobody-listens-here")
    notify = Notify()
    notify.alive()
    notify.stopping()
