"""flash_control against a model of the chip: what it reads and writes, what it refuses, what a cut of power leaves."""

import random

import cocotb
from bench import CLOCK_PS, pulse, run_bench, start_clock
from chip import ENABLE, ERASE, IDENTIFY, IDENTITY, PROGRAM, READ, SECTOR, SIZE, STATUS, Chip, watch_pins
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge

from whisker_protocol import FLASH_COMMANDS, REPORTS, WIRE_VERSION

FLASH = REPORTS["flash"]
COMMANDS = {name: number for name, number in FLASH_COMMANDS.items() if name != "boot"}  # that is the Pico's
SECTORS = 3
LIMIT = SECTORS << 16
UNIT = FLASH.fields["data"].count
BODY = FLASH.fields["address"].offset  # what report_reader takes from the module begins here
IDLE = dict.fromkeys(("running", "write_start", "write_valid", "write_index", "write_data", "write_done"), 0)
IDLE |= {"read_start": 0, "read_next": 0, "flash_miso": 1}
OPCODES = {"identify": [IDENTIFY], "read": [READ], "erase": [ENABLE, ERASE], "program": [ENABLE, PROGRAM]}


async def begin(dut, **options) -> Chip:
    await start_clock(dut, **IDLE)
    chip = Chip(dut, **options)
    cocotb.start_soon(chip.run())
    cocotb.start_soon(watch_pins(dut, CLOCK_PS, chip.wrong))
    return chip


def order(
    command: str | int, address: int, data: bytes = bytes(UNIT), version: int = WIRE_VERSION, ident: int = FLASH.id
) -> bytes:
    number = COMMANDS[command] if isinstance(command, str) else command
    head = FLASH.pack(id=ident, wire_version=version, command=number, address=address)
    return head[: -len(data)] + data


async def write(dut, raw: bytes, stall: float = 0.2) -> bool:
    """Sends a report; was it accepted?"""
    await pulse(dut, dut.write_start)
    for index, byte in enumerate(raw):
        while random.random() < stall:
            await RisingEdge(dut.clk)
        dut.write_index.value, dut.write_data.value = min(index, 63), byte
        await pulse(dut, dut.write_valid)
    await ClockCycles(dut.clk, random.randrange(2, 6))
    dut.write_done.value = 1
    await FallingEdge(dut.clk)
    accepted = bool(int(dut.write_accept.value))
    await RisingEdge(dut.clk)
    dut.write_done.value = 0
    await FallingEdge(dut.clk)
    assert int(dut.busy.value) == accepted or not accepted
    return accepted


async def end(dut) -> None:
    await FallingEdge(dut.clk)
    if int(dut.busy.value):
        await FallingEdge(dut.busy)
    await FallingEdge(dut.clk)


async def read_back(dut, stall: float = 0.2) -> tuple[int, bytes]:
    """Address and data of the report, as report_reader takes them."""
    await pulse(dut, dut.read_start)
    out = bytearray()
    for _ in range(FLASH.size - BODY):
        await FallingEdge(dut.clk)
        out.append(int(dut.read_data.value))
        while random.random() < stall:
            await RisingEdge(dut.clk)
        await pulse(dut, dut.read_next)
    return int.from_bytes(out[:4], "little"), bytes(out[4:])


async def done(dut, command: str, address: int, data: bytes = bytes(UNIT)) -> bytes:
    """An order carried out: its report's data afterwards."""
    assert await write(dut, order(command, address, data)), (command, address)
    assert int(dut.busy.value)
    await end(dut)
    assert int(dut.command.value) == COMMANDS[command]
    at, found = await read_back(dut)
    assert at == address
    return found


