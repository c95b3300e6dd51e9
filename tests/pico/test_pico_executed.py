"""The committed image of the Pico, executed: 20 000 frames against the sensors' own logs, every check of sim/pico/tests."""

import re

import pytest
from pico.emulated import SIM, lines

CHECKS = re.findall(r"^  (\w+)\(\) \{", (SIM / "tests/checks.mjs").read_text().split("const CHECKS")[1], re.MULTILINE)
TICK_SHARE = 0.25  # of 500 us, at most
STACK_BYTES = 1024  # at most; nothing lies between it and 230 kB of free memory


@pytest.fixture(scope="module")
def checked() -> dict[str, str | None]:
    return {line["name"]: line["error"] for line in lines("checks.mjs")}


@pytest.mark.parametrize("name", CHECKS)
def test_check(checked, name):
    assert checked[name] is None


def test_20000_frames_of_8_lanes_are_the_sensors_readings():
    run = lines("soak.mjs", "20000")[-1]
    assert run["frames"] >= 20000 and run["compared"] == 8 * run["frames"]
    assert (run["lost"], run["altered"], run["doubled"], run["errors"]) == (0, 0, 0, [])
    assert run["counters"]["dropped"] == 0 and run["counters"]["good"] == run["compared"]
    assert run["worst_us"] <= TICK_SHARE * 500 and run["stack"] <= STACK_BYTES


def test_150_faults_each_under_its_code():
    campaign = lines("faults.mjs", "150", "1")[-1]
    assert campaign["wrong"] == [] and campaign["faults"] == 150
    assert len(campaign["kinds"]) == 8
