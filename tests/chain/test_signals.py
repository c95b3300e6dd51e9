"""Two signals close together, as a dropped ssh, GNU timeout or a script sends them: every command ends all the same.

`python -m drills.signals` does more of it.
"""

import json
import os
import subprocess
import sys

import pytest
from chainrun import BUILD, ROOT

PAIRS, EACH = 600, 2


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    out = tmp_path_factory.mktemp("signals")
    command = [sys.executable, "-m", "drills.signals", "--pairs", PAIRS, "--each", EACH, "--out", out]
    environment = os.environ | {"WHISKER_BUILD": str(BUILD), "PYTHONPATH": str(ROOT / "tests")}
    done = subprocess.run([str(word) for word in command], env=environment, capture_output=True, text=True)
    found = [json.loads(line) for line in (out / "signals.jsonl").read_text().splitlines()]
    assert {result["what"] for result in found} >= {"stop code", "robot", "view"}, done.stderr
    return found


def test_no_pair_hangs_the_stop_code(results):
    shared = [result for result in results if result["what"] == "stop code"]
    assert sum(result["pairs"] for result in shared) == PAIRS
    assert sum(result["hung"] for result in shared) == 0


def test_every_command_ends_in_good_order(results):
    assert [result for result in results if result["hung"] or result["code"] != 0] == []
