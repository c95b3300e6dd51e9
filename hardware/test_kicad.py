"""Sheets and boards: wired as docs/hardware.md says and the firmware wants, BOM and board as the sheet.

Read from KiCad's own files; its rules are checked, and gerbers made, where kicad-cli (KiCad 9) is on the path.
"""

import csv
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path[:0] = [str(HERE), str(HERE / "whisker")]
from kicad_sheet import Sheet, child, children, properties, read  # noqa: E402
from mount import Mount  # noqa: E402

PAGE = (ROOT / "docs/hardware.md").read_text(encoding="utf-8")
BOARDS = ("node", "adapter")
SYMBOLS = Path(os.environ.get("KICAD9_SYMBOL_DIR", "/usr/share/kicad/symbols"))
FOOTPRINTS = Path(os.environ.get("KICAD9_FOOTPRINT_DIR", "/usr/share/kicad/footprints"))
needs_kicad = pytest.mark.skipif(
    not shutil.which("kicad-cli"), reason="kicad-cli (KiCad 9) is not on the path: not checked"
)


def table(head: str) -> list[list[str]]:
    """Rows of the page's first table whose heading line begins so, without the line of dashes."""
    lines = PAGE[PAGE.index(head) :].split("\n")
    rows = [line for line in lines[: next(n for n, line in enumerate(lines) if not line.startswith("|"))]]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows if not set(row) <= set("|- ")]


def short(number: str, unit: str) -> str:
    """A value as the sheets write it: 1.5 kohm is 1k5, 100 nF is 100n, 33 ohm is 33."""
    letter = {"kohm": "k", "ohm": "", "uF": "u", "nF": "n"}[unit]
    return number.replace(".", letter) if "." in number else number + letter


def cable() -> dict[str, str]:
    """Pin of the cable -> signal, as the page's table says."""
    pins, signals = table("| 1 | 2 | 3 |")[:2]
    return {
        pin: signal.strip("*").replace("ground", "GND").replace("+5 V", "+5V")
        for pin, signal in zip(pins, signals, strict=True)
    }


def sensor() -> dict[str, str]:
    """Signal of the sensor -> its pin, from the page's sentence."""
    sentence = re.search(r"^Sensor \(SOIC-8, C\): (.*)$", PAGE, re.MULTILINE)[1]
    return {name: pin for pin, name in re.findall(r"(\d) (VDD|/SS|SCLK|data|VDIG|VSS)", sentence)}


def beyond(nets: Sheet, value: str, net: str) -> str:
    """The net on the other side of the one resistor of this value at a net."""
    ((ref, pin),) = [key for key, other in nets.net.items() if other == net and nets.value[key[0]] == value]
    return nets.net[ref, "12".replace(pin, "")]


def check_row(nets: Sheet, pin: str, words: str) -> None:
    """What one row of the page's table of the dsPIC's pins asks of the netlist."""
    net = nets.net["U1", pin]
    signals = {signal: number for number, signal in cable().items()}
    met = False
    for kind in re.findall(r"sensor (/SS|SCLK|data)", words):
        met = True
        assert nets.net["U2", sensor()[kind]] == net, (pin, words)
    if signal := signals.get(words.split(",")[0]):
        met = True
        assert nets.net["J1", signal] == net or words.startswith("MISO"), (pin, words)
    if "programming header" in words:
        met = True
        assert "J2" in nets.refs(net), (pin, words)
    if words.startswith("470 ohm, behind it"):
        net = beyond(nets, "470", net)
        assert nets.across("100n", "C", net, "GND"), (pin, words)
    for number, unit, supply in re.findall(r"([\d.]+) (kohm) to (5 V|3\.3 V|ground)", words):
        met = True
        rail = {"5 V": "+5V", "3.3 V": "+3V3", "ground": "GND"}[supply]
        assert nets.across(short(number, unit), "R", net, rail), (pin, words)
    if words == "left open":
        met = True
        assert net.startswith("unconnected-"), (pin, words)
    if words == "MISO, through 33 ohm":
        met = True
        assert nets.across("33", "R", net, nets.net["J1", signals["MISO"]]), (pin, words)
    if words.startswith("10 uF"):
        met = True
        assert nets.across("10u", "C", net, "GND"), (pin, words)
    if words.startswith("3.3 V, 100 nF each"):
        met = True
        assert net == "+3V3" and len(nets.across("100n", "C", net, "GND")) >= 2, (pin, words)
    if words == "ground":
        met = True
        assert net == "GND", (pin, words)
    assert met, f"docs/hardware.md, pin {pin}: this test does not understand '{words}'"


