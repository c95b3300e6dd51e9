"""record_store, answer_store and service_store: what was put in comes out, whatever happens beside it and between."""

import random

import cocotb
from bench import error_record, pulse, run_bench, start_clock
from cocotb.triggers import FallingEdge, RisingEdge
from nodes import BITS

from whisker_protocol import LANES, LIMITS, RECORD, REPORTS, SERVICE, WIRE_VERSION, service_window

ALL = (1 << LANES) - 1
PACKET = 64  # bytes of a control endpoint's packet
HEADER_BYTES = REPORTS["answers"].fields["answer"].offset
IDLE = dict.fromkeys(("bit_index", "bits", "write", "swap", "read_lane", "read_byte"), 0)
IDLE |= dict.fromkeys(("answer_write", "answer_done", "hold", "lane_mask", "absent", "crc_wrong", "tick_wrong"), 0)
IDLE |= dict.fromkeys(("read_start", "read_packet", "read_next", "write_start", "write_valid", "write_index"), 0)
IDLE |= dict.fromkeys(("write_data", "write_done", "service_done", "service_index"), 0)
FAST = {"sck_divider": 6, "word_gap": 30, "tick_period": LIMITS["tick_period"]}
IDLE |= FAST
STALLS = [0.0, 0.5]  # chance that a cycle passes in which nothing moves
NOT_STORED = {"tick", "head_crc", "crc32"}  # of a service order: node_link makes them


def drive(dut, **values: int) -> None:
    for name, value in values.items():
        getattr(dut, name).value = value


async def begin(dut) -> None:
    await start_clock(dut, **IDLE, power_up=1)
    await RisingEdge(dut.clk)
    dut.power_up.value = 0


async def pause(dut, rate: float) -> None:
    while random.random() < rate:
        await RisingEdge(dut.clk)


def random_records() -> list[bytes]:
    return [random.randbytes(RECORD.size) for _ in range(LANES)]


def inverted(records: list[bytes]) -> list[bytes]:
    return [bytes(255 - byte for byte in record) for record in records]


