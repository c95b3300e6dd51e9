"""node_link, lane_receiver and record_store against the node's own firmware, every edge at its time.

What the bridge drives does not depend on what it reads, so each tick runs twice: first the bridge's edges are noted and
played to the nodes, which live in real time with oscillators of their own; then the bridge runs the tick again and
hears what they answered, later by the loop's delay.
"""

import itertools

import cocotb
from bench import LINK, pulse, run_bench, start_clock
from cocotb.triggers import FallingEdge, Timer, ValueChange
from cocotb.utils import get_sim_time
from firmware import LOST_CLOCK, MOSI, SCK, SELECT, SYNC, Node, Parts

from whisker_protocol import CODES, LANES, RECORD, STATUS_CODE_SHIFT

TICK_PS = 500_000_000
IDLE = (1 << LANES) - 1
LOOP_PS = 47_000  # docs/hardware.md: pads, two buffers, 0.6 m of cable there and back, the node's output
PINS = {"sync": SYNC, "select_n": SELECT, "sck": SCK, "mosi": MOSI}
SETTINGS = [(6, 30, 5), (6, 255, 5), (8, 30, 6), (16, 180, 8), (16, 30, 8), (32, 30, 16), (32, 255, 16)]
TICKS = 10
# +4 % is more than the chip's 40 MIPS allow: the model counts that as one breach per node, and nothing else may be.
PARTS = [
    Parts(seed, ppm, prefetch, permille)
    for seed, (ppm, prefetch, permille) in enumerate(itertools.product((-40000, 40000), (1, 2), (900, 1100)))
]


