"""`whisker bridge-sim`: what a user without hardware starts, watched with the commands a user has."""

import re
import socket
import subprocess
import sys
from contextlib import contextmanager

import numpy as np
import pytest
from chainrun import BUILD, END_S

from crunchbot.bridge.ring import FRAME
from crunchbot.cli import main
from crunchbot.recording import read
from crunchbot_lab.simulation.bridge import SimulationError, read_faults
from whisker_protocol import CODES, LIMITS, SENSOR_ERRORS, STATUS_CODE_SHIFT

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

LASTING = """
[[fault]]
tick = 50
until = "end"
lane = 1
kind = "sensor_dead"
[[fault]]
t_s = 0.02
until = 300
lane = 2
kind = "sensor_frozen"
[[fault]]
tick = 300
until_s = 0.18
lane = 3
kind = "link_dead"
[[fault]]
tick = 60
until = 150
lane = 3
kind = "link_dead"
"""


def command(*arguments):
    return [sys.executable, "-m", "crunchbot.cli", *map(str, arguments)]


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


@pytest.mark.parametrize("level", ["rtl", "bytes"])
def test_what_lasts_lasts_from_tick_to_tick(build, tmp_path, level):
    (tmp_path / "faults.toml").write_text(LASTING)
    options = ["--seconds", 0.2, "--pace", 0, "--level", level, "--fault", tmp_path / "faults.toml"]
    frames = record(tmp_path, f"whisker-test-lasting-{level}", *options)
    codes = frames["lane"]["status"] >> STATUS_CODE_SHIFT
    assert set(codes[50:, 1]) == {CODES["sensor_absent"], CODES["resync"]} and not codes[:50, 1].any()
    broken = np.r_[60:150, 300:360]
    assert (codes[broken, 3] == CODES["absent"]).all() and not np.delete(codes[:-1, 3], broken).any()
    assert not codes[:-1, 2].any()
    alpha = frames["lane"]["alpha"][:, 2]
    assert np.ptp(alpha[40:300]) == 0 < np.ptp(alpha[300:-1])


def test_doctor_finds_what_lasts(build, capsys, tmp_path):
    """One entry each: a dead lane, a frozen one and a broken cable, beside good ones."""
    kinds = {1: "sensor_dead", 2: "sensor_frozen", 3: "link_dead"}
    text = "".join(f'[[fault]]\ntick = 0\nuntil = "end"\nlane = {n}\nkind = "{kind}"\n' for n, kind in kinds.items())
    (tmp_path / "faults.toml").write_text(text)
    words = command(
        "bridge-sim", "--ring", "whisker-test-doctor", "--level", "bytes", "--fault", tmp_path / "faults.toml"
    )
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline()
        main(["doctor", "--ring", "whisker-test-doctor"])
        process.terminate()
        assert process.wait(END_S) == 0
    said = [line for line in capsys.readouterr().out.splitlines() if "lane " in line]
    assert [re.match(r"FAIL  lane (\d): (.{8})", line).groups() for line in said] == [
        ("1", "100 % ba"),
        ("2", "frozen: "),
        ("3", "100 % ba"),
    ]


def test_more_lanes_than_the_scene_has_are_at_rest(build, tmp_path):
    frames = record(tmp_path, "whisker-test-lanes", "--seconds", 0.2, "--pace", 0, "--lanes", 8, "--level", "bytes")
    assert frames.dtype == FRAME and (frames["lane_mask"] == 0xFF).all()
    assert (frames["lane"]["status"][:, :8] == 0).mean() > 0.9
    assert (np.abs(frames["lane"]["alpha"][50:-1, 7].astype(int) - 0x8000) < 2000).all()


def test_faults_are_reported_to_the_simulation_in_the_order_they_strike(tmp_path):
    path = tmp_path / "faults.toml"
    path.write_text(FAULTS + '[[fault]]\ntick = 0\nlane = 1\nkind = "sensor_flip"\n')
    low = 1 << SENSOR_ERRORS["field_low"]["sensor_bit"]
    assert read_faults(str(path), 2000).splitlines() == [
        "lane 0 1 sensor_flip 0",  # the first bit, where none is named
        f"lane 600 0 sensor_error {low}",
        "usb 800 host_away",
        "lane 1000 2 link_flip 5",
    ]


@contextmanager
def served():
    """A connection to the device that bridge-sim serves; at the end bridge-sim is stopped as a user stops it."""
    words = command("bridge-sim", "--usbip", 0)
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        said = process.stdout.readline()
        found = re.match(r"the bridge is served by usbip on port (\d+) of this machine; try: ", said)
        assert found, said + process.stderr.read()
        with socket.create_connection(("127.0.0.1", int(found[1])), END_S) as link:
            yield link
        process.terminate()
        assert process.wait(END_S) == 0


def test_usbip_lists_the_bridge_of_the_verilog(build):
    with served() as link:
        link.sendall(bytes.fromhex("0111800500000000"))
        answer = link.makefile("rb").read(12 + 312 + 2 * 4)
    assert answer[:12] == bytes.fromhex("011100050000000000000001")
    device = answer[12 + 256 + 32 : 12 + 312]
    identity = LIMITS["usb_vendor_id"].to_bytes(2, "big") + LIMITS["usb_product_id"].to_bytes(2, "big")
    assert device[:12] == bytes.fromhex("000000010000000200000003") and device[12:16] == identity
    assert (answer[12 + 312], answer[12 + 312 + 4]) == (0xFF, 0x03)  # vendor's and HID's class


def test_wrong_use_is_one_line(capsys, build, tmp_path):
    faults = tmp_path / "faults.toml"
    faults.write_text("[[fault]]\ntick = 1\nlane = 9\nkind = 'link_dead'\n")
    done = subprocess.run(command("bridge-sim", "--seconds", 1, "--fault", faults), capture_output=True, text=True)
    assert (
        done.returncode == 1 and "lane 9 is not populated; give 0 to 5" in done.stderr and done.stderr.count("\n") == 1
    )
    assert main(["bridge-sim", "--lanes", "29"]) == 2
    assert "'29' is not a whole number from 1 to 28" in capsys.readouterr().err


def test_a_port_that_is_taken_is_one_line(build):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        done = subprocess.run(command("bridge-sim", "--usbip", port), capture_output=True, text=True, timeout=END_S)
    assert done.returncode == 1 and f"port {port} of 127.0.0.1 cannot be listened on" in done.stderr
    assert done.stderr.count("\n") == 1


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
        ("[[fault]]\ntick = 1\nlane = 1\nkind = 'sensor_frozen'", 'give until, a tick or "end", or until_s'),
        ("[[fault]]\ntick = 1\nuntil = 1\nlane = 1\nkind = 'link_dead'", "until is not after the fault's beginning"),
        ("[[fault]]\ntick = 1\nuntil = 'end'\nlane = 1\nkind = 'link_flip'", "link_flip does not last; leave out"),
        ("[[fault]]\ntick = 1\nuntil = 'end'\nkind = 'link_dead'", "lane is no whole number from 0"),
        ("not TOML", "not TOML ("),
    ],
)
def test_wrong_fault_files_are_one_line(tmp_path, text, complaint):
    path = tmp_path / "faults.toml"
    path.write_text(text)
    with pytest.raises(SimulationError) as reported:
        read_faults(str(path), 2000)
    assert complaint in str(reported.value) and str(path) in str(reported.value) and "\n" not in str(reported.value)
