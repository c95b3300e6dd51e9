"""Makes a board's bitstream with open tools: `build.py BOARD`. Yosys synthesises, nextpnr places and routes, ecppack packs;
for Gowin's FPGAs see gowin.py.

Every step is also a function for tests and benches. Files go to build/boards/BOARD/: netlist.json, report.json, and the bitstream:
BOARD.bit, or BOARD.fs for Gowin's; BOARD-testid.bit or .fs where it has the USB id for private tests.
"""

import argparse
import json
import re
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPO = HERE.parents[1]
sys.path[:0] = [str(HERE), str(HERE.parent)]

import gowin  # noqa: E402
import image  # noqa: E402
import report  # noqa: E402
from toolchain import ToolError, gather, must  # noqa: E402

LIBRARIES = "+/lattice/cells_sim_ecp5.v +/lattice/cells_bb_ecp5.v"
INCLUDES = (REPO / "fpga/bridge_rtl/crc8.vh", REPO / "protocol/gen/whisker_protocol.vh")
# Registers that lie in the pad's own cell: a route between them and the pad would eat the PHY's set-up time, spread the
# nodes' lines, and behind a delay line it would not be timed.
NODE_REGISTERS = ("*lane_receiver*/w:sampled",)
NODE_REGISTERS += tuple(f"node_link/w:{name}" for name in ("sync", "sck", "select_n", "mosi"))
NODE_REGISTERS += ("tick_generator/w:tick_out", "tick_input/w:pin")
PHY_REGISTERS = tuple(f"*ulpi_shim*/w:{name}" for name in ("ulpi_data_out", "ulpi_stp", "data"))


FLASH_REGISTERS = tuple(f"*flash_control*/w:{name}" for name in ("flash_cs_n", "flash_mosi", "miso"))
# Vendor and product as USB_ID= gives them. Without, the test id: what is made then is for private tests only.
USB_ID = re.compile("[0-9a-fA-F]{4}:[0-9a-fA-F]{4}")
FLASH_PORTS = ("flash_cs_n", "flash_mosi", "flash_miso", "flash_high")


@dataclass(frozen=True)
class Board:
    """A board's file: `top` is its module, `phy` one of report.PHYS or report.UNJUDGED; `number` the protocol's for it,
    `milliamps` what it draws from the host's socket; `clock` the port of its clock; `pins` maps a port to a site, or a vector to
    its sites, bit 0 first. `flash`: what a host may write of the configuration flash, from address 0 on, in sectors of 64 KiB;
    0: nothing; `flash_mbit` is its size in Mbit, as far as 24 bits of address reach."""

    name: str
    title: str
    top: str
    device: str
    part: str
    package: str
    speed: int
    lanes: int
    phy: str
    number: int
    self_powered: bool
    milliamps: int
    pins: dict[str, str | list[str]]
    clock: str = "clk_60"
    clock_mhz: float = report.CLOCK_MHZ
    flash: int = 0
    flash_mbit: int = 0


def boards() -> list[str]:
    """Names of the boards there are."""
    return sorted(path.stem for path in HERE.glob("*.toml"))


def load(name: str) -> Board:
    """The board's file, and what it lacks from the one that it is `like`; ToolError if there is none."""
    path = HERE / f"{name}.toml"
    if not path.exists():
        raise ToolError(f"no board '{name}'; boards: {', '.join(boards())}")
    said = tomllib.loads(path.read_text())
    if "like" in said:
        base = tomllib.loads((HERE / f"{said.pop('like')}.toml").read_text())
        said = {**base, **said, "pins": {**base["pins"], **said["pins"]}}
    return Board(name=name, **said)


def sites(board: Board, lanes: int) -> dict[str, str]:
    """Site of every port bit, as nextpnr names them."""
    if not 1 <= lanes <= len(board.pins["miso"]):
        raise ToolError(f"{board.title} has pins for 1 to {len(board.pins['miso'])} lanes, not {lanes}")
    wide = {port: sites for port, sites in board.pins.items() if isinstance(sites, list)}
    wide["miso"] = wide["miso"][:lanes]
    out = {port: site for port, site in board.pins.items() if isinstance(site, str)}
    return out | {f"{port}[{bit}]": site for port, all_ in wide.items() for bit, site in enumerate(all_)}


