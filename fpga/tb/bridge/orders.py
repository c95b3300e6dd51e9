"""whisker_bridge's service orders: each goes out once, the answers come back, and a restart forgets both."""

import random

import cocotb
from bench import error_record, pulse, wrong_tick
from cocotb.triggers import ClockCycles, FallingEdge
from cycles import service
from rig import CYCLES_PER_TICK, NODES, answer, begin, check, reported

from whisker_protocol import COMMANDS, LANES, LIMITS, ORDER, WIRE_VERSION, service_window

SERVICE_CYCLES = service(divider=6, gap=30)


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
    rig.nodes.answers = {
        0: answer(3, 4, 0),
        1: answer(3, 4, 1),
        2: answer(wrong_tick(3), 4, 2),
        3: b"\0" * 8,
        13: answer(3, 4, 13),
    }
    rig.nodes.answers |= {lane: answer(3, 4, lane) for lane in range(18, 28)}
    await rig.step()
    _, found = await rig.host.answers(stalls)
    wanted = [reported(error_record(0, "absent"))] * LANES
    for lane in (0, 1, 13, *range(18, 28)):
        wanted[lane] = reported(answer(3, 4, lane))
    wanted[2], wanted[3] = reported(error_record(0, "link_tick")), reported(error_record(0, "link_crc"))
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
    await rig.answered_order()
    assert (await rig.host.answers())[1][0] == reported(answer(0, 1, 0))
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
    assert found == [reported(error_record(0, "absent"))] * LANES
    await rig.host.control(1)
    rig.tick = 0
    assert await rig.step() <= CYCLES_PER_TICK
