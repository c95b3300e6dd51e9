"""whisker_bridge on a bench: nodes at its pins, a host in place of its USB device, and what a frame of theirs must hold."""

import random
import struct

import cocotb
from bench import error_record, pulse, record, start_clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge
from nodes import Nodes

from whisker_protocol import (
    CODES,
    FRAME_BYTES,
    FRAME_FLAGS,
    LANES,
    LIMITS,
    REPORTS,
    STATUS_CODE_SHIFT,
    WIRE_VERSION,
    decode_frame,
)

NODES = 6
FIFO_FRAMES = LIMITS["fifo_bytes"] // FRAME_BYTES
CYCLES_PER_TICK = 530  # at most, with FAST
FAST = {"sck_divider": 6, "word_gap": 30, "sample_point": 3}
RTL = [
    "whisker_bridge",
    "tick_generator",
    "run_control",
    "node_link",
    "lane_receiver",
    "pattern_source",
    "tick_input",
    "sof_clock",
    "record_store",
    "framer",
    "crc8",
]
RTL += ["frame_fifo", "bridge_counters", "control_registers", "report_reader", "service_store", "answer_store"]


def reading(tick: int, lane: int) -> bytes:
    return record(tick, 0x8000 + 3 * tick, (0x1000 * lane + tick) & 0xFFFF, 0)


