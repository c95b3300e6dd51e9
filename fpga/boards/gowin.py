"""Bitstreams for Gowin's GW2A: what of `build.py` is the FPGA's own. Yosys synthesises, nextpnr's Himbaechel places and routes,
apycula's gowin_pack packs.

Pins stay unjudged: nextpnr knows no clock-to-pin times of this family.
"""

from pathlib import Path

from toolchain import must

LIBRARIES = "+/gowin/cells_sim.v +/gowin/cells_xtra_gw2a.v"
# Pins of a board that configuration uses too, and that are ours when it is over.
FREED = ("sspi", "ready", "done")
PULLS = {"miso": "UP", "tick_in": "DOWN"}  # by the port's beginning


def is_gowin(device: str) -> bool:
    """Whether a board's `device` is one of theirs."""
    return device.startswith("GW")


def constraints(sites: dict[str, str]) -> str:
    """The CST file: sites, 3.3 V, pull-ups on the lanes."""
    lines = []
    for bit, site in sites.items():
        # nextpnr names the only wire of a port by the port; ECP5's knows both names.
        port = bit if bit.replace("[0]", "[1]") in sites else bit.removesuffix("[0]")
        pull = next((pull for start, pull in PULLS.items() if port.startswith(start)), "NONE")
        lines.append(f'IO_LOC "{port}" {site};')
        lines.append(f'IO_PORT "{port}" IO_TYPE=LVCMOS33 PULL_MODE={pull};')
    return "\n".join(lines) + "\n"


def synthesise(top: str, front: list[str], out: Path) -> Path:
    """Netlist of `top`; `front`: Yosys commands that read and check the design."""
    steps = [*front, f"synth_gowin -top {top} -family gw2a -json netlist.json"]
    (out / "synth.ys").write_text("\n".join(steps) + "\n")
    must("yosys", "-q", "-s", "synth.ys", log=out / "synth.log")
    return out / "netlist.json"


def place(board, sites: dict[str, str], netlist: Path, out: Path, seed: int) -> Path:
    """Places and routes; nextpnr's report. The oscillator is held to the same clock as the rest. A missed clock is no error here: it is in the report."""
    (out / "pins.cst").write_text(constraints(sites))
    result = f"report_{seed}.json"
    options = ["--json", netlist.name, "--write", f"{board.name}.json", "--freq", board.clock_mhz, "--seed", seed]
    options += ["--device", board.part, "--vopt", f"family={board.device}", "--vopt", "cst=pins.cst"]
    options += ["--vopt", "sspi_as_gpio", "--report", result, "--timing-allow-fail"]
    must("nextpnr-himbaechel-gowin", *options, log=out / f"place_{seed}.log")
    return out / result


def pack(board, out: Path) -> Path:
    """The bitstream of what was placed last."""
    names = ["-d", board.device, "-o", f"{board.name}.fs", f"{board.name}.json"]
    must("gowin_pack", *(f"--{name}_as_gpio" for name in FREED), *names, log=out / "pack.log")
    return out / f"{board.name}.fs"
