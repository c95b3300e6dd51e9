"""Intel HEX as a dictionary of bytes by address: data, extended segment and linear addresses, checksums."""

from pathlib import Path

RECORD_BYTES = 16
DATA, END, SEGMENT, START_SEGMENT, LINEAR, START_LINEAR = range(6)


class HexError(ValueError):
    """File, line, what, remedy."""


def read(path: Path) -> dict[int, int]:
    """Bytes by address. HexError names file and line; a file without its end record was cut short."""
    memory: dict[int, int] = {}
    base = 0
    try:
        lines = path.read_text("ascii").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise HexError(f"{path}: cannot be read ({error}); give an Intel HEX file") from error
    for number, line in enumerate(lines, start=1):
        kind, address, data = _record(path, number, line)
        if kind == DATA:
            memory |= {base + address + i: byte for i, byte in enumerate(data)}
        elif kind == END:
            return memory
        elif kind in (SEGMENT, LINEAR) and len(data) == 2:
            base = int.from_bytes(data, "big") << (4 if kind == SEGMENT else 16)
        elif kind not in (START_SEGMENT, START_LINEAR):
            raise HexError(f"{path}:{number}: record type {kind} is not Intel HEX; build the file again")
    raise HexError(f"{path}: no end record: the file was cut short; build it again")


def _record(path: Path, number: int, line: str) -> tuple[int, int, bytes]:
    try:
        raw = bytes.fromhex(line[1:]) if line.startswith(":") else b""
    except ValueError:
        raw = b""
    if len(raw) < 5 or len(raw) != raw[0] + 5 or sum(raw) & 0xFF:
        raise HexError(f"{path}:{number}: not an Intel HEX record, or its checksum is wrong; build the file again")
    return raw[3], int.from_bytes(raw[1:3], "big"), raw[4:-1]


def write(path: Path, memory: dict[int, int]) -> None:
    """Writes the bytes in rising order, with linear addresses."""
    lines, upper = [], 0
    addresses = sorted(memory)
    at = 0
    while at < len(addresses):
        first = addresses[at]
        if first >> 16 != upper:
            upper = first >> 16
            lines.append(_line(LINEAR, 0, upper.to_bytes(2, "big")))
        room = min(RECORD_BYTES, 0x10000 - (first & 0xFFFF))
        data = bytearray()
        while at < len(addresses) and len(data) < room and addresses[at] == first + len(data):
            data.append(memory[addresses[at]])
            at += 1
        lines.append(_line(DATA, first & 0xFFFF, bytes(data)))
    path.write_text("\n".join([*lines, _line(END, 0, b"")]) + "\n", "ascii")


def _line(kind: int, address: int, data: bytes) -> str:
    raw = bytes([len(data)]) + address.to_bytes(2, "big") + bytes([kind]) + data
    return ":" + (raw + bytes([-sum(raw) & 0xFF])).hex().upper()
