"""A ULPI PHY as its specification draws it (ULPI 1.1, section 3.8): its outputs follow each clock edge, and it takes a byte
of the link at an edge before which it held nxt high. It checks what the link may not do and keeps what the link said."""

import random
from collections import deque

IDLE, TRANSMIT, WRITE = 0, 1, 2  # top bits of a command
FUNCTION_CONTROL, OTG_CONTROL = 0x04, 0x0A
RESET = 0x20  # bit of function control
RX_ACTIVE, VBUS_VALID = 0x10, 0x0C  # bits of RXCMD


class UlpiPhy:
    """Runs against an `ulpi_shim`. `receive(...)` and `status(...)` queue what the PHY has to say; `packets`, `aborted` and
    `registers` hold what came from the link; `stall` is the chance that nxt stays low for a cycle; `deaf` commands at the
    beginning get no nxt."""

    RESET_CYCLES = 200

    def __init__(self, dut, stall: float = 0.0, late: int = 0, deaf: int = 0):
        self.dut, self.stall, self.deaf = dut, stall, deaf
        self.waiting = deque()  # (dir, nxt, data) per cycle
        self.busy = late  # cycles during which dir is high and nothing is said
        self.registers, self.writes = {OTG_CONTROL: 0x06, FUNCTION_CONTROL: 0x41}, []
        self.packets, self.aborted = [], []
        self.before = (1, 0)  # dir and nxt that the link saw at the edge
        self.let_go = 1  # the pads of the link, which drive from the second cycle in which dir is low
        self.turnaround = False  # dir rose only now: what the link shows it decided before
        self.command, self.bytes = None, []
        self.interrupt = None  # a chance per cycle of an RXCMD in the midst of what the link does
        self.line = 0
        self.latency = None  # cycles from the end of the last packet to the link's next command
        self.quiet = 0

    # --- what the PHY says

    def status(self, value: int) -> None:
        """An RXCMD of its own: turnaround, the byte, turnaround."""
        self.waiting.extend([(1, 0, None), (1, 0, value)])
        self.line = value & 3

    def receive(self, packet: bytes, gaps: float = 0.0, active_by_nxt: bool = True, error: bool = False) -> None:
        """A packet from the bus, with RXCMDs between its bytes at random (ULPI 1.1, figure of 3.8.2.1)."""
        status = VBUS_VALID | RX_ACTIVE | 1
        self.waiting.append((1, int(active_by_nxt), None))
        if not active_by_nxt:
            self.waiting.append((1, 0, status))
        for byte in packet:
            while random.random() < gaps:
                self.waiting.append((1, 0, status))
            self.waiting.append((1, 1, byte))
        if error:
            self.waiting.append((1, 0, status | 0x20))
        if not active_by_nxt or random.random() < 0.5:
            self.waiting.append((1, 0, VBUS_VALID | self.line))

    # --- what the link says

    def edge(self) -> None:
        """One rising edge: the levels before it are what both sides sampled."""
        was_dir, was_nxt = self.before
        drives, stp = not (was_dir or self.let_go), int(self.dut.ulpi_stp.value)
        self.let_go = was_dir
        data = int(self.dut.ulpi_data_out.value) if drives else 0
        if not was_dir:
            self.listen(data, was_nxt, stp)
        else:
            assert not stp or self.turnaround, "stp while the PHY has the bus"
        self.turnaround = not was_dir
        self.before = self.speak(was_dir)

    def listen(self, data: int, was_nxt: int, stp: int) -> None:
        self.quiet += 1
        if stp:
            self.finish()
        elif self.command is None and data:
            assert data >> 6 in (TRANSMIT, WRITE), f"unknown command {data:02x}"
            self.command, self.bytes = data, None
            self.latency, self.quiet = self.quiet, 0
        if self.command is not None and was_nxt and not stp:
            if self.bytes is None:
                assert data == self.command, "a command must stay until nxt"
                self.bytes = []
            else:
                self.bytes.append(data)

    def finish(self) -> None:
        command, self.command = self.command, None
        if command is None or self.bytes is None:
            self.deaf = max(self.deaf - 1, 0)
            return  # it gave up
        if command >> 6 == TRANSMIT:
            self.packets.append((command & 0xF, bytes(self.bytes)))
            return
        assert len(self.bytes) == 1, "a register write has one byte"
        address, value = command & 0x3F, self.bytes[0]
        self.registers[address] = value & ~RESET if address == FUNCTION_CONTROL else value
        self.writes.append((address, value))
        if address == FUNCTION_CONTROL and value & RESET:
            self.registers = {OTG_CONTROL: 0x06, FUNCTION_CONTROL: 0x41}
            self.busy = self.RESET_CYCLES

    def speak(self, was_dir: int) -> tuple[int, int]:
        if self.busy:
            self.busy -= 1
            self.drive(1, 0, 0)
            if not self.busy:
                self.status(VBUS_VALID | self.line)
            return 1, 0
        begins = self.waiting and self.waiting[0][2] is None  # wants a turnaround first
        if begins and was_dir:
            self.quiet = 0
            return self.drive(0, 0, 0)
        if self.waiting and (was_dir or self.may_begin()):
            return self.say(*self.waiting.popleft())
        if was_dir:
            self.quiet = 0
            return self.drive(0, 0, 0)
        return self.drive(0, int(self.takes()), 0)

    def may_begin(self) -> bool:
        """A packet from the bus waits for the link's own unless it shall interrupt it."""
        if self.command is None:
            return True
        return self.interrupt is not None and random.random() < self.interrupt

    def say(self, dir_: int, nxt: int, data: int | None) -> tuple[int, int]:
        if self.command is not None:
            self.aborted.append(self.command)
            self.command = None
        return self.drive(dir_, nxt, random.randrange(256) if data is None else data)

    def takes(self) -> bool:
        if self.command is None:
            return False
        if self.deaf and self.bytes is None:
            return False
        return random.random() >= self.stall

    def drive(self, dir_: int, nxt: int, data: int) -> tuple[int, int]:
        self.dut.ulpi_dir.value = dir_
        self.dut.ulpi_nxt.value = nxt
        self.dut.ulpi_data_in.value = data
        return dir_, nxt
