#!/usr/bin/env python3
"""Prints the SHA-256 of the firmware's sources as the chip's compiler sees them: without comments, white space and unused macros.

firmware/images/SOURCES holds that of the committed image, so that a test shows when the sources have changed since.
"""

import hashlib
import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware/dspic"
CHIP = FIRMWARE / "port_dspic/chip"
PROGRAMS = ((), ("NODE_LOADER",))


def preprocessed(source: Path, defines: tuple[str, ...]) -> str:
    includes = [f"-I{folder}" for folder in (CHIP / "libc", FIRMWARE, FIRMWARE / "core", FIRMWARE / "port_dspic")]
    command = [
        "cc",
        "-E",
        "-P",
        "-nostdinc",
        "-undef",
        "-std=gnu99",
        "-D__dsPIC33F__",
        *(f"-D{name}" for name in defines),
    ]
    command += [*includes, f"-I{ROOT / 'protocol/gen'}", str(source)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def source_hash() -> str:
    """Hexadecimal. Needs any C preprocessor as `cc`."""
    texts = [(CHIP / "node.gld").read_text(), *(path.read_text() for path in sorted(CHIP.glob("*.s")))]
    for source in sorted(
        path for folder in ("core", "boot", "port_dspic", "port_dspic/chip") for path in FIRMWARE.glob(f"{folder}/*.c")
    ):
        texts += [preprocessed(source, program) for program in PROGRAMS]
    return hashlib.sha256(re.sub(r"\s+", " ", " ".join(texts)).encode()).hexdigest()


if __name__ == "__main__":
    print(source_hash())
