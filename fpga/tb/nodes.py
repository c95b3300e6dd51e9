"""Python model of the nodes on the bridge's bus: SPI mode 1 slaves that answer each tick with the records given, and a
second select window in a tick with the answers given."""

import cocotb
from bench import CLOCK_PS
from cocotb.triggers import FallingEdge, RisingEdge, Timer, ValueChange
from cocotb.utils import get_sim_time

from whisker_protocol import LANES, RECORD, SERVICE

BITS = 8 * RECORD.size


def planes(records: dict[int, bytes], idle: int) -> list[int]:
    """For each bit time the value of all MISO lines; a lane without a record stays high, as `idle` has it."""
    lines = []
    for bit in range(BITS):
        low = sum(1 << lane for lane, r in records.items() if not r[bit // 8] >> (7 - bit % 8) & 1)
        lines.append(idle & ~low)
    return lines


class Nodes:
    """Drives `miso`, `delay_ps` after each rising SCK edge; gathers the order and the times of all edges."""

    def __init__(self, dut, delay_ps: int = 0, lanes: int = LANES):
        self.dut = dut
        self.delay_ps = delay_ps
        self.records: dict[int, bytes] = {}
        self.answers: dict[int, bytes] = {}
        self.orders: list[bytes] = []
        self.services: list[bytes] = []
        self.second = False  # the next window is the second of its tick
        self.times: dict[str, list[int]] = {}
        self.idle = (1 << lanes) - 1  # pull-ups
        dut.miso.value = self.idle
        cocotb.start_soon(self._shift_out())
        cocotb.start_soon(self._shift_in())
        cocotb.start_soon(self._begin_tick())
        for name in ("sync", "sck", "select_n"):
            self.times[name] = []
            cocotb.start_soon(self._watch(name))

    async def _begin_tick(self):
        while True:
            await RisingEdge(self.dut.sync)
            self.second = False

    async def _shift_out(self):
        while True:
            await FallingEdge(self.dut.select_n)
            for lines in planes(self.answers if self.second else self.records, self.idle):
                await RisingEdge(self.dut.sck)
                if self.delay_ps:
                    cocotb.start_soon(self._late(lines))
                else:
                    self.dut.miso.value = lines

    async def _late(self, lines: int):
        await Timer(self.delay_ps, unit="ps")
        self.dut.miso.value = lines

    async def _shift_in(self):
        while True:
            order = 0
            await FallingEdge(self.dut.select_n)
            size = SERVICE.size if self.second else RECORD.size
            for _ in range(8 * size):
                await FallingEdge(self.dut.sck)
                order = order << 1 | int(self.dut.mosi.value)
            (self.services if self.second else self.orders).append(order.to_bytes(size, "big"))
            self.second = True

    async def _watch(self, name: str):
        signal = getattr(self.dut, name)
        while True:
            await ValueChange(signal)
            self.times[name].append(get_sim_time("ps"))

    def cycles(self, name: str) -> list[int]:
        """Cycle numbers of a signal's edges."""
        return [round(t / CLOCK_PS) for t in self.times[name]]
