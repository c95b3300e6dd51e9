"""whisker_bridge's time and options: other devices' ticks, the host's start-of-frame packets, frames at once, the pattern,
and reads of the answers that do not tear."""

import random

import cocotb
from bench import pulse
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge, with_timeout
from rig import FAST, NODES, answer, begin, check, reading, reported

from whisker_protocol import CONTROL_OPTIONS, FRAME_BYTES, FRAME_FLAGS, LANES, LIMITS, REPORTS, decode_frame

PERIOD = LIMITS["tick_period_min"]
TICK_IN, EVERY, PATTERN = (CONTROL_OPTIONS[name] for name in ("tick_in", "every_frame", "pattern"))


async def input_edges(dut, distances: list[int]):
    """A pulse of tick_in, then one after each distance; in no step with the clock."""
    for distance in (*distances, 10):
        dut.tick_in.value = 1
        await ClockCycles(dut.clk, 5)
        dut.tick_in.value = 0
        await ClockCycles(dut.clk, distance - 5)


async def nodes_of_their_own(rig):
    """The nodes publish at each SYNC what the one before began."""
    tick = 0
    while True:
        await RisingEdge(rig.dut.sync)
        rig.nodes.records = {lane: reading(tick - 1, lane) for lane in range(NODES)}
        tick += 1


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def a_run_on_edges_of_tick_in(dut):
    """Each begins a tick, whatever the divider would do; an early one is left out, and the report says so."""
    rig = await begin(dut, external=0)
    nodes = cocotb.start_soon(nodes_of_their_own(rig))
    await rig.host.control(1, tick_period=PERIOD, options=TICK_IN)
    await ClockCycles(dut.clk, 2 * PERIOD + 10)
    assert not int(dut.link_busy.value) and int(dut.running.value), "no edge, no tick"
    await input_edges(dut, [PERIOD, PERIOD + 40, PERIOD + 200, PERIOD // 2, PERIOD // 2, PERIOD])
    await ClockCycles(dut.clk, PERIOD // 2)
    await rig.host.control(0, tick_period=PERIOD, options=TICK_IN)
    await ClockCycles(dut.clk, PERIOD // 2)
    await input_edges(dut, [])
    await FallingEdge(dut.running)
    await rig.quiet()
    check(rig.host.frames(), first_sequence=0, period=PERIOD)
    assert len(rig.host.frames()) == 6
    timing = await rig.host.read("timing")
    found = {name: timing[name] for name in ("edges", "early", "silent", "uneven", "tick", "level")}
    assert found == {"edges": 7, "early": 1, "silent": 1, "uneven": 1, "tick": 6, "level": 0}
    assert timing["shortest"] == PERIOD // 2
    nodes.cancel()


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def a_run_whose_tick_in_is_silent_ends_as_if_it_had_not_begun(dut):
    rig = await begin(dut, external=0)
    await rig.host.control(1, tick_period=PERIOD, options=TICK_IN)
    await ClockCycles(dut.clk, 3 * PERIOD)
    assert (await rig.host.read("timing"))["silent"] == 1
    await rig.host.control(0, tick_period=PERIOD, options=TICK_IN)
    assert not int(dut.running.value) and not rig.host.data
    await rig.host.control(1, tick_period=PERIOD)
    await with_timeout(RisingEdge(dut.sync), 1, "us")


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def frames_and_report_tell_when_their_tick_was(dut):
    """By the start-of-frame packet before its SYNC, not before the frame is made."""
    rig = await begin(dut)
    await rig.host.control(1)
    usb, wanted = rig.host.usb, []
    for number in (5, 5, 5, 2047, 0, 0):
        usb.sof_frame.value = number
        await pulse(dut, usb.sof)
        wait = random.randrange(5, 200)
        await ClockCycles(dut.clk, wait)
        microframe = sum(known >> 3 & 0x7FF == number for known in wanted)
        wanted.append(0x8000 | number << 3 | microframe)
        await rig.step()
        timing = await rig.host.read("timing")
        assert (timing["usb_time"], timing["tick"]) == (wanted[-1], len(wanted) - 1)
        assert wait < timing["sof_cycles"] <= wait + 3
    await rig.host.control(0)
    await rig.step("running")
    await rig.quiet()
    assert [header["usb_time"] for header, _ in rig.host.frames()] == wanted


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def each_frame_ends_its_packet_if_wanted(dut):
    rig = await begin(dut)
    await rig.host.control(1, options=EVERY)
    for _ in range(4):
        await rig.step()
    await rig.host.control(0, options=EVERY)
    await rig.step("transfer_busy")
    await rig.quiet()
    check(rig.host.frames(), first_sequence=0)
    assert rig.host.ends == [FRAME_BYTES * n for n in range(1, 5)]


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def the_pattern_fills_frames_without_nodes(dut):
    """Also with the slowest settings, and a sample point as late as can be."""
    rig = await begin(dut)
    for settings in (FAST, {"sck_divider": 32, "word_gap": 255, "sample_point": 32}):
        rig.host.data = bytearray()
        await rig.host.control(1, **settings, options=PATTERN)
        for _ in range(4):
            rig.nodes.records = {}
            await pulse(dut, dut.tick_strobe)
            await FallingEdge(dut.link_busy)
        await rig.host.control(0, **settings, options=PATTERN)
        await rig.step("running")
        await rig.quiet()
        frames = [
            decode_frame(bytes(rig.host.data[n : n + FRAME_BYTES])) for n in range(0, 4 * FRAME_BYTES, FRAME_BYTES)
        ]
        for tick, (_, records) in enumerate(frames):
            for lane, found in enumerate(records):
                alpha, beta = 0x8000 + 256 * lane + 255 - tick, 0x4000 + 256 * lane + tick
                assert (found["alpha"], found["beta"], found["status"]) == (alpha, beta, 0)
        assert frames[-1][0]["flags"] == FRAME_FLAGS["last"]


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def the_pattern_is_chosen_for_whole_ticks(dut):
    """A change in the midst of a transfer leaves its records whole."""
    rig = await begin(dut)
    for old, new in ((0, PATTERN), (PATTERN, 0)):
        rig.host.data = bytearray()
        await rig.host.control(1, options=old)
        await rig.step()
        rig.nodes.records = {lane: reading(0, lane) for lane in range(LANES)}
        await pulse(dut, dut.tick_strobe)
        await ClockCycles(dut.clk, 250)
        await rig.host.control(1, options=new)
        await FallingEdge(dut.transfer_busy)
        await rig.quiet()
        ((_, records),) = rig.host.frames()
        assert (records == [reading(0, lane) for lane in range(LANES)]) == (old == 0)
        assert all(record[6] == 0 for record in records), "good, all of them"
        await rig.host.control(0, options=new)
        rig.tick = 2
        await rig.step("running")
        await rig.quiet()
        rig.tick = 0


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def answers_that_come_during_a_read_are_shown_after_it(dut):
    """And no order goes out meanwhile that would overwrite them."""
    rig = await begin(dut)
    usb = rig.host.usb
    await rig.host.control(1)
    await rig.answered_order()
    before = await rig.host.answers()
    assert await rig.host.order(0)
    usb.read_open.value = 1
    await rig.host.read_bytes(REPORTS["answers"])
    rig.nodes.answers = {lane: answer(1, 0, lane) for lane in range(LANES)}
    await rig.step()
    header, found = await rig.host.answers()
    assert found == before[1] and header["sequence"] == before[0]["sequence"] and header["pending"] == 1
    assert await rig.host.order(0)
    await rig.step()
    usb.read_open.value = 0
    await ClockCycles(dut.clk, 3)
    header, found = await rig.host.answers()
    assert (header["pending"], header["sequence"]) == (1, before[0]["sequence"] + 1)
    assert found == [reported(answer(1, 0, lane)) for lane in range(LANES)]
    await rig.step()
    assert (await rig.host.answers())[0]["sequence"] == before[0]["sequence"] + 2


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def a_lost_frame_is_shown_until_the_next_run(dut):
    rig = await begin(dut)
    rig.host.reading = False
    await rig.host.control(1)
    while not int(dut.frames_lost.value):
        await rig.step()
    assert rig.tick > LIMITS["fifo_bytes"] // FRAME_BYTES
    rig.host.reading = True
    await rig.host.control(0)
    await rig.step("running")
    assert int(dut.frames_lost.value)
    await rig.host.control(1)
    assert not int(dut.frames_lost.value)