def check_node(nets: Sheet) -> None:
    rows = table("| dsPIC pin (SPDIP-28)")[1:]
    assert len(rows) >= 14
    for pins, port, words, *_ in rows:
        names = re.findall(r"RB\d+", port) or re.findall(r"\w+", port)
        numbers = pins.split(", ")
        for pin, own in zip(numbers, names if len(names) == len(numbers) else ["|".join(names)] * 9, strict=False):
            assert re.search(rf"\b({own})\b", nets.name["U1", pin]), (pin, port, nets.name["U1", pin])
            check_row(nets, pin, words)
    for number, signal in cable().items():
        assert nets.net["J1", number] == signal, f"node: J1 pin {number}"
    assert nets.net["U2", sensor()["VDD"]] == "+5V" and nets.across("100n", "C", "+5V", "GND")
    assert nets.across("100n", "C", nets.net["U2", sensor()["VDIG"]], "GND")
    assert {nets.net["U2", pin] for pin in (sensor()["VSS"], "2", "6")} == {"GND"}
    assert [nets.net["U3", pin] for pin in "123"] == ["GND", "+3V3", "+5V"]
    assert nets.across("1u", "C", "+5V", "GND") and nets.across("1u", "C", "+3V3", "GND")
    assert nets.across("10u", "C", "+5V", "GND") and nets.across("green", "D", beyond(nets, "1k", "+3V3"), "GND")
    guarded = [nets.net[ref, pin] for ref in nets.value if nets.value[ref] == "SRV05-4" for pin in "1346"]
    assert sorted(guarded) == sorted({*cable().values()} - {"GND", "+5V"} | {nets.net["U2", pin] for pin in "345"})
    assert all(nets.net[ref, "2"] == "GND" for ref in nets.value if nets.value[ref] == "SRV05-4")


@pytest.fixture(scope="module")
def sheets() -> dict[str, Sheet]:
    return {name: Sheet(HERE / name / f"{name}.kicad_sch") for name in BOARDS}


def test_node_is_wired_as_the_page_says(sheets):
    check_node(sheets["node"])


@pytest.mark.parametrize("first, second", [(("U1", "23"), ("U1", "24")), (("J1", "6"), ("J1", "8")), (("U2", "3"), ("U2", "4")),
                                           (("R5", "2"), ("R5", "1")), (("C1", "1"), ("C2", "1")), (("U3", "2"), ("U3", "3")),
                                           (("R8", "1"), ("R9", "2")), (("U4", "1"), ("U4", "2")), (("U1", "1"), ("R4", "2"))])  # fmt: skip
def test_swapped_pins_are_seen(first, second):
    nets = Sheet(HERE / "node/node.kicad_sch")
    nets.net[first], nets.net[second] = nets.net[second], nets.net[first]
    if first[0] == "R5":  # a resistor has no direction: this swap alone must change nothing
        check_node(nets)
        return
    with pytest.raises(AssertionError):
        check_node(nets)


def test_firmware_uses_the_pins_of_the_page(sheets):
    pins = dict(re.findall(r"#define PIN_(\w+) (\d+)u", (ROOT / "firmware/dspic/port_dspic/port.h").read_text()))
    nets = sheets["node"]
    signals = {signal: number for number, signal in cable().items()}
    port = {f"RB{number}": name for name, number in pins.items()}
    on = {port[name.split("/")[-1]]: nets.net[key] for key, name in nets.name.items()
          if key[0] == "U1" and name.split("/")[-1] in port}  # fmt: skip
    for name, kind in {"SENSOR_SELECT": "/SS", "SENSOR_CLOCK": "SCLK", "SENSOR_DATA": "data"}.items():
        assert on.get(name) == nets.net["U2", sensor()[kind]], name
    for name, signal in {"LINK_SELECT": "SELECT", "SYNC": "SYNC", "LINK_CLOCK": "SCK", "LINK_MOSI": "MOSI"}.items():
        assert on.get(name) == nets.net["J1", signals[signal]], name
    assert nets.across("33", "R", on["LINK_MISO"], nets.net["J1", signals["MISO"]])
    assert on["SPARE"].startswith("unconnected-")


