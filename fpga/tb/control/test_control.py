"""control_registers: what it accepts, what it refuses, and that a refusal changes nothing."""

import random

import cocotb
from bench import pulse, run_bench, start_clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge

from whisker_protocol import CONTROL_OPTIONS, LANES, LIMITS, REPORTS, WIRE_VERSION

CONTROL = REPORTS["control"]
SETTINGS = ("run", "sck_divider", "word_gap", "sample_point", "options", "lane_mask", "tick_period")
DEFAULTS = {
    "run": 0,
    "sck_divider": LIMITS["sck_divider_default"],
    "word_gap": LIMITS["word_gap_default"],
    "sample_point": LIMITS["sample_point_default"],
    "options": 0,
    "lane_mask": (1 << LANES) - 1,
    "tick_period": LIMITS["tick_period"],
}
OTHER = {
    "run": 1,
    "sck_divider": 6,
    "word_gap": 30,
    "sample_point": 3,
    "options": 5,
    "lane_mask": 0x3F,
    "tick_period": 4000,
}
RIGHT = [
    {},
    {"run": 0},
    {"sck_divider": 32, "sample_point": 32},
    {"word_gap": 255},
    {"sample_point": 1},
    {"sample_point": 6},
    {"lane_mask": 0},
    *({"options": option} for option in CONTROL_OPTIONS.values()),
    {"lane_mask": (1 << LANES) - 1},
    {"tick_period": 0xFFFFFFFF},
]
WRONG = [
    {"id": 2},
    {"wire_version": WIRE_VERSION + 1},
    {"wire_version": 0},
    {"run": 2},
    {"sck_divider": 4},
    {"sck_divider": 7},
    {"sck_divider": 34},
    {"sck_divider": 70},
    {"word_gap": 29},
    {"sample_point": 0},
    {"sample_point": 7},
    {"sample_point": 67},
    {"reserved": 1},
    {"reserved": 0x80},
    *({"options": 1 << bit} for bit in range(4, 8)),
    {"lane_mask": 1 << LANES},
    {"lane_mask": 1 << 31},
    {"tick_period": LIMITS["tick_period_min"] - 1},
]


def report(**values: int) -> bytes:
    return CONTROL.pack(**{"id": CONTROL.id, "wire_version": WIRE_VERSION, **OTHER, **values})


async def begin(dut):
    await start_clock(dut, halt=0, write_start=0, write_valid=0, write_done=0, stopping=0)


async def write(dut, data: bytes, gap: float = 0.3) -> None:
    """The bytes of a report, with idle cycles between."""
    for i, byte in enumerate(data):
        while random.random() < gap:
            await RisingEdge(dut.clk)
        dut.write_index.value = i
        dut.write_data.value = byte
        await pulse(dut, dut.write_valid)


async def finish(dut) -> tuple[bool, int, int]:
    """The end of the report, a cycle after its last byte: was it accepted, and did it start or stop a run."""
    await RisingEdge(dut.clk)
    dut.write_done.value = 1
    await FallingEdge(dut.clk)
    accepted = bool(dut.write_accept.value)
    await RisingEdge(dut.clk)
    dut.write_done.value = 0
    await FallingEdge(dut.clk)
    strobes = int(dut.start.value), int(dut.stop.value)
    await ClockCycles(dut.clk, 2)
    assert (int(dut.start.value), int(dut.stop.value)) == (0, 0), "strobes last one cycle"
    return accepted, *strobes


async def send(dut, data: bytes) -> tuple[bool, int, int]:
    await pulse(dut, dut.write_start)
    await write(dut, data)
    return await finish(dut)


def settings(dut) -> dict[str, int]:
    return {name: int(getattr(dut, name).value) for name in SETTINGS}


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def defaults_after_reset(dut):
    await begin(dut)
    assert settings(dut) == DEFAULTS


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(change=RIGHT)
async def accepts(dut, change):
    await begin(dut)
    accepted, start, stop = await send(dut, report(**change))
    wanted = {**OTHER, **change}
    assert (accepted, start, stop) == (True, wanted["run"], 0)
    assert settings(dut) == wanted


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(change=WRONG)
async def refuses_and_changes_nothing(dut, change):
    await begin(dut)
    assert await send(dut, report(**change)) == (False, 0, 0)
    assert settings(dut) == DEFAULTS


