"""node_link, lane_receiver and record_store against a Python model of the nodes."""

import random

import cocotb
from bench import CLOCK_PS, LINK, REPO, pulse, record, run_bench, start_clock, wrong_tick
from cocotb.triggers import FallingEdge, RisingEdge
from cycles import transfer as transfer_cycles
from nodes import BITS, Nodes

from whisker_protocol import COMMANDS, LANES, ORDER, RECORD, SERVICE, crc8, service_window

SETTINGS = [(6, 30, 3), (6, 30, 5), (16, 180, 8), (32, 30, 16), (32, 255, 32), (8, 41, 1)]  # divider, gap, sample point
SELECT_SETUP = 9  # cycles: 150 ns
SELECT_HOLD = 6  # cycles: 100 ns
SYNC_HIGH = 6


async def begin(dut, delay_ps: int = 0) -> Nodes:
    """Clock and nodes running, link idle."""
    await start_clock(dut, start=0, read_lane=0, read_byte=0, service=0, service_bit=0, pattern=0)
    nodes = Nodes(dut, delay_ps)
    nodes.times["sck"].clear()
    return nodes


async def transfer(dut, nodes: Nodes, records: dict[int, bytes], tick: int, expected: int, settings=SETTINGS[0]):
    """One tick with these records; returns the verdicts absent, crc_wrong, tick_wrong."""
    nodes.records = records
    dut.sck_divider.value, dut.word_gap.value, dut.sample_point.value = settings
    dut.order_tick.value, dut.expected_tick.value = tick, expected
    await pulse(dut, dut.start)
    dut.sck_divider.value, dut.word_gap.value, dut.sample_point.value = 10, 77, 4  # read at start only
    await FallingEdge(dut.busy)
    return tuple(int(v.value) for v in (dut.absent, dut.crc_wrong, dut.tick_wrong))


async def stored(dut, lane: int) -> bytes:
    """The lane's record as the framer would read it."""
    out = bytearray()
    for i in range(RECORD.size):
        dut.read_lane.value, dut.read_byte.value = lane, i
        await FallingEdge(dut.clk)
        out.append(int(dut.read_data.value))
    return bytes(out)


def outcome(verdict: tuple[int, int, int], lane: int) -> str:
    """Name of a lane's verdict, with the framer's precedence."""
    absent, crc_wrong, tick_wrong = (v >> lane & 1 for v in verdict)
    return "absent" if absent else "link_crc" if crc_wrong else "link_tick" if tick_wrong else "good"


