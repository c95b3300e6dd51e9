"""What cocotb runs for pace.py, in the simulator: the bridge without its USB device, its clock going and nothing else."""

import json
import os
import time
from pathlib import Path

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, RisingEdge

CLOCK_PS = 16666  # 60 MHz, even
CYCLES = {"clocked": 200_000, "each cycle awaited": 50_000}


async def clocked(dut, cycles: int) -> None:
    await ClockCycles(dut.clk, cycles)


async def awaited(dut, cycles: int) -> None:
    edge = RisingEdge(dut.clk)
    for _ in range(cycles):
        await edge


@cocotb.test()
async def pace(dut):
    """Cycles a processor second of this process, by what waits for them."""
    Clock(dut.clk, CLOCK_PS, unit="ps").start()
    dut.rst.value = 1
    await ClockCycles(dut.clk, 4)
    dut.rst.value = 0
    found = {}
    for (name, cycles), run in zip(CYCLES.items(), (clocked, awaited), strict=True):
        began = time.process_time()
        await run(dut, cycles)
        found[name] = cycles / (time.process_time() - began)
    Path(os.environ["WHISKER_PACE"]).write_text(json.dumps(found))
