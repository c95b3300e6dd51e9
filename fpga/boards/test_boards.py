"""Boards: what their files say, that synthesis is clean, that timing problems are noticed; place and route with --long."""

import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import build  # noqa: E402
import gowin  # noqa: E402
import image  # noqa: E402
import report  # noqa: E402
from toolchain import ToolError, missing, must  # noqa: E402

from whisker_protocol import GATEWARE_HEADER, LIMITS, crc32  # noqa: E402

LACKING = missing("yosys")
GOWIN_TOOLS = ("yosys", "nextpnr-himbaechel-gowin", "gowin_pack")
needs_yosys = pytest.mark.skipif(bool(LACKING), reason=LACKING)
CLEAN = "module top(input clk, input d, output reg q); always @(posedge clk) q <= d; endmodule"
FAULTY = {
    "latch": "module top(input clk, input d, output reg q); always @* if (clk) q = d; endmodule",
    "several drivers": "module top(input clk, input d, output q); assign q = d; assign q = clk; endmodule",
    "no driver": "module top(input clk, input d, output q); wire n; assign q = d & n; endmodule",
    "loop": "module top(input clk, input d, output q); wire n; assign n = n & d; assign q = n; endmodule",
}


@pytest.mark.parametrize("name", build.boards())
def test_every_port_has_a_pin_of_its_own(name):
    board = build.load(name)
    sites = build.sites(board, len(board.pins["miso"]))
    assert len(set(sites.values())) == len(sites)
    assert len(board.pins["miso"]) == 28 >= board.lanes
    if not gowin.is_gowin(board.device):
        lpf = build.constraints(board, board.lanes)
        assert f'FREQUENCY PORT "{board.clock}" {board.clock_mhz:g} MHZ;' in lpf
    text = (HERE / f"{board.top}.v").read_text()
    assert all(f" {port}," in text or f" {port}\n" in text for port in board.pins)


DOCS = (build.REPO / "docs" / "boards.md").read_text()


def table(after: str) -> list[list[str]]:
    """Cells of the first table after this text of docs/boards.md, the rule under its head left out."""
    lines = DOCS[DOCS.index(after) :].splitlines()
    first = next(n for n, line in enumerate(lines) if line.startswith("|"))
    rows = [line.strip("|") for line in lines[first : lines.index("", first)]]
    return [[cell.strip() for cell in row.split("|")] for row in rows if not set(row) <= set("|-")]


def balls(cell: str) -> list[str]:
    """`Pmod 0: T25, U25` or `Pmod A 1, 2 (C9, B9)`: what stands behind the socket's name."""
    return re.findall(r"[A-Z]\d+", re.split(r"[:(]", cell)[1])


@pytest.mark.parametrize(("given", "named"), [(["miso[0]"], ["miso"]), (["miso[0]", "miso[1]"],) * 2])
def test_gowins_file_pulls_up_the_lanes_alone(given, named):
    lines = gowin.constraints({**dict.fromkeys(given, "A11"), "sync": "B11"}).splitlines()
    lanes = [f'IO_PORT "{port}" IO_TYPE=LVCMOS33 PULL_MODE=UP;' for port in named]
    sync = ['IO_LOC "sync" B11;', 'IO_PORT "sync" IO_TYPE=LVCMOS33 PULL_MODE=NONE;']
    assert lines[1:-2:2] == lanes and lines[-2:] == sync
    assert lines[:-2:2] == [f'IO_LOC "{port}" A11;' for port in named]


@pytest.mark.parametrize("name", build.boards())
def test_pins_are_those_that_the_page_tells_to_solder(name):
    """Two writings of the same wires: a slip in one of them is a swapped lane on a bench."""
    head, *rows = table("## Pins\n")
    board = build.load(name)
    column = next(n for n, title in enumerate(head) if board.title.startswith(title))
    reported = [ball for row in rows for ball in balls(row[column])]
    bus, ticks = (
        [board.pins[wire] for wire in wires.split() if wire in board.pins]
        for wires in ("sync sck select_n mosi", "tick_in tick_out")
    )
    assert reported == bus + board.pins["miso"] + ticks


def test_the_i9s_phy_is_wired_as_the_page_tells():
    reported = dict(zip(*table("### Wiring a USB3300 module"), strict=True))
    pins = build.load("colorlight_i9").pins
    wires = {"CLKOUT": "clk_60", "DIR": "ulpi_dir", "NXT": "ulpi_nxt", "STP": "ulpi_stp", "RESET": "ulpi_reset"}
    wanted = {theirs: pins[ours] for theirs, ours in wires.items()}
    assert reported == wanted | {f"D{bit}": ball for bit, ball in enumerate(pins["ulpi_data"])}


