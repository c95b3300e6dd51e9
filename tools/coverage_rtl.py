#!/usr/bin/env python3
"""Measures how much of the hand-written gateware its benches exercise: lines (with branches) and toggles of every bit.

Runs every bench of fpga/tb built with Verilator's coverage, adds their counts up and prints a line per module of fpga; then
every point never reached, but for those that fpga/tb/coverage.toml gives a reason for, and the modules that no bench holds.
Fails below 95 % of either kind, reasons included.
Example: `tools/coverage_rtl.py --out build/coverage`.
"""

import argparse
import os
import re
import subprocess
import sys
import tomllib
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BENCHES = sorted({path.parent for path in (ROOT / "fpga/tb").glob("*/test_*.py")})
MODULES = {path.stem for folder in ("boards", "bridge_rtl", "usb") for path in (ROOT / "fpga" / folder).glob("*.v")}
REASONS = ROOT / "fpga" / "tb" / "coverage.toml"
ENOUGH = 0.95
FIELD = re.compile("\x01([^\x02]*)\x02([^\x01']*)")

Point = tuple[str, str, int, str]  # module, kind, line, what


def measure(out: Path) -> None:
    """Runs the benches; coverage.dat of each is left under `out`."""
    environment = {**os.environ, "WHISKER_BENCH_COVERAGE": "1", "WHISKER_BENCH_BUILD": str(out)}
    command = [sys.executable, "-m", "pytest", "-q", *map(str, BENCHES)]
    subprocess.run(command, cwd=ROOT, env=environment, check=True)


def points(path: Path) -> dict[Point, int]:
    """Counts of one file's points that lie in the hand-written modules, however often a module is instantiated."""
    found: dict[Point, int] = defaultdict(int)
    for line in path.read_text(errors="replace").splitlines():
        if not line.startswith("C '"):
            continue
        text, count = line[3:].rsplit("' ", 1)
        fields = dict(FIELD.findall(text))
        source = Path(fields["f"])
        if source.stem not in MODULES or source.suffix != ".v":
            continue
        kind = "toggle" if fields["page"].startswith("v_toggle") else "line"
        found[source.stem, kind, int(fields["l"]), fields.get("o", "")] += int(count)
    return found


def gather(out: Path) -> dict[Point, int]:
    """All benches' counts together."""
    total: dict[Point, int] = defaultdict(int)
    for path in sorted(out.glob("*/coverage.dat")):
        for point, count in points(path).items():
            total[point] += count
    return total


def excused(point: Point, reasons: list[dict]) -> bool:
    """Whether a reason names this point: its module, its kind and, by regular expression, what it is."""
    module, kind, _, what = point
    return any(r["module"] == module and r["kind"] == kind and re.fullmatch(r["what"], what) for r in reasons)


def needless(total: dict[Point, int], reasons: list[dict]) -> list[dict]:
    """Reasons for which there is no point that was not reached."""
    never = [point for point, count in total.items() if count == 0]
    return [reason for reason in reasons if not any(excused(point, [reason]) for point in never)]


def table(total: dict[Point, int], reasons: list[dict]) -> list[tuple[str, str, int, int, int]]:
    """Per module and kind: points, reached, with a reason."""
    rows = []
    for module in sorted({point[0] for point in total}):
        for kind in ("line", "toggle"):
            mine = [point for point in total if point[:2] == (module, kind)]
            reached = sum(total[point] > 0 for point in mine)
            known = sum(total[point] == 0 and excused(point, reasons) for point in mine)
            if mine:
                rows.append((module, kind, len(mine), reached, known))
    return rows


def report(total: dict[Point, int], reasons: list[dict]) -> bool:
    """Prints the table and what is missing; whether there is enough of each kind."""
    rows = table(total, reasons)
    print(f"{'module':20} {'kind':7} {'points':>7} {'reached':>8} {'reason':>7}")
    for module, kind, count, reached, known in rows:
        print(f"{module:20} {kind:7} {count:7} {reached:8} {known:7}")
    enough = True
    for kind in ("line", "toggle"):
        mine = [row for row in rows if row[1] == kind]
        count, reached, known = (sum(row[i] for row in mine) for i in (2, 3, 4))
        print(
            f"{kind}s: {100 * reached / count:.1f} % reached, {100 * (reached + known) / count:.1f} % with reasons, of {count}"
        )
        enough = enough and reached + known >= ENOUGH * count
    print(f"in no bench of fpga/tb: {', '.join(sorted(MODULES - {point[0] for point in total}))}")
    for point in sorted(total):
        if total[point] == 0 and not excused(point, reasons):
            print(f"never: {point[0]}.v:{point[2]} {point[1]} {point[3]}")
    for reason in needless(total, reasons):
        print(f"needless reason: {reason['module']} {reason['what']}: take it out of {REASONS.name}")
        enough = False
    return enough


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--out", type=Path, default=ROOT / "build" / "coverage", help="folder (default: build/coverage)"
    )
    parser.add_argument("--no-run", action="store_true", help="report what an earlier run has left")
    arguments = parser.parse_args()
    if not arguments.no_run:
        measure(arguments.out.resolve())
    total = gather(arguments.out)
    if not total:
        print(f"coverage: no coverage.dat under {arguments.out}; run without --no-run", file=sys.stderr)
        return 2
    reasons = tomllib.loads(REASONS.read_text())["reason"]
    return 0 if report(total, reasons) else 1


if __name__ == "__main__":
    sys.exit(main())
