"""The committed image of the Pico: of the present sources, the same bytes from the same compiler, a drive's file that holds it."""

import hashlib
import struct
import subprocess
import sys
from pathlib import Path

import pytest
from pico.emulated import IMAGE, ROOT

sys.path.insert(0, str(ROOT / "tools/firmware"))
import pico_image as tool  # noqa: E402

REMEDY = "tools/firmware/pico_image.py images makes it again"


def need_compiler() -> None:
    if not tool.compiler():
        pytest.skip(f"the Pico's firmware is not compiled: arm-none-eabi-gcc is not there; run: {tool.PACKAGE}")


def test_the_sums_are_those_of_the_files():
    lines = (IMAGE.parent / "SHA256SUMS").read_text().splitlines()
    assert [name for _, name in map(str.split, lines)] == list(tool.FILES)
    for digest, name in map(str.split, lines):
        assert hashlib.sha256((IMAGE.parent / name).read_bytes()).hexdigest() == digest, f"{name}: {REMEDY}"


def test_the_sources_make_the_image_byte_by_byte(tmp_path):
    need_compiler()
    tool.build(tmp_path)
    if tool.compiler_record() != (IMAGE.parent / "COMPILER").read_text():
        pytest.skip("not compared: another build of gcc-arm-none-eabi than the one that COMPILER names")
    for name in tool.FILES:
        assert (tmp_path / name).read_bytes() == (IMAGE.parent / name).read_bytes(), f"{name}: {REMEDY}"


def test_the_descriptors_are_the_bridges():
    """In a process of its own: the emitters' package changes what others import."""
    code = "import sys; sys.path[:0] = ['tools/firmware', 'protocol']; import pico_image; print(pico_image.descriptors_header(), end='')"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == tool.DESCRIPTORS.read_text(), "tools/firmware/pico_image.py descriptors writes it again"


def test_the_drives_file_holds_the_image_for_the_rp2040():
    raw, image = (IMAGE.parent / "pico.uf2").read_bytes(), IMAGE.read_bytes()
    blocks = [raw[at : at + 512] for at in range(0, len(raw), 512)]
    content = b""
    for number, block in enumerate(blocks):
        head, end = struct.unpack_from("<8I", block), struct.unpack_from("<I", block, 508)[0]
        assert head == (
            0x0A324655,
            0x9E5D5157,
            0x2000,
            0x10000000 + 256 * number,
            256,
            number,
            len(blocks),
            0xE48BFF56,
        )
        assert end == 0x0AB16F30 and not any(block[32 + 256 : 508])
        content += block[32 : 32 + 256]
    assert content[: len(image)] == image and not any(content[len(image) :])


def test_nothing_is_linked_that_is_not_in_this_repository(tmp_path):
    need_compiler()
    tool.build(tmp_path)
    names = subprocess.run(["arm-none-eabi-nm", str(tmp_path / "pico.elf")], capture_output=True, text=True, check=True)
    sources = "".join(path.read_text() for path in [*tool.FIRMWARE.rglob("*.[ch]"), tool.FIRMWARE / "pico.ld"])
    sources += "".join(path.read_text() for path in (ROOT / "firmware/dspic/core").glob("*.[ch]"))
    sources += (ROOT / "protocol/gen/whisker_protocol.h").read_text()
    symbols = {line.split()[-1].split(".")[0] for line in names.stdout.splitlines()} - {"$t", "$d", ""}
    symbols -= {"CSWTCH"}  # the compiler's name for a switch that became a table
    assert "stream_read" in symbols
    assert {name for name in symbols if name not in sources} == set()


def test_the_core_is_used_as_it_is():
    assert not [
        path
        for path in tool.FIRMWARE.glob("*.[ch]")
        if path.name in {p.name for p in Path(ROOT / "firmware/dspic/core").glob("*")}
    ]
