"""whisker_bridge without its USB device: runs from start to LAST, from the nodes' pins to the byte stream."""

import cocotb
from bench import error_record, pulse, record, run_bench, start_clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge
from nodes import Nodes

from whisker.protocol import FRAME_BYTES, FRAME_FLAGS, LANES, LIMITS, ORDER, REPORTS, WIRE_VERSION, decode_frame

NODES = 6
CYCLES_PER_TICK = 530
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
RTL += ["frame_fifo", "bridge_counters", "control_registers", "report_reader"]


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

    async def control(self, run: int, **changes: int) -> bool:
        """Writes the control report; True if it was accepted."""
        values = {**FAST, "lane_mask": (1 << LANES) - 1, "tick_period": LIMITS["tick_period"], **changes}
        report = REPORTS["control"]
        await pulse(self.dut, self.usb.write_start)
        for i, byte in enumerate(report.pack(id=report.id, wire_version=WIRE_VERSION, run=run, **values)):
            self.usb.write_index.value, self.usb.write_data.value = i, byte
            await pulse(self.dut, self.usb.write_valid)
        self.usb.write_done.value = 1
        await FallingEdge(self.dut.clk)
        accepted = bool(self.usb.write_accept.value)
        await RisingEdge(self.dut.clk)
        self.usb.write_done.value = 0
        await ClockCycles(self.dut.clk, 3)
        return accepted

    async def read(self, name: str) -> dict[str, int]:
        """Reads a report."""
        report = REPORTS[name]
        self.usb.read_id.value = report.id
        await pulse(self.dut, self.usb.read_start)
        out = bytearray()
        for _ in range(report.size):
            await FallingEdge(self.dut.clk)
            out.append(int(self.usb.read_data.value))
            await RisingEdge(self.dut.clk)
            await pulse(self.dut, self.usb.read_next)
        return report.unpack(bytes(out))

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

    def __init__(self, dut):
        self.dut = dut
        self.nodes = Nodes(dut)
        self.host = Host(dut)
        self.tick = 0

    async def step(self, wait_for: str = "link_busy") -> int:
        """One tick: the nodes deliver the reading before; returns the cycles until `wait_for` falls."""
        self.nodes.records = {lane: reading(self.tick - 1, lane) for lane in range(NODES)}
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


async def begin(dut, external: int = 1) -> Rig:
    await start_clock(dut, tick_external=external, tick_strobe=0, miso=(1 << LANES) - 1)
    return Rig(dut)


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
    assert not (int(dut.running.value) or int(dut.transfer_busy.value)) and int(dut.select_n.value)
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


def test_bridge():
    run_bench("whisker_bridge", __file__, *(f"{name}.v" for name in RTL), bench=("usb_stub.v",))