class Host:
    """The USB side: reports out and in, and a reader of the stream that can be held back."""

    def __init__(self, dut):
        self.dut = dut
        self.usb = dut.usb
        self.data = bytearray()
        self.ends: list[int] = []
        self.reading = True
        cocotb.start_soon(self._read())

    async def _read(self):
        while True:
            ready = self.reading
            self.usb.stream_ready.value = ready
            await FallingEdge(self.dut.clk)
            if ready and int(self.usb.stream_valid.value):
                self.data.append(int(self.usb.stream_data.value))
                if int(self.usb.stream_last.value):
                    self.ends.append(len(self.data))
            await RisingEdge(self.dut.clk)

    async def write(self, data: bytes, stalls: bool = False) -> bool:
        """Writes a report, with idle cycles between its bytes if asked; True if it was accepted."""
        await pulse(self.dut, self.usb.write_start)
        for i, byte in enumerate(data):
            while stalls and random.random() < 0.5:
                await RisingEdge(self.dut.clk)
            self.usb.write_index.value, self.usb.write_data.value = i, byte
            await pulse(self.dut, self.usb.write_valid)
        await RisingEdge(self.dut.clk)
        self.usb.write_done.value = 1
        await FallingEdge(self.dut.clk)
        accepted = bool(self.usb.write_accept.value)
        await RisingEdge(self.dut.clk)
        self.usb.write_done.value = 0
        await ClockCycles(self.dut.clk, 3)
        return accepted

    async def control(self, run: int, **changes: int) -> bool:
        """Writes the control report; True if it was accepted."""
        values = {**FAST, "lane_mask": (1 << LANES) - 1, "tick_period": LIMITS["tick_period"], **changes}
        report = REPORTS["control"]
        return await self.write(report.pack(id=report.id, wire_version=WIRE_VERSION, run=run, **values))

    async def order(self, command: int, argument: bytes = b"", data: bytes = b"", stalls: bool = False) -> bool:
        """Writes the service report; True if it was accepted."""
        head = bytes([REPORTS["service"].id, WIRE_VERSION, command])
        return await self.write(head + argument.ljust(5, b"\0") + data.ljust(48, b"\0"), stalls)

    async def read_bytes(self, report, stalls: bool = False) -> bytes:
        """Reads a report packet by packet, the first one twice as after a lost ACK."""
        self.usb.read_id.value = report.id
        out = bytearray()
        for packet in (0, *range(0, (report.size + 63) // 64)):
            self.usb.read_packet.value = packet
            del out[64 * packet :]
            await pulse(self.dut, self.usb.read_start)
            for _ in range(min(64, report.size - 64 * packet)):
                while stalls and random.random() < 0.5:
                    await RisingEdge(self.dut.clk)
                await FallingEdge(self.dut.clk)
                out.append(int(self.usb.read_data.value))
                await RisingEdge(self.dut.clk)
                await pulse(self.dut, self.usb.read_next)
        return bytes(out)

    async def read(self, name: str) -> dict[str, int]:
        """Reads a report."""
        return REPORTS[name].unpack(await self.read_bytes(REPORTS[name]))

    async def answers(self, stalls: bool = False) -> tuple[dict[str, int], list[tuple[int, int, int]]]:
        """The answers report: its header, and alpha, beta, status per lane."""
        raw = await self.read_bytes(REPORTS["answers"], stalls)
        return REPORTS["answers"].unpack(raw), list(struct.iter_unpack("<HHH", raw[8:]))

    def frames(self) -> list[tuple[dict[str, int], list[bytes]]]:
        """Headers and raw records of all frames read; each must decode."""
        out = []
        for at in range(0, len(self.data), FRAME_BYTES):
            raw = bytes(self.data[at : at + FRAME_BYTES])
            header, records = decode_frame(raw)
            tail = raw[FRAME_BYTES - 8 * len(records) :]
            out.append((header, [tail[8 * n : 8 * n + 8] for n in range(len(records))]))
        return out


class Rig:
    """Bridge, nodes and host; ticks come from tick_strobe unless `external` is 0."""

    def __init__(self, dut, lanes: int = LANES):
        self.dut = dut
        self.populated = min(NODES, lanes)
        self.nodes = Nodes(dut, lanes=lanes)
        self.host = Host(dut)
        self.tick = 0

    async def step(self, wait_for: str = "link_busy") -> int:
        """One tick: the nodes deliver the reading before; returns the cycles until `wait_for` falls."""
        self.nodes.records = {lane: reading(self.tick - 1, lane) for lane in range(self.populated)}
        self.tick += 1
        await pulse(self.dut, self.dut.tick_strobe)
        await FallingEdge(self.dut.clk)
        assert int(self.dut.link_busy.value), "a strobe is answered at once"
        cycles = 1
        while int(getattr(self.dut, wait_for).value):
            await FallingEdge(self.dut.clk)
            cycles += 1
        return cycles

    async def answered_order(self):
        """A first service order, answered by lane 0, and the order that fetches the answers."""
        assert await self.host.order(1)
        await self.step()
        self.nodes.answers = {0: answer(0, 1, 0)}
        assert await self.host.order(0)
        await self.step()

    async def quiet(self):
        """Steps until every byte in the FIFO has been read."""
        length = -1
        while length != len(self.host.data):
            length = len(self.host.data)
            await ClockCycles(self.dut.clk, 20)


async def begin(dut, external: int = 1, lanes: int = LANES) -> Rig:
    await start_clock(dut, tick_external=external, tick_strobe=0, tick_in=0, miso=(1 << lanes) - 1)
    return Rig(dut, lanes)


def check(frames, first_sequence: int, period: int = LIMITS["tick_period"]) -> None:
    """A whole run: headers count up, the last says so, records are the nodes' own or say absent."""
    for n, (header, records) in enumerate(frames):
        last = n == len(frames) - 1
        assert (header["tick"], header["time"], header["sequence"]) == (n, n * period, first_sequence + n)
        assert header["flags"] == (FRAME_FLAGS["last"] if last else 0)
        assert records[:NODES] == [reading(n, lane) for lane in range(NODES)]
        assert records[NODES:] == [error_record(n, "absent")] * (LANES - NODES)


def answer(tick: int, command: int, lane: int) -> bytes:
    """What a node that answered a service order of this tick would send."""
    return record(tick, 7 * lane, 0x1234, CODES["answer"] << STATUS_CODE_SHIFT | command)


def reported(raw: bytes) -> tuple[int, int, int]:
    return struct.unpack("<HHH", raw[1:7])
