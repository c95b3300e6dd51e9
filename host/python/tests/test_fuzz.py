"""Every fuzzer runs from its front, and what goes wrong inside is heard outside."""

import subprocess
import sys

import fuzz
import pytest
from patience import PATIENCE_S


def run(*arguments):
    return subprocess.run(
        [sys.executable, fuzz.__file__, *arguments], capture_output=True, text=True, timeout=PATIENCE_S
    )


@pytest.mark.parametrize("target", sorted(fuzz.TARGETS))
def test_each_target_runs(target):
    done = run(target, "--inputs", "200", "--seed", "2")
    assert done.returncode == 0 and done.stdout.startswith("200 inputs, "), done.stderr


def test_what_does_not_run_is_a_failure():
    assert run("recording", "--inputs", "10", "--seed", "-1").returncode != 0
