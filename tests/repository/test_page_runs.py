"""The commands in the pages are run as they stand: on the example data set, beside a simulated bridge, and, those of a robot,
where no bridge and no base are plugged in. Those that are not run are listed with the reason. Replaced are names that two
test runs would share, and lengths of time."""

import os
import re
import shutil
import signal
import threading
from pathlib import Path

import pytest
from chainrun import BUILD
from keykit import certificates, documented
from linkkit import free_port
from test_examples import FOREVER, PATIENCE_S, RING, bridge, check, place, started, with_own_names
from test_page_commands import ALL
from thymiologs import write_plain

FILES = {  # what the pages' commands read, by what stands for it
    "drive.mcap": "examples/drive.mcap",
    "contacts.csv": "examples/contacts.csv",
    "calibration/lane2.csv": "examples/contacts.csv",
    "calibration/object_2.csv": "examples/contacts.csv",
    "models/texture.json": "examples/texture.json",
    "texture.json": "examples/texture.json",
    "new.csv": "examples/surfaces/ROUGH/1.csv",
    "textures": "examples/surfaces",
    "textures/ROUGH/left_ROUGH1.csv": "examples/surfaces/ROUGH/1.csv",
    "room.yaml": "examples/home.yaml",
    "home.pgm": "examples/home.pgm",
    "scenes/run1": "examples/scene",
    "scenes/robot": "examples/scene",
    "SCENE": "examples/scene",
    "scenes/mine": "examples/scene",
    "MODELS/texture.json": "examples/texture.json",
    **{
        f"{name}{n}.json": "examples/radial.json"
        for name in ("MODELS/object", "models/object_", "models/object")
        for n in (1, 2, 3, 4)
    },
    "firmware/images/node.whex": "examples/node.whex",
}
LOG, LOG_ROWS = "recordings/random_1", 30  # a Thymio's
# What a command prints, or FOREVER: it runs until Ctrl-C. In this order: some write what others read.
ON_FILES = {
    "whisker scene make --family robot --seed 1 --out scenes/mine": ": robot, seed 1",
    "whisker scene make --family free+kidnap+outliers --seed 7 --out scenes/7": "scenes/7: free+kidnap+outliers, seed 7",
    "whisker localise scenes/run1 --filter grid --out est.csv": "",
    "whisker localise examples/scene": "adaptive",
    "whisker localise scenes/7 --filter grid": "grid",
    "whisker localise SCENE --map room.yaml --json": '"pose_error_median_m"',
    "whisker export drive.mcap drive.csv": "drive.csv: 4000 frames",
    "whisker export drive.mcap drive.nwb": "drive.nwb: 4000 frames",
    "whisker export drive.mcap drive.parquet": "drive.parquet: 4000 frames",
    "whisker radial fit calibration/lane2.csv --out lane2.json": "chosen",
    "whisker radial fit calibration/object_2.csv --out models/object_2.json": "chosen",
    "whisker radial predict lane2.json contacts.csv --json": '"radius_mm": ',
    "whisker radial follow lane2.json contacts.csv": "body whisk",
    "whisker texture classify models/texture.json textures/ROUGH/left_ROUGH1.csv": "ROUGH",
    "whisker texture train textures --drive drive.mcap --scene scenes/run1 --out models/texture.json --overwrite": (
        "textures/SMOOTH: 2 recordings added"
    ),
    "whisker texture train textures --drive drive.mcap --lanes 0,1 --surface ROUGH=0-1 --out models/texture.json "
    "--overwrite": "textures/ROUGH: 2 recordings added",
    "whisker texture classify texture.json new.csv": "ROUGH",
    "whisker base SCENE --trial": "no table [base.ros2]; add it",
    "whisker base SCENE --socket base.sock": "no table [base.ros2]; add it",
    "whisker robot SCENE --models MODELS --base ros2": "no [base.ros2]; add it",
    "whisker flash firmware/images/node.whex": "no bridge is connected",
    "whisker flash firmware/images/node.whex --dry-run": "no bridge is connected",
    "whisker robot SCENE --models MODELS --port /dev/ttyUSB0 --desktop --units units": "whisker-robot.target; next: ",
    "whisker scene from thymio recordings/random_1 --out scenes/random_1": f"scenes/random_1: from {LOG}, {LOG_ROWS - 1} rows",
}
WITH_BRIDGE = {
    "whisker info": "wire version ",
    "whisker info --nodes": "lane",
    "whisker calibrate --out calibration --scene scenes/mine": "rest (",
    "whisker doctor": " frames in ",
    "whisker top --scene scenes/mine --once": "lane",
    "whisker texture train textures --live --seconds 8 --surface VINYL --scene scenes/mine --out models/texture.json "
    "--overwrite": "textures/VINYL: 2 recordings added",
    "whisker stream --lanes 0 --frames 8000": "",
    "whisker record drive.mcap --seconds 60 --scene scenes/robot": "frames",
    "whisker replay drive.mcap --ring replayed --speed 2": "frames",
    "whisker-view --open": FOREVER,
}
# What a command prints that ends without hardware, or waits for it until Ctrl-C, which may come while it ends.
WITHOUT_HARDWARE = {
    "whisker bridge-sim --mechanics modes": "is up",
    "whisker bridge-sim --usbip": "the bridge is served by usbip",
    "whisker robot SCENE --models MODELS --port /dev/ttyUSB0 --create 1": "starting whiskerd, base, pilot",
    "whisker robot SCENE --models MODELS --port /dev/ttyUSB0 --desktop": "starting navigator, bag, view, ",
    "whisker robot SCENE --models MODELS --no-daemon": "starting base, pilot",
    "whisker robot scenes/mine --models models --port /dev/ttyUSB0 --create 1 --desktop --out run1": "starting navigator, ",
    "whisker try": "http://127.0.0.1:",
    "whisker-base --help": "--socket PATH",
    "whisker-base --port /dev/ttyUSB0 --socket base.sock": "there is no such port; plug the adapter in",
    "whisker-base --port /dev/ttyUSB0 --socket base.sock --verbose": "there is no such port; plug the adapter in",
    "whisker-view --ring a --ring b": "http://127.0.0.1:",
    "whisker-view --robot --connect tcp/robot.local:7458": "http://127.0.0.1:",
    "whisker-view --robot --connect tls/robot.local:7458 --zenoh-config FILE": "http://127.0.0.1:",
    "whisker-view --robot --scene SCENE": "http://127.0.0.1:",
    "whiskerd --ring whisker --lane-mask 1": "no bridge is connected; plug it in",
    "whiskerd --ring whisker": "no bridge is connected; plug it in",
    "whiskerd --ring whisker --wait": "no bridge is connected; plug it in",
    "whiskerd --ring whisker --wait --verbose": "no bridge is connected; plug it in",
    "whiskerd --ring first --serial 0001": "no bridge of this serial number is connected",
    "whiskerd --ring second --serial 0002 --tick-in rising": "no bridge of this serial number is connected",
}
REASONS = {
    "the example of its help, which test_examples.py runs": (
        "whisker examples",
        "whisker bridge-sim",
        "whisker calibrate --out calibration",
        "whisker pyro",
        "whisker robot --simulated --desktop",
        "whisker ros2 robot-run/scene",
        "whisker bag run.mcap --scene SCENE",
        "whisker bag run.mcap --scene SCENE --connect tcp/192.168.7.2:7458 --connect tcp/127.0.0.1:7459",
        "whisker scene from run.mcap --out scenes/run",
        "whisker scene from run1/robot.mcap --out scenes/run1",
        "whisker texture train textures --out models/texture.json",
        "whisker texture train recordings --out texture.json",
        "whisker top",
        "whisker top --ring replayed",
    ),
    "another test runs it beside what it needs": (
        "whisker --print-completion bash",  # host/python/tests/commands/test_cli.py
        "whisker ros2 robot-run/scene --rmw cyclonedds",  # host/python/tests/robot/standard/test_robot_cyclonedds.py
        "whisker robot scenes/mine --simulated --desktop --seconds 120 --out try",  # tests/drills run it whole
        "whisker robot --simulated --base ros2 --desktop",  # tests/chain/test_ros2_base.py
        "whisker view robot-run/robot.mcap",  # host/python/tests/view/test_view_playback.py
        "whisker-base --port /tmp/create --socket base.sock",  # host/python/tests/pilot/test_base_emulator.py
        "whisker scene from rosbag2_2026_11_28 --scene SCENE --out scenes/run",  # host/python/tests/robot/bags/test_robot_rosbags.py
    ),
    "needs a person who sets contacts; tests/chain/test_calibrate_chain.py has a post in their place": (
        "whisker calibrate --out calibration --lane 2 --radii 90,100,110,120,130",
        "whisker calibrate --out calibration --scene scenes/mine --nodes nodes.txt --lane 3 --radii "
        "90,100,110,120,130,138 --repeats 5 --whisk-rad-s 0.1309",
    ),
}
# Lengths of time, and what the other commands read already.
LENGTHS = (
    ("--out scenes/mine", "--out scenes/mine --overwrite"),
    ("--out models/object_2.json", "--out models/object_2.json --overwrite"),
    ("--seconds 60", "--seconds 2"),
    ("--seconds 8 ", "--seconds 0.5 "),
)


