"""`whisker robot`: which processes it starts, by its options."""

import threading

import pytest
from commandkit import run, signals_as_before  # noqa: F401 - a fixture
from linkkit import free_endpoint

from whisker import scene as scenes
from whisker.commands import robot
from whisker.demo import training
from whisker.simulation.scenes import make_scene


def free_port() -> str:
    return free_endpoint().rpartition(":")[2]


@pytest.fixture
def started(monkeypatch, capsys, tmp_path):
    """A call: the processes that the command would start with these options; none is, for it is stopped before."""
    stopped = threading.Event()
    stopped.set()
    monkeypatch.setattr(robot, "stop_on_signals", lambda: stopped)

    def names(*options) -> list[str]:
        place = ["--out", tmp_path, "--first-port", free_port()]
        code, out, err = run(capsys, "robot", tmp_path, "--models", tmp_path, *place, *options)
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


def test_what_cannot_be_is_one_line(capsys, tmp_path):
    for options, complaint in (
        (["--simulated", "--no-daemon"], "only a whiskerd of its own sees that bridge"),
        ([tmp_path], "no SCENE or no --models"),
    ):
        code, _, err = run(capsys, "robot", *options, "--out", tmp_path, "--first-port", free_port())
        assert code == 2 and complaint in err and err.count("\n") == 1
