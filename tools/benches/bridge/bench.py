"""The bridge in an FPGA and in simulation: lanes against resources, clock, cycles per tick and speed; five seeds per board.

Place and route takes minutes each, an hour in all; every one is kept in build/bench/bridge, so that an interrupted run goes on
where it stopped. Timing figures are nextpnr's own; the limits of the PHY's pins are those of fpga/boards/report.py.
"""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure
from tqdm import tqdm

from .chain import LANES, LINKS

ROOT = Path(__file__).resolve().parents[3]
RESULTS, CHARTS, CACHE = ROOT / "bench/results", ROOT / "docs/charts", ROOT / "build/bench/bridge"
sys.path[:0] = [str(ROOT / "fpga" / folder) for folder in ("boards", "tb")]

import build as boards  # noqa: E402
import cycles  # noqa: E402
import report  # noqa: E402

from whisker.protocol import FRAME_BYTES, LIMITS  # noqa: E402

SWEPT = "colorlight_i9"  # has pins for every number of lanes
SEEDS = tuple(range(1, 6))
PACES = (4000, 2000, 1000, 600, 530, 522, 521, 520, 519, 518, 517, 516)  # cycles from tick to tick
PACED_TICKS = 2000
BEGIN, END = "<!-- tools/benches bridge writes from here -->", "<!-- to here -->"  # in docs/boards.md
WORST = (
    "| board, lanes | clock reached (60 wanted) | out | in | through | shortest in, at least "
    "| LUT | FF | block RAM | distributed RAM |"
)
EACH = "| board, grade | seed 1, MHz | 2 | 3 | 4 | 5 | spread | time to spare | pins: least slack |"
SWEEP = (
    "| lanes | LUT | FF | block RAM | distributed RAM | clock | cycles per tick "
    "| USB at 2 kHz, bytes/s | simulated seconds per second |"
)


def once(name: str, measure: Callable[[], dict]) -> dict:
    """A measurement, from the cache if an earlier run has made it."""
    path = CACHE / f"{name}.json"
    if not path.exists():
        value = measure()
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(value, indent=1) + "\n")
    return json.loads(path.read_text())


def placed(name: str, lanes: int, seed: int) -> dict:
    """One place and route; the netlist is made once per top module and number of lanes."""
    board = boards.load(name)
    made, out = CACHE / f"netlist_{board.top}_{lanes}", CACHE / f"{name}_{lanes}"
    netlist = made / "netlist.json"
    if not netlist.exists():
        boards.prepare(board, lanes, made)
    out.mkdir(exist_ok=True)
    shutil.copy(netlist, out)
    found = boards.place(board, lanes, netlist, out, seed)
    return {**found, "problems": report.timing_problems(found, board.speed, board.phy)}


def fabric() -> dict:
    """Five seeds per board, and the sweep over lanes."""
    jobs = [(name, boards.load(name).lanes, seed) for seed in SEEDS for name in boards.boards()]
    jobs += [(SWEPT, lanes, SEEDS[0]) for lanes in LANES if lanes != boards.load(SWEPT).lanes]
    done = {}
    for name, lanes, seed in tqdm(jobs, desc="place and route", unit="run"):
        done[name, lanes, seed] = once(f"{name}_{lanes}_{seed}", lambda j=(name, lanes, seed): placed(*j))
    return {
        "seeds": {name: seeds_of(done, name) for name in boards.boards()},
        "lanes": [{"lanes": n, **done[SWEPT, n, SEEDS[0]]} for n in LANES],
    }


def seeds_of(done: dict, name: str) -> dict:
    """A board's five results beside its limits."""
    board = boards.load(name)
    runs = [done[name, board.lanes, seed] for seed in SEEDS]
    facts = {key: getattr(board, key) for key in ("title", "part", "speed", "lanes")}
    spare = report.data_spare(board.speed, board.phy)
    least = {"shortest_in_ns": report.hold_needed(board.speed, board.phy)}
    return {**facts, "limits": report.pin_limits(board.speed, board.phy), "least": least, **spare, "runs": runs}


def latency(link: tuple[int, int, int]) -> dict:
    """From the SYNC that starts a reading to the first byte of its frame for USB, at worst: a period, then the next tick."""
    transfer = cycles.transfer(*link[:2])
    total = LIMITS["tick_period"] + transfer + FRAME_BYTES + cycles.FRAMER
    return {"transfer_cycles": transfer, "first_byte_us": total / LIMITS["clock_hz"] * 1e6}


