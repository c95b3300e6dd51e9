"""The UTMI side of the shim, and what both sides send."""

import random

import cocotb
from cocotb.triggers import RisingEdge

FULL_SPEED, HIGH_SPEED, CHIRP = 0x45, 0x40, 0x54  # function control with suspendM high


class Link:
    """The UTMI side: sends packets, hears packets, changes the mode."""

    def __init__(self, dut, phy):
        self.dut, self.phy = dut, phy
        self.heard, self.gathered = [], None
        self.errors = 0
        self.answer = None  # to the next packet heard
        cocotb.start_soon(self.run())

    async def run(self) -> None:
        while True:
            await RisingEdge(self.dut.clk)
            self.phy.edge()
            self.hear()

    def hear(self) -> None:
        active = int(self.dut.utmi_rx_active.value)
        if active and self.gathered is None:
            self.gathered = bytearray()
            assert not int(self.dut.utmi_rx_valid.value), "rx_active comes before the first byte"
        elif active and int(self.dut.utmi_rx_valid.value):
            self.gathered.append(int(self.dut.utmi_rx_data.value))
        elif not active and self.gathered is not None:
            self.heard.append(bytes(self.gathered))
            self.gathered = None
        self.errors += int(self.dut.utmi_rx_error.value)

    async def cycles(self, count: int) -> None:
        for _ in range(count):
            await RisingEdge(self.dut.clk)

    async def until(self, condition, limit: int = 20000) -> None:
        for _ in range(limit):
            if condition():
                return
            await RisingEdge(self.dut.clk)
        raise AssertionError("it never happened")

    def sent(self) -> bool:
        """Nothing of a packet is left in the shim."""
        return int(self.dut.count.value) == 0 and not int(self.dut.in_command.value)

    def mode(self, value: int) -> None:
        self.dut.utmi_xcvr_select.value = value & 3
        self.dut.utmi_term_select.value = value >> 2 & 1
        self.dut.utmi_op_mode.value = value >> 3 & 3

    async def send(self, packet: bytes) -> None:
        self.dut.utmi_tx_valid.value = 1
        for byte in packet:
            self.dut.utmi_tx_data.value = byte
            await RisingEdge(self.dut.clk)
            while not int(self.dut.utmi_tx_ready.value):
                await RisingEdge(self.dut.clk)
        self.dut.utmi_tx_valid.value = 0


def packet(size: int) -> bytes:
    pid = random.choice([0x1, 0x2, 0x3, 0xA, 0xB, 0xE])
    return bytes([pid | (pid ^ 0xF) << 4]) + bytes(random.randrange(256) for _ in range(size))
