"""`whisker bridge-sim --board pico`, its demo's world behind it; what its frames hold: test_pico_commands.py."""

import json
import os
import subprocess
import sys

import pytest
from pico.emulated import need_emulator

LANES = 6


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


def test_the_simulated_board_comes_up_with_whiskerd_on_it(ring):
    answer = subprocess.run(
        [sys.executable, "-m", "crunchbot.cli", "info", "--json", "--ring", ring],
        capture_output=True,
        text=True,
        check=True,
    )
    info = json.loads(answer.stdout)
    assert info["daemon"]["lanes"] == list(range(LANES)) and info["daemon"]["frames_damaged"] == 0
    assert info["daemon"]["serial"] == "E6613852837F2B21"
