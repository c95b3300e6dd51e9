"""`whisker bridge-sim`: what a user without hardware starts, watched with the commands a user has."""

import subprocess
import sys

import numpy as np
import pytest
from chainrun import BUILD, END_S

from whisker.bridgesim import SimulationError, read_faults
from whisker.cli import main
from whisker.recording import read
from whisker.ring import FRAME

SIX = 0x3F
FAULTS = """
[[fault]]
t_s = 0.5
lane = 2
kind = "link_flip"
bit = 5
[[fault]]
tick = 600
lane = 0
kind = "sensor_error"
error = "field_low"
[[fault]]
t_s = 0.4
kind = "host_away"
"""


def command(*arguments):
    return [sys.executable, "-m", "whisker.cli", *map(str, arguments)]


@pytest.fixture
def build(monkeypatch):
    monkeypatch.setenv("WHISKER_BUILD", str(BUILD))


def record(tmp_path, ring, *options) -> np.ndarray:
    """Frames of a bridge-sim with these options, recorded by `whisker record`."""
    path = tmp_path / "a.mcap"
    with subprocess.Popen(command("record", path, "--ring", ring, "--wait", END_S), stdout=subprocess.PIPE) as recorder:
        done = subprocess.run(
            command("bridge-sim", "--ring", ring, *options), capture_output=True, text=True, timeout=END_S
        )
        assert done.returncode == 0, done.stderr
        assert f"try: whisker top --ring {ring}" in done.stdout
        assert recorder.wait(END_S) == 0
    with read(path) as recording:
        assert recording.complete and not list(recording.events()) and recording.metadata["missing"] == "0"
        return np.concatenate(list(recording.blocks()))


def test_faults_strike_where_the_file_says(build, tmp_path):
    (tmp_path / "faults.toml").write_text(FAULTS)
    options = ["--seconds", 1, "--pace", 0, "--fault", tmp_path / "faults.toml"]
    frames = record(tmp_path, "whisker-test-faults", *options)
    assert len(frames) == 2000 and (np.diff(frames["sequence"]) == 1).all()
    bad = [(int(frames["tick"][i]), lane) for i, lane in np.argwhere(frames["lane"]["status"][:-1, :6] != 0)]
    assert bad == [(600, 0), (1000, 2)]


def test_more_lanes_than_the_scene_has_are_at_rest(build, tmp_path):
    frames = record(tmp_path, "whisker-test-lanes", "--seconds", 0.2, "--pace", 0, "--lanes", 8)
    assert frames.dtype == FRAME and (frames["lane_mask"] == 0xFF).all()
    assert (frames["lane"]["status"][:, :8] == 0).mean() > 0.9
    assert (np.abs(frames["lane"]["alpha"][50:-1, 7].astype(int) - 0x8000) < 2000).all()


def test_wrong_use_is_one_line(capsys, build, tmp_path):
    faults = tmp_path / "faults.toml"
    faults.write_text("[[fault]]\ntick = 1\nlane = 9\nkind = 'link_dead'\n")
    done = subprocess.run(command("bridge-sim", "--seconds", 1, "--fault", faults), capture_output=True, text=True)
    assert (
        done.returncode == 1 and "lane 9 is not populated; give 0 to 5" in done.stderr and done.stderr.count("\n") == 1
    )
    with pytest.raises(SystemExit):
        main(["bridge-sim", "--lanes", "29"])
    assert "'29' is not a whole number from 1 to 28" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("fault = 1", "give [[fault]] tables and nothing else"),
        ("[[fault]]\nkind = 'x'", "fault 1: give either tick or t_s"),
        ("[[fault]]\ntick = 1.5\nkind = 'x'", "fault 1: tick is no whole number"),
        ("[[fault]]\ntick = 1\nlane = -1\nkind = 'x'", "fault 1: lane is no whole number"),
        ("[[fault]]\ntick = 1", "fault 1: kind is missing"),
        ("[[fault]]\ntick = 1\nkind = 'x'\ncolour = 2", "fault 1: 'colour' is no key"),
        ("[[fault]]\ntick = 1\nlane = 1\nkind = 'sensor_error'\nerror = 'tired'", "error 'tired' is none; use one of"),
        ("not TOML", "cannot be read"),
    ],
)
def test_wrong_fault_files_are_one_line(tmp_path, text, complaint):
    path = tmp_path / "faults.toml"
    path.write_text(text)
    with pytest.raises(SimulationError) as told:
        read_faults(str(path), 2000)
    assert complaint in str(told.value) and str(path) in str(told.value) and "\n" not in str(told.value)
