"""The commands in the pages are run as they stand, on the example data set and beside a simulated bridge; those that are not are
listed with the reason. Replaced are names that two test runs would share, and lengths of time."""

import re
import shutil

import pytest
from chainrun import BUILD
from test_examples import FOREVER, RING, bridge, check, place, with_own_names
from test_page_commands import ALL

FILES = {  # what the pages' commands read, by what stands for it
    "drive.mcap": "examples/drive.mcap",
    "contacts.csv": "examples/contacts.csv",
    "calibration/lane2.csv": "examples/contacts.csv",
    "calibration/object_2.csv": "examples/contacts.csv",
    "model.json": "examples/radial.json",
    "models/texture.json": "examples/texture.json",
    "textures/ROUGH/left_ROUGH1.csv": "examples/surfaces/ROUGH/1.csv",
    "room.yaml": "examples/home.yaml",
    "home.pgm": "examples/home.pgm",
    "scenes/run1": "examples/scene",
    "scenes/robot": "examples/scene",
    "SCENE": "examples/scene",
    "firmware/images/mlx90333/node.whex": "examples/node.whex",
}
# What a command prints, or FOREVER: it runs until Ctrl-C. In this order: some write what others read.
ON_FILES = {
    "whisker scene make --list-families": "anchor",
    "whisker scene make --family robot --seed 1 --out scenes/mine": "scenes/mine: robot, seed 1",
    "whisker scene make --family free+kidnap+outliers --seed 7 --out scenes/7": "scenes/7: free+kidnap+outliers, seed 7",
    "whisker bench touch --list": "anchor",
    "whisker bench touch --scene anchor+global --out scenes/global": "scenes/global",
    "whisker localise scenes/run1 --filter grid --out est.csv": "",
    "whisker localise SCENE --map room.yaml --json": '"pose_error_median_m"',
    "whisker export drive.mcap drive.csv": "drive.csv: 4000 frames",
    "whisker export drive.mcap drive.nwb": "drive.nwb: 4000 frames",
    "whisker export drive.mcap drive.parquet": "drive.parquet: 4000 frames",
    "whisker radial fit calibration/lane2.csv --out lane2.json": "chosen",
    "whisker radial fit calibration/object_2.csv --out models/object_2.json": "chosen",
    "whisker radial predict lane2.json contacts.csv --json": '"radius_mm": ',
    "whisker radial follow lane2.json contacts.csv": "body whisk",
    "whisker radial follow model.json contacts.csv --json": '"motion": "body whisk"',
    "whisker texture classify models/texture.json textures/ROUGH/left_ROUGH1.csv": "ROUGH",
    "whisker flash firmware/images/mlx90333/node.whex": "no bridge is connected",
    "whisker flash firmware/images/mlx90333/node.whex --dry-run": "no bridge is connected",
    "whisker scene make --family anchor --seed 500 --steps 3000 --out scenes/500": "scenes/500: anchor, seed 500",
    "whisker map scenes/500 --out maps/touch": "faces: ",
}
WITH_BRIDGE = {
    "whisker info": "wire_version: ",
    "whisker info --nodes": "lane",
    "whisker doctor": "frames in 0.5 s",
    "whisker top --scene scenes/mine --once": "lane",
    "whisker stream --lanes 0,1 --frames 16000": "",
    "whisker record drive.mcap --seconds 60": "frames",
    "whisker record drive.mcap --seconds 60 --scene scenes/robot": "frames",
    "whisker replay drive.mcap --ring replayed": "frames",
    "whisker replay drive.mcap --ring replayed --speed 2": "frames",
    "whisker-view --open": FOREVER,
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
        "whisker scene from run.mcap --out scenes/run",
        "whisker scene from run1/robot.mcap --out scenes/run1",
        "whisker texture train textures --out models/texture.json",
        "whisker top",
        "whisker top --ring replayed",
    ),
    "another test runs it beside what it needs": (
        "whisker ros2 robot-run/scene --rmw cyclonedds",  # host/python/tests/robot/standard/test_robot_cyclonedds.py
        "whisker robot scenes/mine --simulated --desktop --seconds 120 --out try",  # test_walkthrough.py, shorter
        "whisker view robot-run/robot.mcap",  # host/python/tests/view/test_view_playback.py
        "whisker-view --robot --scene SCENE",  # host/python/tests/view/test_view_robot.py
        "whisker-view --ring replayed --port 0",
        "whisker-view --ring a --ring b",
        "whisker-base --help",  # test_manual.py, whose pages are made of it
        "whisker-base --port /tmp/create --socket base.sock",  # host/python/tests/pilot/test_base_emulator.py
        "whisker bridge-sim --mechanics modes",
        "whisker scene from build/demo --out scenes/demo",
    ),
    "needs a person who sets contacts or wires": (
        "whisker calibrate --out calibration --lane 2 --radii 90,100,110,120,130",
        "whisker calibrate --lane 2 --radii 90,100,110,120,130,138 --repeats 5 --whisk-rad-s 0.1309 --out calibration",
        "whisker calibrate --out calibration --scene scenes/mine",
        "whisker calibrate --out calibration --scene scenes/mine --nodes nodes.txt --lane 3 --radii "
        "90,100,110,120,130,138 --repeats 5 --whisk-rad-s 0.1309",
    ),
    "needs hardware: a bridge, a base, another machine": (
        "whisker robot SCENE --models MODELS --port /dev/ttyUSB0 --create 1",
        "whisker robot SCENE --models MODELS --port /dev/ttyUSB0 --create 1 --desktop",
        "whisker robot SCENE --models MODELS --port /dev/ttyUSB0 --desktop",
        "whisker robot SCENE --models MODELS --port /dev/ttyUSB0 --desktop --units units",
        "whisker robot SCENE --models MODELS --no-daemon",
        "whisker robot scenes/mine --models models --port /dev/ttyUSB0 --create 1 --desktop --out run1",
        "whisker-base --port /dev/ttyUSB0 --socket base.sock",
        "whisker-base --port /dev/ttyUSB0 --socket base.sock --verbose",
        "whisker-view --robot --connect tcp/robot.local:7458",
        "whisker-view --robot --connect tls/robot.local:7458 --zenoh-config FILE",
        "whiskerd --ring whisker",
        "whiskerd --ring whisker --wait",
        "whiskerd --ring whisker --wait --verbose",
        "whiskerd --ring whisker --serial 0001 --second 0002",
        "whiskerd --ring whisker --serial 0001 --second 0002 --tick-in rising",
    ),
    "needs root and a module of the kernel": ("whisker bridge-sim --usbip",),
    "needs estimates, maps or recordings of others": (
        "whisker bench map maps/touch maps/mine --scene scenes/500",
        "whisker bench touch --scene anchor+global --estimate est.csv",
        "whisker bench touch --scene scenes/random_1 --estimate est.csv --json",
        "whisker bench touch --scene thymio/random_1 --data DIR --filter particle --chart way.svg",
        "whisker scene from thymio recordings/random_1 --out scenes/random_1",
    ),
}
LENGTHS = (("--seconds 60", "--seconds 2"), ("--frames 16000", "--frames 400"))


