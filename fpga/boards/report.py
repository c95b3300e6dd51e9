"""What a placed design needs, how fast it is, and whether the PHY's pins are met: read from nextpnr's report.

nextpnr constrains no pins, so they are checked here. Its paths know neither the pads nor the clock's way to the flip-flops;
both are in the data sheet's clock-to-pin time, which is added to what comes out. What goes in needs nothing added: the
clock's way to a flip-flop takes longer than a pad's input (the data sheet's set-up time of a pad register is 0).
"""

import json
from pathlib import Path

PERIOD_NS = 1e3 / 60  # of the PHY's clock
# USB3300 data sheet, ULPI in output clock mode: set-up of its inputs, and the latest and earliest change of its outputs.
PHY_SETUP_NS, PHY_OUTPUT_NS, PHY_HOLD_NS = 5.0, 5.0, 2.0
# ECP5 data sheet FPGA-DS-02012, external switching characteristics, tCO: pin of a primary clock to pin of a pad register.
CLOCK_TO_PIN_NS = {6: 6.8, 7: 6.1, 8: 5.4}
SPARE = {8: 1.10}  # of the clock asked for, by speed grade; 1 where it is not listed
USED = {
    "LUT": "TRELLIS_COMB",
    "FF": "TRELLIS_FF",
    "block RAM": "DP16KD",
    "distributed RAM": "TRELLIS_RAMW",
    "pin": "TRELLIS_IO",
}
ASYNC = "<async>"
CLOCKED = {  # cell type: its clock inputs
    "TRELLIS_FF": ("CLK",),
    "DP16KD": ("CLKA", "CLKB"),
    "TRELLIS_DPR16X4": ("WCK",),
}


def read(path: Path) -> dict:
    """The report's numbers: fmax_mhz, used, and the longest paths that touch a pin (in ns; None: there is none)."""
    text = json.loads(path.read_text())
    clocks = [clock["achieved"] for clock in text["fmax"].values()]
    if len(clocks) != 1:
        raise ValueError(f"{path}: {len(clocks)} clocks, one is expected")
    paths: dict[str, float | None] = dict.fromkeys(("out_ns", "in_ns", "through_ns"))
    for found in text["critical_paths"]:
        kind = (found["from"] == ASYNC, found["to"] == ASYNC)
        name = {(False, True): "out_ns", (True, False): "in_ns", (True, True): "through_ns"}.get(kind)
        if name:
            paths[name] = round(sum(step["delay"] for step in found["path"]), 3)
    used = {name: text["utilization"][cell]["used"] for name, cell in USED.items()}
    return {"fmax_mhz": round(clocks[0], 2), "used": used, **paths}


def pin_limits(speed: int, phy_clock: str) -> dict[str, float]:
    """What nextpnr's paths to and from pins may take, in ns.

    A PHY that takes its clock from the FPGA runs late by the clock's own way out, at most the clock-to-pin time: that is
    gained on what goes out (not counted here) and lost on what comes in.
    """
    out = CLOCK_TO_PIN_NS[speed]
    late = out if phy_clock == "out" else 0.0
    return {
        "out_ns": PERIOD_NS - PHY_SETUP_NS - out,
        "in_ns": PERIOD_NS - PHY_OUTPUT_NS - late,
        "through_ns": PERIOD_NS - PHY_OUTPUT_NS - out,
    }


def timing_problems(placed: dict, speed: int, phy_clock: str) -> list[str]:
    """What is missed, a sentence each."""
    wanted = 60 * SPARE.get(speed, 1)
    problems = []
    if placed["fmax_mhz"] < wanted:
        problems.append(f"{placed['fmax_mhz']:.1f} MHz, {wanted:g} wanted")
    for name, limit in pin_limits(speed, phy_clock).items():
        if placed[name] is None:
            problems.append(f"no path of this kind ({name}): nextpnr has not timed the PHY's pins")
        elif placed[name] > limit:
            problems.append(f"a path takes {placed[name]:.1f} ns ({name}), {limit:.1f} are left for it")
    return problems


def unconstrained_clocks(netlist: Path, top: str, clock: str) -> list[str]:
    """Cells of a netlist that another net than the port `clock` clocks."""
    module = json.loads(netlist.read_text())["modules"][top]
    (bit,) = module["ports"][clock]["bits"]
    constants = (["0"], ["1"], ["x"])  # the clock of a memory port that is not used
    return [
        f"{name} is clocked by another net than {clock}"
        for name, cell in module["cells"].items()
        for port in CLOCKED.get(cell["type"], ())
        if cell["connections"].get(port, [bit]) not in ([bit], *constants)
    ]
