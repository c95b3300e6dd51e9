"""The example in the help of every command works as it stands, after `whisker examples` and, where a command needs one,
beside a running bridge or robot. Only names that two test runs would share are replaced: ring, ports."""

import argparse
import os
import re
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest
from linkkit import free_endpoint

from crunchbot import cli

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "host/python/crunchbot/data/examples.zip"
PATIENCE_S = 90.0
RING = f"whisker-test-examples-{os.getpid()}"
FOREVER = 130  # ended by Ctrl-C
# What a command prints, or the exit code of one that runs until it is stopped, by its first words.
OFFLINE = {
    "whisker examples": "examples: contacts.csv, ",
    "whisker try": FOREVER,
    "whisker localise": '"pose_error_median_m": 0.0',
    "whisker map": '"faces": ',
    "whisker scene make": "scenes/7: anchor+kidnap, seed 7, 1200 rows",
    "whisker scene map": "scenes/mapped: examples/scene with examples/home.yaml, 1 boxes",
    "whisker texture train": "3 classes: ROUGH, SMOOTH, VINYL",
    "whisker texture classify": '"label": "ROUGH"',
    "whisker radial fit": "chosen",
    "whisker radial predict": '"radius_mm": ',
    "whisker export": "drive.parquet: 4000 frames, lanes lane0, lane1, lane2, lane3, lane4, lane5",
    "whisker radial follow": '"motion": "body whisk"',
    "whisker flash": "no bridge is connected",
    "whisker base": "no table [base.ros2]; add it",
}
WITH_BRIDGE = {
    "whisker info": '"wire_version": ',
    "whisker top": FOREVER,
    "whisker view": FOREVER,
    "whisker doctor": " frames in ",
    "whisker calibrate": "rest (",
    "whisker bridge-sim": "is up; try: whisker top",
    "whisker record": "drive.mcap: 4000 frames",
    "whisker replay": "frames",
    "whisker stream": "",
}
WITH_ROBOT = {
    "whisker robot": FOREVER,
    "whisker pilot": FOREVER,
    "whisker navigator": FOREVER,
    "whisker mapper": FOREVER,
    "whisker foxglove": FOREVER,
    "whisker ros2": FOREVER,
    "whisker bag": FOREVER,
    "whisker pyro": FOREVER,
    "whisker scene from": "rows",
}


def examples() -> dict[str, str]:
    """Every example, by the words of its command."""
    found = {}

    def note(name: str, parser: argparse.ArgumentParser) -> None:
        actions = next((a for a in parser._actions if isinstance(a, argparse._SubParsersAction)), None)
        for action, chosen in (actions.choices if actions else {}).items():
            note(f"{name} {action}", chosen)
        if not actions:
            found[name] = parser.epilog.removeprefix("example:").strip()

    for command in cli.COMMANDS:
        parser = cli.parser_of(command)
        commands = next(a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
        note(f"whisker {command}", commands.choices[command])
    return found


EXAMPLES = examples()


def started(line: str, place: Path) -> subprocess.Popen[str]:
    """A line of a shell, in a process group of its own; all that it prints goes to its stdout."""
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}", "BROWSER": "true"}
    return subprocess.Popen(
        ["sh", "-c", line],
        cwd=place,
        env=environment,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )


def run(line: str, place: Path, seconds: float | None = None) -> tuple[int, str]:
    """A line of a shell: exit code and output. seconds: Ctrl-C comes after so long; None: it ends by itself."""
    process = started(line, place)
    try:
        out, _ = process.communicate(timeout=seconds or PATIENCE_S)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGINT)
        out, _ = process.communicate(timeout=PATIENCE_S)
        assert seconds, out
    return process.returncode, out


def with_own_names(line: str, more: str, first_port: int = 0) -> str:
    """A line with this run's ring and ports in place of the shared ones; options go to the end of the last command."""
    line = re.sub(r"--ring whisker\b", f"--ring {RING}", line)
    line = re.sub(r":745(\d)", lambda found: f":{first_port + int(found[1]) - 7}", line)
    command, arrow, file = line.partition(" >")
    return f"{command} {more}{arrow}{file}"


def test_every_command_has_one_example_in_one_group():
    assert sorted(EXAMPLES) == sorted([*OFFLINE, *WITH_BRIDGE, *WITH_ROBOT])


