"""The committed image: whole, of the present sources, for this chip, with nothing but this repository's code in them."""

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
FILES = {"loader.hex", "node.whex", "node_wire.hex", "node.sym"}
OPTIONS = 0x8000
PROGRAMS = ("cc1", "as", "ld", "bin2hex")  # of the compiler
NOT_RECORDED = "not recorded"
REMEDY = "make firmware-images PIC30=DIR makes them again"
# Bits that exist of each configuration word (device header of the part; DS70291, special features). The others read 0.
CONFIG_BITS = {0x00: 0xCF, 0x04: 0x07, 0x06: 0x87, 0x08: 0xE7, 0x0A: 0xDF, 0x0C: 0xF7, 0x0E: 0xE3}


def sums() -> dict[str, str]:
    lines = (IMAGES / "SHA256SUMS").read_text().splitlines()
    return {name: digest for digest, name in (line.split() for line in lines)}


def test_every_image_is_the_one_whose_hash_is_reported():
    assert sums().keys() == FILES
    assert {path.name for path in IMAGES.iterdir() if path.is_file()} == FILES | {
        "README.md",
        "SHA256SUMS",
        "COMPILER",
        "SOURCES",
    }
    for name, digest in sums().items():
        assert hashlib.sha256((IMAGES / name).read_bytes()).hexdigest() == digest, f"{name}: {REMEDY}"


def test_the_images_are_of_the_present_sources():
    assert (IMAGES / "SOURCES").read_text().strip() == source_hash.source_hash(), f"the sources have changed: {REMEDY}"


def compiler(path: Path) -> dict[str, str]:
    return dict(line.split(": ", 1) for line in path.read_text().splitlines())


def test_the_compiler_is_named_by_the_hashes_of_its_programs():
    named = compiler(IMAGES / "COMPILER")
    assert list(named) == ["version", "host", *PROGRAMS]
    assert all(named[name] == NOT_RECORDED or re.fullmatch("[0-9a-f]{64}", named[name]) for name in PROGRAMS)


@pytest.mark.skipif(not os.environ.get("PIC30"), reason="PIC30=DIR names a public build of the compiler")
def test_the_same_compiler_makes_the_committed_image(tmp_path):
    out = tmp_path / "out"
    environment = os.environ | {"OUT": str(out)}
    subprocess.run(["tools/firmware/build.sh"], cwd=ROOT, env=environment, check=True, capture_output=True)
    used, named = compiler(out / "compiler.txt"), compiler(IMAGES / "COMPILER")
    assert list(used) == list(named)
    if any(used[name] != named[name] for name in PROGRAMS):
        pytest.skip("not the compiler's programs that made the image: other bytes prove nothing")
    for name in ("loader.hex", "node.whex", "node_wire.hex"):
        assert hashlib.sha256((out / name).read_bytes()).hexdigest() == sums()[name]


def test_the_wire_image_holds_loader_and_application_of_its_build():
    make_image.check_wire(IMAGES / "node_wire.hex")
    image = (IMAGES / "node.whex").read_bytes()
    assert make_image.IMAGE_HEADER.unpack(image[: make_image.IMAGE_HEADER.size])["options"] == OPTIONS
    memory = make_image.wire_memory(IMAGES / "loader.hex", image, None)
    assert memory == intel_hex.read(IMAGES / "node_wire.hex")
    assert min(address for address in memory if address >= 2 * 0x2080) >= make_image.HEADER_ROW * make_image.ROW_HEX


