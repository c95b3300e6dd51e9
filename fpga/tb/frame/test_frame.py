"""framer and frame_fifo: every byte of every frame against the protocol in Python, with stalls on both sides."""

import random

import cocotb
from bench import error_record, pulse, record, run_bench, start_clock
from cocotb.triggers import FallingEdge, RisingEdge

from whisker_protocol import CODES, FRAME_BYTES, FRAME_FLAGS, FRAME_HEADER, LANES, LIMITS, WIRE_VERSION, decode_frame

ALL = (1 << LANES) - 1
FIFO_FRAMES = LIMITS["fifo_bytes"] // FRAME_BYTES
CYCLES_PER_FRAME = FRAME_BYTES + 4
DEPTH = LIMITS["fifo_bytes"]


class Stream:
    """Reads the FIFO, taking a byte with probability `rate`; keeps the bytes and where the stream ended."""

    def __init__(self, dut, rate: float):
        self.data = bytearray()
        self.ends: list[int] = []
        self.rate = rate
        cocotb.start_soon(self._read(dut))

    async def _read(self, dut):
        while True:
            ready = random.random() < self.rate
            dut.out_ready.value = ready
            await FallingEdge(dut.clk)
            if ready and int(dut.out_valid.value):
                self.data.append(int(dut.out_data.value))
                if int(dut.out_last.value):
                    self.ends.append(len(self.data))
            await RisingEdge(dut.clk)

    def frames(self) -> list[bytes]:
        assert len(self.data) % FRAME_BYTES == 0, "only whole frames come out"
        return [bytes(self.data[i : i + FRAME_BYTES]) for i in range(0, len(self.data), FRAME_BYTES)]


async def stall_randomly(dut, share: float):
    """Holds back the bytes between framer and FIFO for a share of all cycles."""
    while True:
        dut.stall.value = random.random() < share
        await RisingEdge(dut.clk)


async def begin(dut, rate: float, stall: float = 0.0) -> Stream:
    await start_clock(dut, start=0, stall=0, is_last=0, out_ready=0, dropped_before=0, every=0)
    if stall:
        cocotb.start_soon(stall_randomly(dut, stall))
    return Stream(dut, rate)


def random_frame(number: int) -> dict[str, int]:
    """Random inputs of one frame: verdicts overlap, so that their precedence matters."""
    bits = {name: random.getrandbits(LANES) for name in ("lane_mask", "absent", "crc_wrong", "tick_wrong")}
    records = b"".join(record(number, random.getrandbits(16), random.getrandbits(16)) for _ in range(LANES))
    rest = {"tick": random.getrandbits(32), "tick_time": random.getrandbits(64), "sequence_number": number}
    rest["usb_time"] = random.getrandbits(16)
    return {**bits, **rest, "dropped_before": random.getrandbits(32), "records": int.from_bytes(records, "little")}


def codes_of(f: dict[str, int]) -> list[str]:
    """The code that stands for each lane."""
    order = (("lane_off", ~f["lane_mask"]), ("absent", f["absent"]), ("link_crc", f["crc_wrong"]))
    order += (("link_tick", f["tick_wrong"]), ("ok", ALL))
    return [next(code for code, lanes in order if lanes >> n & 1) for n in range(LANES)]


def packed(f: dict[str, int], is_last: bool) -> bytes:
    """The frame as the protocol defines it."""
    header = FRAME_HEADER.pack(
        magic=LIMITS["frame_magic"],
        wire_version=WIRE_VERSION,
        flags=FRAME_FLAGS["last"] if is_last else 0,
        tick=f["tick"],
        time=f["tick_time"],
        sequence=f["sequence_number"],
        dropped=f["dropped_before"],
        lane_mask=f["lane_mask"],
        lanes=LANES,
        usb_time=f["usb_time"],
    )
    received = f["records"].to_bytes(8 * LANES, "little")
    codes = codes_of(f)
    records = [
        received[8 * n : 8 * n + 8] if codes[n] == "ok" else error_record(f["tick"], codes[n]) for n in range(LANES)
    ]
    return header + b"".join(records)


