"""tick_input, sof_clock and tick_out: what comes from other devices and goes to them."""

import random

import cocotb
from bench import pulse
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge
from test_ticks import begin, drive

from whisker_protocol import LIMITS

COUNTS = ("edges", "early", "silent", "uneven", "shortest")
NEVER = 0xFFFFFFFF
STROBE = 2  # cycles from the one in which the pin was read


async def edge(dut, wait: int, back: int = 2) -> bool:
    """An edge so many cycles after the last one of the pin that counts (2 or more); did it begin a tick?"""
    idle = int(dut.falling.value)
    drive(dut, tick_in=1 - idle)
    await ClockCycles(dut.clk, STROBE)
    await FallingEdge(dut.clk)
    taken = bool(int(dut.taken.value))
    drive(dut, tick_in=idle)
    await ClockCycles(dut.clk, wait - STROBE)
    return taken


def counts(dut) -> dict[str, int]:
    return {name: int(getattr(dut, name).value) for name in COUNTS}


async def watching(dut, period: int, falling: int = 0) -> None:
    await begin(dut, expected=period, falling=falling, tick_in=falling)
    drive(dut, watch=1)
    await pulse(dut, dut.clear)


@cocotb.test(timeout_time=5, timeout_unit="ms")
@cocotb.parametrize(falling=[0, 1])
async def edges_in_time_begin_ticks_and_no_count_grows_but_theirs(dut, falling):
    await watching(dut, 4000, falling)
    assert all([await edge(dut, 4000 + random.randrange(-60, 61)) for _ in range(12)])
    found = counts(dut)
    assert (found["edges"], found["early"], found["silent"], found["uneven"]) == (12, 0, 0, 0)
    assert 3940 <= found["shortest"] <= 4000


