#!/usr/bin/env python3
"""Makes the KiCad projects of node and adapter from node.py and adapter.py: schematic, netlist, BOM, board, checks.

Runs with the Python that KiCad 9 installs pcbnew for, and with kicad-cli on the path:
    python3 hardware/make/make.py [--out DIR] [--fabricate] [node] [adapter]
--fabricate also writes gerbers, drill files, positions, PDF of the sheet and pictures below DIR/NAME/fabrication.
"""

import argparse
import csv
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from kicad_file import read, write
from schematic import Drawing, Symbols

HERE = Path(__file__).resolve().parent
SHARE = Path("/usr/share/kicad")
SYMBOLS = Path(os.environ.get("KICAD9_SYMBOL_DIR", SHARE / "symbols"))
FOOTPRINTS = Path(os.environ.get("KICAD9_FOOTPRINT_DIR", SHARE / "footprints"))


def kicad(*words: object) -> None:
    """Runs kicad-cli with the libraries' own tables, not the user's; what it says is shown only if it fails."""
    with tempfile.TemporaryDirectory() as home:
        tables = Path(home) / "9.0"
        tables.mkdir()
        for table in ("sym-lib-table", "fp-lib-table"):
            shutil.copy(SYMBOLS.parent / "template" / table, tables)
        places = {"KICAD_CONFIG_HOME": home, "KICAD9_SYMBOL_DIR": str(SYMBOLS), "KICAD9_FOOTPRINT_DIR": str(FOOTPRINTS)}
        done = subprocess.run(["kicad-cli", *map(str, words)], capture_output=True, text=True, env=os.environ | places)
    if done.returncode:
        sys.stderr.write(done.stdout + done.stderr)
        raise SystemExit(f"make.py: kicad-cli {words[0]} {words[1]} failed")


def project(sheet) -> str:
    """The project file: net classes and rules; what is not named keeps KiCad's default."""
    base = {"bus_width": 12, "clearance": 0.2, "diff_pair_gap": 0.25, "diff_pair_via_gap": 0.25, "diff_pair_width": 0.2,
            "line_style": 0, "microvia_diameter": 0.3, "microvia_drill": 0.1, "name": "Default",
            "pcb_color": "rgba(0, 0, 0, 0.000)", "priority": 2147483647, "schematic_color": "rgba(0, 0, 0, 0.000)",
            "track_width": 0.25, "via_diameter": 0.6, "via_drill": 0.3, "wire_width": 6}  # fmt: skip
    power = base | {"name": "Power", "track_width": 0.5, "priority": 0}
    rules = {"min_clearance": 0.2, "min_copper_edge_clearance": 0.3, "min_track_width": 0.2, "min_via_diameter": 0.5,
             "min_through_hole_diameter": 0.3, "min_resolved_spokes": 1, "min_hole_clearance": 0.25, "min_text_height": 0.8,
             "min_text_thickness": 0.08}  # fmt: skip
    return json.dumps({
        "board": {"design_settings": {"rules": rules}},
        "meta": {"filename": f"{sheet.name}.kicad_pro", "version": 3},
        "net_settings": {"classes": [base, power], "meta": {"version": 4},
                         "netclass_patterns": [{"netclass": "Power", "pattern": net} for net in sheet.power_nets]},
    }, indent=2) + "\n"  # fmt: skip


def netlist(stem: Path) -> None:
    """The sheet's netlist as KiCad sees it, without the date and the folder it was made in."""
    path = stem.with_suffix(".net")
    kicad("sch", "export", "netlist", "--output", path, stem.with_suffix(".kicad_sch"))
    content = read(path)
    kept = [part for part in content if part[0] in ("version", "components", "nets")]
    path.write_text(write([content[0], *kept]) + "\n", encoding="utf-8")