def paced(build: Path, period: int) -> dict:
    """28 lanes at packet level with a tick asked for every `period` cycles, or what went wrong."""
    command = [build / "sim/bridge/usb_device/bridge-pace", str(period), str(PACED_TICKS)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return json.loads(done.stdout) if done.stdout else {"period": period, "error": done.stderr.strip()}


def sustained(found: dict) -> bool:
    """Whether every tick became a frame whose records are all good."""
    return "error" not in found and found["frames"] == found["asked"] and not found["bad_records"]


def rates(build: Path) -> dict:
    """What the bridge sustains when nodes can follow: by its settings' limit, and measured, faster and faster."""
    tried = [once(f"pace_{period}", lambda p=period: paced(build, p)) for period in PACES]
    fastest = min(found["period"] for found in tried if sustained(found))
    hertz = {"settings_hz": LIMITS["clock_hz"] / LIMITS["tick_period_min"], "link_hz": LIMITS["clock_hz"] / fastest}
    return {
        **hertz,
        "usb_bytes_per_s": {name: rate * FRAME_BYTES for name, rate in (("at 2 kHz", 2000), *hertz.items())},
        "tried": tried,
    }


def simulation() -> dict:
    """The Verilated bridge with nodes and host over lanes, as bench_chain has measured it last."""
    return json.loads((RESULTS / "chain_speed.json").read_text())["bridge"]


def draw_lanes(found: dict) -> Figure:
    """Resources and clock over lanes."""
    figure = Figure(figsize=(7, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    points = found["lanes"]
    for (name, style), marker in zip((("LUT", "-"), ("FF", "--"), ("distributed RAM", ":")), "os^", strict=True):
        left.plot(LANES, [p["used"][name] for p in points], style, marker=marker, color="0.2", label=name)
    left.set(xlabel="lanes", ylabel="cells (of 43 848 LUT)", ylim=(0, None), xticks=LANES)
    left.legend(frameon=False)
    right.plot(LANES, [p["fmax_mhz"] for p in points], "o-", color="0.2")
    right.axhline(report.CLOCK_MHZ, color="0.5", linewidth=1, linestyle="--")
    right.annotate(
        f"{report.CLOCK_MHZ:g} MHz wanted",
        (1, report.CLOCK_MHZ),
        textcoords="offset points",
        xytext=(0, 4),
        color="0.3",
    )
    right.set(xlabel="lanes", ylabel="clock, MHz (nextpnr, one seed)", ylim=(50, None), xticks=LANES)
    return figure


def pin_slack(board: dict, run: dict) -> float:
    """The least that one placement leaves of the limits of the PHY's pins, before and after the edge, in ns."""
    spare = [limit - run[name] for name, limit in board["limits"].items()]
    spare += [run[name] - least for name, least in board["least"].items()]
    return min(*spare, board["data_setup_ns"], board["data_hold_ns"])


def row(board: dict) -> str:
    """A board's line in the table of docs/boards.md: the worst of its seeds."""
    runs = board["runs"]
    clock = min(run["fmax_mhz"] for run in runs)
    ways = [f"{max(run[name] for run in runs):.1f} of {limit:.1f} ns" for name, limit in board["limits"].items()]
    shortest = f"{min(run['shortest_in_ns'] for run in runs):.1f} of {board['least']['shortest_in_ns']:.1f} ns"
    used = [f"{max(run['used'][name] for run in runs)}" for name in ("LUT", "FF", "block RAM", "distributed RAM")]
    name = f"{board['title']} ({board['part']}, grade {board['speed']}), {board['lanes']}"
    clock_text = f"{clock:.1f} MHz: {100 * (clock / report.CLOCK_MHZ - 1):.1f} % to spare"
    return "| " + " | ".join([name, clock_text, *ways, shortest, *used]) + " |"


def sweep_rows(found: dict) -> list[str]:
    """Lines of the table of lanes: fabric of the swept board, and bench_chain's speed of the Verilated bridge."""
    link = next(iter(LINKS))
    rows = []
    for point, speed in zip(found["lanes"], found["simulation"][link], strict=True):
        used = [point["used"][name] for name in ("LUT", "FF", "block RAM", "distributed RAM")]
        cells = [point["lanes"], *used, f"{point['fmax_mhz']:.1f} MHz", f"{speed['cycles_per_tick']:.0f}"]
        cells += [
            f"{found['rates']['usb_bytes_per_s']['at 2 kHz']:,}".replace(",", " "),
            f"{speed['realtime_factor']:.2f}",
        ]
        rows.append("| " + " | ".join(map(str, cells)) + " |")
    return rows


def seed_rows(found: dict) -> list[str]:
    """Lines of the table of seeds: each one's clock, how far they lie apart, the least slack of the pins."""
    rows = []
    for _, board in sorted(found["seeds"].items()):
        clocks = [run["fmax_mhz"] for run in board["runs"]]
        slack = min(pin_slack(board, run) for run in board["runs"])
        cells = [f"{board['title']}, grade {board['speed']}", *(f"{mhz:.1f}" for mhz in clocks)]
        cells += [
            f"{max(clocks) - min(clocks):.1f}",
            f"{1e3 / report.CLOCK_MHZ - 1e3 / min(clocks):.2f} ns",
            f"{slack:.2f} ns",
        ]
        rows.append("| " + " | ".join(cells) + " |")
    return rows


def table(head: str, rows: list[str]) -> str:
    """A table in Markdown; `head`: its first line."""
    return "\n".join([head, "|---" * (head.count("|") - 1) + "|", *rows])


def section(found: dict) -> str:
    """What docs/boards.md says of these figures."""
    return "\n\n".join(
        (
            "The worst of five seeds:",
            table(WORST, [row(board) for _, board in sorted(found["seeds"].items())]),
            "LUT counts nextpnr's cells, carry chains included. The clock with each seed, and what the worst one leaves of "
            f"{1e3 / report.CLOCK_MHZ:.2f} ns and of the limits of the PHY's pins:",
            table(EACH, seed_rows(found)),
            "![Clock and slack of the pins for each seed](charts/bridge_seeds.png)",
            f"Lanes, on the {boards.load(SWEPT).title}, seed {SEEDS[0]}; simulation (`tools/benches chain`) at {next(iter(LINKS))}:",
            table(SWEEP, sweep_rows(found)),
            "![Resources and clock over lanes](charts/bridge_lanes.png)",
        )
    )


def write_section(found: dict) -> None:
    """Puts it between the marks in docs/boards.md."""
    path = ROOT / "docs/boards.md"
    before, rest = path.read_text().split(BEGIN)
    after = rest.split(END)[1]
    path.write_text(f"{before}{BEGIN}\n\n{section(found)}\n\n{END}{after}")


def draw_seeds(found: dict) -> Figure:
    """Clock and slack of the PHY's pins for each seed."""
    figure = Figure(figsize=(7, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    spare = report.CLOCK_MHZ * report.SPARE[8]
    for (_, board), marker, shade in zip(sorted(found["seeds"].items()), "os^", ("0.0", "0.3", "0.6"), strict=True):
        label = f"{board['title']}, grade {board['speed']}"
        left.plot(SEEDS, [run["fmax_mhz"] for run in board["runs"]], marker, color=shade, label=label)
        right.plot(SEEDS, [pin_slack(board, run) for run in board["runs"]], marker, color=shade, label=label)
    for axes, level, words in (
        (left, report.CLOCK_MHZ, "wanted"),
        (left, spare, "wanted on grade 8"),
        (right, 0, "the limit"),
    ):
        axes.axhline(level, color="0.5", linewidth=1, linestyle="--")
        axes.annotate(words, (SEEDS[2], level), xytext=(0, 3), textcoords="offset points", ha="center", fontsize=7)
    left.set(xlabel="seed", xticks=SEEDS, ylabel="clock, MHz", ylim=(50, None))
    right.set(xlabel="seed", xticks=SEEDS, ylabel="least slack of the PHY's pins, ns", ylim=(-0.1, None))
    figure.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False, fontsize=8)
    return figure


def save(figure: Figure, name: str) -> None:
    CHARTS.mkdir(parents=True, exist_ok=True)
    figure.savefig(CHARTS / f"bridge_{name}.svg", metadata={"Date": None})
    figure.savefig(CHARTS / f"bridge_{name}.png", dpi=120)


def run(build: Path, fresh: bool) -> None:
    """All figures of the bridge: bench/results/bridge.json, docs/charts/bridge_*, the table of docs/boards.md.

    `build` runs the pace alone: the simulation's speed is bench_chain's.
    """
    if fresh:
        shutil.rmtree(CACHE, ignore_errors=True)
    found = fabric()
    found |= {"latency": {title: latency(link) for title, link in LINKS.items()}, "rates": rates(build)}
    found["simulation"] = simulation()
    (RESULTS / "bridge.json").write_text(json.dumps(found, indent=1) + "\n")
    save(draw_lanes(found), "lanes")
    save(draw_seeds(found), "seeds")
    write_section(found)
