"""whisker_bridge's wires, bit by bit: what its modules count, ask and judge arrives where it is read, whatever the value."""

import random

import cocotb
from bench import error_record, pulse, record, wrong_tick
from cocotb.triggers import ClockCycles, FallingEdge
from rig import FAST, FIFO_FRAMES, answer, begin, reported

from whisker_protocol import FRAME_FLAGS, LANES, REPORTS, WIRE_VERSION

COUNTS = ("ticks", "frames", "dropped", "sequence_number")
RECORD_COUNTS = ("records_good", "records_absent", "records_crc", "records_tick")
PATTERNS = [0x3C3C_A55A, 0xC3C3_5AA5, 0x3C3C_A55A, 0xC3C3_5AA5]  # each bit goes up and down
VERDICTS = ("ok", "absent", "link_crc", "link_tick")


def patterns(names: tuple[str, ...]):
    """For each round a value per name; no two names have the same."""
    for pattern in PATTERNS:
        yield {name: (pattern << n | pattern >> (32 - n)) & 0xFFFFFFFF for n, name in enumerate(names)}


async def framed(rig, records: dict[int, bytes]):
    """One tick with these records; the frame made of them."""
    rig.nodes.records = records
    rig.host.data = bytearray()
    await pulse(rig.dut, rig.dut.tick_strobe)
    await FallingEdge(rig.dut.transfer_busy)
    await rig.quiet()
    ((header, found),) = rig.host.frames()
    return header, found


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def every_bit_of_a_count_reaches_header_and_report(dut):
    """By presetting the registers: no run is long enough."""
    rig = await begin(dut)
    await rig.host.control(1)
    await rig.step()
    for values in patterns((*COUNTS, *RECORD_COUNTS)):
        tick, time = values["ticks"] ^ 0xFFFF, values["frames"] << 32 | values["ticks"]
        for name, value in values.items():
            getattr(dut.counters, name).value = value
        dut.ticker.number.value, dut.ticker.tick_time.value = tick, time
        counters = await rig.host.read("counters")
        assert all(counters[name] == value for name, value in values.items() if name != "sequence_number")
        header, _ = await framed(rig, {})
        assert (header["tick"], header["time"]) == (tick, time)
        assert (header["sequence"], header["dropped"]) == (values["sequence_number"], values["dropped"])


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def every_lane_gets_every_verdict(dut):
    rig = await begin(dut)
    await rig.host.control(1)
    await rig.step()
    for tick in range(12):
        verdicts = [VERDICTS[(lane + tick) % len(VERDICTS)] for lane in range(LANES)]
        good = [record(tick, random.getrandbits(16), random.getrandbits(16)) for _ in range(LANES)]
        sent = {"ok": lambda r: r, "absent": lambda r: b"\xff" * 8, "link_crc": lambda r: r[:7] + bytes([r[7] ^ 1])}
        sent["link_tick"] = lambda r, tick=tick: record(wrong_tick(tick), random.getrandbits(16))
        on_the_wire = {lane: sent[verdict](good[lane]) for lane, verdict in enumerate(verdicts)}
        _, found = await framed(rig, on_the_wire)
        assert found == [r if v == "ok" else error_record(tick, v) for r, v in zip(good, verdicts, strict=True)]


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def an_order_carries_any_tick_and_its_answers_are_asked_for_by_it(dut):
    rig = await begin(dut)
    await rig.host.control(1)
    await rig.step()
    for tick in (0xFE, 0x00, 0xFF, 0x01):
        dut.service.sequence_low.value = tick
        dut.ticker.number.value = tick
        assert await rig.host.order(3)
        await rig.step()
        assert rig.nodes.services[-1][:2] == bytes([(tick + 1) & 0xFF, 3])
        rig.nodes.answers = {lane: answer((tick + 1) & 0xFF, 3, lane) for lane in range(LANES)}
        assert await rig.host.order(0)
        await rig.step()
        header, found = await rig.host.answers()
        assert header["sequence"] == (tick + 2) & 0xFF
        assert found == [reported(answer(0, 3, lane)) for lane in range(LANES)]


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def every_bit_of_a_setting_is_taken_and_read_back(dut):
    rig = await begin(dut)
    ones = {"sck_divider": 32, "word_gap": 255, "sample_point": 32, "lane_mask": (1 << LANES) - 1, "options": 15}
    zeros = {"sck_divider": 32, "word_gap": 64, "sample_point": 31, "lane_mask": 0, "options": 0}
    others = {"sck_divider": 30, "word_gap": 191, "sample_point": 1}
    steps = ((ones, 0xFFFFFFFF), (zeros, 0x00010000), (others, 0xFFFEFFFF), (ones, 0x00010000), (FAST, 0xFFFFFFFF))
    for settings, period in steps:
        wanted = {**FAST, "lane_mask": 5, **settings, "tick_period": period}
        assert await rig.host.control(0, **wanted)
        control = await rig.host.read("control")
        assert {name: control[name] for name in wanted} == wanted


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def any_unknown_report_reads_as_its_id_and_zeros(dut):
    rig = await begin(dut)
    usb = rig.host.usb
    for report_id in (0xFF, 0x00, 0xAA, 0x55, 0x07):
        usb.read_id.value = report_id
        await pulse(dut, usb.read_start)
        out = []
        for _ in range(REPORTS["counters"].size):
            await FallingEdge(dut.clk)
            out.append(int(usb.read_data.value))
            await pulse(dut, usb.read_next)
        assert out == [report_id, WIRE_VERSION] + [0] * (len(out) - 2)


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def a_stop_while_nobody_reads_ends_when_somebody_does(dut):
    """The last frame of a run waits for room; the run goes on until then, and no start is taken."""
    rig = await begin(dut)
    rig.host.reading = False
    await rig.host.control(1)
    for _ in range(FIFO_FRAMES + 1):
        await rig.step()
    await rig.host.control(0)
    await rig.step()
    await ClockCycles(dut.clk, 1000)
    assert int(dut.running.value) and int(dut.transfer_busy.value)
    assert not await rig.host.control(1)
    rig.host.reading = True
    await FallingEdge(dut.running)
    await rig.quiet()
    headers = [header for header, _ in rig.host.frames()]
    assert [header["sequence"] for header in headers] == list(range(FIFO_FRAMES + 1))
    assert headers[-1]["flags"] == FRAME_FLAGS["last"] and not headers[-1]["dropped"]
    assert await rig.host.control(1)


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def the_phys_wires_are_the_usb_devices(dut):
    """UTMI and the serial number pass through the top as they are."""
    await begin(dut)
    to_device = {"rx_data": 8, "rx_active": 1, "rx_valid": 1, "rx_error": 1, "tx_ready": 1, "line_state": 2}
    to_device |= {"vbus_valid": 1, "session_valid": 1, "session_end": 1}
    to_phy = {"tx_data": 8, "tx_valid": 1, "xcvr_select": 2, "term_select": 1, "op_mode": 2}
    for pattern in (0x5A, 0xA5, 0x5A, 0xA5):
        serial = int.from_bytes(bytes([pattern]) * 8, "big")
        dut.serial_number.value = serial
        for source, target, wires in ((dut, dut.usb, to_device), (dut.usb, dut, to_phy)):
            values = {
                f"utmi_{name}": (pattern >> n % 2) & ((1 << bits) - 1) for n, (name, bits) in enumerate(wires.items())
            }
            for name, value in values.items():
                getattr(source, name).value = value
            await FallingEdge(dut.clk)
            assert {name: int(getattr(target, name).value) for name in values} == values
        assert int(dut.usb.serial_number.value) == serial