def test_what_a_board_has_not_is_refused():
    with pytest.raises(ToolError, match="1 to 28 lanes, not 29"):
        build.sites(build.load("cynthion"), 29)
    with pytest.raises(
        ToolError, match="boards: colorlight_i5, colorlight_i9, cynthion, ecpix5, tang_primer_20k, ulx3s"
    ):
        build.load("toaster")


def checked(tmp_path: Path, text: str) -> str:
    source = tmp_path / "top.v"
    source.write_text(text)
    (tmp_path / "check.ys").write_text("\n".join(build.front("top", [source], {}, tmp_path)) + "\n")
    return must("yosys", "-q", "-s", "check.ys", log=tmp_path / "check.log")


@needs_yosys
def test_the_check_lets_clean_designs_pass(tmp_path):
    checked(tmp_path, CLEAN)


@needs_yosys
@pytest.mark.parametrize("fault", FAULTY)
def test_the_check_notices(fault, tmp_path):
    with pytest.raises(ToolError):
        checked(tmp_path, FAULTY[fault])


@needs_yosys
def test_the_bridge_synthesises_clean_with_one_clock(tmp_path):
    """The whole board with six lanes, USB device and all; pad registers where they belong."""
    lanes = 6
    netlist = build.synthesise(
        "cynthion",
        build.sources(build.generate_usb(tmp_path, build.load("cynthion"))),
        {"LANES": lanes},
        tmp_path,
        build.NODE_REGISTERS + build.PHY_REGISTERS,
    )
    assert report.unconstrained_clocks(netlist, "cynthion", "clk_60") == []
    cells = json.loads(netlist.read_text())["modules"]["cynthion"]["cells"].values()
    assert not any("LATCH" in cell["type"].upper() for cell in cells)
    pads = [cell for cell in cells if "syn_useioff" in cell["attributes"]]
    assert len(pads) == 8 + 8 + 1 + lanes + 4 + 2  # data out and in, stp, MISO, the nodes' bus, ticks
    assert {cell["parameters"]["SRMODE"] for cell in pads} == {"LSR_OVER_CE"}


def test_what_is_generated_does_not_tell_where(tmp_path):
    """Else a commit built in two folders is two bitstreams."""
    for made in (build.generate_usb(tmp_path, build.load("ulx3s")), build.generate_fs_phy(tmp_path)):
        assert ".py:" not in made.read_text()


def test_a_second_clock_is_noticed(tmp_path):
    cells = {f"ff{n}": {"type": "TRELLIS_FF", "connections": {"CLK": [n]}} for n in (2, 3, 4)}
    cells["own"] = {"type": "OSCG", "connections": {"OSC": [4]}}  # the FPGA's oscillator clocks the watchdog
    path = tmp_path / "netlist.json"
    path.write_text(json.dumps({"modules": {"top": {"ports": {"clk": {"bits": [2]}}, "cells": cells}}}))
    assert report.unconstrained_clocks(path, "top", "clk") == ["ff3 is clocked by another net than clk"]


def test_a_second_clock_behind_gowins_pads_is_noticed(tmp_path):
    cells = {f"ff{n}": {"type": "DFFRE", "connections": {"CLK": [n]}} for n in (2, 3, 4, 5)}
    cells["pad"] = {"type": "IBUF", "connections": {"I": [2], "O": [3]}}
    cells["own"] = {"type": "OSC", "connections": {"OSCOUT": [4]}}
    path = tmp_path / "netlist.json"
    path.write_text(json.dumps({"modules": {"top": {"ports": {"clk": {"bits": [2]}}, "cells": cells}}}))
    problems = report.unconstrained_clocks(path, "top", "clk")
    assert problems == [f"ff{n} is clocked by another net than clk" for n in (2, 5)]


@pytest.mark.skipif(bool(missing(*GOWIN_TOOLS)), reason=missing(*GOWIN_TOOLS))
def test_gowins_tools_make_a_bitstream(tmp_path):
    """A counter between pins of the board, some of which configuration uses before."""
    board = replace(
        build.load("tang_primer_20k"), clock="clk", pins={"clk": "T15", "d": "N9", "q": "C13", "miso": ["A11"]}
    )
    source = tmp_path / "top.v"
    source.write_text(
        "module top(input clk, input d, input miso, output q); reg [7:0] n; assign q = n[7];"
        "always @(posedge clk) n <= n + {7'd0, d ^ miso}; endmodule"
    )
    front = build.front("top", [source], {}, tmp_path, libraries=gowin.LIBRARIES)
    netlist = gowin.synthesise("top", front, tmp_path)
    sites = {name.replace("[0]", ""): site for name, site in build.sites(board, 1).items()}
    placed = report.read(gowin.place(board, sites, netlist, tmp_path, 1))
    assert placed["used"]["FF"] == 8 and placed["used"]["pin"] == 4 and placed["fmax_mhz"] > 66
    lines = gowin.pack(board, tmp_path).read_text().split()
    assert len(lines) > 1000 and set("".join(lines)) == {"0", "1"}