def test_adapter_gives_each_cable_an_output_and_a_resistor_per_line(sheets):
    nets = sheets["adapter"]
    inputs = {"18": "2", "16": "4", "14": "6", "12": "8", "3": "17", "5": "15", "7": "13", "9": "11"}  # of a 74LVC244
    outputs = {
        nets.net[f"U{chip}", out]: nets.net[f"U{chip}", into] for chip in range(1, 5) for out, into in inputs.items()
    }
    used = set()
    for n in range(1, 9):
        socket = {signal: nets.net[f"J{n}", pin] for pin, signal in cable().items()}
        assert all(nets.net[f"J{n}", pin] == signal for pin, signal in cable().items() if signal in ("GND", "+5V")), n
        for line in ("SYNC", "SCK", "SELECT", "MOSI"):
            ((ref, pin),) = [key for key, net in nets.net.items() if net == socket[line] and key[0].startswith("RN")]
            driven = nets.net[ref, str(9 - int(pin))]
            assert nets.value[ref] == "4x47" and outputs[driven] == line and driven not in used, (n, line)
            assert nets.refs(socket[line]) == {ref, f"J{n}"}, (n, line)
            used.add(driven)
        assert nets.across("10k", "R", socket["MISO"], "+3V3"), n
        assert nets.net["J10", str(2 * n - 1 if n < 5 else 2 * n - 8)] == socket["MISO"], n
    assert len(used) == 32
    assert [nets.net["J9", pin] for pin in ("1", "3", "5", "7")] == ["SYNC", "SCK", "SELECT", "MOSI"]
    for chip in range(1, 5):
        assert [nets.net[f"U{chip}", pin] for pin in ("1", "19", "10", "20")] == ["GND", "GND", "GND", "+3V3"]
    assert len(nets.across("100n", "C", "+3V3", "GND")) == 4


def test_the_adapters_supply_passes_fuse_clamp_and_transistor(sheets):
    nets = sheets["adapter"]
    gate, nodes, fused = (nets.net["Q1", pin] for pin in "123")  # of an AO3401A: gate, source, drain
    assert nets.value["Q1"] == "AO3401A" and nodes == "+5V" and nets.net["J11", "2"] == "GND"
    assert nets.across("1.1A", "F", nets.net["J11", "1"], fused) and nets.across("SMBJ5.0CA", "D", fused, "GND")
    assert nets.across("100k", "R", gate, "GND") and nets.across("100u", "C", "+5V", "GND")


