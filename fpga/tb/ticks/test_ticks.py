"""tick_generator, run_control and bridge_counters: every cycle against what their headers promise."""

import random

import cocotb
from bench import pulse, run_bench, start_clock
from cocotb.triggers import FallingEdge

from whisker_protocol import CODES, LIMITS

IDLE = {"restart": 0, "enable": 0, "link_busy": 0, "external": 0, "strobe": 0, "period": 2, "pause": 0}
IDLE |= dict.fromkeys(("tick_in", "falling", "clear", "watch", "busy", "sof", "sof_frame", "stamp"), 0)
IDLE |= {"expected": 4000, "start": 0, "stop": 0, "run_tick": 0, "last_done": 0}
IDLE |= {"new_run": 0, "count_tick": 0, "frame": 0, "drop": 0, "record_ends": 0, "record_code": 0}
LEAD = LIMITS["tick_lead"] - 1  # cycles from the divider's start to its first tick: tick_out goes ahead
OF_RUN = ("ticks", "frames", "dropped")
OF_RECORDS = {"ok": "records_good", "absent": "records_absent", "link_crc": "records_crc", "link_tick": "records_tick"}
COUNTERS = (*OF_RUN, "sequence_number", *OF_RECORDS.values())
WORD, TIME = 1 << 32, 1 << 64


def drive(dut, **values: int) -> None:
    for name, value in values.items():
        getattr(dut, name).value = value


def chance(rate: float) -> int:
    return int(random.random() < rate)


async def begin(dut, **inputs: int) -> None:
    await start_clock(dut, **{**IDLE, **inputs})
    await FallingEdge(dut.clk)


# --- tick_generator


async def watch(dut, cycles: int, busy: float, strobe: float, pause: float):
    """Random inputs; returns them by cycle, and what came of each: None, or first, number and previous_time of a tick."""
    inputs, ticks = [], []
    paused = 0
    for _ in range(cycles):
        paused ^= chance(pause)
        inputs.append({"link_busy": chance(busy), "strobe": chance(strobe), "pause": paused})
        drive(dut, **inputs[-1])
        await FallingEdge(dut.clk)
        tick = (int(dut.first.value), int(dut.number.value), int(dut.previous_time.value))
        ticks.append(tick if int(dut.tick.value) else None)
    return inputs, ticks


def expected(inputs, period: int, external: bool):
    """What the header promises: a tick when the source wants one and the link is free; numbers and time go on in a pause."""
    number, due, out = -1, LEAD, []
    for cycle, now in enumerate(inputs):
        begins = not now["link_busy"] and (now["strobe"] if external else cycle >= due)
        due = cycle + period if begins else due
        number += begins and not (now["pause"] and number < 0)
        out.append(number if begins and not now["pause"] else None)
    return out


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(external=[0, 1], period=[2, 7, 40], busy=[0.0, 0.6], pause=[0.0, 0.02])
async def ticks_come_when_they_are_due_and_the_link_is_free(dut, external, period, busy, pause):
    await begin(dut, external=external, period=period, pause=0)
    drive(dut, enable=1)
    inputs, ticks = await watch(dut, 400, busy, 0.2, pause)
    wanted = expected(inputs, period, bool(external))
    assert [tick and tick[1] for tick in ticks] == wanted
    seen = [tick for tick in ticks if tick]
    assert len(seen) >= 5, "too few to tell"
    assert [first for first, _, _ in seen] == [1] + [0] * (len(seen) - 1)
    assert all(time == (number - 1) * period for _, number, time in seen[1:])


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def numbers_and_times_carry_through_every_bit(dut):
    """A run of 24 days, or of ten thousand years, by presetting the registers."""
    await begin(dut, external=1, enable=1)
    for preset in [WORD - 1, WORD - 2, 0, *(random.getrandbits(32) for _ in range(40))]:
        time = random.choice([TIME - 1, random.getrandbits(64), WORD - 1])
        period = random.getrandbits(32)
        drive(dut, period=period)
        drive(dut.ticker, number=preset, tick_time=time, fresh=0)
        for step in range(2):
            drive(dut, strobe=1)
            await FallingEdge(dut.clk)
            drive(dut, strobe=0)
            assert int(dut.number.value) == (preset + 1 + step) % WORD
            assert int(dut.previous_time.value) == (time + step * period) % TIME


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(by=["restart", "rst"])
async def a_new_run_begins_with_number_0(dut, by):
    await begin(dut, enable=1)
    for period in [WORD - 1, 0x80000001, 2, *(random.getrandbits(32) | 2 for _ in range(30))]:
        drive(dut, period=period)
        await pulse(dut, getattr(dut, by))
        await FallingEdge(dut.clk)
        drive(dut, enable=0)  # after rst the divider goes on
        await FallingEdge(dut.clk)
        drive(dut, enable=1)
        for _ in range(LEAD + 1):
            await FallingEdge(dut.clk)
        assert (int(dut.tick.value), int(dut.first.value), int(dut.number.value)) == (1, 1, 0)
        await FallingEdge(dut.clk)
        assert int(dut.tick.value) == 0


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def none_unless_enabled(dut):
    await begin(dut, external=1, strobe=1)
    for external in (1, 0):
        drive(dut, external=external)
        for _ in range(20):
            await FallingEdge(dut.clk)
            assert not int(dut.tick.value)


