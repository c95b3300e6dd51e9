"""The wire format, read from the one definition file: offsets, sizes, codes and the CRC.

Firmware and gateware use the C and Verilog that tools/protogen.py generates from the same file.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path

FIELD_BYTES = {"u8": 1, "u16": 2, "u32": 4, "u64": 8}
STATUS_CODE_SHIFT = 10  # status: ten sensor error bits, then the six-bit code


@dataclass(frozen=True)
class Field:
    """One field of a message: byte offset, bytes per element, number of elements."""

    name: str
    offset: int
    size: int
    count: int
    unit: str
    doc: str

    @property
    def end(self) -> int:
        return self.offset + self.size * self.count


class Message:
    """An ordered list of little-endian fields with computed offsets."""

    def __init__(self, table: dict):
        self.doc = table["doc"]
        self.id = table.get("id")
        self.fields: dict[str, Field] = {}
        offset = 0
        for f in table["fields"]:
            field = Field(
                f["name"], offset, FIELD_BYTES[f["type"]], f.get("count", 1), f.get("unit", ""), f.get("doc", "")
            )
            self.fields[field.name] = field
            offset = field.end
        self.size = offset

    def pack(self, **values: int) -> bytes:
        """Bytes of the message; fields not named are zero; a field "crc" is computed."""
        out = bytearray(self.size)
        for name, value in values.items():
            f = self.fields[name]
            out[f.offset : f.offset + f.size] = value.to_bytes(f.size, "little")
        if "crc" in self.fields and "crc" not in values:
            out[-1] = crc8(out[:-1])
        return bytes(out)

    def unpack(self, data: bytes) -> dict[str, int]:
        """Field values of the message at the start of `data`; arrays are left out. ValueError if it is too short."""
        if len(data) < self.size:
            raise ValueError(f"message truncated: {len(data)} of {self.size} bytes; read the rest")
        single = (f for f in self.fields.values() if f.count == 1)
        return {f.name: int.from_bytes(data[f.offset : f.end], "little") for f in single}


DEFINITION = tomllib.loads((Path(__file__).parent / "whisker.toml").read_text())
WIRE_VERSION: int = DEFINITION["wire_version"]
RECORD = Message(DEFINITION["record"])
ORDER = Message(DEFINITION["order"])
FRAME_HEADER = Message(DEFINITION["frame_header"])
SERVICE = Message(DEFINITION["service"])
IMAGE_HEADER = Message(DEFINITION["image_header"])
GATEWARE_HEADER = Message(DEFINITION["gateware_header"])
REPORTS = {name: Message(table) for name, table in DEFINITION["reports"].items()}
LIMITS: dict[str, int] = {name: entry["value"] for name, entry in DEFINITION["limits"].items()}
CODES: dict[str, int] = {name: entry["value"] for name, entry in DEFINITION["codes"].items()}
COMMANDS: dict[str, int] = {name: entry["value"] for name, entry in DEFINITION["commands"].items()}
SERVICE_COMMANDS: dict[str, int] = {name: e["value"] for name, e in DEFINITION["service_commands"].items()}
NODE_STATES: dict[str, int] = {name: e["value"] for name, e in DEFINITION["node_states"].items()}
FRAME_FLAGS: dict[str, int] = {name: 1 << entry["bit"] for name, entry in DEFINITION["frame_flags"].items()}
CONTROL_OPTIONS: dict[str, int] = {name: 1 << e["bit"] for name, e in DEFINITION["control_options"].items()}
BOARDS: dict[str, int] = {name: entry["value"] for name, entry in DEFINITION["boards"].items()}
FLASH_COMMANDS: dict[str, int] = {name: entry["value"] for name, entry in DEFINITION["flash_commands"].items()}
SENSOR_ERRORS: dict[str, dict] = DEFINITION["sensor_errors"]
LANES: int = LIMITS["lanes"]
FRAME_BYTES: int = FRAME_HEADER.size + LANES * RECORD.size


def crc8(data: bytes) -> int:
    """CRC-8 of `data`, bit by bit, with the parameters of the definition file."""
    p = DEFINITION["crc8"]
    crc = p["init"]
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = ((crc << 1) ^ p["polynomial"]) & 0xFF if crc & 0x80 else crc << 1
    return crc ^ p["xor_out"]


def crc32(data: bytes) -> int:
    """CRC-32 of `data`, most significant bit first, with the parameters of the definition file."""
    p = DEFINITION["crc32"]
    crc = p["init"]
    for byte in data:
        crc ^= byte << 24
        for _ in range(8):
            crc = ((crc << 1) ^ p["polynomial"] if crc & 0x80000000 else crc << 1) & 0xFFFFFFFF
    return crc ^ p["xor_out"]


def service_window(tick: int, command: int, argument: bytes = b"", data: bytes = b"") -> bytes:
    """The bytes a bridge sends in a service window; short arguments and data are filled up with zeros."""
    head = bytes([tick & 0xFF, command]) + argument.ljust(SERVICE.fields["argument"].count, b"\0")
    body = head + bytes([crc8(head)]) + data.ljust(SERVICE.fields["data"].count, b"\0")
    return body + crc32(body).to_bytes(4, "big")


def decode_frame(data: bytes) -> tuple[dict[str, int], list[dict[str, int]]]:
    """Header and records of one frame. ValueError names the field and the remedy when it is malformed."""
    if len(data) < FRAME_BYTES:
        raise ValueError(f"frame truncated: {len(data)} of {FRAME_BYTES} bytes; read the rest")
    header = FRAME_HEADER.unpack(data)
    if header["magic"] != LIMITS["frame_magic"]:
        raise ValueError(
            f"frame magic is {header['magic']:#06x}, not {LIMITS['frame_magic']:#06x}; resynchronise the stream"
        )
    if header["wire_version"] != WIRE_VERSION:
        raise ValueError(
            f"frame wire_version is {header['wire_version']}, this package speaks {WIRE_VERSION}; update the older of the two"
        )
    if header["crc"] != crc8(data[: FRAME_HEADER.size - 1]):
        raise ValueError("frame header crc is wrong; check the USB cable")
    if header["lanes"] != LANES:
        raise ValueError(f"frame lanes is {header['lanes']}, not {LANES}; update the gateware")
    return header, [decode_record(data, FRAME_HEADER.size + lane * RECORD.size) for lane in range(LANES)]


def decode_record(data: bytes, offset: int = 0) -> dict[str, int]:
    """One record's fields, with its code and error bits apart. ValueError if its CRC is wrong."""
    raw = data[offset : offset + RECORD.size]
    record = RECORD.unpack(raw)
    if record["crc"] != crc8(raw[:-1]):
        raise ValueError("record crc is wrong; check the lane's cable")
    record["code"] = record["status"] >> STATUS_CODE_SHIFT
    record["errors"] = record["status"] & ((1 << STATUS_CODE_SHIFT) - 1)
    return record
