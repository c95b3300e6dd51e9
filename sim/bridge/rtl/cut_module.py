"""Cuts a module out of generated Verilog, to be a model of its own: `cut_module.py VERILOG MODULE OUT`.

OUT.v has a module of the same name and ports and nothing in it, whose outputs the simulation writes; OUT.h lists the
ports by the names that Verilator gives them, as macros that apply another one to each: inputs less the clock, outputs.
"""

import re
import sys
from pathlib import Path

CLOCK = "clk"


def ports(text: str, module: str) -> list[tuple[str, str, str]]:
    """Direction, range (with its space, or empty) and name of each port, in order. ValueError: no such module."""
    found = re.search(rf"^module \\{re.escape(module)} \((.*?)\);(.*?)^endmodule", text, re.MULTILINE | re.DOTALL)
    if not found:
        raise ValueError(f"no module {module}")
    listed = [name.strip() for name in found[1].split(",")]
    declared = re.findall(r"^  (input|output) (\[\d+:0\] )?(\S+) ?;", found[2], re.MULTILINE)
    by_name = {name: (direction, width, name) for direction, width, name in declared}
    if by_name.keys() != set(listed):
        raise ValueError(f"module {module}: ports without a declaration, or the other way round")
    return [by_name[name] for name in listed]


def verilated(name: str) -> str:
    """Verilator's name of an escaped identifier."""
    return name.removeprefix("\\").replace("$", "__024")


def main() -> None:
    source, module, out = sys.argv[1:]
    found = ports(Path(source).read_text(), module)
    lines = [
        f"    {direction} {'wire' if direction == 'input' else 'reg'} {width}{name} "
        f"/* verilator public_flat_{'rd' if direction == 'input' else 'rw'} */"
        for direction, width, name in found
    ]
    text = f"module \\{module} (\n" + ",\n".join(lines) + "\n);\nendmodule\n"
    Path(f"{out}.v").write_text(text)
    header = "#pragma once\n"
    for macro, wanted in (("CUT_INPUTS", "input"), ("CUT_OUTPUTS", "output")):
        names = [verilated(name) for direction, _, name in found if direction == wanted and name != CLOCK]
        header += f"#define {macro}(each) " + " ".join(f"each({name})" for name in names) + "\n"
    Path(f"{out}.h").write_text(header)


if __name__ == "__main__":
    main()