def random_records(tick: int) -> dict[int, bytes]:
    return {
        n: record(tick, random.getrandbits(16), random.getrandbits(16), random.getrandbits(16)) for n in range(LANES)
    }


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize(settings=SETTINGS)
async def good_records_arrive_whole(dut, settings):
    nodes = await begin(dut)
    for tick in (5, 0, 255):
        expected = (tick - 1) & 0xFF
        records = random_records(expected)
        assert await transfer(dut, nodes, records, tick, expected, settings) == (0, 0, 0)
        assert nodes.orders[-1] == ORDER.pack(tick=tick, command=COMMANDS["sample"])
        for lane in (0, 13, LANES - 1):
            assert await stored(dut, lane) == records[lane]


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize(settings=SETTINGS)
async def bus_timing(dut, settings):
    nodes = await begin(dut)
    divider, gap, _ = settings
    await transfer(dut, nodes, random_records(0), 1, 0, settings)
    await RisingEdge(dut.clk)
    rise, fall = nodes.cycles("sck")[0::2], nodes.cycles("sck")[1::2]
    sync, select = nodes.cycles("sync"), nodes.cycles("select_n")
    assert len(rise) == len(fall) == BITS
    assert all(f - r == divider // 2 for r, f in zip(rise, fall, strict=True))
    steps = [b - a for a, b in zip(rise, rise[1:], strict=False)]
    assert steps == [divider + gap if i % 16 == 15 else divider for i in range(BITS - 1)]
    assert sync[1] - sync[0] == gap >= SYNC_HIGH and select[0] >= sync[1]
    assert rise[0] - select[0] >= SELECT_SETUP and select[1] - fall[-1] >= SELECT_HOLD
    assert select[1] - sync[0] == transfer_cycles(divider, gap)


@cocotb.test(timeout_time=50, timeout_unit="ms")
@cocotb.parametrize(divider=[6, 16], delay_ns=[0, 10, 20, 30, 40, 50, 60, 70, 80])
async def sample_point_window(dut, divider, delay_ns):
    """A record is read whole exactly when MISO has settled; no sample point that is allowed comes after it has moved on."""
    nodes = await begin(dut, 1000 * delay_ns)
    records = {lane: record(0, 0x5555, 0xAAAA, 0x5555) for lane in range(LANES)}
    for point in range(1, divider + 1):
        verdict = await transfer(dut, nodes, records, 1, 0, (divider, 30, point))
        settled = point * CLOCK_PS > 1000 * delay_ns
        assert (verdict == (0, 0, 0)) == settled, f"sample point {point} of {divider}, {delay_ns} ns of loop delay"


@cocotb.test(timeout_time=10, timeout_unit="ms")
async def a_sample_point_too_late_reads_the_bit_after(dut):
    """The window's other end, beyond what control_registers accepts: a whole SCK period later comes the next bit."""
    nodes = await begin(dut)
    records = {lane: record(0, 0x5555, 0xAAAA, 0x5555) for lane in range(LANES)}
    assert await transfer(dut, nodes, records, 1, 0, (16, 30, 16)) == (0, 0, 0)
    assert await transfer(dut, nodes, records, 1, 0, (16, 30, 17)) != (0, 0, 0)


def judged(raw: bytes, expected: int) -> tuple[bool, bool, bool]:
    """The verdicts absent, crc_wrong, tick_wrong on a record, from the protocol."""
    return raw == b"\xff" * RECORD.size, raw[-1] != crc8(raw[:-1]), raw[0] != expected


def flipped(raw: bytes, bit: int) -> bytes:
    """The record with one bit inverted, 0 the first on the wire."""
    return raw[: bit // 8] + bytes([raw[bit // 8] ^ 0x80 >> bit % 8]) + raw[bit // 8 + 1 :]


def one_of_each(expected: int) -> list[bytes]:
    """A record for every lane, in random order: eight with one bit of the tick wrong each, the others good, stale by any
    other tick, damaged in one bit or in many, absent, or absent but for one bit."""
    stale = [1 << bit ^ expected for bit in range(8)] + [wrong_tick(expected) for _ in range(4)]
    out = list(random_records(expected).values())[:7]
    out += [record(tick, random.getrandbits(16), random.getrandbits(16), random.getrandbits(16)) for tick in stale]
    out += [flipped(record(expected, random.getrandbits(16)), random.randrange(BITS)) for _ in range(4)]
    out += [random.randbytes(RECORD.size), bytes(RECORD.size)]
    out += [b"\xff" * RECORD.size, *(flipped(b"\xff" * RECORD.size, random.randrange(BITS)) for _ in range(2))]
    random.shuffle(out)
    assert len(out) == LANES
    return out


@cocotb.test(timeout_time=10, timeout_unit="ms")
async def every_lane_is_judged_alone(dut):
    """Any expected tick, 255 among them: a lane that nobody drives brings that tick, too."""
    nodes = await begin(dut)
    for expected in [0, 255, *(random.randrange(256) for _ in range(26))]:
        records = one_of_each(expected)
        verdict = await transfer(dut, nodes, dict(enumerate(records)), (expected + 1) & 0xFF, expected)
        for lane, raw in enumerate(records):
            found = tuple(bool(lanes >> lane & 1) for lanes in verdict)
            assert found == judged(raw, expected), f"lane {lane}, tick {expected} expected: {raw.hex()}"


@cocotb.test(timeout_time=10, timeout_unit="ms")
async def any_flipped_bit_is_noticed(dut):
    nodes = await begin(dut)
    for first in range(0, BITS, LANES):
        tick, records = random.randrange(256), {}
        for lane, bit in enumerate(range(first, min(first + LANES, BITS))):
            records[lane] = flipped(random_records(tick)[lane], bit)
        verdict = await transfer(dut, nodes, records, (tick + 1) & 0xFF, tick)
        assert [outcome(verdict, lane) for lane in records] == ["link_crc"] * len(records)


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def golden_records(dut):
    """protocol/vectors/records.txt, each record on a different lane, the other lanes absent."""
    nodes = await begin(dut)
    lines = (REPO / "protocol" / "vectors" / "records.txt").read_text().splitlines()
    vectors = [[f.strip() for f in line.split("|")] for line in lines if line and not line.startswith("#")]
    assert {v[3] for v in vectors} == {"good", "absent", "link_crc", "link_tick"}
    for i, (name, raw, expected, wanted) in enumerate(vectors):
        lane, expected = i % LANES, int(expected)
        verdict = await transfer(dut, nodes, {lane: bytes.fromhex(raw)}, (expected + 1) & 0xFF, expected)
        assert outcome(verdict, lane) == wanted, name
        assert outcome(verdict, (lane + 1) % LANES) == "absent", name
        assert await stored(dut, lane) == bytes.fromhex(raw), name


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize(settings=SETTINGS)
async def the_pattern_is_good_and_another_for_each_lane_and_tick(dut, settings):
    """Whatever the lines say."""
    nodes = await begin(dut)
    dut.pattern.value = 1
    for expected in (0, 255, 0x5A, *(random.randrange(256) for _ in range(3))):
        sent = dict(enumerate(one_of_each(expected)))
        assert await transfer(dut, nodes, sent, (expected + 1) & 0xFF, expected, settings) == (0, 0, 0)
        for lane in range(LANES):
            alpha, beta = 0x8000 + 256 * lane + 255 - expected, 0x4000 + 256 * lane + expected
            assert await stored(dut, lane) == record(expected, alpha, beta)
    dut.pattern.value = 0
    assert await transfer(dut, nodes, {}, 1, 0) != (0, 0, 0)


async def give_service(dut, window: bytes) -> None:
    """What service_store does: the bit that is asked for, in the same cycle."""
    bits = [byte >> (7 - bit) & 1 for byte in window for bit in range(8)]
    while True:
        await FallingEdge(dut.clk)
        dut.service_bit.value = bits[int(dut.service_index.value) % len(bits)]


@cocotb.test(timeout_time=10, timeout_unit="ms")
async def a_service_order_follows_with_its_tick_and_both_crcs(dut):
    """They are the link's own: the store has none of them."""
    nodes = await begin(dut)
    dut.service.value = 1
    for tick in (7, 0xC8):
        data = random.randbytes(SERVICE.fields["data"].count)
        wanted = service_window(tick, 4, b"\x01\x02\x03\x04\x05", data)
        crc_at = wanted.index(data) - 1
        stored = bytes(1) + wanted[1:crc_at] + bytes(1) + data + bytes(4)
        giving = cocotb.start_soon(give_service(dut, stored))
        await transfer(dut, nodes, {}, tick, tick)
        giving.cancel()
        assert nodes.services.pop() == wanted
        assert nodes.orders[-1] == ORDER.pack(tick=tick, command=COMMANDS["service"])


@cocotb.test(timeout_time=10, timeout_unit="ms")
async def reset_ends_a_transfer(dut):
    nodes = await begin(dut)
    nodes.records = random_records(0)
    dut.sck_divider.value, dut.word_gap.value, dut.sample_point.value = SETTINGS[0]
    await pulse(dut, dut.start)
    for _ in range(20):
        await RisingEdge(dut.sck)
    await pulse(dut, dut.rst)
    await FallingEdge(dut.clk)
    assert not int(dut.busy.value)
    await FallingEdge(dut.clk)
    assert (int(dut.busy.value), int(dut.select_n.value), int(dut.sck.value), int(dut.sync.value)) == (0, 1, 0, 0)


def test_link():
    run_bench("link_bench", __file__, *(f"{name}.v" for name in LINK), bench=("link_bench.v",))
