"""The simulated bridge at its two levels: how much faster transactions are than the gateware's clock, lanes populated.

Both run with the internal host of `whisker-bridge-sim --bench`, which checks every frame. Counted is processor time, in
one thread, less that of a short run (start-up), so other programs on the machine matter little; on a free core it is
the wall's.
"""

import resource
import statistics
import subprocess
from pathlib import Path

from tqdm import tqdm

from .. import store
from .chain import LINKS

LANES = (1, 6, 12, 28)
FASTEST, HARDWARE = LINKS.values()
# Level, link settings, simulated seconds. Without a clock the settings of the link cost nothing.
CASES = {
    "bytes": ("bytes", FASTEST, 40.0),
    "rtl, SCK/6, gap 0.5 us": ("rtl", FASTEST, 2.0),
    "rtl, SCK/16, gap 3 us (hardware)": ("rtl", HARDWARE, 1.0),
}
START_UP_S = 0.1  # simulated, of the short run
REPEATS = 3


def processor_s(command: list) -> float:
    """Processor seconds of a program, start to end."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def bench_of(build: Path, case: str, lanes: int) -> list:
    """The command of a case, less its seconds."""
    level, (divider, gap, sample), _ = CASES[case]
    command = [build / "sim/robot/whisker-bridge-sim", "--bench", "--level", level, "--lanes-populated", lanes]
    return [*command, "--sck-divider", divider, "--word-gap", gap, "--sample-point", sample, "--seconds"]


def speed(build: Path, case: str, lanes: int) -> float:
    """Simulated seconds per second of one processor."""
    command, seconds = bench_of(build, case, lanes), CASES[case][2]
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


def run(build: Path) -> None:
    """Two minutes in all: nothing is kept between runs."""
    store.write_result("levels", measure(build))
