"""crc8.v against the protocol's CRC in Python."""

import random

import cocotb
from bench import pulse, run_bench, start_clock
from cocotb.triggers import FallingEdge, RisingEdge

from whisker_protocol import DEFINITION, crc8


async def checksum(dut, data: bytes, gap: float = 0.0) -> int:
    """CRC of the bytes fed one by one, the first together with clear, with idle cycles in between."""
    for i, byte in enumerate(data):
        dut.clear.value = i == 0
        dut.valid.value = 1
        dut.data.value = byte
        await RisingEdge(dut.clk)
        dut.clear.value = 0
        dut.valid.value = 0
        dut.data.value = 0x5A
        while random.random() < gap:
            await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    return int(dut.crc.value)


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def check_value(dut):
    await start_clock(dut, clear=0, valid=0, data=0)
    assert await checksum(dut, b"123456789") == DEFINITION["crc8"]["check"]


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def random_messages_with_idle_cycles(dut):
    await start_clock(dut, clear=0, valid=0, data=0)
    for _ in range(50):
        message = random.randbytes(random.randint(1, 31))
        assert await checksum(dut, message, gap=0.3) == crc8(message)


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def clear_alone_begins_an_empty_message(dut):
    await start_clock(dut, clear=0, valid=0, data=0)
    await checksum(dut, b"left over")
    await pulse(dut, dut.clear)
    await FallingEdge(dut.clk)
    assert int(dut.crc.value) == crc8(b"")


def test_crc8():
    run_bench("crc8", __file__, "crc8.v")
