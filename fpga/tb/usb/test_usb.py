"""The USB parts the project adds to LUNA, in Amaranth's simulator: descriptors, HID requests, the mended endpoint."""

import random
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "usb"))

from amaranth.sim import Simulator  # noqa: E402
from descriptors import Build, descriptors, report_descriptor  # noqa: E402
from endpoints import FrameEndpoint, SilentEndpoint  # noqa: E402
from hid_requests import FEATURE, GET_REPORT, READ, SET_IDLE, SET_REPORT, WRITTEN, HidRequests  # noqa: E402
from usb_protocol.types import USBRequestRecipient, USBRequestType  # noqa: E402

from whisker_protocol import LIMITS, REPORTS  # noqa: E402

PACKET = LIMITS["bulk_packet"]
CONTROL = REPORTS["control"]


def simulate(module, bench, clocked: bool = True) -> None:
    simulator = Simulator(module)
    if clocked:
        simulator.add_clock(1 / LIMITS["clock_hz"], domain="usb")
    simulator.add_testbench(bench)
    simulator.run()


async def pulse(ctx, signal) -> None:
    ctx.set(signal, 1)
    await ctx.tick("usb")
    ctx.set(signal, 0)


# --- descriptors


def test_descriptors_name_the_device_and_its_endpoints():
    found = {(int(kind), index): bytes(raw) for kind, index, raw in descriptors(Build(serial="S1"))}
    device, configuration = found[1, 0], found[2, 0]
    assert int.from_bytes(device[8:10], "little") == LIMITS["usb_vendor_id"]
    assert int.from_bytes(device[10:12], "little") == LIMITS["usb_product_id"]
    assert int.from_bytes(configuration[2:4], "little") == len(configuration)
    other = descriptors(Build(usb_id=(0x1D50, 0x6000)))
    assert {bytes(raw)[8:12] for kind, _, raw in other if int(kind) == 1} == {bytes.fromhex("501d0060")}
    endpoints = [configuration[i : i + 7] for i in range(len(configuration)) if configuration[i : i + 2] == b"\x07\x05"]
    bulk, hid = endpoints
    assert (bulk[2], bulk[3], int.from_bytes(bulk[4:6], "little")) == (LIMITS["usb_bulk_in"], 2, PACKET)
    assert (hid[2], hid[3]) == (LIMITS["usb_hid_in"], 3)
    assert found[0x22, 0] == report_descriptor()
    assert configuration.count(bytes([0x22, len(report_descriptor()), 0])) == 1, "HID descriptor: report length"


def test_report_descriptor_has_every_report_as_a_feature():
    data = report_descriptor()
    for report in REPORTS.values():
        assert bytes([0x85, report.id, 0x09, report.id, 0x95, report.size - 1, 0xB1, 0x02]) in data


# --- endpoints


class BulkHost:
    """Feeds a FrameEndpoint and reads its packets as LUNA's device core would."""

    def __init__(self, ctx, endpoint):
        self.ctx, self.stream, self.bus = ctx, endpoint.stream, endpoint.interface
        self.endpoint, self.restart = endpoint, endpoint.restart

    async def feed(self, data: bytes, last: bool = False) -> None:
        for i, byte in enumerate(data):
            self.ctx.set(self.stream.payload, byte)
            self.ctx.set(self.stream.valid, 1)
            self.ctx.set(self.stream.last, last and i == len(data) - 1)
            while not self.ctx.get(self.stream.ready):
                await self.ctx.tick("usb")
            await self.ctx.tick("usb")
            self.ctx.set(self.stream.valid, 0)

    async def read(self, acknowledge: bool = True) -> tuple[int, bytes] | None:
        """One IN transaction: toggle and bytes, or None for a NAK."""
        token = self.bus.tokenizer
        self.ctx.set(token.endpoint, LIMITS["usb_bulk_in"] & 0xF)
        self.ctx.set(token.is_in, 1)
        await pulse(self.ctx, token.new_token)
        self.ctx.set(token.ready_for_response, 1)
        if self.ctx.get(self.bus.handshakes_out.nak):
            await pulse(self.ctx, token.ready_for_response)
            return None
        toggle, empty = self.ctx.get(self.bus.tx_pid_toggle), self.ctx.get(self.bus.tx.valid)
        await pulse(self.ctx, token.ready_for_response)
        data = b"" if empty else await self._payload()
        if acknowledge:
            await pulse(self.ctx, self.bus.handshakes_in.ack)
        return toggle, data

    async def _payload(self) -> bytes:
        out = bytearray()
        await self.ctx.tick("usb")
        self.ctx.set(self.bus.tx.ready, 1)
        while self.ctx.get(self.bus.tx.valid):
            out.append(self.ctx.get(self.bus.tx.payload))
            await self.ctx.tick("usb")
        self.ctx.set(self.bus.tx.ready, 0)
        return bytes(out)