@cocotb.test(timeout_time=5, timeout_unit="ms")
async def every_distance_is_judged_as_the_protocol_says(dut):
    """At the limits and anywhere: 7/8 of a period, 1/64 beside it, two periods."""
    period = 640
    edges = (559, 560, 561, 629, 630, 631, 649, 650, 651, 1279, 1280, 1281)
    for distance in (*edges, *(random.randrange(4, 2000) for _ in range(30))):
        await watching(dut, period)
        assert await edge(dut, distance)
        taken = await edge(dut, 4)
        assert taken == (distance >= period * 7 // 8), distance
        found = counts(dut)
        assert (found["edges"], found["early"]) == (1 + taken, 1 - taken)
        assert found["uneven"] == int(taken and abs(distance - period) > period // 64), distance
        assert found["silent"] == int(distance >= 2 * period), distance
        assert found["shortest"] == distance
        await pulse(dut, dut.rst)


@cocotb.test(timeout_time=5, timeout_unit="ms")
async def an_early_edge_does_not_move_what_is_expected(dut):
    """A pulse of noise between two edges costs none of them."""
    await watching(dut, 1000)
    assert await edge(dut, 300)
    assert not await edge(dut, 700)
    assert await edge(dut, 1000)
    found = counts(dut)
    assert (found["edges"], found["early"], found["uneven"], found["shortest"]) == (2, 1, 0, 300)


@cocotb.test(timeout_time=5, timeout_unit="ms")
async def a_silent_pin_is_counted_once_for_each_silence(dut):
    await watching(dut, 500)
    await ClockCycles(dut.clk, 3000)
    assert counts(dut) == {"edges": 0, "early": 0, "silent": 1, "uneven": 0, "shortest": NEVER}
    assert await edge(dut, 1900)
    assert await edge(dut, 500)
    assert counts(dut) == {"edges": 2, "early": 0, "silent": 2, "uneven": 1, "shortest": 1900}


@cocotb.test(timeout_time=5, timeout_unit="ms")
async def an_edge_during_a_transfer_or_while_none_is_wanted_begins_no_tick(dut):
    await watching(dut, 500)
    drive(dut, busy=1)
    assert not await edge(dut, 500)
    drive(dut, busy=0)
    assert await edge(dut, 500)
    drive(dut, watch=0)
    assert not await edge(dut, 500)
    assert (counts(dut)["edges"], counts(dut)["early"]) == (1, 1)
    await pulse(dut, dut.clear)
    await FallingEdge(dut.clk)
    assert counts(dut) == {"edges": 0, "early": 0, "silent": 0, "uneven": 0, "shortest": NEVER}


@cocotb.test(timeout_time=5, timeout_unit="ms")
async def counts_of_edges_carry_through_every_bit(dut):
    await watching(dut, 4)
    for preset in (NEVER, 0x5555AAAA, 0xFFFF, random.getrandbits(32)):
        for name in ("edges", "early", "silent", "uneven"):
            getattr(dut.input_pin, name).value = preset
        drive(dut, expected=64)
        assert await edge(dut, 200)
        drive(dut, expected=1000)
        assert not await edge(dut, 2010)
        assert await edge(dut, 100)
        found = counts(dut)
        assert (found["edges"] - preset) % (1 << 32) == 2 and (found["early"] - preset) % (1 << 32) == 1
        assert (found["silent"] - preset) % (1 << 32) >= 1
        drive(dut, expected=4)
        await pulse(dut, dut.clear)


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(external=[0, 1])
async def tick_out_goes_ahead_of_a_tick_of_the_divider(dut, external):
    """By the protocol's lead less the cycle from `tick` to SYNC; a strobe's tick is passed on with it."""
    await begin(dut, period=200, external=external)
    drive(dut, enable=1)
    rises, ticks, high, before = [], [], 0, 0
    for cycle in range(1000):
        drive(dut, strobe=cycle % 200 == 7)
        await FallingEdge(dut.clk)
        out = int(dut.tick_out.value)
        rises += [cycle] if out and not before else []
        ticks += [cycle] if int(dut.tick.value) else []
        high, before = high + out, out
    assert len(ticks) == 5
    lead = 0 if external else LIMITS["tick_lead"] - 1
    assert [tick - rise for tick, rise in zip(ticks, rises, strict=True)] == [lead] * 5
    assert high == 5 * 63
    drive(dut, pause=1)
    for _ in range(300):
        await FallingEdge(dut.clk)
        high += int(dut.tick_out.value)
    assert high == 5 * 63, "no other bridge ticks while the host of this one sleeps"


# --- sof_clock


async def start_of_frame(dut, number: int, wait: int) -> None:
    drive(dut, sof=1, sof_frame=number)
    await RisingEdge(dut.clk)
    drive(dut, sof=0, sof_frame=random.getrandbits(11))
    await ClockCycles(dut.clk, wait - 1)


@cocotb.test(timeout_time=5, timeout_unit="ms")
async def a_tick_is_dated_by_frame_microframe_and_cycles(dut):
    await begin(dut)
    assert (int(dut.usb_time.value), int(dut.sof_cycles.value)) == (0, 0xFFFF)
    seen = []
    for number in (2047, 0, 1, 0x555, 0x2AA, 1365):
        for microframe in range(8):
            wait = random.randrange(3, 60)
            await start_of_frame(dut, number, wait)
            await pulse(dut, dut.stamp)
            await FallingEdge(dut.clk)
            seen.append(0x8000 | number << 3 | microframe)
            assert (int(dut.usb_time.value), int(dut.sof_cycles.value)) == (seen[-1], wait - 1)
            assert len(seen) < 2 or int(dut.previous_usb_time.value) == seen[-2]
            await RisingEdge(dut.clk)


@cocotb.test(timeout_time=5, timeout_unit="ms")
async def without_start_of_frame_packets_there_is_no_date(dut):
    await begin(dut)
    await start_of_frame(dut, 7, 1)
    await ClockCycles(dut.clk, 0xFFFF - 10)
    for wait, wanted in ((8, 0x8000 | 7 << 3), (10, 0)):
        await ClockCycles(dut.clk, wait)
        await pulse(dut, dut.stamp)
        await FallingEdge(dut.clk)
        assert int(dut.usb_time.value) == wanted
        await RisingEdge(dut.clk)
    assert int(dut.sof_cycles.value) == 0xFFFF
    await start_of_frame(dut, 9, 5)
    await pulse(dut, dut.stamp)
    await FallingEdge(dut.clk)
    assert int(dut.usb_time.value) == 0x8000 | 9 << 3
