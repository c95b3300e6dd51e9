"""whisker_bridge without its USB device: runs from start to LAST, from the nodes' pins to the byte stream."""

import cocotb
from bench import error_record, pulse, run_bench, wrong_tick
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge
from cycles import FRAMER, transfer
from rig import CYCLES_PER_TICK, FAST, FIFO_FRAMES, NODES, RTL, begin, check, reading

from whisker_protocol import FRAME_BYTES, FRAME_FLAGS, LANES, LIMITS, ORDER, REPORTS, WIRE_VERSION


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
    rig.nodes.records = {0: reading(0, 0), 1: reading(wrong_tick(0), 1), 2: b"\x00" * 8}
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
    dut.usb.board.value, dut.usb.build.value = 0x5A, 0xC3A5
    identity = await rig.host.read("identity")
    assert (identity["lanes"], identity["clock_hz"]) == (LANES, LIMITS["clock_hz"])
    assert (identity["board"], identity["wired_lanes"], identity["build"]) == (0x5A, LANES, 0xC3A5)
    assert (identity["frame_bytes"], identity["fifo_bytes"]) == (FRAME_BYTES, LIMITS["fifo_bytes"])
    assert (identity["wire_version"], identity["gateware"]) == (WIRE_VERSION, LIMITS["gateware_version"])
    await rig.host.control(1, sck_divider=20, word_gap=99, sample_point=13, lane_mask=0x5A5A5A5, tick_period=123456)
    control = await rig.host.read("control")
    assert (control["id"], control["wire_version"], control["run"], control["reserved"]) == (1, WIRE_VERSION, 1, 0)
    assert (control["sck_divider"], control["word_gap"], control["sample_point"]) == (20, 99, 13)
    assert (control["lane_mask"], control["tick_period"]) == (0x5A5A5A5, 123456)


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
    run_bench(
        "whisker_bridge",
        __file__,
        *(f"{name}.v" for name in RTL),
        bench=("usb_stub.v",),
        more=("orders", "wires", "timing"),
    )
