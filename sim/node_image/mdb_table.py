"""Writes a script for mdb, the debugger of MPLAB X, that times the image's interrupts on Microchip's own simulator.

mdb_table.py IMAGE.hex > table.mdb; mdb.sh table.mdb     the cycles by timer 1, and what sim/node_image counts beside them

Never run by this project, which has no MPLAB X: commands as the guide of mdb (DS50002102) has them. The simulator has
no sensor and no bridge: each interrupt is raised once by its flag, 40 ms after power-on, as `image_check handlers` does.
Timer 1, which the firmware leaves alone, counts the cycles from the handler's first instruction to its return.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import paths
import translate

ROOT = Path(__file__).resolve().parents[2]
IRQS = {"INT2": 29, "DMA1": 14, "SPI2 error": 32, "SPI1": 10, "T2": 7, "SPI1 error": 9, "INT1": 20}
IFS0, TMR1, PR1, T1CON, TIMER_ON = 0x84, 0x100, 0x102, 0x104, 0x8000
RETFIE = 0x064000
RETURN_CYCLES = 3  # of the return itself, before which the breakpoint stops


def return_of(words: dict[int, int], entry: int) -> int:
    return next(index for index in range(entry, entry + 64) if words.get(index) == RETFIE)


def script(image: Path, words: dict[int, int], counted: dict[str, int]) -> str:
    """The commands: start-up, then each interrupt with its breakpoints. `counted`: cycles by handler, from here."""
    lines = ["device dsPIC33FJ128MC802", "hwtool sim", f'program "{image}"', "run", "sleep 40", "halt"]
    for name, entry in paths.handlers(words, IRQS).items():
        flag = IFS0 + 2 * (IRQS[name] // 16)
        lines += [
            f"break *{2 * entry:#x}",
            f"break *{2 * return_of(words, entry):#x}",
            f"write /r {flag:#x} {1 << IRQS[name] % 16:#x}",
            "continue",
            "wait 2000",
            f"write /r {PR1:#x} 0xffff",
            f"write /r {TMR1:#x} 0",
            f"write /r {T1CON:#x} {TIMER_ON:#x}",
            "continue",
            "wait 2000",
            f'echo "{name}: {counted[name] - RETURN_CYCLES} cycles in sim/node_image; by the simulator:"',
            "print /d TMR1",
            "delete",
            "continue",
            "sleep 1",
            "halt",
        ]
    return "\n".join([*lines, "quit", ""])


def count(words: dict[int, int], program: Path) -> dict[str, int]:
    """The same interrupts here: cycles to the return, that included."""
    with tempfile.NamedTemporaryFile() as table:
        table.write(translate.table_of(words))
        table.flush()
        environment = os.environ | {"NODE_IMAGE": table.name}
        done = subprocess.run([program, "handlers"], env=environment, capture_output=True, text=True, check=True)
    return dict(zip(IRQS, json.loads(done.stdout), strict=True))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("hex", type=Path)
    parser.add_argument("--build-dir", type=Path, default=ROOT / "build/release")
    options = parser.parse_args()
    try:
        words = translate.flash_words(options.hex)
        counted = count(words, options.build_dir / "sim/node_image/image_check")
        sys.stdout.write(script(options.hex.resolve(), words, counted))
    except (translate.intel_hex.HexError, OSError, subprocess.CalledProcessError) as error:
        print(f"mdb_table: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
