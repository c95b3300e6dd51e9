"""The boards' tops from pad to pad: a PHY at the ULPI pins, nodes at the others, a stand-in for the USB device inside."""

from types import SimpleNamespace

import cocotb
from bench import CLOCK_PS, run_bench
from bridge.rig import RTL, Host, reading
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, ReadOnly, RisingEdge
from nodes import Nodes
from ulpi.link import CHIRP, FULL_SPEED, HIGH_SPEED, Link, packet
from ulpi.phy import FUNCTION_CONTROL, OTG_CONTROL, UlpiPhy

from whisker.protocol import LANES, LIMITS

POLARITY = (0x39, 0x06)  # USB334x data sheet; on Cynthion D+ and D- are swapped between socket and PHY
VENDOR = {"usb3300": [], "cynthion": [POLARITY]}
NO_RESET = {"usb3300": ("reset", 0), "cynthion": ("reset_n", 1)}
PERIOD = LIMITS["tick_period_min"]
UTMI = ("rx_active", "rx_valid", "rx_data", "rx_error", "tx_valid", "tx_data", "tx_ready")
UTMI += ("xcvr_select", "term_select", "op_mode")


class Board:
    """A board's pins by their names, its PHY, and the USB side of the bridge inside."""

    def __init__(self, dut, name: str):
        def pin(signal):
            return getattr(dut, f"{name}_{signal}")

        self.clk, self.usb = dut.clk, getattr(dut, name).core.bridge.usb
        self.reset, self.no_reset = pin(NO_RESET[name][0]), NO_RESET[name][1]
        self.led_n, self.data_in, self.vendor = pin("led_n"), pin("data_in"), VENDOR[name]
        bus = {wire: pin(wire) for wire in ("sync", "sck", "select_n", "mosi", "miso")}
        self.nodes = Nodes(SimpleNamespace(clk=dut.clk, **bus))
        ulpi = {"ulpi_data_oe": "drives", "ulpi_data_out": "data_out", "ulpi_stp": "stp", "ulpi_data_in": "data_in"}
        ulpi |= {"ulpi_dir": "dir", "ulpi_dir_pin": "dir", "ulpi_nxt": "nxt"}
        self.phy = UlpiPhy(SimpleNamespace(**{ours: pin(theirs) for ours, theirs in ulpi.items()}))
        pin("dir").value, pin("nxt").value = 1, 0
        self.drives, self.dir = pin("drives"), pin("dir")
        utmi = {f"utmi_{wire}": getattr(self.usb, f"utmi_{wire}") for wire in UTMI}
        # The clock of the bench: one further in would show what is there after its edge.
        self.link = Link(SimpleNamespace(clk=dut.clk, **utmi), self.phy)
        self.link.mode(FULL_SPEED)
        getattr(dut, name).core.awake.value = 0  # as configuration leaves it: nothing else resets a board

    async def watch(self) -> None:
        """The pads let go in the cycle in which dir rises, all at once, and the PHY is not held in reset."""
        while True:
            await FallingEdge(self.clk)
            assert int(self.reset.value) == self.no_reset, "the PHY is held in reset"
            assert int(self.drives.value) in ((0,) if int(self.dir.value) else (0, 0xFF)), "who drives the data lines?"


async def start(dut, name: str) -> Board:
    """Clock and PHY running, set-up done."""
    board = Board(dut, name)
    Clock(dut.clk, CLOCK_PS, unit="ps").start()
    cocotb.start_soon(board.watch())
    wanted = [(FUNCTION_CONTROL, 0x65), (OTG_CONTROL, 0), *board.vendor, (FUNCTION_CONTROL, FULL_SPEED)]
    await board.link.until(lambda: len(board.phy.writes) == len(wanted))
    assert board.phy.writes == wanted
    await board.link.cycles(4)
    return board


@cocotb.test(timeout_time=20, timeout_unit="ms")
@cocotb.parametrize(name=list(VENDOR))
async def the_devices_modes_and_packets_pass(dut, name):
    board = await start(dut, name)
    for mode in (HIGH_SPEED, CHIRP, 0x49, 0x46, HIGH_SPEED):  # each bit of the three settings alone
        board.link.mode(mode)
        await board.link.until(lambda mode=mode: board.phy.registers[FUNCTION_CONTROL] == mode)
    for size in (0, 1, 2, 64):
        to_host, from_host = packet(size), packet(size)
        await board.link.send(to_host)
        await board.link.until(lambda sent=to_host: (sent[0] & 0xF, sent[1:]) in board.phy.packets)
        board.phy.receive(from_host)
        await board.link.until(lambda sent=from_host: sent in board.link.heard)


@cocotb.test(timeout_time=20, timeout_unit="ms")
@cocotb.parametrize(name=list(VENDOR))
async def every_lane_has_its_place(dut, name):
    board = await start(dut, name)
    host = Host(board)
    assert int(board.led_n.value) == 1
    await host.control(1, tick_period=PERIOD)
    for tick in range(3):
        await RisingEdge(board.nodes.dut.sync)
        board.nodes.records = {lane: reading(tick - 1, lane) for lane in range(LANES)}
        assert int(board.led_n.value) == 0
    await host.control(0, tick_period=PERIOD)
    await RisingEdge(board.nodes.dut.sync)
    board.nodes.records = {lane: reading(2, lane) for lane in range(LANES)}
    await board.link.until(lambda: host.ends)
    assert [records for _, records in host.frames()] == [[reading(n, lane) for lane in range(LANES)] for n in range(3)]
    await board.link.cycles(4)
    assert int(board.led_n.value) == 1


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def cynthions_phy_has_the_oscillators_clock(dut):
    Clock(dut.clk, CLOCK_PS, unit="ps").start()
    for _ in range(10):
        await RisingEdge(dut.clk)
        await ReadOnly()
        assert int(dut.cynthion_clk.value) == 1
        await FallingEdge(dut.clk)
        await ReadOnly()
        assert int(dut.cynthion_clk.value) == 0


def test_tops():
    boards = ("board_core.v", "usb3300_board.v", "cynthion.v", "ulpi_pads.v", "hold_cells.v")
    run_bench(
        "boards_bench",
        __file__,
        *(f"{name}.v" for name in RTL),
        *(f"../boards/{name}" for name in boards),
        "../usb/ulpi_shim.v",
        bench=("boards_bench.v", "cells.v", "../bridge/usb_stub.v"),
    )
