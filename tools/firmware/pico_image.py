#!/usr/bin/env python3
"""Builds the Pico's firmware with Debian's gcc-arm-none-eabi: pico.uf2, which the chip's boot drive takes, pico.bin and pico.elf.

pico_image.py build OUT          into this folder; in COMPILER what built it
pico_image.py images             firmware/images/pico again: built twice, in two folders, and replaced if both are the same
pico_image.py descriptors        firmware/pico/gen/usb_descriptors.h, of fpga/usb/descriptors.py
"""

import argparse
import hashlib
import shutil
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware/pico"
IMAGES = ROOT / "firmware/images/pico"
DESCRIPTORS = FIRMWARE / "gen/usb_descriptors.h"
PREFIX = "arm-none-eabi-"
PACKAGE = "apt-get install --no-install-recommends gcc-arm-none-eabi"
CORE = ("record.c",)  # of firmware/dspic/core: the rest is the MLX90333's and the node link's
FLAGS = "-mcpu=cortex-m0plus -mthumb -std=c99 -O3 -Wall -Wextra -Werror -ffreestanding -fno-builtin -nostdlib"
FLAGS += " --param=min-pagesize=0"  # the ROM's table lies at address 0x14
FLAGS += " -fno-tree-loop-distribute-patterns -fno-common -ffunction-sections -Wl,--gc-sections,--build-id=none"
FILES = ("pico.uf2", "pico.bin")
BOOT2_BYTES = 252
PRODUCT = "Whisker Pico"  # host/python/crunchbot/bridge/usbtree.py knows it by this
MILLIAMPERES = 100  # of the board and 16 sensors of 3.4 mA

UF2_BLOCK = struct.Struct("<IIIIIIII476sI")
UF2_MAGIC = (0x0A324655, 0x9E5D5157, 0x0AB16F30)
UF2_FAMILY_GIVEN = 0x2000  # flag: the field holds a family
UF2_PAYLOAD = 256
RP2040_FAMILY = 0xE48BFF56
FLASH = 0x10000000


def boot_crc(code: bytes) -> int:
    """CRC-32 as the chip's ROM wants it behind boot stage 2: not reflected, not inverted at the end (data sheet, 2.8.1.3.1)."""
    crc = 0xFFFFFFFF
    for byte in code:
        crc ^= byte << 24
        for _ in range(8):
            crc = (crc << 1 ^ (0x04C11DB7 if crc & 0x80000000 else 0)) & 0xFFFFFFFF
    return crc


def with_boot_crc(image: bytes) -> bytes:
    code = image[:BOOT2_BYTES]
    return code + struct.pack("<I", boot_crc(code)) + image[BOOT2_BYTES + 4 :]


def uf2(image: bytes, family: int = RP2040_FAMILY) -> bytes:
    """Blocks of 256 bytes for flash from its begin on (the format's description, github.com/microsoft/uf2)."""
    pieces = [image[at : at + UF2_PAYLOAD].ljust(UF2_PAYLOAD, b"\0") for at in range(0, len(image), UF2_PAYLOAD)]
    return b"".join(
        UF2_BLOCK.pack(
            *UF2_MAGIC[:2],
            UF2_FAMILY_GIVEN,
            FLASH + UF2_PAYLOAD * i,
            UF2_PAYLOAD,
            i,
            len(pieces),
            family,
            piece,
            UF2_MAGIC[2],
        )
        for i, piece in enumerate(pieces)
    )


def compiler() -> str | None:
    return shutil.which(f"{PREFIX}gcc")


def compiler_record() -> str:
    """Version, and the SHA-256 of each program that makes bytes of the image."""
    gcc = compiler()
    lines = [f"version: {_run(gcc, '--version').splitlines()[0]}"]
    for name in ("cc1", "as", "ld", "objcopy"):
        path = _run(gcc, f"-print-prog-name={name}").strip()
        lines.append(f"{name}: {hashlib.sha256(Path(shutil.which(path) or path).read_bytes()).hexdigest()}")
    return "\n".join(lines) + "\n"