# --- run_control


class Run:
    """The picture in run_control's header."""

    def __init__(self):
        self.state, self.ticked = "idle", False

    def step(self, start: int, stop: int, tick: int, last_done: int) -> None:
        before = self.state
        ended = last_done or (before in ("stopping", "finishing") and not self.ticked and not tick)
        if ended:
            self.state, self.ticked = "idle", False
            return
        if start and before == "idle":
            self.state = "running"
        if stop and before == "running":
            self.state = "stopping"
        if tick and before == "stopping" and self.ticked:
            self.state = "finishing"
        self.ticked = self.ticked or bool(tick)

    def outputs(self) -> tuple[int, int, int]:
        at = ("idle", "running", "stopping", "finishing").index(self.state)
        return int(at > 0), int(at > 1), int(at > 2)


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def runs_start_stop_and_end_as_drawn(dut):
    await begin(dut)
    run, seen, asked = Run(), set(), 0
    for _ in range(3000):
        tick = asked and chance(0.3)  # as tick_generator gives them: a cycle after it was asked
        asked = int(dut.take_ticks.value)
        inputs = {"start": chance(0.1), "stop": chance(0.1), "tick": tick}
        inputs["last_done"] = chance(0.2) if run.state == "finishing" else 0
        drive(dut, **{"run_tick" if name == "tick" else name: value for name, value in inputs.items()})
        await FallingEdge(dut.clk)
        seen.add((run.state, run.ticked, *inputs.values()))
        run.step(**inputs)
        assert (int(dut.running.value), int(dut.stopping.value), int(dut.finishing.value)) == run.outputs()
        assert not int(dut.take_ticks.value) or run.state in ("running", "stopping")
    assert len(seen) > 30
    drive(dut, start=1, stop=0, run_tick=0, last_done=0)
    await FallingEdge(dut.clk)
    assert int(dut.running.value)
    await pulse(dut, dut.rst)
    await FallingEdge(dut.clk)
    assert not int(dut.running.value), "a reset ends a run"
    await FallingEdge(dut.clk)
    assert int(dut.running.value), "and start begins another"


# --- bridge_counters


def counted(before: dict[str, int], events: dict[str, int]) -> dict[str, int]:
    """The counters a cycle later."""
    after = dict(before)
    for name, event in (("ticks", "count_tick"), ("frames", "frame"), ("dropped", "drop")):
        after[name] = 0 if events["new_run"] else (before[name] + events[event]) % WORD
    after["sequence_number"] = (before["sequence_number"] + events["frame"]) % WORD
    for code, name in OF_RECORDS.items():
        ends = events["record_ends"] and events["record_code"] == CODES[code]
        after[name] = (before[name] + ends) % WORD
    return after


async def check_counters(dut, counts: dict[str, int], cycles: int) -> None:
    codes = [CODES[code] for code in (*OF_RECORDS, "lane_off")]
    for _ in range(cycles):
        events = {name: chance(0.5) for name in ("count_tick", "frame", "drop", "record_ends")}
        events |= {"new_run": chance(0.05), "record_code": random.choice(codes)}
        drive(dut, **events)
        await FallingEdge(dut.clk)
        counts = counted(counts, events)
        assert {name: int(getattr(dut, name).value) for name in COUNTERS} == counts


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def every_event_is_counted_once(dut):
    await begin(dut)
    await check_counters(dut, dict.fromkeys(COUNTERS, 0), 400)


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def counters_carry_through_every_bit_and_wrap(dut):
    """Days of counting, by presetting the registers; a reset clears them all."""
    await begin(dut)
    for preset in [WORD - 1, 0, *(random.getrandbits(32) for _ in range(40))]:
        counts = {name: preset ^ n for n, name in enumerate(COUNTERS)}
        drive(dut.counters, **counts)
        await check_counters(dut, counts, 4)
    drive(dut, count_tick=0, frame=0, drop=0, record_ends=0, new_run=0)
    await pulse(dut, dut.rst)
    await FallingEdge(dut.clk)
    assert not any(int(getattr(dut, name).value) for name in COUNTERS)


def test_ticks():
    run_bench(
        "ticks_bench",
        __file__,
        "tick_generator.v",
        "run_control.v",
        "bridge_counters.v",
        "tick_input.v",
        "sof_clock.v",
        bench=("ticks_bench.v",),
        more=("sources",),
    )