def test_configuration_words_are_the_sources_and_have_no_bit_that_does_not_exist():
    text = (FIRMWARE / "port_dspic/chip/config.c").read_text()
    wanted = {int(at, 16): int(value, 16) for at, value in re.findall(r"CONFIG\(\w+, (0x\w+), (0x\w+)\)", text)}
    memory = intel_hex.read(IMAGES / "node_wire.hex")
    found = {a // 2: memory[a] | memory[a + 1] << 8 for a in memory if a >= make_image.CONFIG and a % 4 == 0}
    assert found == wanted and {at & 0xFF for at in wanted} == CONFIG_BITS.keys()
    for at, value in wanted.items():
        assert value & ~CONFIG_BITS[at & 0xFF] == 0, f"{at:#x}: {value:#04x} reads back otherwise"


def words_at(memory: dict[int, int], address: int, count: int) -> list[int]:
    """Program words from an address on, two address units each."""
    return [sum(memory[2 * (address + 2 * n) + i] << 8 * i for i in range(3)) for n in range(count)]


def test_no_vector_leads_to_the_start_of_a_program():
    """There the processor would go on at the interrupt's priority and serve none of its own: what is not served resets."""
    memory = intel_hex.read(IMAGES / "node_wire.hex")
    start, reset = 0x040000, 0xFE0000
    first = words_at(memory, 0x0000, 1)[0] & 0xFFFF
    gotos = words_at(memory, 0x2080, 2 * 127)[::2]
    assert all(word & 0xFF0000 == start for word in gotos)
    targets = {word & 0xFFFF for word in gotos[1:]} | set(words_at(memory, 0x0104, 126))
    assert not targets & {0, first, gotos[0] & 0xFFFF} and len(targets) == 2 * (12 + 1)
    assert sum(words_at(memory, target, 1)[0] == reset for target in targets) == 2


def program(memory: dict[int, int]) -> list[int]:
    """All program words in order of their addresses, configuration words apart."""
    found = sorted(address for address in memory if address < make_image.CONFIG and address % 4 == 0)
    return [sum(memory.get(address + i, 0xFF) << 8 * i for i in range(3)) for address in found]


def test_no_memory_is_filled_by_the_compilers_own_code():
    """GCC 4.5.1 for the chip makes of memset(.., 0xFF, ..) a row of 0xFEFF: no update would pass."""
    mov_feff = 0x2FEFF0  # mov.w #0xfeff, w0 to w15
    assert not [word for word in program(intel_hex.read(IMAGES / "node_wire.hex")) if word & 0xFFFFF0 == mov_feff]


def symbols() -> list[tuple[int, str]]:
    lines = (line.split() for line in (IMAGES / "node.sym").read_text().splitlines())
    return [(int(address, 16), name.lstrip("_")) for address, name in lines]


def test_nothing_is_linked_that_is_not_in_this_repository():
    sources = "".join(path.read_text() for path in FIRMWARE.rglob("*.[chs]") if "tests" not in path.parts)
    sources += (ROOT / "protocol/gen/whisker_protocol.h").read_text()
    handlers = re.findall(r"HANDLER\((\w+)\)", sources)
    known = {word.lstrip("_") for word in re.findall(r"\w+", sources)} | {"Alt" + name for name in handlers}
    functions = {name for _, name in symbols()}
    assert "node_on_order" in functions and "memcpy" in functions
    assert {name for name in functions if name not in known} == set()


def test_each_symbol_lies_in_the_image():
    memory = intel_hex.read(IMAGES / "node_wire.hex")
    assert [name for address, name in symbols() if 2 * address not in memory] == []


def test_the_stack_limit_lies_below_the_memory_that_dma_reaches():
    words = program(intel_hex.read(IMAGES / "node_wire.hex"))
    mov_w0_splim = 0x880100  # mov.w w0, 0x20; before it: mov.w #limit, w0
    limits = [before >> 4 & 0xFFFF for before, word in zip(words, words[1:], strict=False) if word == mov_w0_splim]
    assert len(limits) == 2 and all(0x2000 < limit < 0x4000 for limit in limits)


def test_a_node_is_programmed_without_any_compiler():
    done = subprocess.run(
        ["tools/firmware/flash.sh", "--tool", "pk2cmd", "--dry-run"], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0 and "-Ffirmware/images/node_wire.hex" in done.stdout, done.stderr
