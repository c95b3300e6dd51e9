"""Unmodified whiskerd, libusb and hidapi on the executed image, through umockdev: `whisker bridge-sim --board pico`."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from pico.emulated import need_emulator

from crunchbot.bridge.ring import Reader
from whisker_protocol import CODES, STATUS_CODE_SHIFT

FRAMES, LANES, WAIT_S = 400, 6, 3600.0  # a reader waits for frames, not for the clock


@pytest.fixture
def ring():
    need_emulator()
    name = f"whisker-test-pico-{os.getpid()}"
    words = [
        sys.executable,
        "-m",
        "crunchbot.cli",
        "bridge-sim",
        "--board",
        "pico",
        "--lanes",
        str(LANES),
        "--ring",
        name,
    ]
    with subprocess.Popen(words, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline().startswith(f"ring {name} is up"), process.stderr.read()
        yield name
        process.terminate()
        _, said = process.communicate()
    assert process.returncode == 0, said
    assert " 0 with damaged records, 0 bytes skipped" in said, said


def frames_of(name: str) -> np.ndarray:
    """The first FRAMES frames that come, copied."""
    with Reader(name, WAIT_S) as reader:
        taken = []
        while sum(map(len, taken)) < FRAMES:
            taken.append(reader.take(WAIT_S))
        return np.concatenate(taken)


def test_frames_reach_the_ring_whole_and_the_tools_know_the_board(ring):
    codes = frames_of(ring)["lane"]["status"] >> STATUS_CODE_SHIFT
    assert set(np.unique(codes[-100:, :LANES])) == {CODES["ok"]}
    assert set(np.unique(codes[:, LANES:])) == {CODES["lane_off"]}
    assert set(np.unique(codes[:, :LANES])) <= {CODES["ok"], CODES["starting"]}
    answer = subprocess.run(
        [sys.executable, "-m", "crunchbot.cli", "info", "--json", "--ring", ring],
        capture_output=True,
        text=True,
        check=True,
    )
    info = json.loads(answer.stdout)
    assert info["daemon"]["lanes"] == list(range(LANES)) and info["daemon"]["frames_damaged"] == 0
    assert info["daemon"]["serial"] == "E6613852837F2B21"
