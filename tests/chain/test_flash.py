"""Firmware updates end to end: whisker-flash, libusb and hidapi, RTL, nodes with their loaders; then sampling goes on."""

import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest
from chainrun import END_S, FAST_LINK, ROOT, program, simulation, write_flat_scene

from crunchbot.bridge.ring import Reader
from whisker_protocol import CODES, STATUS_CODE_SHIFT

sys.path.insert(0, str(ROOT / "tools/firmware"))
import intel_hex  # noqa: E402
import make_image  # noqa: E402

WHISKERS = 6
BODY_WORDS = 400
VERSION = 0x0203
SAMPLING_S = 2  # simulated: the update takes less than half of one


def synthetic_hex(path, words: int = BODY_WORDS, first: int = make_image.FIRST_ROW * 128):
    """An application of so many instructions, as a compiler's HEX file has it."""
    random = np.random.default_rng(7)
    memory = {}
    for n, word in enumerate(random.integers(0, 1 << 24, words).tolist()):
        memory |= {2 * (first + 2 * n) + i: byte for i, byte in enumerate(word.to_bytes(4, "little"))}
    intel_hex.write(path, memory)
    return path


@pytest.fixture(scope="module")
def image(tmp_path_factory):
    folder = tmp_path_factory.mktemp("image")
    path = folder / "app.whex"
    path.write_bytes(make_image.make_image(synthetic_hex(folder / "app.hex"), VERSION))
    return path


def bridge_with(folder, traits: str, shell: str) -> subprocess.CompletedProcess:
    """Runs shell commands with a simulated bridge whose nodes have these traits; $FLASH is whisker-flash."""
    scene, _ = write_flat_scene(folder, 3)
    (folder / "nodes.txt").write_text(traits)
    command = simulation(folder, scene, 600, 3, "unused", "--nodes", folder / "nodes.txt")
    command = [*command[: command.index("--") + 1], "sh", "-c", shell]
    environment = os.environ | {"FLASH": program("whisker-flash"), "LINK": " ".join(FAST_LINK)}
    return subprocess.run(command, capture_output=True, text=True, timeout=END_S, env=environment)


def nodes_listed(text: str) -> dict[int, tuple[str, str, str]]:
    """lane: (serial, version, state) of whisker-flash --list."""
    found = re.findall(r"^ +(\d+)  (\S+) +(\d+\.\d+) +0x0000 +2 +0x06\w\w +1 +(.*)$", text, re.M)
    return {int(lane): (serial, version, state) for lane, serial, version, state in found}


def assert_bar_fills(text: str) -> None:
    """The bar that a terminal shows: from little to all, as long as the share beside it says."""
    bars = [(len(bar), int(share)) for bar, share in re.findall(r"^\[(#*) *\] +(\d+) %", text, re.M)]
    assert len(bars) > 5 and bars == sorted(bars) and bars[0][1] < 20 and bars[-1][1] == 100, text
    longest = bars[-1][0]
    assert all(abs(length - longest * share / 100) < 1 for length, share in bars), text


def test_all_nodes_at_once_but_for_those_that_cannot(image, tmp_path):
    """Lane 1 loses its supply in the middle, lane 4 is another chip; the second time lane 1 takes it too."""
    terminal = f"{sys.executable} -c 'import pty, sys; sys.exit(pty.spawn(sys.argv[1:]) >> 8)'"
    shell = f"$FLASH $LINK {image}; echo first $?; {terminal} $FLASH $LINK {image} --node 2; echo second $?;"
    shell += "$FLASH $LINK --list"
    done = bridge_with(tmp_path, "1 cut 10\n4 chip 0x062A\n", shell)
    first, _, rest = done.stdout.partition("first 1\n")
    assert rest, done.stdout + done.stderr
    fate = dict(re.findall(r"^lane +(\d): (.*)$", first, re.M))
    assert {lane for lane, text in fate.items() if text == "updated"} == {"0", "2", "3", "5"}
    assert fate["4"] == "refused: the image is for another chip"
    second, reported, rest = rest.partition("second 0\n")
    assert reported, second + rest
    assert_bar_fills(second)
    listed = nodes_listed(rest)
    assert {lane: version for lane, (_, version, _) in listed.items()} == {
        lane: "0.1" if lane == 4 else "2.3" for lane in range(WHISKERS)
    }
    assert {state for _, _, state in listed.values()} == {"the application runs"}