def in_pages() -> set[str]:
    """Whole commands of the project's programs; targets of make build, test and measure what the other tests try."""
    lines = {" ".join(words) for _, words, whole in ALL if whole and words[0] != "make"}
    return {re.sub(r"^\S*/", "", line) for line in lines}


def test_every_command_is_run_or_has_a_reason():
    reasons = [line for lines in REASONS.values() for line in lines]
    listed = [*ON_FILES, *WITH_BRIDGE, *WITHOUT_HARDWARE, *reasons]
    assert sorted(listed) == sorted(in_pages())


@pytest.fixture(scope="module")
def desk(place):
    for name, source in FILES.items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        copy = shutil.copytree if (place / source).is_dir() else shutil.copy
        copy(place / source, place / name)
    write_plain(place / LOG, LOG_ROWS)
    certificates(place, "view")
    shutil.copy(documented(place, "view"), place / "FILE")
    return place


@pytest.fixture
def nothing_plugged(tmp_path, monkeypatch):
    """No USB device is there for the programs that `umockdev-wrapper` starts, whatever is plugged into this machine."""
    (tmp_path / "sys/bus").mkdir(parents=True)
    (tmp_path / "dev").mkdir()
    monkeypatch.setenv("UMOCKDEV_DIR", str(tmp_path))