def nextpnr_report(fmax: float, out: float, in_: float, through: float, shortest: float = 2.0) -> dict:
    """What nextpnr writes, as far as it is read. The shortest way in is hidden behind one from a flip-flop."""
    ends = {
        ("posedge $glbnet$clk_60", report.ASYNC): out,
        (report.ASYNC, "posedge $glbnet$clk_60"): in_,
        (report.ASYNC, report.ASYNC): through,
    }
    ends |= {("posedge osc", report.ASYNC): 99.0, ("posedge osc", "posedge $glbnet$clk_60"): 99.0}
    paths = [{"from": a, "to": b, "path": [{"delay": ns - 1}, {"delay": 1}]} for (a, b), ns in ends.items()]
    used = {cell: {"used": 1} for cell, _ in report.USED.values()}
    ends = [{"cell": "ff", "port": "D", "event": "clk", "delay": [ns, 9]} for ns in (0.5, shortest)]
    nets = [{"event": "clk", "endpoints": ends}, {"event": report.ASYNC, "endpoints": [{**ends[1], "delay": [3, 9]}]}]
    return {
        "fmax": {"$glbnet$clk_60": {"achieved": fmax, "constraint": 60.0024}, "osc": {"achieved": 9, "constraint": 9}},
        "critical_paths": paths,
        "utilization": used,
        "detailed_net_timings": nets,
    }


@pytest.mark.parametrize(
    ("values", "speed", "phy", "problems"),
    [
        ((60.1, 4, 9, 4), 6, "USB3300", 0),
        ((59.9, 4, 9, 4), 6, "USB3300", 1),
        ((65.9, 4, 5, 4), 8, "USB3343", 1),  # 10 % to spare on grade 8
        ((66.1, 4, 5, 4), 8, "USB3343", 0),
        ((70, 5, 9, 4), 6, "USB3300", 1),  # 16.67 - 5.0 - 6.8
        ((70, 4, 12, 4), 6, "USB3300", 1),  # 16.67 - 5.0
        ((70, 4, 9, 5), 6, "USB3300", 1),
        ((70, 4, 5.4, 4), 8, "USB3343", 1),  # its clock is late: 16.67 - 6.0 - 5.4
        ((70, 4, 9, 4, 1.2), 6, "USB3300", 1),  # 3.3 - 2.0 to hold
        ((70, 4, 9, 4, 1.2), 8, "USB3300", 0),  # 2.7 - 2.0
        ((70, 4, 5, 4, 0.1), 8, "USB3343", 0),  # its outputs change late
        ((50, 9, 13, 9, 0.5), 6, "USB3300", 5),
    ],
)
def test_missed_limits_are_named(values, speed, phy, problems, tmp_path):
    path = tmp_path / "report.json"
    path.write_text(json.dumps(nextpnr_report(*values)))
    assert len(report.timing_problems(report.read(path), speed, phy)) == problems


def test_a_bitstream_with_the_test_id_is_named_so(tmp_path):
    made = tmp_path / "ecpix5.bit"
    made.write_bytes(b"bits")
    assert build.named(made, "1d50:6000") == made
    assert build.named(made, None).name == "ecpix5-testid.bit" and not made.exists()


def test_the_build_tries_seeds_until_one_does(tmp_path, monkeypatch, capfd):
    placed = {seed: nextpnr_report(70, 4 if seed == 3 else 5, 9, 4) for seed in (1, 2, 3, 4)}

    def place(board, lanes, netlist, out, seed):
        (out / "report.json").write_text(json.dumps(placed[seed]))
        return report.read(out / "report.json")

    monkeypatch.setattr(build, "prepare", lambda *_: None)
    monkeypatch.setattr(build, "place", place)
    monkeypatch.setattr(build, "pack", lambda board, out: out / "packed")
    board = build.load("colorlight_i9")
    assert build.make(board, 6, tmp_path, [1, 2, 3, 4], "0001", "1d50:6000") == tmp_path / "packed"
    said = capfd.readouterr()
    assert "seed 3: 70.0 MHz" in said.out and "seed 4" not in said.out
    steps = [line.removeprefix("bitstream: ").split(",")[0].split(":")[0] for line in said.err.splitlines()]
    tried = ["place and route", "seed 1 misses", "place and route", "seed 2 misses", "place and route"]
    assert steps == [board.title, *tried]
    with pytest.raises(ToolError, match="none of the seeds 1 to 2"):
        build.make(board, 6, tmp_path, [1, 2], "0001", "1d50:6000")


