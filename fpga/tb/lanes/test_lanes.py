"""whisker_bridge with fewer lanes than the wire has: frames and reports keep their size, the missing lanes are off."""

import os

import cocotb
import pytest
from bench import error_record, run_bench
from bridge.rig import RTL, Rig, answer, begin, reading, reported

from whisker_protocol import FRAME_BYTES, LANES

HAVE = int(os.environ.get("WHISKER_BENCH_LANES", LANES))


async def run(rig: Rig, ticks: int, **settings: int) -> list:
    """A run of so many ticks; its frames."""
    assert await rig.host.control(1, **settings)
    for _ in range(ticks):
        await rig.step()
    await rig.host.control(0, **settings)
    await rig.step("transfer_busy")
    await rig.quiet()
    return rig.host.frames()


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def frames_are_the_wires(dut):
    rig = await begin(dut, lanes=HAVE)
    frames = await run(rig, 3)
    assert rig.host.ends == [3 * FRAME_BYTES]
    nodes = min(HAVE, len(rig.nodes.records))
    for n, (header, records) in enumerate(frames):
        assert (header["tick"], header["lanes"], header["lane_mask"]) == (n, LANES, (1 << HAVE) - 1)
        assert records[:nodes] == [reading(n, lane) for lane in range(nodes)]
        assert records[nodes:HAVE] == [error_record(n, "absent")] * (HAVE - nodes)
        assert records[HAVE:] == [error_record(n, "lane_off")] * (LANES - HAVE)


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def a_mask_with_lanes_it_lacks_is_taken_without_them(dut):
    rig = await begin(dut, lanes=HAVE)
    identity = await rig.host.read("identity")
    assert (identity["lanes"], identity["wired_lanes"]) == (LANES, HAVE)
    await rig.host.control(0, lane_mask=(1 << LANES) - 1)
    assert (await rig.host.read("control"))["lane_mask"] == (1 << HAVE) - 1
    await rig.host.control(0, lane_mask=1 << (LANES - 1))
    assert (await rig.host.read("control"))["lane_mask"] == 0
    assert not await rig.host.control(0, lane_mask=1 << LANES)


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def answers_of_lanes_it_lacks_are_off(dut):
    rig = await begin(dut, lanes=HAVE)
    await rig.host.control(1)
    await rig.answered_order()
    _, found = await rig.host.answers()
    absent, off = reported(error_record(0, "absent")), reported(error_record(0, "lane_off"))
    assert found == [reported(answer(0, 1, 0))] + [absent] * (HAVE - 1) + [off] * (LANES - HAVE)


@pytest.mark.parametrize("lanes", [1, 12])
def test_lanes(lanes):
    run_bench(
        "whisker_bridge",
        __file__,
        *(f"{name}.v" for name in RTL),
        bench=("../bridge/usb_stub.v",),
        parameters={"LANES": lanes},
    )