def bom(sheet, path: Path) -> None:
    """One row per value and footprint: how many, which, two order codes with their makers."""
    rows: dict[tuple, list] = {}
    for part in sheet.parts:
        if part.in_bom:
            rows.setdefault((part.value, part.footprint, *sum(part.sources, ())), []).append(part)
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(
            ["quantity", "references", "value", "footprint", "maker 1", "order code 1", "maker 2", "order code 2"]
        )
        for (value, footprint, *codes), parts in rows.items():
            references = " ".join(part.ref for part in parts)
            out.writerow([len(parts), references, value, footprint, *codes, *[""] * (4 - len(codes))])


def fabricate(folder: Path, name: str) -> None:
    """What a board house and the bench want, from the board and sheet in the folder."""
    out = folder / "fabrication"
    out.mkdir(exist_ok=True)
    board, sheet = folder / f"{name}.kicad_pcb", folder / f"{name}.kicad_sch"
    layers = "F.Cu,B.Cu,F.Paste,F.Silkscreen,B.Silkscreen,F.Mask,B.Mask,Edge.Cuts"
    kicad("pcb", "export", "gerbers", "--layers", layers, "--output", f"{out}/", board)
    kicad("pcb", "export", "drill", "--output", f"{out}/", board)
    kicad("pcb", "export", "pos", "--units", "mm", "--format", "csv", "--output", out / f"{name}-positions.csv", board)
    kicad("sch", "export", "pdf", "--output", out / f"{name}-schematic.pdf", sheet)
    kicad("sch", "export", "svg", "--output", f"{out}/", sheet)
    for side, names in (
        ("front", "F.Cu,F.Mask,F.Silkscreen,Edge.Cuts"),
        ("back", "B.Cu,B.Mask,B.Silkscreen,Edge.Cuts"),
    ):
        kicad("pcb", "export", "svg", "--layers", names, "--mode-single", "--page-size-mode", "2",
              "--exclude-drawing-sheet", "--output", out / f"{name}-{side}.svg", board)  # fmt: skip


def check(folder: Path, name: str) -> None:
    """Electrical rules of the sheet, design rules of the board, and that both agree: nothing at all to report."""
    sheet, board = folder / f"{name}.kicad_sch", folder / f"{name}.kicad_pcb"
    common = ("--severity-all", "--exit-code-violations", "--output", "/dev/stderr")
    kicad("sch", "erc", *common, sheet)
    kicad("pcb", "drc", "--schematic-parity", *common, board)


def make(sheet, root: Path) -> Path:
    """Writes the project's files below root; the folder they are in."""
    from board import Maker  # KiCad's Python only

    folder = root / sheet.name
    folder.mkdir(parents=True, exist_ok=True)
    stem = folder / sheet.name
    drawing = Drawing(sheet, Symbols([HERE.parent / "symbols", SYMBOLS]))
    stem.with_suffix(".kicad_pro").write_text(project(sheet), encoding="utf-8")
    stem.with_suffix(".kicad_sch").write_text(drawing.file(), encoding="utf-8")
    library = '(lib (name "crunchbot") (type "KiCad") (uri "${KIPRJMOD}/../symbols/crunchbot.kicad_sym") (options "") (descr ""))'
    (folder / "sym-lib-table").write_text(f"(sym_lib_table\n  (version 7)\n  {library}\n)\n", encoding="utf-8")
    netlist(stem)
    bom(sheet, folder / "bom.csv")
    Maker(sheet, stem.with_suffix(".net"), FOOTPRINTS).make(stem.with_suffix(".kicad_pcb"))
    return folder


def main() -> None:
    import adapter
    import node

    sheets = {sheet.name: sheet for sheet in (node.SHEET, adapter.SHEET)}
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=HERE.parent)
    parser.add_argument("--fabricate", action="store_true")
    parser.add_argument("names", nargs="*", default=[], metavar="NAME")
    given = parser.parse_args()
    for name in given.names or sheets:
        if name not in sheets:
            parser.error(f"there is no board {name}: choose from {', '.join(sheets)}")
        folder = make(sheets[name], given.out)
        if given.fabricate:
            fabricate(folder, name)
        check(folder, name)


if __name__ == "__main__":
    main()
