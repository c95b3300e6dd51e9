#!/usr/bin/env python3
"""Makes what goes into a node out of the compiler's Intel HEX.

make_image.py image APP.hex OUT.whex --version 0.2     what `whisker flash` loads through the bridge
make_image.py wire LOADER.hex OUT.hex [--app APP.hex --version 0.2] [--serial N]
                                                       what `make flash` programs by wire: loader, application, number
make_image.py check WIRE.hex                           is it whole, for this chip, and of a version that this host knows?
make_image.py verify WIRE.hex READ.hex                 does what was read back from a chip hold it, configuration words included?

An instruction is four bytes in the HEX file (three and a zero) at twice its address; three bytes in an image.
"""

import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "protocol"), str(Path(__file__).resolve().parent)]
import intel_hex  # noqa: E402

from whisker_protocol import IMAGE_HEADER, LIMITS, WIRE_VERSION, crc32  # noqa: E402

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
            f"{path}: code at {where:#08x}, which is the loader's; link it from {FIRST_ROW * ROW // 3 * 2:#08x} on, as make firmware does"
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
        raise intel_hex.HexError(f"{loader}: code in the application's rows; give the loader.hex of make firmware")
    if image:
        head, content = image[: IMAGE_HEADER.size], image[IMAGE_HEADER.size :]
        for i, byte in enumerate(head.ljust(ROW, b"\xff") + content):
            memory[HEADER_ROW * ROW_HEX + i // 3 * 4 + i % 3] = byte
            memory[HEADER_ROW * ROW_HEX + i // 3 * 4 + 3] = 0
    if serial is not None:
        for i, byte in enumerate(serial.to_bytes(4, "little")):
            memory |= {FUID0 + 4 * i: byte, FUID0 + 4 * i + 1: 0, FUID0 + 4 * i + 2: 0, FUID0 + 4 * i + 3: 0}
    return memory


def check_wire(path: Path) -> None:
    """HexError unless `path` has a loader and a whole application for this chip and this wire version."""
    memory = intel_hex.read(path)
    placed = flash_bytes(memory)
    if not any(placed.get(i, 0xFF) != 0xFF for i in range(3)):
        raise intel_hex.HexError(
            f"{path}: nothing at the reset vector, so no loader; give the node_wire.hex of a build"
        )
    raw = bytes(placed.get(HEADER_ROW * ROW + i, 0xFF) for i in range(IMAGE_HEADER.size))
    head = IMAGE_HEADER.unpack(raw)
    crc_at = IMAGE_HEADER.fields["header_crc32"].offset
    if head["magic"] != LIMITS["image_magic"] or crc32(raw[:crc_at]) != head["header_crc32"]:
        raise intel_hex.HexError(
            f"{path}: no application header in row {HEADER_ROW}; give the node_wire.hex of a build"
        )
    if head["chip"] != LIMITS["chip_id"]:
        raise intel_hex.HexError(
            f"{path}: for chip {head['chip']:#06x}, not {LIMITS['chip_id']:#06x}; give an image of this board"
        )
    if head["wire_version"] != WIRE_VERSION:
        raise intel_hex.HexError(
            f"{path}: wire version {head['wire_version']}, this host's is {WIRE_VERSION}; take image and host of one release"
        )
    content = bytes(placed.get(FIRST_ROW * ROW + i, 0xFF) for i in range(head["length"]))
    if head["length"] > FLASH_END or crc32(content) != head["body_crc32"]:
        raise intel_hex.HexError(
            f"{path}: the application's CRC-32 is wrong: cut short or changed; fetch or build it again"
        )


def verify(wanted: Path, found: Path) -> None:
    """HexError at the first byte of `wanted` that `found` does not hold. Erased flash reads 0xFF; of a configuration word
    only its low byte exists."""
    memory, chip = intel_hex.read(wanted), intel_hex.read(found)
    for address, byte in sorted(memory.items()):
        is_there = address % 4 == 0 if address >= CONFIG else address % 4 != 3
        if is_there and chip.get(address, 0xFF) != byte:
            raise intel_hex.HexError(
                f"{found}: {chip.get(address, 0xFF):#04x} at {address // 2:#08x} of the chip, not {byte:#04x}; check supply and "
                "wires, program it again"
            )


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
    check = kinds.add_parser("check", usage=argparse.SUPPRESS)
    check.add_argument("hex", type=Path)
    compare = kinds.add_parser("verify", usage=argparse.SUPPRESS)
    compare.add_argument("hex", type=Path)
    compare.add_argument("found", type=Path)
    words = parser.parse_args()
    try:
        if words.kind == "check":
            check_wire(words.hex)
        elif words.kind == "verify":
            verify(words.hex, words.found)
        elif words.kind == "image":
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