def in_pages() -> set[str]:
    """Whole commands of the project's programs; targets of make build, test and measure what the other tests try."""
    lines = {" ".join(words) for _, words, whole in ALL if whole and words[0] != "make"}
    return {re.sub(r"^\S*/", "", line) for line in lines}


def test_every_command_is_run_or_has_a_reason():
    reasons = [line for lines in REASONS.values() for line in lines]
    listed = [*ON_FILES, *WITH_BRIDGE, *reasons]
    assert sorted(listed) == sorted(in_pages())


@pytest.fixture(scope="module")
def desk(place):
    for name, source in FILES.items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        copy = shutil.copytree if (place / source).is_dir() else shutil.copy
        copy(place / source, place / name)
    return place


def try_out(line: str, wanted: str | int, folder, more: str = "") -> None:
    for long, short in LENGTHS:
        line = line.replace(long, short)
    if "record" in line:
        (folder / "drive.mcap").unlink(missing_ok=True)
    line = with_own_names(line, more).replace("--ring replayed", f"--ring {RING}-3")
    program = line.split()[0]
    native = BUILD / "host/apps" / program
    check(line.replace(program, str(native), 1) if native.exists() else line, folder, wanted, 5.0)


@pytest.mark.parametrize("line", ON_FILES)
def test_a_command_on_files(desk, line):
    try_out(line, ON_FILES[line], desk)


@pytest.mark.parametrize("line", WITH_BRIDGE)
def test_a_command_beside_a_bridge(bridge, desk, line):
    own = f"--ring {RING}" if "--ring" not in line else ""
    try_out(line, WITH_BRIDGE[line], desk, f"{own} --port 0" if line.startswith("whisker-view") else own)


__all__ = ["bridge", "place"]