async def send(dut, f: dict[str, int], is_last: bool = False):
    """Starts a frame, then takes everything away but the records' bytes."""
    for name, value in f.items():
        getattr(dut, name).value = value
    dut.is_last.value = is_last
    await pulse(dut, dut.start)
    for name in f.keys() - {"records"}:
        getattr(dut, name).value = 0
    dut.is_last.value = 0


async def finished(dut):
    """Steps until the framer has handed over its last byte."""
    await FallingEdge(dut.clk)
    if int(dut.busy.value):
        await FallingEdge(dut.busy)
    await RisingEdge(dut.clk)


async def drained(dut, stream: Stream):
    """Steps until nothing has come out for a while."""
    length = -1
    while length != len(stream.data):
        length = len(stream.data)
        for _ in range(100):
            await RisingEdge(dut.clk)


@cocotb.test(timeout_time=2, timeout_unit="ms")
@cocotb.parametrize(rate=[1.0, 0.5, 0.95], stall=[0.0, 0.4])
async def every_byte_is_right(dut, rate, stall):
    stream = await begin(dut, rate, stall)
    wanted = []
    for _ in range(12):
        f = random_frame(random.getrandbits(32))
        await send(dut, f)
        await finished(dut)
        wanted.append(packed(f, False))
    await drained(dut, stream)
    assert stream.frames() == wanted
    assert stream.ends == []
    decode_frame(wanted[0])


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def a_byte_a_cycle(dut):
    await begin(dut, 1.0)
    await send(dut, random_frame(0))
    cycles = 0
    await FallingEdge(dut.clk)
    while int(dut.busy.value):
        cycles += 1
        await FallingEdge(dut.clk)
    assert cycles <= CYCLES_PER_FRAME


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def record_codes_are_reported(dut):
    await begin(dut, 1.0)
    f = random_frame(3)
    await send(dut, f)
    seen = []
    while len(seen) < LANES:
        await FallingEdge(dut.clk)
        if int(dut.record_ends.value):
            seen.append(int(dut.record_code.value))
    assert seen == [CODES[code] for code in codes_of(f)]


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def last_frame_ends_the_stream(dut):
    stream = await begin(dut, 0.8)
    wanted = []
    for i in range(3):
        f = random_frame(i)
        await send(dut, f, is_last=i == 1)
        await finished(dut)
        wanted.append(packed(f, i == 1))
    await drained(dut, stream)
    assert stream.frames() == wanted
    assert stream.ends == [2 * FRAME_BYTES]


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def each_frame_ends_the_stream_if_wanted(dut):
    """From the frame on in which that is said, to the one in which it is taken back."""
    stream = await begin(dut, 0.8)
    for i in range(6):
        dut.every.value = i in (1, 2, 4)
        await send(dut, random_frame(i))
        await finished(dut)
    await drained(dut, stream)
    assert stream.ends == [n * FRAME_BYTES for n in (2, 3, 5)]


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def a_frame_is_seen_only_when_whole(dut):
    stream = await begin(dut, 1.0)
    f = random_frame(0)
    await send(dut, f)
    await FallingEdge(dut.clk)
    while int(dut.busy.value):
        assert not stream.data
        await FallingEdge(dut.clk)
    await drained(dut, stream)
    assert stream.frames() == [packed(f, False)]


async def count_drops(dut, drops: list[int]):
    """Adds an entry for every cycle in which a frame is reported dropped."""
    while True:
        await FallingEdge(dut.clk)
        if int(dut.dropped.value):
            drops.append(1)


@cocotb.test(timeout_time=5, timeout_unit="ms")
@cocotb.parametrize(stall=[0.0, 0.2])
async def overflow_drops_whole_frames_and_counts(dut, stall):
    stream = await begin(dut, 0.0, stall)
    drops: list[int] = []
    cocotb.start_soon(count_drops(dut, drops))
    sent = []
    for i in range(FIFO_FRAMES + 7):
        f = random_frame(i)
        await send(dut, f)
        await finished(dut)
        sent.append(packed(f, False))
    assert len(drops) == 7
    stream.rate = 1.0
    await drained(dut, stream)
    f = random_frame(999)
    await send(dut, f)
    await finished(dut)
    await drained(dut, stream)
    assert stream.frames() == sent[:FIFO_FRAMES] + [packed(f, False)]


