"""What a bridge's configuration flash holds beside bitstreams: images for an update over USB, and the jump to the image that
an ECP5 falls back to."""

from whisker_protocol import GATEWARE_HEADER, LIMITS, WIRE_VERSION, crc32

SECTOR = 1 << 16  # bytes, unit of a board's `flash`
PAGE = 256
MBIT = 1 << 17  # bytes
# Commands of sysCONFIG: FPGA-TN-02039, and Project Trellis, whose ecpmulti writes the same page.
PREAMBLE = bytes.fromhex("ffffbdb3")
CONTROL_0 = bytes.fromhex("2200000000000000")
JUMP = bytes.fromhex("7e00000003")  # with the opcode of a slow read


def gateware_image(bitstream: bytes, board: int, lanes: int, commit: int) -> bytes:
    """The file that `whisker flash` takes: header, bitstream. `board`: the protocol's number, `commit`: first 16 bits, 0 if unknown."""
    header = GATEWARE_HEADER.pack(
        magic=LIMITS["gateware_magic"],
        format=LIMITS["gateware_format"],
        wire_version=WIRE_VERSION,
        board=board,
        lanes=lanes,
        build=commit,
        gateware=LIMITS["gateware_version"],
        length=len(bitstream),
        body_crc32=crc32(bitstream),
    )
    at = GATEWARE_HEADER.fields["header_crc32"].offset
    return header[:at] + crc32(header[:at]).to_bytes(4, "little") + bitstream


def fallback_address(sectors: int) -> int:
    """Where the other image begins: behind what a host may write."""
    return sectors * SECTOR


def jump_address(mbit: int) -> int:
    """The flash's last page, where an ECP5 looks that found no whole image at 0."""
    return mbit * MBIT - PAGE


def jump_page(address: int) -> bytes:
    """That page, sending it to this address."""
    page = b"\xff" * 16 + PREAMBLE + b"\xff" * 4 + CONTROL_0 + JUMP + address.to_bytes(3, "big")
    return page.ljust(PAGE, b"\xff")
