#!/usr/bin/env python3
"""Makes what goes into a node out of the compiler's Intel HEX.

make_image.py image APP.hex OUT.whex --version 0.2     what `whisker flash` loads through the bridge
make_image.py wire LOADER.hex OUT.hex [--app APP.hex --version 0.2] [--serial N]
                                                       what `make flash` programs by wire: loader, application, number

An instruction is four bytes in the HEX file (three and a zero) at twice its address; three bytes in an image.
"""

import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host/python"), str(Path(__file__).resolve().parent)]
import intel_hex  # noqa: E402

from whisker.protocol import IMAGE_HEADER, LIMITS, WIRE_VERSION, crc32  # noqa: E402

ROW = LIMITS["flash_row_bytes"]
ROW_HEX = ROW // 3 * 4  # bytes of a row in the HEX file
HEADER_ROW = LIMITS["application_row"]
FIRST_ROW = HEADER_ROW + 1
FLASH_END = LIMITS["flash_rows"] * ROW_HEX
CONFIG = 0xF80000 * 2
FUID0 = 0xF80010 * 2


def flash_bytes(memory: dict[int, int]) -> dict[int, int]:
    """Bytes as an image counts them, three per instruction, by place in flash; configuration words left out."""
    out = {}
    for address, byte in memory.items():
        if address < FLASH_END and address % 4 != 3:
            out[address // 4 * 3 + address % 4] = byte
    return out


def body(path: Path) -> bytes:
    """The application's rows. HexError if it lies where it must not."""
    memory = intel_hex.read(path)
    outside = [a for a in memory if FLASH_END <= a < CONFIG]
    placed = flash_bytes(memory)
    if outside or not placed:
        raise intel_hex.HexError(f"{path}: {'data beyond the flash' if outside else 'no code'}; build it for this chip")
    if min(placed) < FIRST_ROW * ROW:
        where = min(placed) // 3 * 2
        raise intel_hex.HexError(
            f"{path}: code at {where:#08x}, which is the loader's; link it with app.gld, from {FIRST_ROW * ROW // 3 * 2:#08x}"
        )
    rows = max(placed) // ROW + 1 - FIRST_ROW
    return bytes(placed.get(FIRST_ROW * ROW + i, 0xFF) for i in range(rows * ROW))


def header(content: bytes, version: int, options: int, chip: int, wire_version: int) -> bytes:
    values = {"magic": LIMITS["image_magic"], "chip": chip, "wire_version": wire_version, "version": version}
    values |= {"format": LIMITS["image_format"], "length": len(content), "body_crc32": crc32(content)}
    out = IMAGE_HEADER.pack(**values, options=options, first_row=FIRST_ROW)
    check = IMAGE_HEADER.fields["header_crc32"]
    return out[: check.offset] + crc32(out[: check.offset]).to_bytes(4, "little")


def make_image(
    path: Path, version: int, options: int = 0, chip: int = LIMITS["chip_id"], wire: int = WIRE_VERSION
) -> bytes:
    """An image file's bytes."""
    content = body(path)
    return header(content, version, options, chip, wire) + content


def wire_memory(loader: Path, image: bytes | None, serial: int | None, whole: bool = False) -> dict[int, int]:
    """The loader's HEX with image and serial number put in; whole: there is an application in it already."""
    memory = intel_hex.read(loader)
    if not whole and any(HEADER_ROW * ROW_HEX <= address < FLASH_END for address in memory):
        raise intel_hex.HexError(f"{loader}: code in the application's rows; link it with build/firmware/loader.gld")
    if image:
        head, content = image[: IMAGE_HEADER.size], image[IMAGE_HEADER.size :]
        for i, byte in enumerate(head.ljust(ROW, b"\xff") + content):
            memory[HEADER_ROW * ROW_HEX + i // 3 * 4 + i % 3] = byte
            memory[HEADER_ROW * ROW_HEX + i // 3 * 4 + 3] = 0
    if serial is not None:
        for i, byte in enumerate(serial.to_bytes(4, "little")):
            memory |= {FUID0 + 4 * i: byte, FUID0 + 4 * i + 1: 0, FUID0 + 4 * i + 2: 0, FUID0 + 4 * i + 3: 0}
    return memory


def version_number(text: str) -> int:
    major, _, minor = text.partition(".")
    if not (major.isdigit() and minor.isdigit() and int(major) < 256 and int(minor) < 256 and int(major) + int(minor)):
        raise argparse.ArgumentTypeError("give a version such as 0.2, each part below 256, not 0.0")
    return int(major) << 8 | int(minor)


def serial_number(text: str) -> int:
    if not text.isdigit() or not 0 < int(text) < LIMITS["serial_none"]:
        raise argparse.ArgumentTypeError(f"give a number from 1 to {LIMITS['serial_none'] - 1}")
    return int(text)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = parser.add_subparsers(dest="kind", required=True)
    image = kinds.add_parser("image", usage=argparse.SUPPRESS)  # an error is one line
    image.add_argument("hex", type=Path)
    image.add_argument("out", type=Path)
    image.add_argument("--version", type=version_number, required=True)
    wire = kinds.add_parser("wire", usage=argparse.SUPPRESS)
    wire.add_argument("hex", type=Path)
    wire.add_argument("out", type=Path)
    wire.add_argument("--app", type=Path)
    wire.add_argument("--version", type=version_number, default=1)
    wire.add_argument("--serial", type=serial_number)
    wire.add_argument("--whole", action="store_true", help="the HEX has its application already")
    for kind in (image, wire):
        kind.add_argument("--options", type=lambda text: int(text, 0), default=0)
    words = parser.parse_args()
    try:
        if words.kind == "image":
            words.out.write_bytes(make_image(words.hex, words.version, words.options))
        else:
            app = make_image(words.app, words.version, words.options) if words.app else None
            intel_hex.write(words.out, wire_memory(words.hex, app, words.serial, words.whole))
    except intel_hex.HexError as error:
        print(f"make_image: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
