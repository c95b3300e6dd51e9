"""ulpi_shim against a model of a PHY: set-up whatever the PHY does, packets both ways under stalls, interruptions."""

import random

import bench
import cocotb
import pytest
from ulpi.link import CHIRP, FULL_SPEED, HIGH_SPEED, Link, packet
from ulpi.phy import FUNCTION_CONTROL, OTG_CONTROL, VBUS_VALID, UlpiPhy

VENDOR = {"VENDOR_REGISTER": 0x39, "VENDOR_VALUE": 0x06}  # as Cynthion needs it
# Cycles a high-speed link has from the end of a packet to its answer: ULPI 1.1, table of section 3.8.2.6.
LINK_DECISION = 14
DEVICE_DECIDES = 7  # of these, what the device takes from the fall of rx_active to tx_valid (test of sim/bridge)


def written_anew(dut) -> list[tuple[int, int]]:
    """Registers and values of a set-up, in their order."""
    vendor = [(int(dut.VENDOR_REGISTER.value), int(dut.VENDOR_VALUE.value))]
    return [
        (FUNCTION_CONTROL, 0x65),
        (OTG_CONTROL, 0x00),
        *(vendor if vendor[0][0] else []),
        (FUNCTION_CONTROL, FULL_SPEED),
    ]


async def start(dut, ready: bool = True, **phy_settings) -> Link:
    phy = UlpiPhy(dut, **phy_settings)
    inputs = {"ulpi_dir": 1, "ulpi_nxt": 0, "ulpi_data_in": 0, "utmi_tx_valid": 0, "utmi_tx_data": 0}
    await bench.start_clock(
        dut, **inputs, utmi_xcvr_select=1, utmi_term_select=1, utmi_op_mode=0, **({"rst": 1} if not ready else {})
    )
    link = Link(dut, phy)
    if ready:
        await link.until(lambda: int(dut.ready.value), 40000)
        await link.cycles(4)
    return link


# --- set-up


@cocotb.test()
async def set_up_resets_the_phy_and_writes_its_mode(dut):
    link = await start(dut)
    assert link.phy.writes == written_anew(dut)


@cocotb.test()
@cocotb.parametrize(late=[1, 63, 64, 5000])
async def a_phy_that_is_late_or_holds_dir_is_waited_for(dut, late):
    link = await start(dut, late=late)
    assert link.phy.writes == written_anew(dut)


@cocotb.test()
async def a_command_without_nxt_is_given_up_and_tried_again(dut):
    link = await start(dut, deaf=5)
    assert link.phy.deaf == 0 and link.phy.writes == written_anew(dut)


@cocotb.test()
async def until_set_up_the_device_sees_no_session_and_no_packet(dut):
    link = await start(dut, late=50, ready=False)
    link.phy.receive(b"\xa5\x00\x10")
    while not int(dut.ready.value):
        assert int(dut.utmi_session_end.value) and not int(dut.utmi_rx_active.value)
        assert not int(dut.utmi_tx_ready.value)
        await link.cycles(1)
    await link.cycles(2)
    assert not int(dut.utmi_session_end.value)


@cocotb.test()
async def set_up_survives_status_bytes_at_any_moment(dut):
    link = await start(dut, ready=False)
    link.phy.interrupt = 0.2
    while not int(dut.ready.value):
        if random.random() < 0.02:
            link.phy.status(VBUS_VALID | random.randrange(3))
        await link.cycles(1)
    assert link.phy.registers[OTG_CONTROL] == 0 and link.phy.registers[FUNCTION_CONTROL] == FULL_SPEED


# --- modes


@cocotb.test()
async def every_change_of_mode_reaches_the_phy_however_often_it_is_interrupted(dut):
    link = await start(dut, stall=0.5)
    link.phy.interrupt = 0.3
    for _ in range(60):
        wanted = random.choice([FULL_SPEED, HIGH_SPEED, CHIRP])
        link.mode(wanted)
        for _ in range(random.randrange(30)):
            if random.random() < 0.3:
                link.phy.status(VBUS_VALID | random.randrange(3))
            await link.cycles(1)
        await link.until(lambda want=wanted: link.phy.registers[FUNCTION_CONTROL] == want)
    assert link.phy.aborted, "nothing was interrupted"


@cocotb.test()
async def a_chirp_is_sent_without_identifier_and_after_its_mode_is_set(dut):
    link = await start(dut, stall=0.1)
    link.mode(CHIRP)
    await link.cycles(2)
    dut.utmi_tx_data.value = 0
    dut.utmi_tx_valid.value = 1
    await link.cycles(600)
    dut.utmi_tx_valid.value = 0
    await link.until(lambda: link.phy.packets)
    (pid, data) = link.phy.packets[0]
    assert pid == 0 and len(data) > 400 and not any(data)
    assert link.phy.writes[-1] == (FUNCTION_CONTROL, CHIRP)


