"""whisker_bridge without its USB device: runs from start to LAST, from the nodes' pins to the byte stream."""

import random
import struct

import cocotb
from bench import error_record, pulse, record, run_bench, start_clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge
from cycles import FRAMER, service, transfer
from nodes import Nodes

from whisker.protocol import (
    CODES,
    COMMANDS,
    FRAME_BYTES,
    FRAME_FLAGS,
    LANES,
    LIMITS,
    ORDER,
    REPORTS,
    STATUS_CODE_SHIFT,
    WIRE_VERSION,
    decode_frame,
    service_window,
)

NODES = 6
FIFO_FRAMES = LIMITS["fifo_bytes"] // FRAME_BYTES
CYCLES_PER_TICK = 530
SERVICE_CYCLES = service(divider=6, gap=30)
FAST = {"sck_divider": 6, "word_gap": 30, "sample_point": 3}
RTL = [
    "whisker_bridge",
    "tick_generator",
    "run_control",
    "node_link",
    "lane_receiver",
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

    async def quiet(self):
        """Until every byte in the FIFO has been read."""
        length = -1
        while length != len(self.host.data):
            length = len(self.host.data)
            await ClockCycles(self.dut.clk, 20)


async def begin(dut, external: int = 1, lanes: int = LANES) -> Rig:
    await start_clock(dut, tick_external=external, tick_strobe=0, miso=(1 << lanes) - 1)
    return Rig(dut, lanes)


def check(frames, first_sequence: int, period: int = LIMITS["tick_period"]) -> None:
    """A whole run: headers count up, the last says so, records are the nodes' own or say absent."""
    for n, (header, records) in enumerate(frames):
        last = n == len(frames) - 1
        assert (header["tick"], header["time"], header["sequence"]) == (n, n * period, first_sequence + n)
        assert header["flags"] == (FRAME_FLAGS["last"] if last else 0)
        assert records[:NODES] == [reading(n, lane) for lane in range(NODES)]
        assert records[NODES:] == [error_record(n, "absent")] * (LANES - NODES)


@cocotb.test(timeout_time=20, timeout_unit="ms")
@cocotb.parametrize(ticks=[1, 2, 7])
async def a_run_from_start_to_last(dut, ticks):
    rig = await begin(dut)
    assert await rig.host.control(1)
    for _ in range(ticks):
        await rig.step()
    assert await rig.host.control(0)
    assert int(dut.running.value)
    assert not await rig.host.control(1), "not while the stop is under way"
    await rig.step("transfer_busy")
    assert not int(dut.running.value)
    await rig.quiet()
    check(rig.host.frames(), first_sequence=0)
    assert len(rig.host.frames()) == ticks and rig.host.ends == [ticks * FRAME_BYTES]
    assert rig.nodes.orders == [ORDER.pack(tick=n, command=1) for n in range(ticks + 1)]


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def next_tick_while_the_frame_is_made(dut):
    """Strobes as soon as link_busy falls: no record is lost or mixed, and a tick stays within the budget."""
    rig = await begin(dut)
    await rig.host.control(1)
    cycles = [await rig.step() for _ in range(10)]
    await rig.host.control(0)
    await rig.step("transfer_busy")
    await rig.quiet()
    check(rig.host.frames(), first_sequence=0)
    assert len(rig.host.frames()) == 10 and max(cycles) <= CYCLES_PER_TICK


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def two_runs_and_the_counters(dut):
    rig = await begin(dut)
    for run, ticks in enumerate((5, 3)):
        rig.tick, rig.host.data = 0, bytearray()
        await rig.host.control(1, lane_mask=0xFF, tick_period=5000)
        for _ in range(ticks):
            await rig.step()
        await rig.host.control(0, lane_mask=0xFF, tick_period=5000)
        await rig.step("transfer_busy")
        await rig.quiet()
        frames = rig.host.frames()
        assert [h["sequence"] for h, _ in frames] == [5 * run + n for n in range(ticks)]
        assert [h["time"] for h, _ in frames] == [5000 * n for n in range(ticks)]
        assert frames[0][1][NODES:] == [error_record(0, "absent")] * 2 + [error_record(0, "lane_off")] * 20
        counters = await rig.host.read("counters")
        made = 5 * run + ticks
        assert (counters["ticks"], counters["frames"], counters["dropped"]) == (ticks + 1, ticks, 0)
        assert (counters["records_good"], counters["records_absent"]) == (NODES * made, 2 * made)
        assert (counters["records_crc"], counters["records_tick"], counters["running"]) == (0, 0, 0)


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def bad_records_are_named_and_counted(dut):
    rig = await begin(dut)
    await rig.host.control(1)
    await rig.step()
    rig.nodes.records = {0: reading(0, 0), 1: reading(255, 1), 2: b"\x00" * 8}
    await pulse(dut, dut.tick_strobe)
    await FallingEdge(dut.transfer_busy)
    await rig.quiet()
    (_, records) = rig.host.frames()[0]
    wanted = [reading(0, 0), error_record(0, "link_tick"), error_record(0, "link_crc"), error_record(0, "absent")]
    assert records[:4] == wanted
    counters = await rig.host.read("counters")
    assert [counters[f"records_{kind}"] for kind in ("good", "tick", "crc", "absent")] == [1, 1, 1, LANES - 3]
    assert counters["running"] == 1


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def ticks_of_its_own(dut):
    """Without external ticks the divider gives them, the first at once."""
    rig = await begin(dut, external=0)
    period = LIMITS["tick_period_min"]
    await rig.host.control(1, tick_period=period)
    for n in range(4):
        await RisingEdge(dut.sync)
        rig.nodes.records = {lane: reading(n - 1, lane) for lane in range(NODES)}
    await rig.host.control(0, tick_period=period)
    await RisingEdge(dut.sync)
    rig.nodes.records = {lane: reading(3, lane) for lane in range(NODES)}
    await FallingEdge(dut.running)
    await rig.quiet()
    check(rig.host.frames(), first_sequence=0, period=period)
    rises = rig.nodes.cycles("sync")[-10::2]
    assert [b - a for a, b in zip(rises, rises[1:], strict=False)] == [period] * 4


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def in_suspend_ticks_are_counted_but_not_made(dut):
    """Afterwards the frames' ticks and times have jumped, their sequence has not: nothing was lost."""
    asleep = 5
    rig = await begin(dut)
    await rig.host.control(1)
    for _ in range(4):
        await rig.step()
    dut.usb.suspended.value = 1
    for _ in range(asleep):
        await pulse(dut, dut.tick_strobe)
        await ClockCycles(dut.clk, 3)
        assert not int(dut.link_busy.value) and int(dut.running.value)
    dut.usb.suspended.value = 0
    rig.tick += asleep
    for _ in range(3):
        await rig.step()
    await rig.host.control(0)
    await rig.step("running")
    await rig.quiet()
    headers = [header for header, _ in rig.host.frames()]
    ticks = [0, 1, 2, *range(3 + asleep, 7 + asleep)]
    assert [header["tick"] for header in headers] == ticks
    assert [header["time"] for header in headers] == [tick * LIMITS["tick_period"] for tick in ticks]
    assert [header["sequence"] for header in headers] == list(range(len(ticks)))


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def a_stop_before_the_first_tick_ends_at_once(dut):
    rig = await begin(dut)
    await rig.host.control(1)
    assert int(dut.running.value)
    await rig.host.control(0)
    assert not int(dut.running.value)
    await pulse(dut, dut.tick_strobe)
    await ClockCycles(dut.clk, 5)
    assert not int(dut.link_busy.value) and not rig.host.data


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def usb_restart_ends_a_run_in_the_middle_of_a_transfer(dut):
    rig = await begin(dut)
    rig.host.reading = False
    await rig.host.control(1)
    for _ in range(3):
        await rig.step()
    await pulse(dut, dut.tick_strobe)
    await ClockCycles(dut.clk, 200)
    await pulse(dut, dut.usb.restart)
    await FallingEdge(dut.clk)
    assert not (int(dut.running.value) or int(dut.transfer_busy.value))
    await FallingEdge(dut.clk)
    assert int(dut.select_n.value)
    rig.host.reading = True
    await rig.quiet()
    assert not rig.host.data


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def settings_wait_for_the_next_tick(dut):
    """A change of speed in the middle of a transfer does not touch it."""
    rig = await begin(dut)
    await rig.host.control(1)
    await rig.step()
    rig.nodes.records = {lane: reading(0, lane) for lane in range(NODES)}
    rig.tick = 2
    await pulse(dut, dut.tick_strobe)
    await ClockCycles(dut.clk, 100)
    await rig.host.control(1, sck_divider=32, sample_point=16)
    await FallingEdge(dut.link_busy)
    await rig.step()
    await rig.host.control(0)
    await rig.step("transfer_busy")
    await rig.quiet()
    check(rig.host.frames(), first_sequence=0)


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def identity_and_control_read_back(dut):
    rig = await begin(dut)
    identity = await rig.host.read("identity")
    assert (identity["lanes"], identity["clock_hz"]) == (LANES, LIMITS["clock_hz"])
    assert (identity["frame_bytes"], identity["fifo_bytes"]) == (FRAME_BYTES, LIMITS["fifo_bytes"])
    assert (identity["wire_version"], identity["gateware"]) == (WIRE_VERSION, LIMITS["gateware_version"])
    await rig.host.control(1, sck_divider=20, word_gap=99, sample_point=13, lane_mask=0x5A5A5A5, tick_period=123456)
    control = await rig.host.read("control")
    assert (control["id"], control["wire_version"], control["run"], control["reserved"]) == (1, WIRE_VERSION, 1, 0)
    assert (control["sck_divider"], control["word_gap"], control["sample_point"]) == (20, 99, 13)
    assert (control["lane_mask"], control["tick_period"]) == (0x5A5A5A5, 123456)


def answer(tick: int, command: int, lane: int) -> bytes:
    """What a node that answered a service order of this tick would send."""
    return record(tick, 7 * lane, 0x1234, CODES["answer"] << STATUS_CODE_SHIFT | command)


def told(raw: bytes) -> tuple[int, int, int]:
    return struct.unpack("<HHH", raw[1:7])


@cocotb.test(timeout_time=20, timeout_unit="ms")
@cocotb.parametrize(stalls=[False, True])
async def a_service_order_goes_out_once_and_brings_the_answers_to_the_one_before(dut, stalls):
    rig = await begin(dut)
    await rig.host.control(1)
    assert max([await rig.step() for _ in range(3)]) <= CYCLES_PER_TICK
    data = bytes(random.randrange(256) for _ in range(48))
    assert await rig.host.order(4, b"\x01\x02\x03\x04\x05", data, stalls)
    header, _ = await rig.host.answers(stalls)
    assert (header["pending"], header["sequence"]) == (1, 0)
    assert not await rig.host.order(0), "one order at a time"
    rig.nodes.answers = {lane: answer(255, 0, lane) for lane in range(NODES)}
    cycles = await rig.step()
    assert SERVICE_CYCLES < cycles <= CYCLES_PER_TICK + SERVICE_CYCLES
    header, found = await rig.host.answers(stalls)
    assert (header["pending"], header["sequence"]) == (0, 1)
    assert await rig.step() <= CYCLES_PER_TICK, "the order went out once"
    assert await rig.host.order(0)
    rig.nodes.answers = {0: answer(3, 4, 0), 1: answer(3, 4, 1), 2: answer(4, 4, 2), 3: b"\0" * 8, 13: answer(3, 4, 13)}
    rig.nodes.answers |= {lane: answer(3, 4, lane) for lane in range(18, 28)}
    await rig.step()
    _, found = await rig.host.answers(stalls)
    wanted = [told(error_record(0, "absent"))] * LANES
    for lane in (0, 1, 13, *range(18, 28)):
        wanted[lane] = told(answer(3, 4, lane))
    wanted[2], wanted[3] = told(error_record(0, "link_tick")), told(error_record(0, "link_crc"))
    assert found == wanted
    await rig.host.control(0)
    await rig.step("transfer_busy")
    await rig.quiet()
    check(rig.host.frames(), first_sequence=0)
    assert rig.nodes.services == [service_window(3, 4, b"\x01\x02\x03\x04\x05", data), service_window(5, 0)]
    serving = {3, 5}
    wanted = [ORDER.pack(tick=n, command=COMMANDS["service" if n in serving else "sample"]) for n in range(7)]
    assert rig.nodes.orders == wanted


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def no_service_order_is_taken_that_is_malformed_or_does_not_fit(dut):
    rig = await begin(dut)
    good = bytes([4, WIRE_VERSION, 1]) + bytes(53)
    await rig.host.control(1)
    for bad in (good[:-1], good + b"x", good[:8], bytes([6]) + good[1:], bytes([4, WIRE_VERSION + 1]) + good[2:]):
        assert not await rig.host.write(bad)
    for slow in ({"sck_divider": 18}, {"word_gap": 181}, {"tick_period": LIMITS["service_tick_min"] - 1}):
        await rig.host.control(1, **slow)
        assert not await rig.host.write(good)
    await rig.host.control(1, sck_divider=16, word_gap=180, tick_period=LIMITS["service_tick_min"])
    assert await rig.host.write(good)
    assert await rig.step() < LIMITS["service_tick_min"]
    assert await rig.host.write(good)
    await rig.host.control(1, sck_divider=18)
    await rig.step()
    assert (await rig.host.answers())[0]["pending"] == 1, "it waits for settings that leave room"
    await rig.host.control(1)
    await rig.step()
    assert [service[:3] for service in rig.nodes.services] == [bytes([n, 1, 0]) for n in (0, 2)]


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def a_usb_restart_forgets_a_service_order_and_the_answers(dut):
    rig = await begin(dut)
    await rig.host.control(1)
    assert await rig.host.order(1)
    await rig.step()
    rig.nodes.answers = {0: answer(0, 1, 0)}
    assert await rig.host.order(0)
    await rig.step()
    assert (await rig.host.answers())[1][0] == told(answer(0, 1, 0))
    await rig.host.order(1)
    await pulse(dut, dut.tick_strobe)
    await ClockCycles(dut.clk, 3500)
    await pulse(dut, dut.usb.restart)
    await FallingEdge(dut.clk)
    assert not int(dut.link_busy.value)
    await FallingEdge(dut.clk)
    assert int(dut.select_n.value)
    header, found = await rig.host.answers()
    assert (header["pending"], header["sequence"]) == (0, 2)
    assert found == [told(error_record(0, "absent"))] * LANES
    await rig.host.control(1)
    rig.tick = 0
    assert await rig.step() <= CYCLES_PER_TICK


@cocotb.test(timeout_time=20, timeout_unit="ms")
@cocotb.parametrize(divider=[6, 16, 32], gap=[30, 180, 255])
async def the_first_byte_comes_with_the_frames_end(dut, divider, gap):
    """From SYNC of the tick that brings the records to the first byte for USB: the transfer, the frame, the FIFO."""
    rig = await begin(dut)
    await rig.host.control(1, sck_divider=divider, word_gap=gap)
    await rig.step("transfer_busy")
    cocotb.start_soon(rig.step())
    await RisingEdge(dut.sync)
    cycles = 0
    while not int(dut.usb.stream_valid.value):
        await FallingEdge(dut.clk)
        cycles += 1
    assert cycles <= transfer(divider, gap) + FRAME_BYTES + FRAMER


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def a_host_that_stops_reading_loses_whole_frames_and_is_told(dut):
    """What does not fit is dropped and counted; reading again is all it takes. However long the pause, only counts grow."""
    rig = await begin(dut)
    lost = 9
    rig.host.reading = False
    await rig.host.control(1)
    for _ in range(FIFO_FRAMES + lost + 1):
        await rig.step()
    rig.host.reading = True
    await rig.quiet()
    for _ in range(3):
        await rig.step()
    await rig.host.control(0)
    await rig.step("transfer_busy")
    await rig.quiet()
    headers = [header for header, _ in rig.host.frames()]
    before, after = headers[:FIFO_FRAMES], headers[FIFO_FRAMES:]
    assert [h["sequence"] for h in before] == list(range(FIFO_FRAMES)) and not any(h["dropped"] for h in before)
    assert [h["sequence"] for h in after] == [FIFO_FRAMES + lost + n for n in range(4)]
    assert {h["dropped"] for h in after} == {lost}
    assert (await rig.host.read("counters"))["dropped"] == lost
    assert after[-1]["flags"] == FRAME_FLAGS["last"] and not int(dut.running.value)


@cocotb.test(timeout_time=20, timeout_unit="ms")
@cocotb.parametrize(stalls=[False, True])
async def junk_reports_are_refused_and_change_nothing(dut, stalls):
    """Unknown ids, sizes that are no report's, values out of range; a run goes on, and the next right report is taken."""
    rig = await begin(dut)
    assert await rig.host.control(1, lane_mask=0xFFF)
    wanted = await rig.host.read_bytes(REPORTS["control"])
    good = REPORTS["control"].pack(id=1, wire_version=WIRE_VERSION, run=1, lane_mask=1, tick_period=5000, **FAST)
    junk = [bytes([n]) + good[1:] for n in (0, 2, 3, 5, 6, 0x7F, 0xFF)] + [good[:n] for n in range(1, len(good))]
    junk += [good + bytes(n) for n in (1, 16, 40, 48)] + [good[:12] + bytes(4), bytes(16), b"\xff" * 16]
    for report in junk:
        assert not await rig.host.write(report, stalls), report.hex()
        assert await rig.host.read_bytes(REPORTS["control"]) == wanted
    assert int(dut.running.value) and int(dut.led.value)
    await rig.step()
    assert await rig.host.write(good, stalls)
    await rig.host.control(0)
    assert (await rig.host.read("control"))["run"] == 0
    await rig.step("transfer_busy")
    assert not (int(dut.running.value) or int(dut.led.value))


def test_bridge():
    run_bench("whisker_bridge", __file__, *(f"{name}.v" for name in RTL), bench=("usb_stub.v",), more=("wires",))
