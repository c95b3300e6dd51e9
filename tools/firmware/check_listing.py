#!/usr/bin/env python3
"""Looks through a disassembly of the node's firmware: no library routine where a sample passes, no interrupt flag lost.

check_listing.py LISTING: exit 1, with a line per finding, if a function between SYNC and an armed record calls one of the
compiler's helpers (float, 32-bit division or multiplication), or changes a flag register (IFS0 to IFS4) by reading it,
changing the copy and writing it back: a flag that the hardware sets in between would be gone. One bit or mask in one
instruction is what the accessors of sfr.h are to become. On standard output: instructions and cycles of each such function,
every instruction once and no branch taken: less than it takes where it loops, more where it leaves early. These figures
take the place of simavr's in docs/hardware.md.
"""

import re
import sys
from pathlib import Path

SAMPLE_PATH = re.compile(
    r"_(port_on_\w+|node_on_\w+|sampler_on_\w+|sensor_frame_\w+|record_pack|order_parse|board_(link|sensor|timer)_\w+"
    r"|_(INT[12]|T2|SPI[12](Err)?|DMA1)Interrupt)$"
)
HELPER = re.compile(r"<?(_{2,3}(u?div|u?mod|mul|add|sub|float|fix|lt|gt|le|ge|eq|ne|neg|cmp)\w*(si|di|sf|df|hi)\w*)>?")
FUNCTION = re.compile(r"^\s*[0-9a-f]+ <(\w+)>:")
CALL = re.compile(r"\b(r?call|goto|bra)\b(.*)$")
IFS = "0x0*8[4-9a-dA-D]"  # IFS0 0x0084 to IFS4 0x008C
INSTRUCTION = re.compile(r"^\s*[0-9a-f]+:\s+(?:[0-9a-f]{2} ){3}\s*([a-z]+(?:\.[a-z])?)\b")
# Cycles besides 1 (dsPIC30F/33F programmer's reference manual, DS70157: table of instructions, C); divisions stand behind REPEAT.
CYCLES = {"call": 2, "rcall": 2, "goto": 2, "return": 3, "retlw": 3, "retfie": 3, "mov.d": 2, "do": 2, "repeat": 18}
CYCLES |= {name: 2 for name in ("tblrdl", "tblrdh", "tblwtl", "tblwth", "tblrdl.w", "tblrdh.w", "tblwtl.w", "tblwth.w")}
WRITTEN_BACK = re.compile(rf"\bmov(?:\.\w)?\s+w\d+,\s*{IFS}\b|\bmov(?:\.\w)?\s+#{IFS},\s*w\d+")


def findings(text: str) -> list[str]:
    found, function = [], ""
    for line in text.splitlines():
        if begins := FUNCTION.match(line):
            function = begins.group(1)
        elif (call := CALL.search(line)) and (helper := HELPER.search(call.group(2))) and SAMPLE_PATH.match(function):
            found.append(f"{function} calls {helper.group(1)}")
        elif WRITTEN_BACK.search(line) and SAMPLE_PATH.match(function):
            found.append(f"{function} writes an interrupt flag register back as a whole")
    return found


def passes(text: str) -> dict[str, tuple[int, int]]:
    """Instructions and cycles of one straight pass through each function of the sample path."""
    out, function = {}, ""
    for line in text.splitlines():
        if begins := FUNCTION.match(line):
            function = begins.group(1)
        elif (instruction := INSTRUCTION.match(line)) and SAMPLE_PATH.match(function):
            count, cycles = out.get(function, (0, 0))
            out[function] = count + 1, cycles + CYCLES.get(instruction.group(1), 1)
    return out


def main() -> int:
    text = Path(sys.argv[1]).read_text()
    found = findings(text)
    for name, (count, cycles) in passes(text).items():
        print(f"{name} {count} instructions, {cycles} cycles")
    if not any(SAMPLE_PATH.match(name) for name in re.findall(r"<(\w+)>:", text)):
        found.append("no function of the sample path is in it; is it a disassembly with symbols?")
    for line in found:
        print(f"check_listing: {sys.argv[1]}: {line}", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