# By the port's beginning.
PAD_OPTIONS = {"miso": " PULLMODE=UP", "tick_in": " PULLMODE=DOWN", "ulpi": " SLEWRATE=FAST", "usb_d": " PULLMODE=NONE"}


def constraints(board: Board, lanes: int) -> str:
    """The LPF file: sites, 3.3 V, pull-ups on the lanes (nobody there reads as ones), fast edges towards the PHY, clock."""
    lines = [f'FREQUENCY PORT "{board.clock}" {board.clock_mhz:g} MHZ;']
    for port, site in sites(board, lanes).items():
        extra = next((more for start, more in PAD_OPTIONS.items() if port.startswith(start)), "")
        lines.append(f'LOCATE COMP "{port}" SITE "{site}";')
        lines.append(f'IOBUF PORT "{port}" IO_TYPE=LVCMOS33{extra};')
    return "\n".join(lines) + "\n"


def sources(usb: Path) -> list[Path]:
    """Verilog of every board; `usb` is the generated USB device."""
    return [
        *sorted((REPO / "fpga/bridge_rtl").glob("*.v")),
        REPO / "fpga/usb/ulpi_shim.v",
        usb,
        *sorted(HERE.glob("*.v")),
    ]


def commit() -> str:
    """First 16 bits of the commit that the files are of, in hexadecimal; 0 if they have changes, or belong to none."""
    changed = ["git", "status", "--porcelain", "--untracked-files=no"]
    found, dirty = (
        subprocess.run(command, cwd=REPO, capture_output=True, text=True)
        for command in (["git", "rev-parse", "HEAD"], changed)
    )
    return found.stdout[:4] if found.returncode == 0 and not dirty.stdout else "0"


def generate_usb(out: Path, board: Board, serial: str = "0001", usb_id: str | None = None) -> Path:
    """The board's USB device as Verilog; usb_id: see USB_ID."""
    path = out / "whisker_usb.v"
    command = [sys.executable, str(REPO / "fpga/usb/generate.py"), str(path), "--serial", serial]
    command += ["--board", str(board.number), "--commit", commit(), "--milliamps", str(board.milliamps)]
    command += [] if board.self_powered else ["--bus-powered"]
    command += ["--usb-id", usb_id] if usb_id else []
    command += ["--full-speed"] if board.phy == report.GATEWARE else []
    subprocess.run(command, check=True)
    return path


def generate_fs_phy(out: Path) -> Path:
    """The PHY of a board without one, as Verilog."""
    path = out / "whisker_fs_phy.v"
    subprocess.run([sys.executable, str(REPO / "fpga/usb/gateware_phy.py"), str(path)], check=True)
    return path


def front(
    top: str,
    files: list[Path],
    parameters: dict[str, int],
    out: Path,
    libraries: str = LIBRARIES,
    without: tuple[str, ...] = (),
) -> list[str]:
    """Yosys commands that read a design and fail on latches, several drivers of a wire, and wires without one; ports
    `without` a pin are left out."""
    gather(out, *INCLUDES)
    names = gather(out, *files)
    given = [f"chparam -set {name} {value} {top}" for name, value in parameters.items()]
    absent = [f"delete -port {top}/w:{port}" for port in without]
    return [
        f"read_verilog -lib -specify {libraries}",
        "read_verilog " + " ".join(names),
        *given,
        f"hierarchy -check -top {top}",
        *absent,
        "proc",
        "select -assert-none t:$dlatch t:$adlatch t:$dlatchsr t:$sr",
        "check -assert",
    ]


def synthesise(
    top: str,
    files: list[Path],
    parameters: dict[str, int],
    out: Path,
    registers: tuple[str, ...],
    without: tuple[str, ...] = (),
) -> Path:
    """Netlist of `top` for ECP5, `registers` (patterns of Yosys) in the pads' cells; `without`: see front."""
    marks = [f"select -assert-any {name}; setattr -set syn_useioff 1 {name}" for name in registers]
    steps = [*front(top, files, parameters, out, without=without), *marks, f"synth_ecp5 -top {top} -json netlist.json"]
    (out / "synth.ys").write_text("\n".join(steps) + "\n")
    must("yosys", "-q", "-s", "synth.ys", log=out / "synth.log")
    agree_on_resets(out / "netlist.json", top)
    return out / "netlist.json"