# --- packets


@cocotb.test()
@cocotb.parametrize(stall=[0.0, 0.3, 0.9])
async def packets_of_the_device_arrive_whole_under_any_stalls(dut, stall):
    link = await start(dut, stall=stall)
    sent = []
    for size in [0, 1, 2, 3, 4, 66, *(random.randrange(40) for _ in range(20))]:
        sent.append(packet(size))
        await link.send(sent[-1])
        wanted = len(sent)
        await link.until(lambda n=wanted: len(link.phy.packets) == n)
        await link.cycles(random.randrange(6))
    assert link.phy.packets == [(p[0] & 0xF, p[1:]) for p in sent]


@cocotb.test()
async def packets_of_the_host_arrive_whole_with_status_bytes_between(dut):
    link = await start(dut)
    sent = []
    for size in [0, 1, 2, 515, *(random.randrange(80) for _ in range(60))]:
        sent.append(packet(size))
        link.phy.receive(sent[-1], gaps=random.choice([0, 0.3, 0.9]), active_by_nxt=random.random() < 0.5)
        if random.random() < 0.5:
            link.phy.status(VBUS_VALID | 1)
    await link.until(lambda: len(link.heard) == len(sent))
    assert link.heard == sent and link.errors == 0


@cocotb.test()
async def both_ways_at_once_lose_only_what_the_phy_interrupted(dut):
    link = await start(dut, stall=0.2)
    link.phy.interrupt = 0.2
    to_host, from_host = [], []
    for _ in range(150):
        to_host.append(packet(random.randrange(30)))
        sending = cocotb.start_soon(link.send(to_host[-1]))
        if random.random() < 0.5:
            await link.cycles(random.randrange(20))
            from_host.append(packet(random.randrange(12)))
            link.phy.receive(from_host[-1], gaps=0.2)
        await sending
        await link.cycles(2)
        await link.until(link.sent)
        await link.cycles(random.randrange(60))
    await link.until(lambda: len(link.heard) == len(from_host))
    assert link.heard == from_host
    whole = [(p[0] & 0xF, p[1:]) for p in to_host]
    remaining = iter(whole)
    assert all(p in remaining for p in link.phy.packets), "a packet that was never sent, or out of order"
    lost = len(whole) - len(link.phy.packets)
    assert link.phy.aborted and 0 < lost <= len(from_host)


@cocotb.test()
async def an_answer_is_within_the_time_a_link_has(dut):
    link = await start(dut)
    link.mode(HIGH_SPEED)
    await link.until(lambda: link.phy.registers[FUNCTION_CONTROL] == HIGH_SPEED)
    for active_by_nxt in (True, False):
        link.phy.receive(b"\x69\x00\x10", active_by_nxt=active_by_nxt)
        heard = len(link.heard)
        await link.until(lambda n=heard: len(link.heard) > n)
        sent = len(link.phy.packets)
        await link.send(b"\x5a")
        await link.until(lambda n=sent: len(link.phy.packets) > n)
        dut._log.info("answer %d cycles after the packet's end", link.phy.latency)
        assert link.phy.latency + DEVICE_DECIDES <= LINK_DECISION


# --- status


@cocotb.test()
async def line_state_session_and_errors_are_told(dut):
    link = await start(dut)
    for line in (1, 2, 0):
        link.phy.status(VBUS_VALID | line)
        await link.until(lambda want=line: int(dut.utmi_line_state.value) == want, 20)
    for vbus, session_end, valid in ((0, 1, 0), (1, 0, 0), (2, 0, 0), (3, 0, 1)):
        link.phy.status(vbus << 2)
        await link.cycles(10)
        assert int(dut.utmi_session_end.value) == session_end and int(dut.utmi_vbus_valid.value) == valid
    link.phy.receive(b"\xc3\x01\x02", error=True)
    await link.until(lambda: link.heard)
    assert link.errors > 0


@cocotb.test()
async def a_transmission_without_nxt_ends_and_the_next_goes_through(dut):
    link = await start(dut)
    link.phy.deaf = 1
    await link.send(b"\xc3" + bytes(3))
    await link.until(lambda: link.phy.deaf == 0)
    await link.cycles(100)
    await link.send(b"\x4b\x01\x02\x03")
    await link.until(lambda: link.phy.packets)
    assert link.phy.packets == [(0xB, b"\x01\x02\x03")]


@pytest.mark.parametrize("vendor", [{}, VENDOR], ids=["plain", "vendor register"])
def test_ulpi(vendor):
    bench.run_bench("ulpi_shim", __file__, "../usb/ulpi_shim.v", parameters=vendor)