def test_gowins_slowest_clock_is_the_one_that_counts(tmp_path):
    """Both of its clocks are asked for 60 MHz, whatever the net is called; pins are not timed."""
    path = tmp_path / "report.json"
    clocks = {name: {"achieved": fmax, "constraint": 60} for name, fmax in (("osc", 300), ("core.clk", 59.9))}
    used = {cell: {"used": 1} for _, cell in report.USED.values()}
    path.write_text(json.dumps({"fmax": clocks, "critical_paths": [], "utilization": used}))
    assert report.timing_problems(report.read(path), 8, "USB3317") == ["59.9 MHz, 66 wanted"]


def test_without_a_phy_every_clock_is_judged(tmp_path):
    path = tmp_path / "report.json"
    text = nextpnr_report(60.1, 9, 13, 9)
    path.write_text(json.dumps(text))
    assert report.timing_problems(report.read(path), 6, report.GATEWARE) == []
    text["fmax"]["clk_48"] = {"achieved": 47.9, "constraint": 48}
    path.write_text(json.dumps(text))
    assert report.timing_problems(report.read(path), 6, report.GATEWARE) == ["clk_48 is too slow"]


def test_data_behind_delay_lines_has_time_to_spare():
    """The only pins that nextpnr does not time: the data sheets' figures stand for them."""
    for name in build.boards():
        board = build.load(name)
        assert all(spare > 0 for spare in report.data_spare(board.speed, board.phy).values())
    assert report.data_spare(6, "USB3300")["data_setup_ns"] == pytest.approx(1e3 / 60 - 5.0 - 1.46)
    assert report.data_spare(8, "USB3343")["data_setup_ns"] == pytest.approx(1e3 / 60 - 6.0 - 5.4 - 1.2)


def test_pins_that_are_not_timed_are_named(tmp_path):
    """A report without a path of one kind must not pass for a good one."""
    path = tmp_path / "report.json"
    text = nextpnr_report(70, 4, 5, 4)
    text["critical_paths"] = [found for found in text["critical_paths"] if found["from"] != report.ASYNC]
    text["detailed_net_timings"] = []
    path.write_text(json.dumps(text))
    problems = report.timing_problems(report.read(path), 8, "USB3343")
    assert len(problems) == 3 and sum("not timed" in problem for problem in problems) == 2


@pytest.mark.parametrize("name", build.boards())
def test_both_images_and_the_jump_have_their_place_in_the_flash(name):
    """The first begins at 0, the other behind what a host may write, the jump in the last page."""
    board = build.load(name)
    if board.flash:
        other, jump = image.fallback_address(board.flash), image.jump_address(board.flash_mbit)
        assert jump + image.PAGE == board.flash_mbit * 2**17 <= 1 << 24
        longest = {"25k": 583_000, "45k": 1_033_000, "um5g-45k": 1_033_000, "85k": 1_948_000}[
            board.device
        ]  # uncompressed
        assert longest + 4096 < other and longest < jump - other


def test_the_jump_is_the_one_that_trellis_writes():
    """`ecpmulti --golden` of a bitstream at 2 MiB put these 58 bytes into the last page of 64 Mbit."""
    page = image.jump_page(0x200000)
    written = "ff" * 18 + "bdb3" + "ff" * 4 + "2200000000000000" + "7e000000" + "03200000" + "ff" * 18
    assert page == bytes.fromhex(written).ljust(image.PAGE, b"\xff")


def test_an_image_says_what_it_is_for():
    body = bytes(range(200))
    made = image.gateware_image(body, 5, 28, 0x1234)
    header = GATEWARE_HEADER.unpack(made)
    wanted = {"board": 5, "lanes": 28, "build": 0x1234, "length": 200, "gateware": LIMITS["gateware_version"]}
    assert {name: header[name] for name in wanted} == wanted and made[GATEWARE_HEADER.size :] == body
    assert header["body_crc32"] == crc32(body) and header["header_crc32"] == crc32(made[:28])
