"""Two bridges tick as one: how far apart their SYNC pulses are, whatever the cable and however far their clocks run apart."""

import random
from types import SimpleNamespace

import cocotb
from bench import CLOCK_PS, run_bench
from bridge.rig import RTL, Host
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, RisingEdge, Timer, ValueChange
from cocotb.utils import get_sim_time

from whisker_protocol import CONTROL_OPTIONS, LIMITS

PERIOD = LIMITS["tick_period_min"]
TICKS = 10  # two clocks 120 ppm apart drift by half a cycle in one
# Metres of cable at 5 ns, and what lies beside it: buffers on both sides (74LVC2G34: 1 to 4.3 ns each) and the difference
# between an output pad and an input's set-up (0 to 4 ns).
CABLES_M = (0.1, 1.0, 2.0, 5.0)
NS_PER_M = 5.0
BESIDE_NS = (2.0, 12.6)
SKEW_NS = 50  # at most


class Reader(Host):
    """A host that takes all frames and looks at none."""

    async def _read(self):
        self.usb.stream_ready.value = 1


def side(dut, name: str) -> SimpleNamespace:
    """One bridge as rig.Host wants it."""
    bridge = getattr(dut, name)
    return SimpleNamespace(clk=getattr(dut, f"{name}_clk"), usb=bridge.usb, running=bridge.running)


async def pass_on(dut, delay_ps: int):
    """The cable: every edge of tick_out comes out so much later."""
    dut.cable.value = 0

    async def later(level: int):
        await Timer(delay_ps, unit="ps")
        dut.cable.value = level

    while True:
        await ValueChange(dut.tick_out)
        cocotb.start_soon(later(int(dut.tick_out.value)))


async def rises(signal, times: list[int]):
    while True:
        await RisingEdge(signal)
        times.append(get_sim_time("ps"))


@cocotb.test(timeout_time=200, timeout_unit="ms")
async def sync_pulses_of_two_bridges_come_together(dut):
    dut.a_rst.value = dut.b_rst.value = 1
    Clock(dut.a_clk, CLOCK_PS, unit="ps").start()
    await Timer(random.randrange(CLOCK_PS), unit="ps")
    Clock(dut.b_clk, CLOCK_PS + 2, unit="ps").start()  # 120 ppm slower
    await ClockCycles(dut.b_clk, 4)
    dut.a_rst.value = dut.b_rst.value = 0
    first, second = Reader(side(dut, "a")), Reader(side(dut, "b"))
    syncs: tuple[list[int], list[int]] = ([], [])
    for signal, times in zip((dut.a_sync, dut.b_sync), syncs, strict=True):
        cocotb.start_soon(rises(signal, times))
    for metres in CABLES_M:
        for beside in BESIDE_NS:
            for times in syncs:
                times.clear()
            cable = cocotb.start_soon(pass_on(dut, round(1000 * (metres * NS_PER_M + beside))))
            options = CONTROL_OPTIONS["tick_in"] | CONTROL_OPTIONS["pattern"]
            assert await second.control(1, tick_period=PERIOD, options=options)
            await ClockCycles(dut.a_clk, random.randrange(2 * PERIOD))
            assert await first.control(1, tick_period=PERIOD, options=CONTROL_OPTIONS["pattern"])
            while len(syncs[0]) < TICKS:
                await RisingEdge(dut.a_sync)
            assert await second.control(0, tick_period=PERIOD, options=options)
            assert await first.control(0, tick_period=PERIOD, options=CONTROL_OPTIONS["pattern"])
            await ClockCycles(dut.a_clk, 3 * PERIOD)
            cable.cancel()
            timing = await second.read("timing")
            assert (timing["edges"], timing["early"], timing["uneven"]) == (len(syncs[1]), 0, 0)
            assert len(syncs[0]) == len(syncs[1]) == TICKS + 1
            assert timing["tick"] == (await first.read("timing"))["tick"] == TICKS
            skews = [(b - a) / 1000 for a, b in zip(*syncs, strict=True)]
            assert max(map(abs, skews)) <= SKEW_NS, (metres, beside)


def test_pair():
    sources = [f"../bridge/{name}" for name in ("usb_stub.v",)]
    run_bench(
        "pair_bench",
        __file__,
        *(f"{name}.v" for name in RTL),
        bench=("pair_bench.v", *sources),
        parameters={"LANES": 1},
    )