def agree_on_resets(netlist: Path, top: str) -> None:
    """Lets the input and the output register of a pad share its cell, which has one reset and one way to take it.

    Yosys ties the reset of a register without one to 0 and leaves its kind open; nextpnr would see two resets there, or make
    the other's asynchronous.
    """
    design = json.loads(netlist.read_text())
    for cell in design["modules"][top]["cells"].values():
        if "syn_useioff" in cell["attributes"]:
            cell["parameters"]["SRMODE"] = "LSR_OVER_CE"
            if cell["connections"].get("LSR") == ["0"]:
                del cell["connections"]["LSR"], cell["port_directions"]["LSR"]
    netlist.write_text(json.dumps(design))


def place(board: Board, lanes: int, netlist: Path, out: Path, seed: int = 1, speed: int | None = None) -> dict:
    """Places and routes; the report of report.read. A missed clock is no error here: it is in the report."""
    if gowin.is_gowin(board.device):
        return report.read(gowin.place(board, sites(board, lanes), netlist, out, seed))
    (out / "pins.lpf").write_text(constraints(board, lanes))
    result = f"report_{seed}.json"
    options = ["--json", netlist.name, "--lpf", "pins.lpf", "--textcfg", f"{board.name}.config"]
    options += ["--report", result, "--detailed-timing-report"]
    options += [f"--{board.device}", "--package", board.package, "--speed", speed or board.speed, "--seed", seed]
    must("nextpnr-ecp5", *options, "--timing-allow-fail", log=out / f"place_{seed}.log")
    return report.read(out / result)


def prepare(board: Board, lanes: int, out: Path, serial: str = "0001", usb_id: str | None = None) -> Path:
    """The netlist of a whole board; ToolError if a cell has another clock than the PHY's."""
    out.mkdir(parents=True, exist_ok=True)
    files, registers = sources(generate_usb(out, board, serial, usb_id)), NODE_REGISTERS + PHY_REGISTERS
    if board.phy == report.GATEWARE:
        files, registers = [*files, generate_fs_phy(out)], NODE_REGISTERS
    leds = board.pins.get("led_n")
    parameters = {
        "LANES": lanes,
        **({"LEDS": len(leds)} if board.top == "usb3300_board" and isinstance(leds, list) else {}),
    }
    if board.flash:
        parameters["FLASH_SECTORS"] = board.flash
        registers += FLASH_REGISTERS
    if gowin.is_gowin(board.device):
        netlist = gowin.synthesise(board.top, front(board.top, files, parameters, out, gowin.LIBRARIES), out)
    else:
        without = tuple(port for port in FLASH_PORTS if port not in board.pins)
        netlist = synthesise(board.top, files, parameters, out, registers, without)
    problems = report.unconstrained_clocks(netlist, board.top, board.clock)
    if problems:
        raise ToolError("; ".join(problems))
    return netlist


def netlist_verilog(board: Board, lanes: int, out: Path) -> Path:
    """What synthesis makes of a board, as Verilog of the FPGA's cells, for simulation."""
    prepare(board, lanes, out)
    must("yosys", "-q", "-p", "read_json netlist.json; write_verilog -noattr netlist.v", log=out / "verilog.log")
    return out / "netlist.v"


def summary(board: Board, seed: int, placed: dict) -> str:
    """A line for the reader: speed, pins, resources."""
    limits = report.pin_limits(board.speed, board.phy)
    pins = ", ".join(f"{name} {placed[name] or 0:.1f} of {limit:.1f}" for name, limit in limits.items())
    used = ", ".join(f"{number} {name}" for name, number in placed["used"].items())
    return f"{board.title}, seed {seed}: {placed['fmax_mhz']:.1f} MHz; pins: {pins or 'not judged'}; {used}"