def check(line: str, place: Path, wanted: str | int, seconds: float) -> None:
    endless = wanted == FOREVER
    code, out = run(line, place, seconds if endless else None)
    assert "Traceback" not in out and "usage:" not in out and "--help" not in out, out
    if endless:
        assert code in (0, FOREVER, -signal.SIGINT), out  # the last: of the shell itself
        assert not re.search("^whisker[a-z-]*: (?!warning)", out, re.MULTILINE), out
    else:
        assert wanted in out, out


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("place")
    code, out = run(EXAMPLES["whisker examples"], folder)
    assert code == 0, out
    return folder


@pytest.mark.parametrize("command", list(OFFLINE)[1:])
def test_examples_on_files(place, command):
    more = {"whisker try": " --no-open"}.get(command, "")
    check(EXAMPLES[command] + more, place, OFFLINE[command], 5.0)


def test_the_data_set_is_not_written_over(place):
    code, out = run(EXAMPLES["whisker examples"], place)
    assert code == 2 and "examples: is there already; give --overwrite, or another name" in out


def test_the_data_set_is_small_and_says_whose_it_is():
    assert DATA.stat().st_size < 600_000
    with zipfile.ZipFile(DATA) as data:
        assert data.testzip() is None
        assert {name.split("/")[0] for name in data.namelist()} >= {"scene", "surfaces", "contacts.csv", "drive.mcap"}
        image = data.read("node.whex")
    assert image == (ROOT / "firmware/images/node.whex").read_bytes()


@pytest.fixture(scope="module")
def bridge(place):
    """A simulated bridge whose ring is up."""
    words = [sys.executable, "-m", "crunchbot.cli", "bridge-sim", "--level", "bytes", "--ring", RING]
    process = subprocess.Popen(words, cwd=place, stdout=subprocess.PIPE, text=True)
    assert "is up" in process.stdout.readline()
    yield
    process.send_signal(signal.SIGINT)
    process.wait(PATIENCE_S)


@pytest.mark.parametrize("command", WITH_BRIDGE)
def test_examples_beside_a_bridge(bridge, place, command):
    name = f"--ring {RING}" if "--ring" not in EXAMPLES[command] else ""
    more = {
        "whisker top": "--once",
        "whisker view": "--port 0",
        "whisker record": "--seconds 2",
        "whisker bridge-sim": f"--ring {RING}",
    }.get(command, "")
    line = with_own_names(EXAMPLES[command], f"{name if command != 'whisker bridge-sim' else ''} {more}")
    if command == "whisker bridge-sim":  # two commands: the ring is that of the first
        first, second = EXAMPLES[command].split("&")
        line = f"{first} --ring {RING}-2 & {second} --ring {RING}-2 --wait 60 --once; kill $!; wait"
    line = line.replace("--ring replayed", f"--ring {RING}-3")
    check(line, place, WITH_BRIDGE[command], 5.0)


@pytest.fixture(scope="module")
def robot(tmp_path_factory, place):
    """The simulated robot of the example, until it has driven for a while; its first port."""
    port = int(free_endpoint().rpartition(":")[2])
    line = EXAMPLES["whisker robot"]
    line = f"exec {line} --seconds 45 --no-view --ring {RING}-4 --first-port {port}"
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    process = subprocess.Popen(["sh", "-c", line], cwd=place, env=environment)
    began = time.monotonic()
    while not (place / "robot-run/robot.mcap").exists():
        assert process.poll() is None and time.monotonic() < began + 4 * PATIENCE_S
        time.sleep(0.2)
    yield port
    assert process.wait(4 * PATIENCE_S) == 0


@pytest.mark.parametrize("command", list(WITH_ROBOT)[1:])
def test_examples_beside_a_robot(robot, place, command):
    more = {
        "whisker navigator": "--listen none",
        "whisker mapper": "--listen none",
        "whisker pilot": f"--listen none --ring {RING}-4",
        "whisker foxglove": f"--port 0 --connect tcp/127.0.0.1:{robot + 1}",
        "whisker ros2": f"--connect tcp/127.0.0.1:{robot + 1} --router {free_endpoint()}",
        "whisker bag": f"--connect tcp/127.0.0.1:{robot + 1}",
        "whisker pyro": "--port 0",
    }.get(command, "")
    check(with_own_names(EXAMPLES[command], more, robot), place, WITH_ROBOT[command], 5.0)