def test_serial_numbers_address_one_node_and_duplicates_are_reported(image, tmp_path):
    shell = (
        f"$FLASH $LINK {image} --lane 0; echo one $?; $FLASH $LINK {image} --lane 2; echo two $?;"
        f"$FLASH $LINK {image} --node 99; echo three $?; $FLASH $LINK {image} --dry-run; echo four $?;"
        f"$FLASH $LINK {image} --node 50; echo five $?; $FLASH $LINK --list"
    )
    done = bridge_with(tmp_path, "0 serial 50\n1 serial 7\n2 serial 7\n3 serial 0xFFFFFFFF\n", shell)
    assert done.stdout.count("serial number 7 is on several lanes: 1 2;") >= 2
    assert "one 0" in done.stdout and "two 1" in done.stdout and "three 1" in done.stdout and "four 0" in done.stdout
    assert "five 0" in done.stdout
    assert "no serial number of its own" in done.stderr and "no node has serial number 99" in done.stderr
    listed = nodes_listed(done.stdout)
    assert {lane: version for lane, (_, version, _) in listed.items()} == {
        lane: "2.3" if lane == 0 else "0.1" for lane in range(WHISKERS)
    }


def other_image(folder, version: int, options: int):
    path = folder / f"{version:x}_{options:x}.whex"
    path.write_bytes(make_image.make_image(synthetic_hex(folder / "app.hex", 40), version, options))
    return path


def test_an_older_image_and_one_of_another_build_are_refused_unless_forced(image, tmp_path):
    """In one line, before any node is touched; the silicon bit of the options is no other build."""
    older, sensor, later = (other_image(tmp_path, *of) for of in ((0x0202, 0), (0x0204, 1), (0x0205, 0x8000)))
    shell = (
        f"$FLASH $LINK {image}; $FLASH $LINK {older}; echo older $?; $FLASH $LINK {sensor}; echo sensor $?;"
        f"$FLASH $LINK --list; $FLASH $LINK {older} --force >/dev/null; echo forced $?; $FLASH $LINK --list | sed s/^/after/;"
        f"$FLASH $LINK {later} --dry-run"
    )
    done = bridge_with(tmp_path, "", shell)
    assert "older 1" in done.stdout and "sensor 1" in done.stdout and "forced 0" in done.stdout
    assert {version for _, version, _ in nodes_listed(done.stdout).values()} == {"2.3"}
    after = nodes_listed("\n".join(line[5:] for line in done.stdout.splitlines() if line.startswith("after")))
    assert {version for _, version, _ in after.values()} == {"2.2"} and len(after) == WHISKERS
    assert done.stdout.count("would be updated to 2.5") == WHISKERS
    reported = [line for line in done.stderr.splitlines() if "--force" in line]
    assert len(reported) == 2 and "the older 2.2" in reported[0] and "build 0x0001" in reported[1]


def test_what_is_no_image_is_refused_before_the_bridge_is_touched(image, tmp_path):
    bad = tmp_path / "bad.whex"
    bad.write_bytes(image.read_bytes()[:-1] + b"\x00")
    for arguments, code in (([bad], 2), ([tmp_path / "none"], 2), ([], 2), (["--list", image], 2)):
        done = subprocess.run([program("whisker-flash"), *arguments], capture_output=True, text=True)
        assert (done.returncode, done.stderr.count("\n")) == (code, 1), done.stderr


def test_sampling_goes_on_after_an_update(image, tmp_path):
    """whiskerd takes over: every lane's records are good but for the sensor's start-up."""
    ring = f"whisker-flash-{os.getpid()}"
    shell = f"$FLASH $LINK {image} && exec {program('whiskerd')} --ring {ring} $LINK"
    scene, _ = write_flat_scene(tmp_path, 3)
    command = simulation(tmp_path, scene, SAMPLING_S, 3, ring)
    command = [*command[: command.index("--") + 1], "sh", "-c", shell]
    environment = os.environ | {"FLASH": program("whisker-flash"), "LINK": " ".join(FAST_LINK)}
    with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL) as process:
        with Reader(ring, wait_s=60.0) as reader:
            frames = np.concatenate([view.copy() for view in reader.frames()])
        assert process.wait(END_S) == 0
    codes = frames["lane"]["status"][:, :WHISKERS] >> STATUS_CODE_SHIFT
    assert len(frames) > 500
    assert not codes[100:].any()
    assert set(np.unique(codes)) <= {CODES["ok"], CODES["starting"], CODES["resync"]}


def test_image_survives_the_way_from_hex(image):
    raw = image.read_bytes()
    assert len(raw) == 48 + (3 * BODY_WORDS + 191) // 192 * 192
    assert json.dumps(make_image.IMAGE_HEADER.unpack(raw)["length"]) == str(len(raw) - 48)