def on_endpoint(scenario) -> None:
    endpoint = FrameEndpoint(endpoint_number=LIMITS["usb_bulk_in"] & 0xF, max_packet_size=PACKET)

    async def bench(ctx):
        ctx.set(endpoint.interface.active_config, 1)
        await scenario(BulkHost(ctx, endpoint))

    simulate(endpoint, bench)


def pattern(start: int, length: int) -> bytes:
    return bytes((start + 7 * i) & 0xFF for i in range(length))


def test_packets_leave_when_full_or_last():
    async def scenario(host):
        await host.feed(pattern(0, PACKET - 1))
        assert await host.read() is None
        await host.feed(b"x")
        assert await host.read() == (0, pattern(0, PACKET - 1) + b"x")
        await host.feed(pattern(5, 256), last=True)
        assert await host.read() == (1, pattern(5, 256))
        assert await host.read() is None

    on_endpoint(scenario)


def test_a_full_last_packet_is_followed_by_an_empty_one():
    async def scenario(host):
        await host.feed(pattern(1, PACKET), last=True)
        assert await host.read() == (0, pattern(1, PACKET))
        assert await host.read() == (1, b"")
        assert await host.read() is None

    on_endpoint(scenario)


def test_a_packet_without_ack_comes_again():
    async def scenario(host):
        await host.feed(pattern(2, PACKET))
        assert await host.read(acknowledge=False) == (0, pattern(2, PACKET))
        assert await host.read() == (0, pattern(2, PACKET))

    on_endpoint(scenario)


@pytest.mark.parametrize("packets", [1, 2])
@pytest.mark.parametrize("waiting", [0, 100, PACKET, PACKET + 100])
def test_restart_begins_with_data0_and_empty_buffers(packets, waiting):
    async def scenario(host):
        for _ in range(packets):
            await host.feed(pattern(3, PACKET))
            await host.read()
        await host.feed(pattern(4, waiting))
        await pulse(host.ctx, host.restart)
        assert await host.read() is None
        await host.feed(pattern(9, PACKET))
        assert await host.read() == (0, pattern(9, PACKET))

    on_endpoint(scenario)


@pytest.mark.parametrize("by", ["unhalt", "restart"])
def test_a_halt_ends_with_data0_and_keeps_no_packet_from_the_host(by):
    """USB 2.0 section 9.4.5: whatever the toggle was. A halt keeps what waits, a restart does not."""

    async def scenario(host):
        await host.feed(pattern(6, PACKET))
        assert await host.read() == (0, pattern(6, PACKET))
        await pulse(host.ctx, host.endpoint.halt)
        assert host.ctx.get(host.endpoint.halted)
        await host.feed(pattern(7, PACKET))
        await pulse(host.ctx, getattr(host.endpoint, by))
        assert not host.ctx.get(host.endpoint.halted)
        if by == "restart":
            await host.feed(pattern(8, PACKET))
        assert await host.read() == (0, pattern(7 if by == "unhalt" else 8, PACKET))

    on_endpoint(scenario)


def test_silent_endpoint_naks_its_own_tokens_only():
    endpoint = SilentEndpoint(endpoint_number=2)

    async def bench(ctx):
        token = endpoint.interface.tokenizer
        for configured, number, is_in, nak in ((1, 2, 1, 1), (1, 1, 1, 0), (1, 2, 0, 0), (0, 2, 1, 0)):
            ctx.set(endpoint.interface.active_config, configured)
            ctx.set(token.endpoint, number)
            ctx.set(token.is_in, is_in)
            ctx.set(token.ready_for_response, 1)
            assert ctx.get(endpoint.interface.handshakes_out.nak) == nak

    simulate(endpoint, bench)