@cocotb.test(timeout_time=2, timeout_unit="ms")
async def a_frame_fits_exactly_when_its_bytes_are_free(dut):
    """Any fill, by presetting the pointers: one byte too few drops a frame, or makes the last of a run wait."""
    await begin(dut, 0.0)
    drops: list[int] = []
    cocotb.start_soon(count_drops(dut, drops))
    edges = (0, FRAME_BYTES - 1, FRAME_BYTES, FRAME_BYTES + 1, DEPTH)
    for free in (*edges, *edges, *(random.randrange(DEPTH + 1) for _ in range(20))):
        end, is_last = random.randrange(2 * DEPTH), random.random() < 0.5
        for name, value in {"write_at": end, "commit_at": end, "read_at": (end + DEPTH + free) % (2 * DEPTH)}.items():
            getattr(dut.dut_fifo, name).value = value
        dut.dut_fifo.out_valid.value = 1
        drops.clear()
        await send(dut, random_frame(0), is_last)
        for _ in range(8):
            await RisingEdge(dut.clk)
        fits = free >= FRAME_BYTES
        assert (int(dut.dut_fifo.write_at.value) != end) == fits, f"{free} bytes free, last: {is_last}"
        assert len(drops) == int(not fits and not is_last), f"{free} bytes free, last: {is_last}"
        await pulse(dut, dut.rst)


@cocotb.test(timeout_time=5, timeout_unit="ms")
async def frames_of_a_slow_reader_are_whole_or_gone(dut):
    """The reader keeps up with half of the frames: what comes out is a subset of what went in, in order."""
    stream = await begin(dut, 0.45)
    drops: list[int] = []
    cocotb.start_soon(count_drops(dut, drops))
    sent = []
    for i in range(2 * FIFO_FRAMES + 30):
        f = random_frame(i)
        await send(dut, f)
        await finished(dut)
        sent.append(packed(f, False))
    stream.rate = 1.0
    await drained(dut, stream)
    frames = stream.frames()
    numbers = [FRAME_HEADER.unpack(frame)["sequence"] for frame in frames]
    assert numbers == sorted(set(numbers)) and len(drops) > 0
    assert frames == [sent[n] for n in numbers]
    assert len(frames) + len(drops) == len(sent)


@cocotb.test(timeout_time=5, timeout_unit="ms")
async def last_frame_waits_for_room(dut):
    stream = await begin(dut, 0.0)
    for i in range(FIFO_FRAMES + 2):
        await send(dut, random_frame(i))
        await finished(dut)
    f = random_frame(77)
    await send(dut, f, is_last=True)
    for _ in range(2 * FRAME_BYTES):
        await RisingEdge(dut.clk)
    assert int(dut.busy.value)
    stream.rate = 1.0
    await finished(dut)
    await drained(dut, stream)
    assert stream.frames()[-1] == packed(f, True)
    assert stream.ends == [len(stream.data)]


@cocotb.test(timeout_time=2, timeout_unit="ms")
async def reset_empties_and_forgets_a_half_written_frame(dut):
    stream = await begin(dut, 0.0)
    await send(dut, random_frame(0))
    await finished(dut)
    await send(dut, random_frame(1))
    for _ in range(100):
        await RisingEdge(dut.clk)
    await pulse(dut, dut.rst)
    stream.rate = 1.0
    f = random_frame(2)
    await send(dut, f)
    await finished(dut)
    await drained(dut, stream)
    assert stream.frames() == [packed(f, False)]


def test_frame():
    run_bench("frame_bench", __file__, "framer.v", "crc8.v", "frame_fifo.v", bench=("frame_bench.v",))
