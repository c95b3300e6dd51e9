"""What a placed design needs, how fast it is, and whether the PHY's pins are met: read from nextpnr's report.

nextpnr constrains no pins, so they are checked here. Its paths know neither the pads nor the clock's way to the flip-flops;
both are in the data sheet's clock-to-pin time, which is added to what comes out. What goes in needs nothing added: the
clock's way to a flip-flop takes longer than a pad's input (the data sheet's set-up time of a pad register is 0). DATA comes in
through a delay line to a register in the pad's cell, which nextpnr does not time: the data sheet's figures stand for it.
"""

import json
from dataclasses import dataclass
from pathlib import Path

from whisker_protocol import LIMITS

CLOCK_MHZ = LIMITS["clock_hz"] / 1e6
PERIOD_NS = 1e3 / CLOCK_MHZ


@dataclass(frozen=True)
class Phy:
    """ULPI at a PHY's pins, in ns from the edge at its clock pin: set-up and hold of what it takes in; its own outputs change
    between `earliest` and `latest`. `clock_out`: it takes the clock from the FPGA."""

    setup: float
    hold: float
    earliest: float
    latest: float
    clock_out: bool


GATEWARE = "gateware"  # no PHY
UNJUDGED = {  # PHYs whose pins have no limits here, and why
    GATEWARE: "a full-speed bit takes four samples",
    "USB3317": "no clock-to-pin time of its FPGA is known",
}
PHYS = {
    # USB3300 data sheet, ULPI output clock mode; Intel's AN 702, table 3, repeats it
    "USB3300": Phy(setup=5.0, hold=0.0, earliest=2.0, latest=5.0, clock_out=False),
    # USB334x data sheet rev. 1.2, table 4.4, 60 MHz ULPI input clock
    "USB3343": Phy(setup=3.0, hold=0.0, earliest=0.5, latest=6.0, clock_out=True),
}


@dataclass(frozen=True)
class Pads:
    """A speed grade's pad registers, in ns between the pin of a primary clock and the pad: clock to output, hold of an input
    without delay line, set-up of one behind SCLK_ZEROHOLD. Set-up without delay line and hold behind one are 0."""

    clock_to_pin: float
    hold: float
    delayed_setup: float


# ECP5 data sheet FPGA-DS-02012, external switching characteristics, tCO, tH and tSU_DEL without PLL. LFE5UM5G has no rows of
# its own there: grade 8 stands for it.
PADS = {
    6: Pads(clock_to_pin=6.8, hold=3.3, delayed_setup=1.46),
    8: Pads(clock_to_pin=5.4, hold=2.7, delayed_setup=1.2),
}
SPARE = {8: 1.10}  # of the clock asked for, by speed grade; 1 where it is not listed
USED = {  # ECP5's and Gowin's names
    "LUT": ("TRELLIS_COMB", "LUT4"),
    "FF": ("TRELLIS_FF", "DFF"),
    "block RAM": ("DP16KD", "BSRAM"),
    "distributed RAM": ("TRELLIS_RAMW", "RAM16SDP4"),
    "pin": ("TRELLIS_IO", "IOB"),
}
ASYNC = "<async>"
SOURCES = {
    "OSCG": ("OSC",),
    "OSC": ("OSCOUT",),
    "EHXPLLL": ("CLKOP", "CLKOS"),
}  # cells that make a clock which nextpnr knows
CLOCKED = {  # cell type: its clock inputs
    "TRELLIS_FF": ("CLK",),
    "DP16KD": ("CLKA", "CLKB"),
    "TRELLIS_DPR16X4": ("WCK",),
    **{f"DFF{kind}{enable}": ("CLK",) for kind in ("", "S", "R", "P", "C") for enable in ("", "E")},
    **dict.fromkeys(("RAM16SDP4", "SP", "SPX9"), ("CLK",)),
    **dict.fromkeys(("SDPB", "SDPX9B", "DPB", "DPX9B"), ("CLKA", "CLKB")),
}


def read(path: Path) -> dict:
    """The report's numbers: fmax_mhz, used, `slow`: other clocks that miss what is wanted of them, the longest paths that touch a pin, and the shortest from a pin to a flip-flop
    (in ns; None: there is none)."""
    text = json.loads(path.read_text())
    ours = [name for name, found in text["fmax"].items() if round(found["constraint"]) == CLOCK_MHZ]
    clock = min(ours, key=lambda name: text["fmax"][name]["achieved"])
    slow = [name for name, found in text["fmax"].items() if name != clock and found["achieved"] < found["constraint"]]
    paths: dict[str, float | None] = dict.fromkeys(("out_ns", "in_ns", "through_ns"))
    for found in text["critical_paths"]:
        ends = (found["from"], found["to"])
        kind = tuple(end if end == ASYNC else clock if end == f"posedge {clock}" else "" for end in ends)
        name = {(clock, ASYNC): "out_ns", (ASYNC, clock): "in_ns", (ASYNC, ASYNC): "through_ns"}.get(kind)
        if name:
            paths[name] = round(sum(step["delay"] for step in found["path"]), 3)
    cells = text["utilization"]
    used = {name: next(cells[cell]["used"] for cell in kinds if cell in cells) for name, kinds in USED.items()}
    return {
        "fmax_mhz": round(text["fmax"][clock]["achieved"], 2),
        "used": used,
        **paths,
        "shortest_in_ns": shortest_in(text),
        "slow": slow,
    }