def build(out: Path, sources: Path = FIRMWARE) -> None:
    """RuntimeError with what the compiler said. `sources`: another folder than the firmware's in tests that change it."""
    out.mkdir(parents=True, exist_ok=True)
    core = ROOT / "firmware/dspic/core"
    files = [*sorted(sources.glob("*.c")), *(core / name for name in CORE)]
    includes = [f"-I{folder}" for folder in (sources, core, ROOT / "protocol/gen")]
    maps = [f"-ffile-prefix-map={ROOT}=."]
    script = ["-T", str(sources / "pico.ld")]
    _run(f"{PREFIX}gcc", *FLAGS.split(), *maps, *includes, *map(str, files), *script, "-o", str(out / "pico.elf"))
    _run(f"{PREFIX}objcopy", "-O", "binary", "--gap-fill", "0", str(out / "pico.elf"), str(out / "pico.bin"))
    image = with_boot_crc((out / "pico.bin").read_bytes())
    (out / "pico.bin").write_bytes(image)
    (out / "pico.uf2").write_bytes(uf2(image))


def _run(*words: str) -> str:
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{words[0]}: {done.stderr.strip()}")
    return done.stdout


def images() -> None:
    with tempfile.TemporaryDirectory() as first, tempfile.TemporaryDirectory() as second:
        for folder in (first, second):
            build(Path(folder))
        if any((Path(first) / name).read_bytes() != (Path(second) / name).read_bytes() for name in FILES):
            raise RuntimeError("two builds differ; nothing was replaced")
        IMAGES.mkdir(parents=True, exist_ok=True)
        for name in FILES:
            shutil.copy(Path(first) / name, IMAGES / name)
    sums = [f"{hashlib.sha256((IMAGES / name).read_bytes()).hexdigest()}  {name}\n" for name in FILES]
    (IMAGES / "SHA256SUMS").write_text("".join(sums))
    (IMAGES / "COMPILER").write_text(compiler_record())


def descriptors_header() -> str:
    """What the bridge says of itself at full speed, with the Pico's current and without a supply of its own."""
    sys.path.insert(0, str(ROOT / "fpga/usb"))
    import descriptors as d
    import standard_requests as r

    found = d.descriptors(d.Build(product=PRODUCT, full_speed_only=True, self_powered=False, milliamps=MILLIAMPERES))
    lines = [
        "/* Generated by tools/firmware/pico_image.py from fpga/usb/descriptors.py. Do not edit. */",
        "#include <stdbool.h>",
    ]
    lines += ["#include <stdint.h>", ""]
    lines += [f"#define USB_STRING {r.STRING}u", f"#define USB_SERIAL_INDEX {d.SERIAL_INDEX}u"]
    lines += [f"#define USB_WINDOWS_REQUEST {r.WINDOWS_REQUEST}u", f"#define USB_WINDOWS_INDEX {r.WINDOWS_INDEX}u", ""]
    rows = []
    for kind, index, raw in found:
        kind = r.CONFIGURATION if kind == r.CONFIGURATION_AT_FULL_SPEED else kind
        if kind == r.STRING and index == d.SERIAL_INDEX:
            continue  # the flash chip's number
        name = "usb_windows_set" if kind == r.WINDOWS_SET else f"usb_descriptor_{kind}_{index}"
        lines.append(f"static const uint8_t {name}[] = {{{', '.join(map(str, raw))}}};")
        if kind != r.WINDOWS_SET:
            of_interface = str(kind in r.OF_INTERFACE).lower()
            rows.append(f"    {{{kind}, {index}, {of_interface}, sizeof {name}, {name}}},")
    lines += ["", "static const struct {", "    uint8_t type, index;", "    bool of_interface;", "    uint16_t length;"]
    lines += ["    const uint8_t *bytes;", "} described[] = {", *rows, "};", ""]
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_subparsers(dest="what", required=True)
    what.add_parser("build", usage=argparse.SUPPRESS).add_argument("out", type=Path)
    what.add_parser("images")
    what.add_parser("descriptors")
    words = parser.parse_args()
    if words.what == "descriptors":
        DESCRIPTORS.parent.mkdir(exist_ok=True)
        DESCRIPTORS.write_text(descriptors_header())
        return 0
    if not compiler():
        print(f"pico: {PREFIX}gcc is not there; run: {PACKAGE}", file=sys.stderr)
        return 1
    try:
        build(words.out) if words.what == "build" else images()
    except RuntimeError as error:
        print(f"pico: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
