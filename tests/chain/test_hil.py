"""The checks of `make test-hil`, on simulated parts: what is sound passes, what is broken is named, what is not there is skipped."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from chainrun import BUILD, END_S, Cable, program, running, simulation, write_flat_scene

from crunchbot.bridge.ring import FRAME, Clock
from whisker_protocol import CODES, LIMITS, STATUS_CODE_SHIFT

HIL = Path(__file__).resolve().parents[1] / "hil"
sys.path.insert(0, str(HIL))
from base_checks import SILENT_FRAMES, await_said, await_stop  # noqa: E402
from bridge_checks import judge_clock  # noqa: E402
from bridge_rig import SETTLE_TICKS, Rig, Stream  # noqa: E402
from checks import CheckError, SkipError  # noqa: E402

LONG_S = 3600
TICKS = range(3000, 20000, 20)  # at which the broken lane's cable spoils a bit
BRIDGE = "enumerates identity hid_control sample_points node_health frames lanes rest_noise clock replug"
BASE = "stream voltage mode drive dead_man commander_gone"
NOMINAL_NS = 1e9 / LIMITS["clock_hz"]


def words(*arguments) -> list[str]:
    return [sys.executable, str(HIL / "run.py"), "--simulated", *map(str, arguments)]


@pytest.fixture
def alone(monkeypatch):
    """No part is there but what a test brings."""
    monkeypatch.delenv("WHISKER_BASE_PORT", raising=False)
    monkeypatch.setenv("WHISKER_BUILD", str(BUILD))


@contextmanager
def at_a_bridge(folder: Path, options: list, *arguments) -> Iterator[tuple[subprocess.Popen, Cable]]:
    """The checks as the command of a simulated bridge; the simulation's own end is nobody's business."""
    scene, _ = write_flat_scene(folder, 1)
    sock = folder / "sim.sock"
    command = simulation(folder, scene, LONG_S, 1, "unused", "--level", "bytes", "--socket", sock, *options)
    command = [*command[: command.index("--") + 1], *words(*arguments)]
    with running(command, stdout=subprocess.PIPE, env=os.environ | {"PYTHONUNBUFFERED": "1"}) as process:
        cable = Cable(sock, process)
        yield process, cable
        cable.close()


def states(lines: list[str]) -> dict[str, str]:
    """What became of each check, by name."""
    return {line.split()[1].rstrip(":"): line.split()[0] for line in lines if line.startswith(("ok", "skip", "FAILED"))}


def test_all_is_skipped_by_name_where_nothing_is_there(alone, tmp_path):
    done = subprocess.run(words("--root", tmp_path), capture_output=True, text=True, timeout=END_S)
    lines = done.stdout.splitlines()
    names = [f"bridge.{name}" for name in BRIDGE.split()] + [f"base.{name}" for name in BASE.split()]
    assert states(lines) == dict.fromkeys(names, "skip") and list(states(lines)) == names
    assert "skip bridge.enumerates: bridge: not plugged in: skipped" in lines
    assert "skip base.stream: base: no port given (--base PORT or WHISKER_BASE_PORT): skipped" in lines
    assert lines[-1] == f"all {len(names)} skipped: no hardware was tested" and done.returncode == 0


def test_a_port_that_is_not_there_is_named(alone, monkeypatch, tmp_path):
    monkeypatch.setenv("WHISKER_BASE_PORT", str(tmp_path / "ttyUSB0"))
    done = subprocess.run(words("base.mode"), capture_output=True, text=True, timeout=END_S)
    assert done.stdout.splitlines()[0] == f"skip base.mode: base: {tmp_path / 'ttyUSB0'} is not there: skipped"
    assert done.returncode == 0


def test_a_sound_bridge_passes_and_is_unplugged_by_whoever_is_asked(alone, tmp_path):
    said = []
    with at_a_bridge(tmp_path, [], "bridge", "--interactive", "--seconds", 0.5) as (process, cable):
        for line in process.stdout:
            said.append(line.rstrip())
            if "unplug the bridge now" in line:
                cable.pull()
            if "plug it in again" in line:
                cable.put()
    assert states(said) == {f"bridge.{name}": "ok" for name in BRIDGE.split()}, "\n".join(said)
    assert said[-1] == f"{len(BRIDGE.split())} passed, 0 failed, 0 skipped"


def test_a_bridge_with_a_bad_cable_fails_where_it_is_bad(alone, tmp_path):
    (tmp_path / "faults").write_text("".join(f"lane {tick} 2 link_flip 5\n" for tick in TICKS))
    options = ["--fault-list", tmp_path / "faults"]
    names = ("bridge.hid", "bridge.frames", "bridge.lanes", "bridge.replug")
    with at_a_bridge(tmp_path, options, *names, "--seconds", 2) as (process, _):
        said = process.stdout.read().splitlines()
    assert list(states(said).values()) == ["ok", "ok", "FAILED", "skip"], said
    assert "lane 2: " in said[2] and "the record's CRC is wrong; check the lane's cable" in said[2]
    assert said[3] == "skip bridge.replug: nobody is there to pull the plug: give --interactive: skipped"
    assert said[-1] == "2 passed, 1 failed, 1 skipped"


@contextmanager
def emulated(folder: Path, *options) -> Iterator[Path]:
    """The serial port of an emulated Create."""
    link = folder / "create"
    with running([program("whisker-create-sim"), "--link", str(link), *options], stdout=subprocess.PIPE) as process:
        assert process.stdout.readline()
        yield link


def check_base(link: Path, *arguments) -> tuple[dict[str, str], list[str], int]:
    command = words("base", "--base", link, "--seconds", 1, *arguments)
    done = subprocess.run(command, capture_output=True, text=True, timeout=END_S)
    return states(done.stdout.splitlines()), done.stdout.splitlines(), done.returncode


def test_a_sound_base_passes_once_its_wheels_are_up(alone, tmp_path):
    with emulated(tmp_path) as link:
        found, said, code = check_base(link, "--wheels-up")
    assert found == {f"base.{name}": "ok" for name in BASE.split()}, said
    assert code == 0


def test_nothing_moves_before_its_wheels_are_up_and_a_bad_line_and_battery_are_reported(alone, tmp_path):
    with emulated(tmp_path, "--model", "2", "--lose-bytes", "0.01", "--battery-low") as link:
        found, said, code = check_base(link, "--model", 2)
    assert list(found.values()) == ["FAILED", "FAILED", "ok", "skip", "skip", "skip"], said
    assert "corrupt" in said[0] and "check plug and cable" in said[0] and "low; charge it" in said[1]
    assert said[3].endswith("wheels may be on the ground: put it on blocks and give --wheels-up: skipped")
    assert code == 1


def test_a_base_whose_wheels_hang_in_safe_mode_is_reported_to_go_on_blocks(alone, tmp_path):
    with emulated(tmp_path, "--event", "drop-left@0+1000") as link:
        found, said, _ = check_base(link)
    assert found["base.mode"] == "FAILED" and "on blocks with --wheels-up" in said[2], said


class Runaway:
    """A base that does not stop."""

    frames = 0

    def health(self) -> dict[str, str]:
        self.frames += 1
        return {"frames": str(self.frames), "left_mm_s": "100", "right_mm_s": "100"}


def test_a_base_that_drives_on_is_no_good_after_half_a_second():
    base = Runaway()
    with pytest.raises(CheckError, match=r"the wheels turn on 0\.495 s after the last order; switch the base off"):
        await_stop(base, "the last order")
    assert base.frames <= 6 * SILENT_FRAMES


class Asked:
    """A base that says nothing of itself until it has heard what it was asked anew."""

    def __init__(self):
        self.said = iter(["unknown", "unknown", "14000"])

    def health(self) -> dict[str, str]:
        return {"voltage_mv": next(self.said)}


def test_of_a_base_that_is_asked_anew_the_voltage_is_waited_for():
    assert await_said(Asked(), "voltage_mv") == {"voltage_mv": "14000"}


def test_a_bridge_without_nodes_is_reported_from_a_bad_one(alone, tmp_path):
    frames = np.zeros(SETTLE_TICKS + 10, FRAME)
    frames["lane"]["status"] = CODES["absent"] << STATUS_CODE_SHIFT
    rig = Rig(1.0, False, True, tmp_path, _stream=Stream(frames, None, None, None))
    with pytest.raises(SkipError, match="nodes: none answers on any lane"):
        _ = rig.populated
    frames["lane"]["status"][-1, 3] = 0
    assert rig.populated == [3]


def test_a_clock_is_judged_by_what_it_said_half_a_run_before():
    half = Clock(0, 0, 0, NOMINAL_NS, 10_000.0)
    cycles = 10 * LIMITS["clock_hz"]

    def judge(late_ns: int, ppm: float = 0.0, uncertainty_ns: float = 10_000.0) -> str:
        rate = NOMINAL_NS * (1 + 1e-6 * ppm)
        return judge_clock(half, Clock(cycles, 10**10 + late_ns, 0, rate, uncertainty_ns))[1]

    assert judge(50_000) == judge(0, 150) == ""
    assert judge(150_000) == judge(-150_000) == judge(0, uncertainty_ns=150_000.0) == "more than 100 us"
    assert judge(0, -250) == "more than 200 ppm"
