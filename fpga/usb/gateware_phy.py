"""Writes a full-speed PHY as Verilog: `gateware_phy.py OUT.v`, for boards whose USB socket goes to pins of the FPGA.

LUNA's PHY samples the pins at 48 MHz and has UTMI at 12 MHz. Here its UTMI side stands still in four cycles of five of a
60 MHz clock, so that the device behind it sees UTMI at 60 MHz, as of any PHY. Both clocks come from one PLL.

    D+, D- <--> pads <--> whisker_fs_phy <-- UTMI, 60 MHz --> whisker_usb
"""

import argparse
import os
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace

os.environ.setdefault("AMARANTH_USE_YOSYS", "builtin")
warnings.filterwarnings("ignore", category=DeprecationWarning)

from amaranth import Cat, ClockDomain, Elaboratable, EnableInserter, Module, Signal  # noqa: E402
from amaranth.back import verilog  # noqa: E402
from amaranth.lib.cdc import FFSynchronizer  # noqa: E402
from luna.gateware.interface.gateware_phy.phy import GatewarePHY  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parent))
from generate import NOTICE  # noqa: E402

CYCLES = 5  # of 60 MHz in one of 12 MHz


class Pin:
    """A pad of the FPGA: what comes in, what goes out, and whether it does."""

    def __init__(self, name: str):
        self.i, self.o, self.oe = Signal(name=f"{name}_i"), Signal(name=f"{name}_o"), Signal(name=f"{name}_oe")


class FullSpeedPhy(Elaboratable):
    """LUNA's PHY behind UTMI at 60 MHz. The pull-up is on while the device wants its full-speed termination."""

    def __init__(self):
        self.d_p, self.d_n, self.pull_up = Pin("d_p"), Pin("d_n"), Signal(name="pull_up")
        self.inputs = {name: Signal(width, name=f"utmi_{name}") for name, width in (("tx_data", 8), ("tx_valid", 1))}
        self.inputs |= {
            name: Signal(width, name=f"utmi_{name}") for name, width in (("xcvr_select", 2), ("op_mode", 2))
        }
        self.inputs["term_select"] = Signal(name="utmi_term_select")
        outputs = (
            ("rx_data", 8),
            ("rx_active", 1),
            ("rx_valid", 1),
            ("rx_error", 1),
            ("tx_ready", 1),
            ("line_state", 2),
        )
        self.outputs = {name: Signal(width, name=f"utmi_{name}") for name, width in outputs}

    def ports(self) -> list[Signal]:
        """Every port but the clocks and the reset."""
        pins = [getattr(pin, end) for pin in (self.d_p, self.d_n) for end in ("i", "o", "oe")]
        return [*pins, self.pull_up, *self.inputs.values(), *self.outputs.values()]

    def elaborate(self, platform):
        m = Module()
        phase = Signal(range(CYCLES))
        moves = Signal()
        phy = GatewarePHY(io=SimpleNamespace(d_p=self.d_p, d_n=self.d_n))
        m.submodules.phy = EnableInserter({"usb": moves})(phy)
        m.submodules.lines = FFSynchronizer(Cat(self.d_p.i, self.d_n.i), self.outputs["line_state"], o_domain="usb")
        m.d.usb += [phase.eq(phase + 1), self.pull_up.eq(self.inputs["term_select"])]
        with m.If(moves):
            m.d.usb += phase.eq(0)
        m.d.comb += [
            moves.eq(phase == CYCLES - 1),
            *(getattr(phy, name).eq(signal) for name, signal in self.inputs.items()),
            *(self.outputs[name].eq(getattr(phy, name)) for name in ("rx_data", "rx_active", "rx_error")),
            *(self.outputs[name].eq(getattr(phy, name) & moves) for name in ("rx_valid", "tx_ready")),
        ]
        return m


def generate() -> str:
    """Verilog text of module whisker_fs_phy."""
    top = Module()
    top.domains.usb, top.domains.usb_io = usb, fast = ClockDomain("usb"), ClockDomain("usb_io")
    usb.clk.name, usb.rst.name, fast.clk.name, fast.rst.name = "clk", "rst", "clk_48", "rst_48"
    top.submodules.phy = phy = FullSpeedPhy()
    ports = [usb.clk, usb.rst, fast.clk, fast.rst, *phy.ports()]
    return NOTICE + verilog.convert(top, name="whisker_fs_phy", ports=ports, strip_internal_attrs=True, emit_src=False)


def main() -> None:
    parser = argparse.ArgumentParser(description="Write a full-speed PHY as Verilog.")
    parser.add_argument("out", type=Path, help="Verilog file to write")
    parser.parse_args().out.write_text(generate())


if __name__ == "__main__":
    main()
