"""`whisker robot`: which processes it starts, by its options."""

import os
import socket
import sys
import threading

import pytest
from commandkit import run, signals_as_before  # noqa: F401 - a fixture
from linkkit import free_endpoint

from whisker import scene as scenes
from whisker.bridge.ring import Writer
from whisker.commands import robot
from whisker.demo import training
from whisker.robot import holders
from whisker.simulation.scenes import make_scene


def free_port() -> str:
    return free_endpoint().rpartition(":")[2]


@pytest.fixture
def started(monkeypatch, capsys, tmp_path):
    """A call: the processes that the command would start with these options; none is, for it is stopped before."""
    stopped = threading.Event()
    stopped.set()
    monkeypatch.setattr(robot, "stop_on_signals", lambda: stopped)

    monkeypatch.setattr(robot, "load_models", lambda folder, robot: ({}, {}))
    scenes.write(tmp_path / "scene", make_scene(5)[0])

    def names(*options) -> list[str]:
        place = ["--out", tmp_path, "--first-port", free_port(), "--ring", "whisker-test-robot-command"]
        code, out, err = run(capsys, "robot", tmp_path / "scene", "--models", tmp_path, *place, *options)
        assert code == 0, err
        return out.removeprefix("starting ").partition(";")[0].split(", ")

    return names


def test_a_netbook_has_daemon_base_and_pilot(started):
    assert started() == ["whiskerd", "base", "pilot"]


def test_a_daemon_that_runs_already_is_used(started):
    assert started("--no-daemon") == ["base", "pilot"]


def test_the_desktops_side_is_added(started):
    assert started("--desktop") == ["navigator", "bag", "view", "whiskerd", "base", "pilot"]
    assert started("--desktop", "--no-view", "--no-daemon") == ["navigator", "bag", "base", "pilot"]


@pytest.mark.parametrize("given", [False, True])
def test_a_simulated_robot_learns_its_own_whiskers(capsys, monkeypatch, tmp_path, given):
    """Models of other whiskers read floors wrong: those that learn are those of the simulation, batch and all."""
    learnt = []
    monkeypatch.setattr("whisker.demo.training.learn", lambda models, scene, *_: learnt.append(scene))
    stopped = threading.Event()
    stopped.set()
    monkeypatch.setattr(robot, "stop_on_signals", lambda: stopped)
    scenes.write(tmp_path / "given", make_scene(5)[0])
    options = [tmp_path / "given"] if given else []
    code, _, err = run(
        capsys, "robot", *options, "--simulated", "--seed", 7, "--out", tmp_path / "out", "--first-port", free_port()
    )
    assert code == 0, err
    flown = (tmp_path / "out/scene.flat").read_text().splitlines()
    robots = [
        [line for line in text if line.split()[0] in ("mechanics", "batch", "texture_whisker", "object_whisker")]
        for text in (flown, training.flat(learnt[0]).splitlines())
    ]
    assert robots[0] == robots[1] and "batch 7" in robots[0]
    with pytest.raises(ValueError, match="simulated"):
        training.flat(scenes.load(tmp_path / "out/scene" if not given else tmp_path / "given"))


@pytest.fixture
def refused(capsys, monkeypatch, tmp_path):
    """A call: (exit code, line) of a start that is refused. Nothing is started, and nobody is waited for."""
    monkeypatch.setattr(robot, "Supervisor", None)

    def line(*options, port=None) -> tuple[int, str]:
        place = ["--out", tmp_path, "--first-port", port or free_port(), "--ring", "whisker-test-robot-command"]
        code, out, err = run(capsys, "robot", *options, *place)
        assert out == "" and err.count("\n") == 1, err
        return code, err

    return line


@pytest.fixture
def given(monkeypatch, tmp_path):
    """Scene and models that are right."""
    monkeypatch.setattr(robot, "load_models", lambda folder, robot: ({}, {}))
    scenes.write(tmp_path / "scene", make_scene(5)[0])
    return [tmp_path / "scene", "--models", tmp_path]


@pytest.mark.parametrize(
    "options, complaint",
    [
        (["--simulated", "--no-daemon"], "only a whiskerd of its own sees that bridge"),
        (["nosuch"], "no SCENE or no --models"),
        (["nosuch", "--models", "nosuch"], "nosuch"),
    ],
)
def test_what_cannot_be_is_one_line(refused, options, complaint):
    code, line = refused(*options)
    assert code == 2 and complaint in line


def test_models_are_looked_at_before_anything_starts(refused, tmp_path):
    scenes.write(tmp_path / "scene", make_scene(5)[0])
    code, line = refused(tmp_path / "scene", "--models", tmp_path / "nosuch")
    assert code == 2 and "nosuch/texture.json" in line


def test_who_holds_a_port_is_named(refused, given):
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        for first in (port, port - 2):
            code, line = refused(*given, port=first)
            assert code == 1 and f"port {port} of 127.0.0.1" in line and f"process {os.getpid()} (" in line
            assert "--first-port" in line
        code, line = refused(*given, "--desktop", "--view-port", port)
        assert code == 1 and f"process {os.getpid()} (" in line and "--view-port" in line


def test_who_writes_the_ring_is_named(refused, given):
    with Writer("whisker-test-robot-command", 64):
        code, line = refused(*given)
    assert code == 1 and f"by process {os.getpid()} (" in line and "--no-daemon" in line


def test_who_has_the_serial_port_is_named(refused, given, tmp_path):
    main, held = os.openpty()
    link = tmp_path / "port"
    link.symlink_to(os.ttyname(held))
    code, line = refused(*given, "--port", link)
    os.close(main)
    os.close(held)
    assert code == 1 and f"by process {os.getpid()} (" in line and "--port" in line


def test_a_port_that_is_not_there_is_said_once(started, capsys, tmp_path):
    warning = holders.check_serial(tmp_path / "none")
    assert f"{tmp_path}/none: there is no such port yet" in warning
    assert started("--port", tmp_path / "none") == ["whiskerd", "base", "pilot"]


def test_without_a_source_tree_models_have_to_be_given(refused, monkeypatch):
    """As from an installed wheel, which has no simulation to learn from."""
    monkeypatch.delitem(sys.modules, "whisker.demo.training", raising=False)
    monkeypatch.delattr("whisker.demo.training", raising=False)
    monkeypatch.setitem(sys.modules, "whisker.simulation.world", None)
    code, line = refused("--simulated")
    assert code == 2 and "source tree" in line and "--models" in line
