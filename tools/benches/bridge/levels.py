"""The simulated bridge at its two levels: how much faster transactions are than the gateware's clock, lanes populated.

Both run with the internal host of `whisker-bridge-sim --bench`, which checks every frame. Counted is processor time, in
one thread, less that of a short run (start-up), so other programs on the machine matter little; on a free core it is
the wall's.
"""

import resource
import statistics
import subprocess
from pathlib import Path

from matplotlib.figure import Figure
from tqdm import tqdm

from .. import store
from .chain import LINKS

LANES = (1, 6, 28)
FASTEST, HARDWARE = LINKS.values()
# Level, link settings, simulated seconds. Without a clock the settings of the link cost nothing.
CASES = {
    "bytes": ("bytes", FASTEST, 4.0),
    "rtl, SCK/6, gap 0.5 us": ("rtl", FASTEST, 1.0),
    "rtl, SCK/16, gap 3 us (hardware)": ("rtl", HARDWARE, 0.5),
}
START_UP_S = 0.1  # simulated, of the short run
REPEATS = 3


def processor_s(command: list) -> float:
    """Processor seconds of a program, start to end."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def speed(build: Path, case: str, lanes: int) -> float:
    """Simulated seconds per second of one processor."""
    level, (divider, gap, sample), seconds = CASES[case]
    command = [build / "sim/robot/whisker-bridge-sim", "--bench", "--level", level, "--lanes-populated", lanes]
    command += ["--sck-divider", divider, "--word-gap", gap, "--sample-point", sample, "--seconds"]
    return seconds / (processor_s([*command, START_UP_S + seconds]) - processor_s([*command, START_UP_S]))


def measure(build: Path) -> dict:
    """Medians, with every repeat's figure; the cases take turns, so that a slow moment strikes all of them."""
    found = {case: {lanes: [] for lanes in LANES} for case in CASES}
    turns = [(case, lanes) for _ in range(REPEATS) for lanes in LANES for case in CASES]
    for case, lanes in tqdm(turns, desc="levels", unit="run"):
        found[case][lanes].append(round(speed(build, case, lanes), 3))
    return {
        case: [{"lanes": n, "realtime_factor": statistics.median(runs), "runs": runs} for n, runs in by_lanes.items()]
        for case, by_lanes in found.items()
    }


def draw(found: dict) -> Figure:
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    for (case, points), style in zip(found.items(), ("^-", "o-", "s--"), strict=True):
        axes.plot([p["lanes"] for p in points], [p["realtime_factor"] for p in points], style, label=case)
    axes.axhline(1.0, color="0.3", linewidth=1)
    axes.annotate("real time", (LANES[-1], 1.0), textcoords="offset points", xytext=(0, 4), ha="right", color="0.3")
    axes.set(xlabel="populated lanes", ylabel="simulated seconds per processor second", yscale="log", xticks=LANES)
    axes.legend(frameon=False, title="bridge and nodes, level")
    return figure


def run(build: Path) -> None:
    """Half a minute in all: nothing is kept between runs."""
    found = measure(build)
    store.write_result("levels", found)
    store.write_chart("levels_speed", draw(found))