class Rig:
    """A bridge's link and nodes of all parts on lanes 0 to 7."""

    def __init__(self, dut, settings, loop_ps: int = LOOP_PS):
        self.dut, self.settings, self.loop_ps = dut, settings, loop_ps
        self.nodes = [Node(parts) for parts in PARTS]
        self.tick = 0
        self.edges: list[tuple[int, int, int]] = []

    async def start(self) -> None:
        await start_clock(self.dut, start=0, read_lane=0, read_byte=0, miso=IDLE, pattern=0)
        for name in PINS:
            cocotb.start_soon(self._watch(name))

    async def _watch(self, name: str) -> None:
        signal = getattr(self.dut, name)
        while True:
            await ValueChange(signal)
            self.edges.append((round(get_sim_time("ps")), PINS[name], int(signal.value)))

    async def _transfer(self) -> int:
        """One tick of the bridge; its time of start."""
        self.dut.sck_divider.value, self.dut.word_gap.value, self.dut.sample_point.value = self.settings
        self.dut.order_tick.value, self.dut.expected_tick.value = self.tick & 0xFF, (self.tick - 1) & 0xFF
        start = round(get_sim_time("ps"))
        await pulse(self.dut, self.dut.start)
        await FallingEdge(self.dut.busy)
        return start

    async def _answer(self, changes: list[tuple[int, int]]) -> None:
        now = 0
        for at, lines in changes:
            if at > now:
                await Timer(at - now, unit="ps")
                now = at
            self.dut.miso.value = lines

    async def run(self, fields, faults=None, spoil=lambda edges: edges):
        """A tick with these fields (one per node) and faults by lane; verdict and record of each lane's last tick."""
        self.edges = []
        start = await self._transfer()
        edges = [(0, MOSI, 0)]  # it fell after the transfer before
        edges += sorted(((t - start, pin, v) for t, pin, v in self.edges), key=lambda e: (e[0], e[1] != MOSI))
        played = spoil([(self.tick * TICK_PS + t, pin, v) for t, pin, v in edges])
        played.append(((self.tick + 1) * TICK_PS - 1, SYNC, 0))  # no edge: the nodes live on until the next tick
        lines = [IDLE] * len(played)
        for lane, node in enumerate(self.nodes):
            node.set(*fields[lane], *(faults or {}).get(lane, ()))
            for i, level in enumerate(node.play(played)):
                lines[i] &= ~(0 if level else 1 << lane)
        shift = self.loop_ps - self.tick * TICK_PS
        changes = [(t + shift, v) for (t, _, _), v in zip(played, lines, strict=True) if t + shift < TICK_PS // 4]
        answering = cocotb.start_soon(self._answer(changes))
        await self._transfer()
        answering.cancel()
        self.dut.miso.value = IDLE
        self.tick += 1
        return [await self._lane(lane) for lane in range(len(self.nodes))]

    async def _lane(self, lane: int):
        wrong = [int(v.value) >> lane & 1 for v in (self.dut.absent, self.dut.crc_wrong, self.dut.tick_wrong)]
        raw = bytearray()
        for i in range(RECORD.size):
            self.dut.read_lane.value, self.dut.read_byte.value = lane, i
            await FallingEdge(self.dut.clk)
            raw.append(int(self.dut.read_data.value))
        name = next((n for n, w in zip(("absent", "link_crc", "link_tick"), wrong, strict=True) if w), None)
        return name, RECORD.unpack(bytes(raw))

    def finish(self) -> None:
        for node, parts in zip(self.nodes, PARTS, strict=True):
            assert node.violations() == (parts.frc_ppm > 20000), parts
            node.free()


def field(tick: int, lane: int) -> tuple[float, float]:
    return 1.5 * tick - 2.0 * lane, 3.0 * lane - 0.75 * tick


def counts(angle_deg: float) -> int:
    """The sensor's transfer: 180 degrees over 65536 counts in steps of 16."""
    return 16 * int(2048 + angle_deg * 4096 / 180 + 0.5)


def is_good(answer, tick: int, lane: int) -> bool:
    name, record = answer
    alpha, beta = field(tick, lane)
    return name is None and (record["alpha"], record["beta"], record["status"]) == (counts(alpha), counts(beta), 0)


def code(answer) -> str:
    name, record = answer
    return name or next(n for n, value in CODES.items() if value == record["status"] >> STATUS_CODE_SHIFT)


async def ticks(rig: Rig, count: int = TICKS, **special):
    """Runs ticks; `special` maps "at<tick>" to keywords of Rig.run. The answers, one list per tick."""
    out = []
    for _ in range(count):
        fields = [field(rig.tick, lane) for lane in range(len(rig.nodes))]
        out.append(await rig.run(fields, **special.get(f"at{rig.tick}", {})))
    return out


@cocotb.test(timeout_time=50, timeout_unit="ms")
@cocotb.parametrize(settings=SETTINGS)
async def every_sample_arrives_whole(dut, settings):
    rig = Rig(dut, settings)
    await rig.start()
    for tick, answers in enumerate(await ticks(rig)):
        assert tick == 0 or all(is_good(a, tick - 1, lane) for lane, a in enumerate(answers)), (tick, answers)
    rig.finish()


@cocotb.test(timeout_time=50, timeout_unit="ms")
@cocotb.parametrize(loop_ns=[0, 30, 60, 75])
async def the_loop_may_take_until_the_sample_point(dut, loop_ns):
    rig = Rig(dut, (6, 30, 5), 1000 * loop_ns)
    await rig.start()
    for tick, answers in enumerate(await ticks(rig, 4)):
        assert tick == 0 or all(is_good(a, tick - 1, lane) for lane, a in enumerate(answers))
    rig.finish()


@cocotb.test(timeout_time=50, timeout_unit="ms")
@cocotb.parametrize(settings=[SETTINGS[0], SETTINGS[3]])
async def a_missing_and_a_doubled_sync_cost_a_tick_each(dut, settings):
    def without_sync(edges):
        return [e for e in edges if e[1] != SYNC]

    def with_two(edges):
        base = edges[0][0]
        return sorted(edges + [(base + 40_000_000, SYNC, 1), (base + 41_000_000, SYNC, 0)])

    rig = Rig(dut, settings)
    await rig.start()
    out = await ticks(rig, 9, at3={"spoil": without_sync}, at6={"spoil": with_two})
    for tick, answers in enumerate(out[1:], 1):
        wanted = {4: "link_tick", 7: "late"}.get(tick, "ok")  # the order had come: the link holds LATE
        assert [code(a) for a in answers] == [wanted] * len(answers), tick
        assert wanted != "ok" or all(is_good(a, tick - 1, lane) for lane, a in enumerate(answers))
    rig.finish()


@cocotb.test(timeout_time=50, timeout_unit="ms")
async def a_slip_of_the_sensors_clock_costs_its_tick_and_a_resynchronisation(dut):
    rig = Rig(dut, SETTINGS[0])
    await rig.start()
    out = await ticks(rig, 8, at3={"faults": {lane: (LOST_CLOCK, 12 + 5 * lane) for lane in range(0, 8, 2)}})
    for tick, answers in enumerate(out[1:], 1):
        for lane, a in enumerate(answers):
            wanted = {4: "sensor_sum", 5: "resync"}.get(tick, "ok") if lane % 2 == 0 else "ok"
            assert code(a) == wanted, (tick, lane, a)
            assert wanted != "ok" or is_good(a, tick - 1, lane)
    rig.finish()


@cocotb.test(timeout_time=50, timeout_unit="ms")
@cocotb.parametrize(lost=[5, 16, 33])
async def lost_link_clocks_cost_one_record(dut, lost):
    def cut(edges):
        sck = [e for e in edges if e[1] == SCK][-2 * lost :]
        return [e for e in edges if e not in sck]

    rig = Rig(dut, SETTINGS[0])
    await rig.start()
    out = await ticks(rig, 7, at3={"spoil": cut})
    assert all(code(a) != "ok" for a in out[3])
    for tick in (1, 2, 4, 5, 6):
        assert all(is_good(a, tick - 1, lane) for lane, a in enumerate(out[tick])), tick
    rig.finish()


def test_node():
    run_bench("link_bench", __file__, *(f"{name}.v" for name in LINK), bench=("../link/link_bench.v",))