# --- HID requests


class ControlHost:
    """Drives HidRequests through the stages of a control transfer."""

    def __init__(self, ctx, handler):
        self.ctx, self.handler, self.bus = ctx, handler, handler.interface
        self.random = random.Random(1)

    async def setup(self, request: int, value: int, length: int, is_in: bool, index: int = LIMITS["usb_hid_interface"]):
        setup, fields = self.bus.setup, {"request": request, "value": value, "length": length, "index": index}
        fields |= {"type": USBRequestType.CLASS, "recipient": USBRequestRecipient.INTERFACE, "is_in_request": is_in}
        for name, content in fields.items():
            self.ctx.set(getattr(setup, name), content)
        await pulse(self.ctx, setup.received)

    def _answer(self) -> str:
        handshake, tx = self.bus.handshakes_out, self.bus.tx
        named = {"ack": handshake.ack, "stall": handshake.stall, "empty": tx.valid & tx.last & ~tx.first}
        return " ".join(name for name, signal in named.items() if self.ctx.get(signal))

    async def ask(self, signal) -> str:
        """Raises a strobe for a cycle and says what the handler answers in it."""
        self.ctx.set(signal, 1)
        answer = self._answer()
        await pulse(self.ctx, signal)
        return answer

    async def status(self) -> str:
        return await self.ask(self.bus.status_requested)

    async def write(self, data: bytes) -> tuple[str, bytes]:
        """An OUT data packet: the answer, and the bytes the registers saw by index."""
        seen = bytearray(len(data))
        await pulse(self.ctx, self.bus.tokenizer.new_token)
        for byte in data:
            self.ctx.set(self.bus.rx.valid, 1)
            self.ctx.set(self.bus.rx.next, 1)
            self.ctx.set(self.bus.rx.payload, byte)
            if self.ctx.get(self.handler.write_valid):
                seen[self.ctx.get(self.handler.write_index)] = self.ctx.get(self.handler.write_data)
            await self.ctx.tick("usb")
        self.ctx.set(self.bus.rx.valid, 0)
        self.ctx.set(self.bus.rx.next, 0)
        return await self.ask(self.bus.rx_ready_for_response), bytes(seen)

    async def read(self, acknowledge: bool = True, share: float = 1.0) -> bytes:
        """A packet of the data stage of a read: the registers show the position as the byte. `share`: of cycles in which
        the transmitter is ready."""
        assert await self.ask(self.bus.data_requested) == ""
        base = 64 * self.ctx.get(self.handler.read_packet)
        out, position, over, cycles = bytearray(), 0, False, 0
        while not over:
            cycles += 1
            assert cycles < 1000, "the packet has an end"
            takes = self.random.random() < share
            self.ctx.set(self.bus.tx.ready, takes)
            self.ctx.set(self.handler.read_data, (base + position) % 256)
            if self.ctx.get(self.bus.tx.valid) and takes:
                assert self.ctx.get(self.bus.tx.first) == (not out)
                assert self.ctx.get(self.bus.tx_data_pid) == 1 - base // 64 % 2
                out.append(self.ctx.get(self.bus.tx.payload))
                over = self.ctx.get(self.bus.tx.last)
            position += self.ctx.get(self.handler.read_next)
            assert position - len(out) <= 2, "bytes read ahead"
            await self.ctx.tick("usb")
        assert share < 1.0 or cycles == 2 + len(out), "a byte in each cycle, once the first is there"
        self.ctx.set(self.bus.tx.ready, 0)
        assert not self.ctx.get(self.bus.tx.valid)
        if acknowledge:
            await pulse(self.ctx, self.bus.handshakes_in.ack)
        return bytes(out)


def on_requests(scenario) -> None:
    handler = HidRequests()

    async def bench(ctx):
        ctx.set(handler.interface.active_config, 1)
        await scenario(ControlHost(ctx, handler))

    simulate(handler, bench)


def value(report_id: int, kind: int = FEATURE) -> int:
    return kind << 8 | report_id