def unit(limit: int) -> int:
    """An address below, at the border as often as not."""
    return random.choice([0, limit - UNIT, random.randrange(0, limit, UNIT)])


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def orders_do_what_they_say(dut):
    """In random order, read back through the report, with a chip that is busy for long or hardly at all."""
    chip = await begin(dut)
    for address in range(0, SIZE, SIZE // 64):
        chip.content[address] = random.getrandbits(8)
    for _ in range(16):
        chip.busy_for = random.choice([1, 2, 9])
        command = random.choice(list(COMMANDS))
        writes = command in ("erase", "program")
        address, data = unit(LIMIT if writes else SIZE), random.randbytes(UNIT)
        before, sector = chip.bytes_at(address, UNIT), address - address % SECTOR
        chip.heard.clear()
        found = await done(dut, command, address, data)
        polls = [STATUS] * (chip.busy_for + 1) if writes else []
        assert chip.heard == OPCODES[command] + polls
        if command == "identify":
            assert found == IDENTITY + data[len(IDENTITY) :]
        elif command == "read":
            assert found == before
        elif command == "erase":
            assert chip.bytes_at(sector, SECTOR) == b"\xff" * SECTOR and found == data
        else:
            assert chip.bytes_at(address, UNIT) == bytes(a & b for a, b in zip(before, data, strict=True))
    assert chip.wrong == []


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def a_page_written_in_units_reads_back(dut):
    chip = await begin(dut)
    page = random.randbytes(256)
    start = LIMIT - SECTOR
    await done(dut, "erase", start)
    for at in range(0, len(page), UNIT):
        await done(dut, "program", start + at, page[at : at + UNIT])
    assert b"".join([await done(dut, "read", start + at) for at in range(0, len(page), UNIT)]) == page
    assert chip.wrong == []


def legal(command: int, address: int) -> bool:
    writes = command in (COMMANDS["erase"], COMMANDS["program"])
    return command < len(COMMANDS) and address % UNIT == 0 and address < (LIMIT if writes else SIZE)


@cocotb.test(timeout_time=50, timeout_unit="ms")
async def nothing_is_written_behind_the_limit(dut):
    """Any command, any address: it is accepted when the definition says so, and the fallback image stays."""
    chip = await begin(dut, busy_for=1)
    golden = {address: random.getrandbits(8) for address in range(LIMIT, LIMIT + 4096)}
    chip.content |= golden
    verdicts = {}
    for _ in range(100):
        command = random.choice([*COMMANDS.values()] * 8 + [random.randrange(256)])
        address = random.choice([unit(LIMIT), LIMIT, LIMIT + UNIT, LIMIT - 1, random.getrandbits(32), unit(SIZE)])
        address ^= random.choice([0] * 6 + [1 << 24, 1 << random.randrange(32)])
        accepted = await write(dut, order(command, address, random.randbytes(UNIT)), 0.0)
        assert accepted == legal(command, address), (command, hex(address))
        verdicts[command, accepted] = True
        await end(dut)
    assert {(command, verdict) for command in COMMANDS.values() for verdict in (True, False)} <= verdicts.keys()
    assert {address: chip.content[address] for address in golden} == golden
    assert max(chip.content) < LIMIT + 4096 and chip.wrong == []


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def refuses_what_is_no_order(dut):
    chip = await begin(dut)
    good = order("program", 0, random.randbytes(UNIT))
    wrong = [good[:n] for n in (0, 1, 12, FLASH.size - 1)] + [good + bytes(n) for n in (1, 5, 40)]
    wrong += [order("program", 0, ident=ident) for ident in (0, 1, 4, 6, 8, 0x87)]
    wrong += [order("program", 0, version=version) for version in (0, WIRE_VERSION + 1)]
    for raw in wrong:
        assert not await write(dut, raw), raw
    assert await write(dut, random.randbytes(FLASH.size) and good)
    assert not await write(dut, good), "one at a time"
    await end(dut)
    dut.running.value = 1
    assert not await write(dut, good), "a run is in progress"
    dut.running.value = 0
    assert await write(dut, good)
    await end(dut)
    assert chip.heard == 2 * [ENABLE, PROGRAM, STATUS, STATUS, STATUS] and chip.wrong == []


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def a_report_sent_again_counts_once(dut):
    """The host repeats its packet when the first came damaged."""
    chip = await begin(dut)
    data = random.randbytes(UNIT)
    await pulse(dut, dut.write_start)
    for raw in (order("erase", LIMIT - SECTOR, random.randbytes(UNIT)), order("program", 64, data)):
        for index, byte in enumerate(raw):
            dut.write_index.value, dut.write_data.value = index, byte
            await pulse(dut, dut.write_valid)
    await ClockCycles(dut.clk, 3)
    await pulse(dut, dut.write_done)
    await end(dut)
    assert chip.bytes_at(64, UNIT) == data and ERASE not in chip.heard and chip.wrong == []


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def a_busy_chip_is_asked_until_it_is_ready(dut):
    """However long: an order that comes meanwhile is refused, and changes nothing; reading disturbs nothing."""
    chip = await begin(dut, busy_for=400)
    data = random.randbytes(UNIT)
    assert await write(dut, order("program", 0, data))
    for _ in range(5):
        await ClockCycles(dut.clk, 600)
        assert not await write(dut, order("erase", 0))
        await read_back(dut)
    assert int(dut.busy.value)
    chip.busy = 1
    await end(dut)
    assert await read_back(dut) == (0, data) and chip.bytes_at(0, UNIT) == data and chip.wrong == []


@cocotb.test(timeout_time=60, timeout_unit="ms")
async def a_cut_of_power_changes_nothing_else(dut):
    """At any cycle of an erase or a program: bytes beside it and behind the limit stay; the next order works."""
    chip = await begin(dut)
    for _ in range(12):
        command, address = random.choice(["erase", "program"]), unit(LIMIT)
        chip.content |= {place: random.getrandbits(8) for place in (address ^ SECTOR, LIMIT, LIMIT + 5, SIZE - 256)}
        kept = dict(chip.content)
        span = SECTOR if command == "erase" else UNIT
        assert await write(dut, order(command, address, random.randbytes(UNIT)), 0.0)
        await ClockCycles(dut.clk, random.choice([random.randrange(800), random.randrange(5000)]))
        chip.cut()
        dut.rst.value = 1
        await ClockCycles(dut.clk, 4)
        dut.rst.value = 0
        await ClockCycles(dut.clk, 4)
        assert not int(dut.busy.value) and int(dut.flash_cs_n.value)
        touched = range(address - address % span, address - address % span + span)
        assert all(chip.content.get(place, 0xFF) == byte for place, byte in kept.items() if place not in touched)
        assert await done(dut, "read", LIMIT) == chip.bytes_at(LIMIT, UNIT)
    assert chip.wrong == []


def test_flash():
    run_bench("flash_control", __file__, "flash_control.v", parameters={"SECTORS": SECTORS})