def pack(board: Board, out: Path) -> Path:
    """The bitstream of what was placed last."""
    if gowin.is_gowin(board.device):
        return gowin.pack(board, out)
    names = ["--input", f"{board.name}.config", "--bit", f"{board.name}.bit"]
    must("ecppack", "--compress", *names, log=out / "pack.log")
    return out / f"{board.name}.bit"


def add_images(board: Board, lanes: int, bitstream: Path) -> None:
    """Writes beside a bitstream its image for `whisker flash`, and the page that leads to the image to fall back to."""
    content = image.gateware_image(bitstream.read_bytes(), board.number, lanes, int(commit(), 16))
    bitstream.with_suffix(".wgw").write_bytes(content)
    jump = image.jump_page(image.fallback_address(board.flash))
    bitstream.with_name(f"{board.name}_jump.bin").write_bytes(jump)


def named(bitstream: Path, usb_id: str | None) -> Path:
    """The bitstream under the name that says whether it may be given to others."""
    return bitstream if usb_id else bitstream.replace(bitstream.with_stem(f"{bitstream.stem}-testid"))


def step(text: str) -> None:
    """What takes long is announced on standard error; standard output holds the results."""
    print(f"bitstream: {text}", file=sys.stderr, flush=True)


def make(board: Board, lanes: int, out: Path, seeds: list[int], serial: str, usb_id: str | None) -> Path:
    """All steps, placed with one seed after another until one meets the clock and the PHY's limits; ToolError if none does."""
    step(f"{board.title}: synthesis of {lanes} lanes, one to three minutes; log: {out / 'synth.log'}")
    netlist = prepare(board, lanes, out, serial, usb_id)
    for seed in seeds:
        step(f"place and route, seed {seed}, one to five minutes; log: {out / f'place_{seed}.log'}")
        placed = place(board, lanes, netlist, out, seed)
        print(summary(board, seed, placed), flush=True)
        problems = report.timing_problems(placed, board.speed, board.phy)
        if not problems:
            return named(pack(board, out), usb_id)
        step(f"seed {seed} misses: {'; '.join(problems)}")
    raise ToolError(
        f"{board.title} with {lanes} lanes: none of the seeds {seeds[0]} to {seeds[-1]} meets the limits; try others"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description="Make a board's bitstream.", epilog="example: build.py colorlight_i9")
    parser.add_argument("board", nargs="?", help=", ".join(boards()))
    parser.add_argument("--list", action="store_true", help="the boards there are, and nothing else")
    parser.add_argument("--lanes", type=int, help="lanes with a pin (default: the board's)")
    parser.add_argument("--seed", type=int, default=1, help="first placement seed")
    parser.add_argument("--tries", type=int, default=8, help="placements to try, until one meets the limits")
    parser.add_argument("--serial", default="0001", help="USB serial number")
    parser.add_argument(
        "--usb-id",
        metavar="VID:PID",
        help="USB numbers of your own (default: the test id 1209:0001, not to be shipped)",
    )
    parser.add_argument("--out", type=Path, help="folder (default: build/boards/BOARD)")
    parser.add_argument("--netlist", action="store_true", help="end after synthesis, with the netlist as Verilog")
    arguments = parser.parse_args()
    if arguments.list:
        print("\n".join(boards()))
        return 0
    try:
        if arguments.usb_id and not USB_ID.fullmatch(arguments.usb_id):
            raise ToolError(
                f"USB id '{arguments.usb_id}' is not VID:PID; give four hexadecimal digits each, as 1d50:6000"
            )
        board = load(arguments.board or "")
        out = arguments.out or REPO / "build" / "boards" / board.name
        lanes = arguments.lanes or board.lanes
        if arguments.netlist:
            print(netlist_verilog(board, lanes, out.resolve()))
            return 0
        seeds = [arguments.seed + n for n in range(arguments.tries)]
        bitstream = make(board, lanes, out.resolve(), seeds, arguments.serial, arguments.usb_id)
        if board.flash:
            add_images(board, lanes, bitstream)
        print(bitstream)
    except ToolError as error:
        print(f"bitstream: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
