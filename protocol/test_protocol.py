"""The definition, its generated files and the golden vectors agree."""

import subprocess
import sys
from pathlib import Path

import pytest

import whisker_protocol as p

HERE = Path(__file__).parent


def vectors(name: str) -> list[list[str]]:
    lines = (HERE / "vectors" / name).read_text().splitlines()
    rows = [[cell.strip() for cell in line.split("|")] for line in lines if line and not line.startswith("#")]
    assert rows, f"{name} holds no vector"
    return rows


def test_generated_files_are_current():
    done = subprocess.run(
        [sys.executable, HERE.parent / "tools/protogen.py", "--check"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_crc_matches_its_published_check_value():
    assert p.crc8(b"123456789") == p.DEFINITION["crc8"]["check"]


def test_sizes_are_those_of_the_design():
    assert (p.RECORD.size, p.FRAME_HEADER.size, p.FRAME_BYTES) == (8, 32, 256)
    assert p.LIMITS["bulk_packet"] == 2 * p.FRAME_BYTES


def test_codes_fit_their_six_bits_and_error_bits_their_ten():
    assert all(value < 64 for value in p.CODES.values())
    assert sorted(e["bit"] for e in p.SENSOR_ERRORS.values()) == list(range(p.STATUS_CODE_SHIFT))


@pytest.mark.parametrize("name, data, tick, outcome", vectors("records.txt"))
def test_record_vector(name, data, tick, outcome):
    raw = bytes.fromhex(data)
    assert judge_record(raw, int(tick)) == outcome


def judge_record(raw: bytes, tick: int) -> str:
    """What the bridge decides about a record, in the order it decides it."""
    if raw == b"\xff" * p.RECORD.size:
        return "absent"
    try:
        record = p.decode_record(raw)
    except ValueError:
        return "link_crc"
    return "good" if record["tick"] == tick else "link_tick"


def test_record_vectors_carry_every_node_code_and_every_error_bit():
    good = [p.decode_record(bytes.fromhex(row[1])) for row in vectors("records.txt") if row[3] == "good"]
    assert {r["code"] for r in good} == {value for value in p.CODES.values() if value < 32}
    assert {r["errors"] for r in good} >= {1 << e["bit"] for e in p.SENSOR_ERRORS.values()}


def test_byte_order_of_a_record():
    raw = next(bytes.fromhex(row[1]) for row in vectors("records.txt") if row[0] == "byte_order")
    record = p.decode_record(raw)
    assert (raw[1], raw[2], record["alpha"], record["beta"]) == (0x34, 0x12, 0x1234, 0xABCD)


@pytest.mark.parametrize("name, data, outcome", vectors("frames.txt"))
def test_frame_vector(name, data, outcome):
    raw = bytes.fromhex(data)
    if outcome == "ok":
        header, records = p.decode_frame(raw)
        assert len(records) == p.LANES
        assert all(r["tick"] == header["tick"] & 0xFF for r in records)
        return
    with pytest.raises(ValueError, match=outcome.replace("_", ".").replace("record.crc", "record crc")) as refused:
        p.decode_frame(raw)
    assert ";" in str(refused.value), "an error names its remedy"


@pytest.mark.parametrize("name, data, outcome", vectors("services.txt"))
def test_service_vector(name, data, outcome):
    raw = bytes.fromhex(data)
    again = p.service_window(raw[0], raw[1], raw[2:7], raw[8:56])
    assert (again == raw) == (outcome == "good")


def test_crc32_matches_its_published_check_value():
    assert p.crc32(b"123456789") == p.DEFINITION["crc32"]["check"]


def test_block_header_and_reports_fit_what_carries_them():
    block = p.SERVICE.fields["data"].count
    assert (p.SERVICE.size, block, p.IMAGE_HEADER.size, p.LIMITS["flash_row_bytes"] % block) == (60, 48, 48, 0)
    assert p.REPORTS["service"].size <= 64, "one packet of the control endpoint"
    assert p.REPORTS["answers"].size == 8 + 6 * p.LANES


def test_frame_vectors_carry_every_bridge_code():
    frames = [p.decode_frame(bytes.fromhex(row[1]))[1] for row in vectors("frames.txt") if row[2] == "ok"]
    assert {r["code"] for records in frames for r in records} == set(p.CODES.values())


def test_pack_and_unpack_are_inverse():
    values = {"tick": 7, "alpha": 0x1234, "beta": 0xFEDC, "status": 0x0401}
    assert p.RECORD.unpack(p.RECORD.pack(**values)) | values == p.RECORD.unpack(p.RECORD.pack(**values))


def test_unpack_refuses_a_short_message():
    with pytest.raises(ValueError, match="truncated: 3 of 8 bytes; read the rest"):
        p.RECORD.unpack(b"abc")
