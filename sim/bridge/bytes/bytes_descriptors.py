"""Writes the bridge's descriptors as C++: `bytes_descriptors.py OUT.cpp`, for the bridge at level bytes.

They have one home, fpga/usb/descriptors.py: from it the gateware's ROM is made, and this table, so no Verilated model has
to run for the other level to be built. A test compares what both devices answer.
"""

import argparse
import sys
import warnings
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "fpga/usb"))
warnings.filterwarnings("ignore", category=DeprecationWarning)  # LUNA's, about Amaranth's

from descriptors import Build, descriptors  # noqa: E402


def table(build: Build) -> str:
    """The text of the source file: one entry per descriptor, by type and index."""
    rows = [
        f"    {{{kind}, {index}, {{{', '.join(str(byte) for byte in bytes(raw))}}}}},\n"
        for kind, index, raw in descriptors(build)
    ]
    head = '#include "bytes_descriptors.h"\n\nnamespace bridge_sim\n{\n\n'
    return f"{head}const std::vector<Descriptor> DESCRIPTORS = {{\n{''.join(rows)}}};\n\n}} // namespace bridge_sim\n"


def main() -> None:
    parser = argparse.ArgumentParser(description="Write the bridge's descriptors as C++.")
    parser.add_argument("out", type=Path, help="source file to write")
    parser.parse_args().out.write_text(table(Build()))


if __name__ == "__main__":
    main()
