"""The node's image, executed, against the firmware's C on the same simulated chip, sensor and link.

Small runs of the committed image; `make firmware-check` makes the long ones (WHISKER_IMAGE_LONG), of any image
(WHISKER_IMAGE: its node_wire.hex).
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
sys.path.insert(0, str(HERE))
import paths  # noqa: E402
import translate  # noqa: E402
from translate import patches  # noqa: E402

PROGRAMS = ROOT / os.environ.get("WHISKER_BUILD", "build/release") / "tests/rigs/node_image"
COMMITTED = ROOT / "firmware/images/node_wire.hex"
WIRE = Path(os.environ.get("WHISKER_IMAGE") or COMMITTED)
LONG = "WHISKER_IMAGE_LONG" in os.environ
TICKS, SEEDS, BOOTS, CUT_SEEDS = (10000, (1, 2, 3), 50, 3) if LONG else (500, (1,), 5, 1)
IRQS = {"T2": 7, "SPI1 error": 9, "SPI1": 10, "DMA1": 14, "INT1": 20, "INT2": 29, "SPI2 error": 32}
SERVED = {8 + irq for irq in IRQS.values()}
KINDS = {"INT1": ("SYNC",), "T2": ("GAP", "READY"), "SPI1": ("BYTE", "LAST_BYTE"), "DMA1": ("ORDER",)}
CODES = {"trap": 10, "illegal opcode": 10, "watchdog": 9}  # whisker.toml: RESET_TRAP, RESET_WATCHDOG
RESET_POWER = 8


class Image:
    """The words of an image's flash, and the programs that run it."""

    def __init__(self, words: list[int], table: Path):
        self.words, self.table = words, table
        table.write_bytes(translate.table_of(words))

    def run(self, program: str, *words, costs: Path | None = None) -> subprocess.CompletedProcess:
        names = {"NODE_IMAGE": self.table} | ({"NODE_IMAGE_COSTS": costs} if costs else {})
        environment = os.environ | {name: str(path) for name, path in names.items()}
        command = [str(PROGRAMS / program), *map(str, words)]
        return subprocess.run(command, env=environment, capture_output=True, text=True)

    def measured(self, *words):
        done = self.run(*words)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)


@pytest.fixture(scope="module")
def image(tmp_path_factory) -> Image:
    return Image(translate.flash_words(WIRE), tmp_path_factory.mktemp("image") / "table")


@pytest.mark.parametrize("seed", SEEDS)
def test_every_record_is_the_one_that_the_c_makes(image, tmp_path, seed):
    wanted = image.run("native_records", TICKS, seed)
    found = image.run("image_records", TICKS, seed, costs=tmp_path / "costs")
    assert found.returncode == 0, found.stderr
    pairs = zip(wanted.stdout.splitlines(), found.stdout.splitlines(), strict=True)
    assert [pair for pair in pairs if pair[0] != pair[1]] == []
    assert wanted.stdout.splitlines()[-1] == "breaches 0"
    assert wanted.stdout.count(" good") > TICKS / 2
    costs = json.loads((tmp_path / "costs").read_text())
    assert costs["spoiled"] == 0, "an interrupt leaves a register other than it found it"
    assert costs["handlers"]["SYNC"]["count"] >= TICKS * 9 // 10
    assert_within_the_longest_path(image.words, costs)
    model = re.findall(r"X\((\w+), \w+, \d+, (\d+)\)", (ROOT / "sim/node/node_cycles.h").read_text())
    assert len(model) == 11
    for name, whole in model:  # what the model of the node counts for the C is what the image takes
        assert costs["handlers"][name]["most"] <= int(whole), name


def assert_within_the_longest_path(words: list[int], costs: dict) -> None:
    loops = {int(at) // 2: times for at, times in costs["loops"].items()}
    program = paths.Program(words, loops, {at // 2 for at in costs["constants"]})
    for name, entry in paths.handlers(words, IRQS).items():
        for kind in KINDS.get(name, ()):
            assert 0 < costs["handlers"][kind]["most"] <= program.worst(entry), kind


@pytest.mark.parametrize("name", patches.patches())
def test_a_fault_of_the_port_is_noticed(tmp_path, name):
    words = translate.flash_words(COMMITTED)
    broken = Image(patches.apply(words, name), tmp_path / "broken")
    wanted, found = broken.run("native_records", 500, 1), broken.run("image_records", 500, 1)
    assert wanted.returncode == 0
    assert found.returncode != 0 or found.stdout != wanted.stdout


def test_each_vector_leads_to_its_handler_or_to_a_reset(image):
    outcomes = image.measured("image_check", "vectors")
    for program in ("application", "loader"):
        assert {n for n, what in enumerate(outcomes[program]) if what == "returns"} == SERVED
        assert {n for n, what in enumerate(outcomes[program]) if what not in ("returns", "restarts")} == {5, 6, 7}


def test_a_node_starts_whatever_its_memory_holds(image):
    boots = image.measured("image_check", "boots", BOOTS)
    assert len(boots) == BOOTS
    assert all(boot == {"good": True, "lost": 0, "breaches": 0} for boot in boots), boots


def test_a_node_is_back_after_every_kind_of_reset_at_its_full_clock(image):
    resets = image.measured("image_check", "resets")
    assert len(resets) == 12
    for reset in resets:
        reported = CODES.get(reset["cause"], RESET_POWER)
        assert reset["good"] and reset["breaches"] == 0, reset
        assert reset["reported"] & 1 << reported and not reset["reported"] & 0x700 & ~(1 << reported), reset
        assert reset["hz"][0] == reset["hz"][1] > 38_000_000, reset


def test_the_supply_may_fail_at_each_step_of_an_update(image, tmp_path):
    done = image.run("image_cuts", tmp_path / "cuts", CUT_SEEDS)
    assert done.returncode == 0, done.stderr
    steps = json.loads((tmp_path / "cuts").read_text())
    assert len(steps) == 19
    for step in steps:
        for one in step["runs"]:
            assert one["fate"] & step["allowed"] and one["reported"] and one["again"] and one["ticks"] <= 90, step


@pytest.mark.skipif(not LONG, reason="long: make firmware-check")
def test_the_supply_may_fail_at_any_time_of_an_update(image):
    done = image.run("image_cuts")
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(not LONG, reason="long: make firmware-check")
def test_a_thousand_schedules_of_random_faults(image):
    done = image.run("image_storm", 0, 1)
    assert done.returncode == 0, done.stdout
