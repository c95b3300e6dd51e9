"""Bad input ends in one line that says what to do, a non-zero exit code, and nothing left behind."""

import os
import subprocess
from pathlib import Path

import pytest
from chainrun import END_S, FAST_LINK, program, running, simulation, write_flat_scene

from crunchbot.bridge.ring import Reader
from whisker_protocol import WIRE_VERSION

RING = f"whisker-bad-{os.getpid()}"  # no other test's, which may run beside this one


def shared_memory() -> set[str]:
    return {path.name for path in Path("/dev/shm").iterdir() if RING in path.name}


def children_of_this_test() -> list[str]:
    mine = []
    for status in Path("/proc").glob("[0-9]*/status"):
        try:
            fields = dict(line.split(":\t", 1) for line in status.read_text().splitlines() if ":\t" in line)
        except OSError:
            continue
        if fields["PPid"].strip() == str(os.getpid()) and fields["Name"].strip().startswith("whisker"):
            mine.append(fields["Name"].strip())
    return mine


@pytest.fixture(autouse=True)
def nothing_left_behind():
    before = shared_memory()
    yield
    assert shared_memory() == before
    assert children_of_this_test() == []


def only_line(text: str, program_name: str) -> str:
    lines = [line for line in text.splitlines() if not line.startswith(("progress", f"{program_name}: 0 frames"))]
    assert len(lines) == 1, text
    assert lines[0].startswith(program_name) and ";" in lines[0], "names itself and a remedy"
    return lines[0]


def run_chain(folder: Path, *options, seconds: float = 1.0) -> subprocess.CompletedProcess:
    scene, _ = write_flat_scene(folder, 1)
    command = simulation(folder, scene, seconds, 1, RING, *options)
    return subprocess.run(command, capture_output=True, text=True, timeout=END_S)


def test_wrong_wire_version(tmp_path):
    done = run_chain(tmp_path, "--defect", "wire-version")
    assert done.returncode == 1
    line = only_line(done.stderr, "whiskerd")
    assert f"bridge {WIRE_VERSION + 1}, host {WIRE_VERSION}" in line


def test_corrupted_frame(tmp_path):
    done = run_chain(tmp_path, "--defect", "frame")
    assert done.returncode == 1
    lines = [line for line in done.stderr.splitlines() if line.startswith("whiskerd: bridge:")]
    assert len(lines) == 1 and "header" in lines[0] and ";" in lines[0], done.stderr


def test_truncated_stream(tmp_path):
    done = run_chain(tmp_path, "--defect", "truncate")
    assert done.returncode == 1
    lines = [line for line in done.stderr.splitlines() if line.startswith("whiskerd: bridge:")]
    assert len(lines) == 1 and "after frame" in lines[0] and "check the USB cable" in lines[0], done.stderr


def test_second_daemon(tmp_path):
    scene, _ = write_flat_scene(tmp_path, 1)
    second = tmp_path / "second.txt"
    whiskerd = f"{program('whiskerd')} --ring {RING}"
    both = f"trap : TERM; {whiskerd} {' '.join(FAST_LINK)} & first=$!; read go; {whiskerd} 2>{second}; echo $? >>{second}; kill $first; while kill -0 $first; do wait $first; done"
    command = simulation(tmp_path, scene, 600, 1, RING)
    command = [*command[: command.index("--") + 1], "sh", "-c", both]
    with running(command, stdin=subprocess.PIPE) as process:
        with Reader(RING, wait_s=END_S) as reader:
            next(reader.frames())
            process.stdin.write("go\n")
            process.stdin.flush()
            process.wait(END_S)
        process.stdin.close()
    *lines, code = second.read_text().splitlines()
    assert code == "1"
    assert "another" in only_line("\n".join(lines), "whiskerd")


def test_flat_scene_with_an_unknown_item(tmp_path):
    scene, text = write_flat_scene(tmp_path, 1)
    scene.write_text("colour red\n" + text)
    command = simulation(tmp_path, scene, 1, 1, "whisker-bad")
    done = subprocess.run(command, capture_output=True, text=True, timeout=END_S)
    assert done.returncode == 1
    assert "colour" in only_line(done.stderr, "whisker-bridge-sim")
