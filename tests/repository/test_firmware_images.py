"""The committed images: whole, of the present sources, for this chip, with nothing but this repository's code in them."""

import hashlib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools/firmware"))
import intel_hex  # noqa: E402
import make_image  # noqa: E402
import source_hash  # noqa: E402

FIRMWARE = ROOT / "firmware/dspic"
IMAGES = ROOT / "firmware/images"
OPTIONS = {"mlx90333": 0x8000, "mlx90316": 0x8001, "resync": 0x8002}
REMEDY = "make firmware-images PIC30=DIR makes them again"
# Bits that exist of each configuration word (device header of the part; DS70291, special features). The others read 0.
CONFIG_BITS = {0x00: 0xCF, 0x04: 0x07, 0x06: 0x87, 0x08: 0xE7, 0x0A: 0xDF, 0x0C: 0xF7, 0x0E: 0xE3}


def sums() -> dict[str, str]:
    lines = (IMAGES / "SHA256SUMS").read_text().splitlines()
    return {name: digest for digest, name in (line.split() for line in lines)}


def test_every_image_is_the_one_whose_hash_is_reported():
    found = {str(path.relative_to(IMAGES)): path for path in IMAGES.glob("*/*")}
    assert found.keys() == sums().keys() and len(found) == 4 * len(OPTIONS)
    for name, path in found.items():
        assert hashlib.sha256(path.read_bytes()).hexdigest() == sums()[name], f"{name}: {REMEDY}"
        assert path.stat().st_size < 1_000_000


def test_the_images_are_of_the_present_sources():
    assert (IMAGES / "SOURCES").read_text().strip() == source_hash.source_hash(), f"the sources have changed: {REMEDY}"


@pytest.mark.skipif(not os.environ.get("PIC30"), reason="PIC30=DIR names a public build of the compiler")
def test_the_compiler_makes_the_committed_images(tmp_path):
    """One of the three: a minute and a half of processor time would make all."""
    environment = os.environ | {"OUT": str(tmp_path / "out")}
    subprocess.run(["tools/firmware/build.sh"], cwd=ROOT, env=environment, check=True, capture_output=True)
    for name in ("loader.hex", "node.whex", "node_wire.hex"):
        digest = hashlib.sha256((tmp_path / "out" / name).read_bytes()).hexdigest()
        assert digest == sums()[f"mlx90333/{name}"]


@pytest.mark.parametrize("build", OPTIONS)
def test_the_wire_image_holds_loader_and_application_of_its_build(build):
    make_image.check_wire(IMAGES / build / "node_wire.hex")
    image = (IMAGES / build / "node.whex").read_bytes()
    assert make_image.IMAGE_HEADER.unpack(image[: make_image.IMAGE_HEADER.size])["options"] == OPTIONS[build]
    memory = make_image.wire_memory(IMAGES / build / "loader.hex", image, None)
    assert memory == intel_hex.read(IMAGES / build / "node_wire.hex")
    assert min(address for address in memory if address >= 2 * 0x2080) >= make_image.HEADER_ROW * make_image.ROW_HEX


@pytest.mark.parametrize("build", OPTIONS)
def test_configuration_words_are_the_sources_and_have_no_bit_that_does_not_exist(build):
    text = (FIRMWARE / "port_dspic/chip/config.c").read_text()
    wanted = {int(at, 16): int(value, 16) for at, value in re.findall(r"CONFIG\(\w+, (0x\w+), (0x\w+)\)", text)}
    memory = intel_hex.read(IMAGES / build / "node_wire.hex")
    found = {a // 2: memory[a] | memory[a + 1] << 8 for a in memory if a >= make_image.CONFIG and a % 4 == 0}
    assert found == wanted and {at & 0xFF for at in wanted} == CONFIG_BITS.keys()
    for at, value in wanted.items():
        assert value & ~CONFIG_BITS[at & 0xFF] == 0, f"{at:#x}: {value:#04x} reads back otherwise"


def words_at(memory: dict[int, int], address: int, count: int) -> list[int]:
    """Program words from an address on, two address units each."""
    return [sum(memory[2 * (address + 2 * n) + i] << 8 * i for i in range(3)) for n in range(count)]


@pytest.mark.parametrize("build", OPTIONS)
def test_no_vector_leads_to_the_start_of_a_program(build):
    """There the processor would go on at the interrupt's priority and serve none of its own: what is not served resets."""
    memory = intel_hex.read(IMAGES / build / "node_wire.hex")
    start, reset = 0x040000, 0xFE0000
    first = words_at(memory, 0x0000, 1)[0] & 0xFFFF
    gotos = words_at(memory, 0x2080, 2 * 127)[::2]
    assert all(word & 0xFF0000 == start for word in gotos)
    targets = {word & 0xFFFF for word in gotos[1:]} | set(words_at(memory, 0x0104, 126))
    assert not targets & {0, first, gotos[0] & 0xFFFF} and len(targets) == 2 * (12 + 1)
    assert sum(words_at(memory, target, 1)[0] == reset for target in targets) == 2


@pytest.mark.parametrize("build", OPTIONS)
def test_no_memory_is_filled_by_the_compilers_own_code(build):
    """GCC 4.5.1 for the chip makes of memset(.., 0xFF, ..) a row of 0xFEFF: no update would pass."""
    assert "#0xfeff" not in (IMAGES / build / "node.lst").read_text()


def functions_of(listing: str) -> set[str]:
    """C and assembler names at the beginnings of the code, compiler's own labels apart."""
    return {name.lstrip("_") for name in re.findall(r"^[0-9a-f]{8} <(\w+)>:$", listing, re.M)}


@pytest.mark.parametrize("build", OPTIONS)
def test_nothing_is_linked_that_is_not_in_this_repository(build):
    sources = "".join(path.read_text() for path in FIRMWARE.rglob("*.[chs]") if "tests" not in path.parts)
    sources += (ROOT / "protocol/gen/whisker_protocol.h").read_text()
    handlers = re.findall(r"HANDLER\((\w+)\)", sources)
    known = {word.lstrip("_") for word in re.findall(r"\w+", sources)} | {"Alt" + name for name in handlers}
    functions = functions_of((IMAGES / build / "node.lst").read_text())
    assert "node_on_order" in functions and "memcpy" in functions
    assert {name for name in functions if name not in known} == set()


@pytest.mark.parametrize("build", OPTIONS)
def test_the_stack_limit_lies_below_the_memory_that_dma_reaches(build):
    listing = (IMAGES / build / "node.lst").read_text()
    limits = re.findall(r"mov\.w +#(0x\w+), w0\n.*mov\.w +w0, 0x20\n", listing)
    assert len(limits) == 2 and all(0x2000 < int(limit, 16) < 0x4000 for limit in limits)


def test_a_node_is_programmed_without_any_compiler(tmp_path):
    for setting, build in (({}, "mlx90333"), ({"SENSOR": "mlx90316"}, "mlx90316"), ({"RESYNC": "1"}, "resync")):
        done = subprocess.run(
            ["tools/firmware/flash.sh", "--tool", "pk2cmd", "--dry-run"],
            cwd=ROOT, env=os.environ | setting, capture_output=True, text=True,
        )  # fmt: skip
        assert done.returncode == 0 and f"-Ffirmware/images/{build}/node_wire.hex" in done.stdout, done.stderr
