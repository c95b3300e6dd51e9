"""A serial NOR flash as its data sheets have it (W25Q64JV and its like): write enable latch, pages that wrap, erase to 0xFF, a
time in which it is busy and hears nothing but the question whether it is; and what a cut of power leaves."""

import random

from cocotb.triggers import First, ValueChange
from cocotb.utils import get_sim_time

PAGE, SECTOR, SIZE = 256, 4096, 1 << 24
ENABLE, STATUS, IDENTIFY, READ, ERASE, PROGRAM = 0x06, 0x05, 0x9F, 0x03, 0x20, 0x02
IDENTITY = bytes([0xEF, 0x40, 0x17])
BUSY = 1


class Chip:
    """`content` by address, erased where it is silent; `busy_for`: transactions that an erase or a program lasts; `wrong`: what
    no data sheet allows, a line each; `heard`: opcodes."""

    def __init__(self, dut, busy_for: int = 2):
        self.dut, self.busy_for = dut, busy_for
        self.content: dict[int, int] = {}
        self.wrong: list[str] = []
        self.heard: list[int] = []
        self.enabled, self.busy = False, 0
        self.under_way: set[int] = set()  # what an erase or a program that has not ended may change
        self.off = False

    def bytes_at(self, address: int, count: int) -> bytes:
        return bytes(self.content.get(address + n, 0xFF) for n in range(count))

    def cut(self) -> None:
        """Power goes and comes: what was under way is anything."""
        for address in self.under_way:
            self.content[address] = random.getrandbits(8)
        self.under_way, self.enabled, self.busy, self.off = set(), False, 0, not int(self.dut.flash_cs_n.value)

    async def run(self) -> None:
        """Serves transactions for ever."""
        while True:
            if int(self.dut.flash_cs_n.value):
                await ValueChange(self.dut.flash_cs_n)
                continue
            received = await self._transaction()
            if received and not self.off:
                self._act(received)
            self.off = False

    async def _transaction(self) -> list[int]:
        """Bytes that came until select ended; a part of one is an offence."""
        dut, received, bits, out = self.dut, [], [], []
        while True:
            await First(ValueChange(dut.flash_sck), ValueChange(dut.flash_cs_n))
            if int(dut.flash_cs_n.value):
                if not self.off and (bits or int(dut.flash_sck.value)):
                    self.wrong.append("select ended within a byte")
                return received
            if int(dut.flash_sck.value):
                bits.append(int(dut.flash_mosi.value))
                if len(bits) == 8:
                    received.append(int("".join(map(str, bits)), 2))
                    bits, out = [], self._answer(received)
            else:  # the host reads after the falling edge's bit has come
                dut.flash_miso.value = out.pop(0) if out else random.getrandbits(1)

    def _answer(self, received: list[int]) -> list[int]:
        """Bits of the byte that follows, highest first."""
        opcode, count = received[0], len(received)
        if opcode == STATUS:
            byte = BUSY if self.busy else 0
        elif self.busy:
            return []
        elif opcode == IDENTIFY and count <= len(IDENTITY):
            byte = IDENTITY[count - 1]
        elif opcode == READ and count >= 4:
            byte = self.content.get((int.from_bytes(bytes(received[1:4]), "big") + count - 4) % SIZE, 0xFF)
        else:
            return []
        return [byte >> n & 1 for n in range(7, -1, -1)]

    def _act(self, received: list[int]) -> None:
        """What a transaction does at its end."""
        opcode, *rest = received
        self.heard.append(opcode)
        if opcode == STATUS:
            self.busy = max(0, self.busy - 1)
            self.under_way = self.under_way if self.busy else set()
            return
        if self.busy:
            self.wrong.append(f"opcode {opcode:#04x} while busy")
        elif opcode == ENABLE:
            self.enabled = True
        elif opcode in (ERASE, PROGRAM):
            self._write(opcode, int.from_bytes(bytes(rest[:3]), "big"), rest[3:])
        elif opcode not in (IDENTIFY, READ):
            self.wrong.append(f"opcode {opcode:#04x}")

    def _write(self, opcode: int, address: int, data: list[int]) -> None:
        if not self.enabled:
            self.wrong.append(f"opcode {opcode:#04x} without write enable")
            return
        if opcode == ERASE:
            start = address - address % SECTOR
            self.under_way = set(range(start, start + SECTOR))
            for place in self.under_way:
                self.content.pop(place, None)
        else:
            page = address - address % PAGE
            places = [page + (address + n) % PAGE for n in range(len(data))]
            self.under_way = set(places)
            for place, byte in zip(places, data, strict=True):
                self.content[place] = self.content.get(place, 0xFF) & byte
        self.enabled, self.busy = False, self.busy_for


async def watch_pins(dut, cycle_ps: int, wrong: list[str]) -> None:
    """Times at the pins, in cycles of 60 MHz: SCK at most 7.5 MHz, select high for 0.1 us at least, MOSI still while SCK rises."""
    since = {}
    while True:
        changed = await First(*(ValueChange(pin) for pin in (dut.flash_cs_n, dut.flash_sck, dut.flash_mosi)))
        pin, now = (
            changed.signal._name,
            round(2 * get_sim_time("ps") / cycle_ps) / 2,
        )  # pins change with an edge of the clock
        before, since[pin] = since.get((pin, int(changed.signal.value)), now - 100), now
        since[pin, int(changed.signal.value)] = now
        if pin == "flash_sck" and int(dut.flash_sck.value):
            wrong += ["SCK is too fast"] if now - before < 8 else []
            wrong += ["MOSI moves as SCK rises"] if now - since.get("flash_mosi", 0) < 3 else []
        if pin == "flash_cs_n" and not int(dut.flash_cs_n.value):
            wrong += ["select was high too briefly"] if now - since.get((pin, 1), -100) < 6 else []