def rows_of(name: str) -> list[dict]:
    with (HERE / name / "bom.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("name", BOARDS)
def test_bom_is_the_schematic_and_names_two_sources(name, sheets):
    nets, seen = sheets[name], []
    for row in rows_of(name):
        refs = row["references"].split()
        assert int(row["quantity"]) == len(refs) and row["order code 1"], row
        seen += refs
        for ref in refs:
            fields = nets.fields[ref]
            assert (fields["Value"], fields["Footprint"]) == (row["value"], row["footprint"]), ref
            for n in "12":
                found = fields.get(f"Maker{n}", ""), fields.get(f"OrderCode{n}", "")
                assert found == (row[f"maker {n}"], row[f"order code {n}"]), ref
        single = ("Microchip", "Melexis")  # one maker only
        assert row["order code 2"] or row["maker 1"] in single, row
    assert sorted(seen) == sorted(ref for ref in nets.value if not ref.startswith(("H", "TP")))


def test_bom_has_what_the_page_lists():
    page = {row[0].split(":")[0]: row[0] for row in table("| for each node | |") + table("| for the bridge | |")}
    node = {row["value"]: int(row["quantity"]) for row in rows_of("node")}
    wanted = {}
    for line in (page["capacitors"], table("| for each node | |")[5][0]):
        for item in line.split(": ")[1].split(", "):
            number, unit, count = re.fullmatch(r"([\d.]+) (\w+).* (\d+)", item).groups()
            wanted[short(number, unit)] = int(count)
    assert len(wanted) == 9 and {value: node[value] for value in wanted} == wanted
    adapter = {row["value"]: int(row["quantity"]) for row in rows_of("adapter")}
    assert "47 ohm 4 per cable, 10 kohm 1 per node" in PAGE and "| 1 for two cables" in PAGE
    values = ("4x47", "10k", "74LVC244A", "100n", "1.1A", "SMBJ5.0CA", "AO3401A", "100k", "100u")
    assert [adapter[value] for value in values] == [8, 8, 4, 4, 1, 1, 1, 1, 1]


@pytest.mark.parametrize("name", BOARDS)
def test_board_has_the_nets_of_the_schematic(name, sheets):
    board = read(HERE / name / f"{name}.kicad_pcb")
    pads = {}
    for footprint in children(board, "footprint"):
        ref = properties(footprint)["Reference"]
        for pad in children(footprint, "pad"):
            if pad[1]:
                pads[ref, pad[1]] = (child(pad, "net") or [0, 0, ""])[2].removeprefix("/")
    nets = sheets[name].net
    assert {key: net for key, net in pads.items() if not net.startswith("unconnected-")} == \
        {key: net for key, net in nets.items() if not net.startswith("unconnected-")}  # fmt: skip
    legends = {child(text, "layer")[1]: text[1] for text in children(board, "gr_text") if text[1] == "NOT YET BUILT"}
    assert set(legends) == {"F.SilkS", "B.SilkS"}
    for file in (HERE / name).glob("*"):
        assert file.stat().st_size < 1_000_000, f"{file.name} has grown over 1 MB"


def test_sensor_lies_on_the_follicles_axis_and_vcap_is_near():
    board = read(HERE / "node/node.kicad_pcb")
    place, pads = {}, {}
    for footprint in children(board, "footprint"):
        ref = properties(footprint)["Reference"]
        x, y = map(float, child(footprint, "at")[1:3])
        place[ref] = (x, y)
        turn = float((child(footprint, "at") + ["0"])[3])
        for pad in children(footprint, "pad"):
            px, py = map(float, child(pad, "at")[1:3])
            for _ in range(int(turn) % 360 // 90):
                px, py = py, -px
            pads[ref, pad[1]] = (x + px, y + py)
    x, y = place["U2"]
    half = Mount.read().given["follicle"]["hole_pitch"] / 2
    assert {(round(place[f"H{n}"][0] - x, 3), round(place[f"H{n}"][1] - y, 3)) for n in range(1, 5)} == \
        {(sx * half, sy * half) for sx in (-1, 1) for sy in (-1, 1)}  # fmt: skip
    assert "within 6 mm" in PAGE
    a, b = pads["U1", "20"], pads["C1", "1"]
    assert ((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2) ** 0.5 < 6


def kicad(home: Path, *words: object) -> None:
    """Runs kicad-cli with the libraries' own tables, not the user's."""
    (home / "9.0").mkdir(exist_ok=True)
    for name in ("sym-lib-table", "fp-lib-table"):
        shutil.copy(SYMBOLS.parent / "template" / name, home / "9.0")
    places = {"KICAD_CONFIG_HOME": home, "KICAD9_SYMBOL_DIR": SYMBOLS, "KICAD9_FOOTPRINT_DIR": FOOTPRINTS}
    environment = os.environ | {name: str(path) for name, path in places.items()}
    done = subprocess.run(["kicad-cli", *map(str, words)], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr


@needs_kicad
@pytest.mark.parametrize("name", BOARDS)
def test_kicad_has_nothing_to_report_and_makes_gerbers(tmp_path, name):
    sheet, board = HERE / name / f"{name}.kicad_sch", HERE / name / f"{name}.kicad_pcb"
    common = ("--severity-all", "--exit-code-violations", "--output", tmp_path / "report")
    kicad(tmp_path, "sch", "erc", *common, sheet)
    kicad(tmp_path, "pcb", "drc", "--schematic-parity", *common, board)
    layers = "F.Cu,B.Cu,F.Paste,F.Silkscreen,B.Silkscreen,F.Mask,B.Mask,Edge.Cuts"
    kicad(tmp_path, "pcb", "export", "gerbers", "--layers", layers, "--output", f"{tmp_path}/", board)
    kicad(tmp_path, "pcb", "export", "drill", "--output", f"{tmp_path}/", board)
    made = {path.suffix for path in tmp_path.iterdir()}
    assert {".gtl", ".gbl", ".gts", ".gbs", ".gto", ".gbo", ".gtp", ".gm1", ".drl"} <= made
