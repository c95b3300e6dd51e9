"""Cycles a processor second: the simulated node beside simavr, the simulated bridge beside cocotb.

.venv/bin/python tools/benches pace    bench/results/pace.json, a section of docs/results/simulation.md

None of them simulates the same: a dsPIC is not an AVR, and cocotb's bridge has no USB device, no nodes and no host. So the
figures say what a clock cycle costs in each, not how much faster the one would make the other.
"""

import json
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

from .. import store
from ..node.image import BUILDS, IMAGES, TICK_CYCLES, translate
from .chain import bridge_speed
from .levels import FASTEST, TICKS_PER_S, processor_s, speed

ROOT = Path(__file__).resolve().parents[3]
HERE = Path(__file__).resolve().parent
DSPIC = ROOT / "firmware/dspic"
TICKS, LANES = 10_000, 6
AVR = "atmega1284p"
REPEATS = 20_000  # of the record, on the AVR
RTL_CASE = "rtl, SCK/6, gap 0.5 us"


def node(build: Path) -> dict[str, float]:
    """The simulated node: its firmware's C on the chip's registers, and its linked image, instruction by instruction."""
    programs, found = build / "sim/node_image" / BUILDS[0], {}
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "table"
        table.write_bytes(translate.table_of(translate.flash_words(IMAGES / BUILDS[0] / "node_wire.hex")))
        environment = ["env", f"NODE_IMAGE={table}", f"NODE_IMAGE_COSTS={Path(folder) / 'costs'}"]
        for program, what in (("native_records", "C on registers"), ("image_records", "image by instructions")):
            spent_s = processor_s([*environment, programs / program, TICKS, 1])
            found[f"node, {what}"] = TICKS * TICK_CYCLES / spent_s
    return found


def simavr() -> dict[str, float]:
    """The firmware's record on an AVR. RuntimeError: its compiler or simavr is not there or fails, with its own error."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "pace.elf"
        included = [f"-I{path}" for path in (DSPIC / "core", DSPIC / "tests/avr", ROOT / "protocol/gen")]
        sources = [HERE / "pace_avr.c", DSPIC / "core/record.c", DSPIC / "tests/avr/machine.c"]
        compiler = ["avr-gcc", f"-mmcu={AVR}", "-std=gnu99", "-Os", f"-DREPEATS={REPEATS}u", *included, *sources]
        said = Path(folder) / "said"
        run = ["simavr", "-m", AVR, "-f", "16000000", program]
        for name in (compiler[0], run[0]):
            if shutil.which(name) is None:
                raise RuntimeError(f"{name} is not installed; run make setup-tests")
        if error := store.failure([*compiler, "-o", program]):
            raise RuntimeError(error)
        spent_s = processor_s(["sh", "-c", '"$@" >"$0" 2>&1', said, *run])
        cycles = re.search(r"cycles (\d+), (\d+) orders", said.read_text(errors="replace"))
        if cycles is None:
            raise RuntimeError("simavr: the program did not say how many cycles it took")
        return {f"simavr, {AVR}": int(cycles[1]) / spent_s}


def bridge(build: Path) -> dict[str, float]:
    """The simulated bridge cycle by cycle, with USB device, nodes and host."""
    cycles = bridge_speed(build, LANES, FASTEST)["cycles_per_tick"]
    return {f"bridge, {LANES} nodes and host": cycles * TICKS_PER_S * speed(build, RTL_CASE, LANES)}


def cocotb() -> dict[str, float]:
    """The bridge without its USB device under cocotb. RuntimeError with cocotb's own error."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "pace.json"
        paths = os.pathsep.join(str(path) for path in (ROOT / "fpga/tb", ROOT / "fpga/tb/bridge", ROOT / "protocol"))
        environment = os.environ | {"PYTHONPATH": paths, "WHISKER_PACE": str(out), "WHISKER_BENCH_BUILD": folder}
        program = (
            "import bench, rig; bench.run_bench('whisker_bridge', "
            f"{str(HERE / 'pace_cocotb.py')!r}, *(f'{{n}}.v' for n in rig.RTL), "
            f"bench=({str(ROOT / 'fpga/tb/bridge/usb_stub.v')!r},))"
        )
        if error := store.failure([sys.executable, "-c", program], env=environment):
            raise RuntimeError(error)
        return {f"cocotb, {name}": pace for name, pace in json.loads(out.read_text()).items()}


def run(build: Path) -> None:
    """A minute in all: nothing is kept between runs."""
    found = node(build) | bridge(build)
    for name, measure in (("simavr", simavr), ("cocotb", cocotb)):
        try:
            found |= measure()
        except RuntimeError as error:
            store.leave_out(name, str(error))
    store.write_result("pace", {name: round(pace) for name, pace in found.items()})