def shortest_in(text: dict) -> float | None:
    """The shortest way from a pin to a flip-flop outside the pads, by nextpnr's least delays, in ns; None: there is none.

    The report names a net's start once. Where ways from pins and from flip-flops meet in a net, each of its ends is listed
    twice, always in the same order, first for the start that is named.
    """
    ways = []
    for net in text.get("detailed_net_timings", []):
        seen = set()
        for end in net["endpoints"]:
            place = (end["cell"], end["port"], end["event"])
            from_pin = (net["event"] == ASYNC) != (place in seen)
            seen.add(place)
            if from_pin and end["event"] != ASYNC:
                ways.append(end["delay"][0])
    return round(min(ways), 3) if ways else None


def pin_limits(speed: int, phy: str) -> dict[str, float]:
    """What nextpnr's paths to and from pins may take, in ns.

    A PHY that takes its clock from the FPGA runs late by the clock's own way out, at most the clock-to-pin time: that is
    gained on what goes out (not counted here) and lost on what comes in.
    """
    if phy in UNJUDGED:
        return {}
    out, phy_ = PADS[speed].clock_to_pin, PHYS[phy]
    return {
        "out_ns": PERIOD_NS - phy_.setup - out,
        "in_ns": PERIOD_NS - phy_.latest - late(speed, phy),
        "through_ns": PERIOD_NS - phy_.latest - out,
    }


def late(speed: int, phy: str) -> float:
    """The most by which the PHY's clock runs behind the FPGA's, in ns."""
    return PADS[speed].clock_to_pin if PHYS[phy].clock_out else 0.0


def data_spare(speed: int, phy: str) -> dict[str, float]:
    """What DATA has to spare on its way in, in ns: before the edge and after it, the data sheets' figures alone."""
    if phy in UNJUDGED:
        return {}
    before = PERIOD_NS - PHYS[phy].latest - late(speed, phy) - PADS[speed].delayed_setup
    return {"data_setup_ns": before, "data_hold_ns": PHYS[phy].earliest}


def hold_needed(speed: int, phy: str) -> float:
    """How long the shortest way in from a pin without delay line must be, in ns.

    To a pad register it may be 0 if the pin holds for `hold`; the PHY holds for `earliest`, the way must do the rest. A PHY
    that takes its clock from the FPGA changes its outputs later than that by the clock's way out, which is longer than the
    clock's way to any flip-flop: nothing is left to do.
    """
    return 0.0 if PHYS[phy].clock_out else PADS[speed].hold - PHYS[phy].earliest


def timing_problems(placed: dict, speed: int, phy: str) -> list[str]:
    """What is missed, a sentence each."""
    wanted = CLOCK_MHZ * SPARE.get(speed, 1)
    problems = []
    if placed["fmax_mhz"] < wanted:
        problems.append(f"{placed['fmax_mhz']:.1f} MHz, {wanted:g} wanted")
    for name, limit in pin_limits(speed, phy).items():
        if placed[name] is None:
            problems.append(f"no path of this kind ({name}): nextpnr has not timed the PHY's pins")
        elif placed[name] > limit:
            problems.append(f"a path takes {placed[name]:.1f} ns ({name}), {limit:.1f} are left for it")
    problems += [f"{name}: {spare:.1f} ns" for name, spare in data_spare(speed, phy).items() if spare < 0]
    problems += [f"{name} is too slow" for name in placed["slow"]]
    if phy in UNJUDGED:
        return problems
    shortest, needed = placed["shortest_in_ns"], hold_needed(speed, phy)
    if shortest is None or shortest < needed:
        problems.append(f"the shortest way in takes {shortest} ns, {needed:.1f} are needed to hold")
    return problems


def unconstrained_clocks(netlist: Path, top: str, clock: str) -> list[str]:
    """Cells of a netlist that another net than the port `clock` clocks."""
    module = json.loads(netlist.read_text())["modules"][top]
    (bit,) = module["ports"][clock]["bits"]
    buffers = [cell["connections"] for cell in module["cells"].values() if cell["type"] == "IBUF"]
    bit = next((pins["O"][0] for pins in buffers if pins["I"] == [bit]), bit)  # Gowin's netlists name the pads
    constants = (["0"], ["1"], ["x"])  # the clock of a memory port that is not used
    cells = module["cells"].values()
    own = [cell["connections"][port] for cell in cells for port in SOURCES.get(cell["type"], ())]
    return [
        f"{name} is clocked by another net than {clock}"
        for name, cell in module["cells"].items()
        for port in CLOCKED.get(cell["type"], ())
        if cell["connections"].get(port, [bit]) not in ([bit], *own, *constants)
    ]