async def fill(dut, records: list[bytes], strobe, stall: float) -> None:
    """A window: all lanes bit by bit; between two bits the lines may show anything."""
    for bit in range(BITS):
        drive(dut, bits=random.getrandbits(LANES), bit_index=random.randrange(BITS))
        await pause(dut, stall)
        values = [record[bit // 8] >> (7 - bit % 8) & 1 for record in records]
        drive(dut, bits=sum(value << lane for lane, value in enumerate(values)), bit_index=bit)
        await pulse(dut, strobe)


# --- record_store


async def read_records(dut) -> list[bytes]:
    """All bytes of the bank that is read, in random order."""
    out = [bytearray(RECORD.size) for _ in range(LANES)]
    places = [(lane, byte) for lane in range(LANES) for byte in range(RECORD.size)]
    random.shuffle(places)
    for lane, byte in places:
        drive(dut, read_lane=lane, read_byte=byte)
        await FallingEdge(dut.clk)
        out[lane][byte] = int(dut.read_data.value)
    return [bytes(record) for record in out]


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(stall=STALLS)
async def one_bank_is_read_while_the_other_is_filled(dut, stall):
    await begin(dut)
    before = random_records()
    await fill(dut, before, dut.write, stall)
    for turn in range(6):
        await pulse(dut, dut.swap)
        after = inverted(before) if turn % 3 else random_records()
        filling = cocotb.start_soon(fill(dut, after, dut.write, stall))
        assert await read_records(dut) == before
        await filling
        before = after


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def a_reset_begins_with_the_first_bank_again(dut):
    await begin(dut)
    first, second = random_records(), random_records()
    await fill(dut, first, dut.write, 0.0)
    await pulse(dut, dut.swap)
    await fill(dut, second, dut.write, 0.0)
    await pulse(dut, dut.rst)
    assert await read_records(dut) == second, "it is the first bank that is written next"


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def lanes_that_are_not_there_read_as_zeros(dut):
    await begin(dut)
    await fill(dut, [b"\xff" * RECORD.size] * LANES, dut.write, 0.0)
    await pulse(dut, dut.swap)
    for lane in range(LANES, 32):
        drive(dut, read_lane=lane)
        await FallingEdge(dut.clk)
        assert int(dut.read_data.value) == 0


# --- answer_store


async def read_report(dut, stall: float) -> bytes:
    """The report's body in packets, each of which may be read again; checks where its header ends."""
    out = bytearray()
    for packet in (0, *range((REPORTS["answers"].size + PACKET - 1) // PACKET)):
        drive(dut, read_packet=packet)
        await pulse(dut, dut.read_start)
        del out[PACKET * packet :]
        for _ in range(min(PACKET, REPORTS["answers"].size - PACKET * packet)):
            await pause(dut, stall)
            await FallingEdge(dut.clk)
            assert int(dut.in_header.value) == (len(out) < HEADER_BYTES)
            out.append(int(dut.answer_data.value))
            await RisingEdge(dut.clk)
            await pulse(dut, dut.read_next)
    return bytes(out[HEADER_BYTES:])


def expected(records: list[bytes], verdicts: dict[str, int]) -> bytes:
    """Alpha, beta, status of each lane, or the bridge's code in the order of precedence."""
    order = {"lane_off": ~verdicts["lane_mask"], "absent": verdicts["absent"]}
    order |= {"link_crc": verdicts["crc_wrong"], "link_tick": verdicts["tick_wrong"]}
    body = b""
    for lane, record in enumerate(records):
        wrong = [code for code, lanes in order.items() if lanes >> lane & 1]
        body += (error_record(0, wrong[0]) if wrong else record)[1:7]
    return body


@cocotb.test(timeout_time=2, timeout_unit="ms")
@cocotb.parametrize(stall=STALLS)
async def answers_are_those_of_the_latest_window(dut, stall):
    await begin(dut)
    nothing = {"lane_mask": ALL, "absent": ALL, "crc_wrong": 0, "tick_wrong": 0}
    assert await read_report(dut, stall) == expected(random_records(), nothing)
    records, verdicts = random_records(), nothing
    for turn in range(8):
        records = inverted(records) if turn % 3 else random_records()
        rare = [random.getrandbits(LANES) & random.getrandbits(LANES) & random.getrandbits(LANES) for _ in range(4)]
        lanes = [lanes if turn % 2 else ALL ^ lanes for lanes in rare] if turn > 5 else rare
        verdicts = {"lane_mask": ALL ^ lanes[0], "absent": lanes[1], "crc_wrong": lanes[2], "tick_wrong": lanes[3]}
        await fill(dut, records, dut.answer_write, stall)
        drive(dut, **verdicts)
        await pulse(dut, dut.answer_done)
        drive(dut, **dict.fromkeys(verdicts, 0))
        filling = cocotb.start_soon(fill(dut, random_records(), dut.answer_write, stall))
        assert await read_report(dut, stall) == expected(records, verdicts)
        await filling


@cocotb.test(timeout_time=2, timeout_unit="ms")
async def a_window_that_ends_during_a_read_is_shown_after_it(dut):
    """At any byte, a packet sent again included; then at once, and the number of windows with it."""
    await begin(dut)
    verdicts = {"lane_mask": ALL, "absent": 0, "crc_wrong": 0, "tick_wrong": 0}
    before = random_records()
    for turn in range(6):
        await fill(dut, before, dut.answer_write, 0.0)
        drive(dut, **verdicts)
        for strobe in (dut.answer_done, dut.service_done):
            strobe.value = 1
        await RisingEdge(dut.clk)
        drive(dut, answer_done=0, service_done=0)
        await FallingEdge(dut.clk)
        assert int(dut.waiting.value)
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        assert not int(dut.waiting.value) and int(dut.shown.value) == 2 * turn + 1
        after = inverted(before)
        await fill(dut, after, dut.answer_write, 0.0)
        drive(dut, hold=1)
        reading = cocotb.start_soon(read_report(dut, 0.3))
        for _ in range(random.randrange(500)):
            await RisingEdge(dut.clk)
        drive(dut, answer_done=1, service_done=1)
        await RisingEdge(dut.clk)
        drive(dut, answer_done=0, service_done=0, absent=ALL)
        assert await reading == expected(before, verdicts)
        assert int(dut.waiting.value) and int(dut.shown.value) == 2 * turn + 1
        drive(dut, hold=0)
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        assert not int(dut.waiting.value) and int(dut.shown.value) == 2 * turn + 2
        assert await read_report(dut, 0.0) == expected(after, verdicts)
        before = after


# --- service_store


def report(command: int, argument: bytes, data: bytes) -> bytes:
    return bytes([REPORTS["service"].id, WIRE_VERSION, command]) + argument + data


async def write(dut, raw: bytes, stall: float) -> bool:
    """Sends a report; was it accepted?"""
    await pulse(dut, dut.write_start)
    for index, byte in enumerate(raw):
        await pause(dut, stall)
        drive(dut, write_index=index, write_data=byte)
        await pulse(dut, dut.write_valid)
    drive(dut, write_done=1)
    await FallingEdge(dut.clk)
    accepted = bool(int(dut.write_accept.value))
    await RisingEdge(dut.clk)
    drive(dut, write_done=0)
    await RisingEdge(dut.clk)
    return accepted


async def sent(dut, stall: float) -> bytes:
    """The bits of a window as node_link asks for them, first byte excepted."""
    value = 0
    for bit in range(8, 8 * SERVICE.size):
        drive(dut, service_index=bit)
        await pause(dut, stall)
        await FallingEdge(dut.clk)
        value = value << 1 | int(dut.service_bit.value)
    return b"\0" + value.to_bytes(SERVICE.size - 1, "big")


def stored_part(window: bytes) -> list[bytes]:
    """What of a window comes from the store."""
    fields = [field for name, field in SERVICE.fields.items() if name not in NOT_STORED]
    return [window[field.offset : field.end] for field in fields]


@cocotb.test(timeout_time=2, timeout_unit="ms")
@cocotb.parametrize(stall=STALLS)
async def an_order_goes_out_as_it_came_and_nothing_replaces_it(dut, stall):
    await begin(dut)
    for turn in range(8):
        command, argument, data = random.getrandbits(8), random.randbytes(5), random.randbytes(48)
        assert not int(dut.due.value)
        assert await write(dut, report(command, argument, data), stall)
        assert int(dut.due.value) and int(dut.pending.value)
        assert not await write(dut, report(0, bytes(5), bytes(48)), stall), "one at a time"
        assert stored_part(await sent(dut, stall)) == stored_part(service_window(0, command, argument, data))
        assert int(dut.sequence_low.value) == turn
        await pulse(dut, dut.service_done)
        await FallingEdge(dut.clk)
        assert not int(dut.pending.value)


@cocotb.test(timeout_time=2, timeout_unit="ms")
async def an_order_waits_while_its_window_does_not_fit(dut):
    await begin(dut)
    limits = {"sck_divider": LIMITS["sck_divider_default"], "word_gap": LIMITS["word_gap_default"]}
    least = LIMITS["service_tick_min"]
    await write(dut, report(1, bytes(5), bytes(48)), 0.0)
    verdicts = set()
    for _ in range(300):
        settings = {"sck_divider": random.randrange(6, 33), "word_gap": random.randrange(256)}
        settings["tick_period"] = random.choice([least - 1, least, random.getrandbits(32), random.randrange(least)])
        drive(dut, **settings)
        await FallingEdge(dut.clk)
        fits = all(settings[name] <= most for name, most in limits.items()) and settings["tick_period"] >= least
        verdicts.add(fits)
        assert int(dut.due.value) == fits, settings
    assert verdicts == {True, False}


@cocotb.test(timeout_time=2, timeout_unit="ms")
async def a_reset_forgets_the_order_but_not_how_many_there_were(dut):
    await begin(dut)
    for windows in range(1, 300):
        await pulse(dut, dut.service_done)
        await FallingEdge(dut.clk)
        assert int(dut.sequence_low.value) == windows % 256
    assert await write(dut, report(1, bytes(5), bytes(48)), 0.0)
    await pulse(dut, dut.rst)
    await FallingEdge(dut.clk)
    assert not int(dut.pending.value) and int(dut.sequence_low.value) == 299 % 256
    await pulse(dut, dut.power_up)
    await FallingEdge(dut.clk)
    assert int(dut.sequence_low.value) == 0


def test_stores():
    modules = ("record_store.v", "answer_store.v", "service_store.v")
    run_bench("stores_bench", __file__, *modules, bench=("stores_bench.v",))