@pytest.mark.parametrize("share", [1.0, 0.4])
@pytest.mark.parametrize("name", READ)
@pytest.mark.parametrize("asked", [255, 64, 5, 1])
def test_get_report_sends_the_report_or_what_fits_packet_by_packet(name, asked, share):
    report = REPORTS[name]

    async def scenario(host):
        await host.setup(GET_REPORT, value(report.id), asked, True)
        wanted = bytes(range(min(asked, report.size)))
        got = b""
        while got != wanted:
            packet = await host.read(acknowledge=False, share=share)
            assert packet and await host.read(share=share) == packet, "asked again when the host's ACK was lost"
            got += packet
        assert host.ctx.get(host.handler.read_open)
        assert await host.status() == "ack"
        assert not host.ctx.get(host.handler.read_open)

    on_requests(scenario)


def test_a_read_is_over_when_the_host_begins_another_request():
    async def scenario(host):
        for request, number, length, is_in in ((GET_REPORT, 5, 176, True), (SET_IDLE, 0, 0, False)):
            await host.setup(GET_REPORT, value(5), 176, True)
            await host.read()
            assert host.ctx.get(host.handler.read_open)
            await host.setup(request, value(number), length, is_in)
            assert not host.ctx.get(host.handler.read_open)

    on_requests(scenario)


def test_each_read_begins_with_the_first_packet():
    async def scenario(host):
        for _ in range(2):
            await host.setup(GET_REPORT, value(REPORTS["answers"].id), 255, True)
            assert await host.read() == bytes(range(64))

    on_requests(scenario)


REFUSED = [
    (GET_REPORT, value(8), 64, True, 1),  # no such report
    (GET_REPORT, value(4), 64, True, 1),  # write only
    (SET_REPORT, value(4), 55, False, 1),  # too short
    (SET_REPORT, value(4), 57, False, 1),  # too long
    (SET_REPORT, value(5), 176, False, 1),  # read only
    (GET_REPORT, value(1, kind=1), 64, True, 1),  # an input report
    (GET_REPORT, value(1), 64, True, 0),  # the wrong interface
    (SET_REPORT, value(2), 32, False, 1),  # read only
    (SET_REPORT, value(1), 15, False, 1),  # too short
    (SET_REPORT, value(1), 64, False, 1),  # too long
    (0x0B, 0, 0, False, 1),  # SET_PROTOCOL
    (0x03, 0, 1, True, 1),  # GET_PROTOCOL
]


@pytest.mark.parametrize("request_, what, length, is_in, index", REFUSED)
def test_other_requests_stall_at_every_stage(request_, what, length, is_in, index):
    async def scenario(host):
        await host.setup(request_, what, length, is_in, index)
        for signal in (host.bus.data_requested, host.bus.rx_ready_for_response, host.bus.status_requested):
            assert await host.ask(signal) == "stall"

    on_requests(scenario)


@pytest.mark.parametrize("name", WRITTEN)
@pytest.mark.parametrize("accept", [0, 1])
def test_set_report_is_decided_once(accept, name):
    report = REPORTS[name]
    data = bytes(range(10, 10 + report.size))

    async def scenario(host):
        done = []
        await host.setup(SET_REPORT, value(report.id), report.size, False)
        for _ in range(2):  # the host repeats its data when our ACK was lost
            assert await host.write(data) == ("ack", data)
        host.ctx.set(host.handler.write_accept, accept)
        for _ in range(3):  # and its question when our answer was
            host.ctx.set(host.bus.status_requested, 1)
            done.append(host.ctx.get(host.handler.write_done))
            assert await host.status() == ("empty" if accept else "stall")
            host.ctx.set(host.handler.write_accept, not accept)
        assert done == [1, 0, 0]

    on_requests(scenario)


def test_a_setup_ends_whatever_was_going_on():
    async def scenario(host):
        await host.setup(SET_REPORT, value(CONTROL.id), CONTROL.size, False)
        await host.write(bytes(CONTROL.size))
        await host.setup(SET_IDLE, 0, 0, False)
        host.ctx.set(host.bus.status_requested, 1)
        assert not host.ctx.get(host.handler.write_done)
        assert await host.status() == "empty"
        await host.setup(GET_REPORT, value(3), 64, True)
        assert len(await host.read()) == REPORTS["identity"].size

    on_requests(scenario)