def shorter(line: str) -> str:
    for long, short in LENGTHS:
        line = line.replace(long, short)
    return line


def words_of(line: str) -> str:
    """A line whose program, if it is one of the build's, is named by its path."""
    program = line.split()[0]
    native = BUILD / "host/apps" / program
    return line.replace(program, str(native), 1) if native.exists() else line


def try_out(line: str, wanted: str | int, folder: Path, more: str = "") -> None:
    if "record" in line:
        (folder / "drive.mcap").unlink(missing_ok=True)
    named = with_own_names(shorter(line), more).replace("--ring replayed", f"--ring {RING}-3")
    check(words_of(named), folder, wanted, 5.0)


@pytest.mark.parametrize("line", ON_FILES)
def test_a_command_on_files(desk, nothing_plugged, line):
    try_out(line, ON_FILES[line], desk)


@pytest.mark.parametrize("line", WITH_BRIDGE)
def test_a_command_beside_a_bridge(bridge, desk, line):
    own = f"--ring {RING}" if "--ring" not in line else ""
    try_out(line, WITH_BRIDGE[line], desk, f"{own} --port 0" if line.startswith("whisker-view") else own)


@pytest.mark.parametrize("line", WITHOUT_HARDWARE)
def test_a_command_without_hardware(desk, nothing_plugged, line):
    more = {"whisker robot": f"--first-port {free_port(3)} --view-port 0 --ring {RING}-5", "whisker-view": "--port 0"}
    own = next((options for start, options in more.items() if line.startswith(start)), "")
    if "bridge-sim" in line:
        own = "0" if line.endswith("--usbip") else f"--ring {RING}-6"
    named = line.replace("--ring whisker", f"--ring {RING}-5").replace("/dev/ttyUSB0", "/dev/no-adapter")
    said, code = said_until(f"{words_of(named)} {own}", WITHOUT_HARDWARE[line], desk)
    assert WITHOUT_HARDWARE[line] in said and "Traceback" not in said and "usage:" not in said, said
    assert code in (0, 1, FOREVER, -signal.SIGINT), said


def said_until(line: str, wanted: str, folder: Path) -> tuple[str, int]:
    """What a command printed, with its exit code; Ctrl-C comes once it has printed what is wanted."""
    wrapped = line if "bridge-sim" in line else f"umockdev-wrapper {line}"
    process = started(f"exec {wrapped}", folder)
    too_long = threading.Timer(PATIENCE_S, os.killpg, (process.pid, signal.SIGKILL))
    too_long.start()
    said = ""
    for printed in process.stdout:
        said += printed
        if wanted in said:
            process.send_signal(signal.SIGINT)
            break
    rest, _ = process.communicate()
    too_long.cancel()
    return said + rest, process.returncode


__all__ = ["bridge", "place"]