def legal(values: dict[str, int]) -> bool:
    """What the protocol's definition says of the report's values."""
    divider = values["sck_divider"]
    return (
        values["run"] <= 1
        and LIMITS["sck_divider_min"] <= divider <= LIMITS["sck_divider_max"]
        and divider % 2 == 0
        and values["word_gap"] >= LIMITS["word_gap_min"]
        and 1 <= values["sample_point"] <= divider
        and values["options"] < 1 << len(CONTROL_OPTIONS)
        and values["lane_mask"] < 1 << LANES
        and values["tick_period"] >= LIMITS["tick_period_min"]
    )


def random_values() -> dict[str, int]:
    """Any bytes at all in some fields, what is allowed in the others."""
    divider = random.randrange(LIMITS["sck_divider_min"], LIMITS["sck_divider_max"] + 1, 2)
    right = {
        "run": random.getrandbits(1),
        "sck_divider": divider,
        "word_gap": random.randrange(LIMITS["word_gap_min"], 256),
        "sample_point": random.randint(1, divider),
        "options": random.getrandbits(4),
        "lane_mask": random.getrandbits(LANES),
        "tick_period": random.randrange(LIMITS["tick_period_min"], 1 << 32),
    }
    bits = {"lane_mask": 32, "tick_period": 32}
    return {n: random.getrandbits(bits.get(n, 8)) if random.random() < 0.05 else value for n, value in right.items()}


@cocotb.test(timeout_time=5, timeout_unit="ms")
async def random_reports_are_taken_whole_or_not_at_all(dut):
    await begin(dut)
    wanted = dict(DEFAULTS)
    verdicts = set()
    for _ in range(200):
        values = random_values()
        accepted, _, _ = await send(dut, report(**values))
        assert accepted == legal(values), values
        verdicts.add(accepted)
        wanted = values if accepted else wanted
        assert settings(dut) == wanted
    assert verdicts == {True, False}


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(length=[0, 1, 15, 17, 32, 63])
async def refuses_a_wrong_length(dut, length):
    await begin(dut)
    assert await send(dut, (report() + bytes(64))[:length]) == (False, 0, 0)
    assert settings(dut) == DEFAULTS


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def a_repeated_packet_counts_once(dut):
    """The host sends its data again when the ACK was lost, or when the first packet was corrupted."""
    await begin(dut)
    await pulse(dut, dut.write_start)
    await write(dut, random.randbytes(CONTROL.size))
    await write(dut, report())
    assert await finish(dut) == (True, 1, 0)
    assert settings(dut) == OTHER


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def an_old_report_is_not_taken_for_a_new_one(dut):
    await begin(dut)
    await write(dut, report())
    await pulse(dut, dut.write_start)
    assert await finish(dut) == (False, 0, 0)


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def start_and_stop(dut):
    await begin(dut)
    assert await send(dut, report(run=0)) == (True, 0, 0), "stopped already"
    assert await send(dut, report(run=1)) == (True, 1, 0)
    assert await send(dut, report(run=1, word_gap=40)) == (True, 0, 0), "running already"
    assert int(dut.word_gap.value) == 40
    assert await send(dut, report(run=0)) == (True, 0, 1)
    dut.stopping.value = 1
    assert await send(dut, report(run=1)) == (False, 0, 0), "the stop is not finished"
    assert await send(dut, report(run=0)) == (True, 0, 0)
    dut.stopping.value = 0
    assert await send(dut, report(run=1)) == (True, 1, 0)


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def usb_reset_clears_run_only(dut):
    await begin(dut)
    await send(dut, report())
    await pulse(dut, dut.halt)
    await FallingEdge(dut.clk)
    assert settings(dut) == {**OTHER, "run": 0}


def test_control():
    run_bench("control_registers", __file__, "control_registers.v")
