"""docs/results/robot.md of what tools/benches robot has measured so far."""

from crunchbot.report.figures import TITLES as FILTERS

from .levels import CASES, LEAST_SEEDS, SCORES, TITLES
from .levels import SECONDS as LEVEL_S
from .odometry import METRES, PAPER, SEEDS

HEAD = """# The whole robot, measured

`tools/benches robot` on simulated hardware, two cores; figures in `bench/results/robot_*.json`. Scenes are those of `make demo`: arena, start and wrong prior
(0.2 m, 10 degrees) drawn from the seed; no seed here was used in development.
"""
WHY = """Why:

- Level 0 has one share of wrong windows and one radial error for all scenes, fitted to other runs at level 1 (`host/python/tests/scenes/test_levels.py`), and none of the
  places where signals err, such as borders of tiles.
- A tip on a face follows the closed form at both levels of mechanics. Of a shaft on a corner each level learns a line of its own.
- Large deflection without vibration (`elastica`) changed no score of 17 paired seeds against `static` and was removed.
- `modes` lets tips ring and bounce over steps; the texture models learn that ringing with the floors. Without it a few windows more are read.
- Until a pile let go of a tip that backed off, `static` took a hooked whisker along for seconds, and SMOOTH for VINYL.
- `static` is the default: texture, distances and poses are those of the finer levels, and it is the cheapest in work for each tick. Studies of whiskers that ring and of edges (`texture`, `contact`, `radial`,
  `mechanics`) use `modes`.
- Bytes without a Create differ from signals by the faults put in (bad records of sensors and lanes) alone: with the same bad samples the rows are equal, cell by cell
  (`host/python/tests/demo/test_levels_agree.py`).
- The Create's odometry comes in whole millimetres and degrees of its counters, 15 ms apart, and its wheels obey a serial line later: another path through the same arena.
- Gateware and bytes give the same frames.
"""
MISSING = "Not measured yet: `tools/benches robot --only {}`."


def page(found: dict) -> str:
    """The whole page; parts that are not measured say so."""
    parts = [HEAD, *_levels(found["levels"]), *_long(found.get("long", {}))]
    for part, write in (("odometry", _odometry), ("latency", _latency), ("instructions", _instructions)):
        parts += write(found[part]) if part in found else [MISSING.format(part)]
    return "\n".join(parts) + "\n"


def _table(header: list[str], rows: list[list[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def _levels(found: dict) -> list[str]:
    made = found["levels"]
    rows = []
    for case in CASES:
        if case.name in made:
            level = made[case.name]
            cells = [f"{scale * level['quartiles'][key][1]:.{digits}f}" for key, (_, scale, digits) in SCORES.items()]
            rows.append([case.title, str(level["seeds"]), f"{level['realtime_factor']:.3g}", *cells])
    left = [case.title for case in CASES if case.name not in made]
    header = ["level", "seeds", "times real time", *(title for title, _, _ in SCORES.values())]
    return [
        "## The same scenes at every level\n",
        f"One robot's whiskers, {LEVEL_S:g} s, the same arena, start, prior and pilot's seed at every level. Median over seeds of a run's median position error in mm.",
        "Times real time: simulated seconds per second of one processor, from the world to the poses of four filters, start of all processes included, training not.",
        "Mechanics of the object and floor whiskers are those of `sim/mechanics`; each level trains and calibrates at its own. Level 0 keeps the path and the rows that were",
        "read of the level-1 run with mechanics `static`, and draws the answers as `whisker scene make robot` does.\n",
        _table(header, rows),
        *([f"Not measured on these mechanics yet: {', '.join(left)}.\n"] if left else []),
        "![Error and texture accuracy against real-time factor](../charts/robot_levels.svg)\n",
        "The fastest level is on top. Bars: quartiles over seeds. Dotted: real time.\n",
        "### Where a lower level changes the answer\n",
        f"Paired by seed: mean difference, and, from {LEAST_SEEDS} seeds on, the interval that 95 % of bootstrap means fall into. Bold, and filled in the chart:",
        "zero is outside.\n",
        "![Paired differences between levels](../charts/robot_level_pairs.svg)\n",
        _pairs_table(found["pairs"]),
        _equal(found["rtl_rows_equal_bytes"]),
        WHY,
    ]


def _pairs_table(pairs: dict) -> str:
    rows = []
    for name, pair in pairs.items():
        ours, theirs = name.split(" - ")
        cells = [_interval(pair, key, scale, digits) for key, (_, scale, digits) in SCORES.items()]
        rows.append([f"{TITLES[ours]} less {TITLES[theirs]}", str(pair["seeds"]), *cells])
    return _table(["pair", "seeds", *(title for title, _, _ in SCORES.values())], rows)


def _interval(pair: dict, key: str, scale: float, digits: int) -> str:
    mean = f"{scale * pair[key]['mean']:+.{digits}f}"
    if pair["seeds"] < LEAST_SEEDS:
        return mean
    low, high = (scale * value for value in pair[key]["interval"])
    mark = "**" if low > 0 or high < 0 else ""
    return f"{mark}{mean}{mark} ({low:+.{digits}f} to {high:+.{digits}f})"


def _equal(equal: dict[str, bool]) -> str:
    if not equal:
        return ""
    same = sum(equal.values())
    return f"Observation rows at RTL level equal those at bytes level to the last digit in {same} of {len(equal)} runs: the gateware's clock adds nothing to the answer but its cost.\n"


def _long(found: dict) -> list[str]:
    parts = [
        "## Half an hour\n",
        "`make demo-long`: 30 simulated minutes. Lost: more than 0.25 m off; a loss ends after a second within it. For the pose signals are enough, by the table above; the",
        "command's default is `bytes`, which has the Create, the network and every process in it.\n",
    ]
    if not found:
        return [*parts, MISSING.format("long")]
    rows = []
    for name, run in found.items():
        for key in ("adaptive", "grid", "foveal", "odometry"):
            f = run["filters"][key]
            errors = [f"{f[which]:.3f}" for which in ("median_m", "p90_m", "max_m")]
            rows.append(
                [
                    name,
                    FILTERS[key],
                    *errors,
                    f"{100 * f['lost_share']:.1f} %",
                    str(f["losses"]),
                    f"{f['longest_loss_s']:.1f}",
                ]
            )
    header = ["run", "estimate", "median (m)", "90 % (m)", "largest (m)", "time lost", "losses", "longest (s)"]
    met = [
        [
            name,
            f"{run['driven_m']:.0f}",
            f"{run['tiles_visited']} of {run['tiles']}",
            str(run["contacts"]),
            str(run["whisks"]),
        ]
        + [f"{100 * run['texture_accuracy']:.1f} %", f"{run['simulated_s'] / run['chain_wall_s']:.2f}"]
        for name, run in found.items()
    ]
    names = ["run", "driven (m)", "tiles", "contacts", "whisks measured", "texture right", "times real time, wall"]
    chart = (
        "![Position error of every estimate over half an hour](../charts/robot_long.svg)\n\nThe run at bytes level.\n"
    )
    return [*parts, _table(header, rows), _table(names, met), chart]


def _odometry(found: dict) -> list[str]:
    rows = [
        [
            title,
            *(_worst(moves[kind], key) for kind in ("straight", "turn") for key in ("rms", "worst", "beyond_paper")),
        ]
        for title, moves in found.items()
    ]
    header = [
        "base and driver",
        "straight, rms %",
        "worst %",
        "moves beyond 5 %",
        "turn, rms %",
        "worst %",
        "moves beyond 5 %",
    ]
    return [
        f"## Odometry against the paper's {100 * PAPER:g} %\n",
        f"Emulator and driver, {METRES:g} m straight and 180 degrees on the spot, {SEEDS} worlds each, from rest to rest. The worst speed of each kind, largest root mean square and largest single error:\n",
        _table(header, rows),
        "![Odometry error against speed](../charts/robot_odometry.svg)\n",
        "The simulated wheels run just as ordered and count wrong (1 % a run, 2 % a move): what is integrated from orders (`auto` on a Create 1, when it has not found that the",
        "firmware keeps remainders) is better here than it can be on a floor. The error that is a robot's own is that of the counters: packets 19 and 20 with the remainder kept,",
        "or encoders. A Create 1 that drops remainders tells no turn at all at the whisk's rate (0.13 rad/s), nor up to 1 rad/s; its driver must integrate orders.\n",
    ]


def _worst(moves: list[dict], key: str) -> str:
    return (
        f"{100 * max(move[key] for move in moves):.2f}"
        if key != "beyond_paper"
        else f"{100 * max(m[key] for m in moves):.0f} %"
    )


def _latency(found: dict) -> list[str]:
    rows = [
        [name, kind, str(values["n"]), f"{values['p50_ms']:.3g}", f"{values['p99_ms']:.3g}"]
        for kind in ("simulated", "processor", "wall")
        for name, values in found[kind].items()
    ]
    return [
        "## From touch to pose\n",
        "*Simulated* is time of the robot's clock, the same on any machine; *processor* is time of one processor of this machine; *wall* is between two processes on this machine,",
        f"one row at a time over zenoh on loopback, with other work running (load average {found['load_average']:g} on two cores at the end).\n",
        _table(["part", "kind of time", "n", "p50 (ms)", "p99 (ms)"], rows),
        "![Latency part by part](../charts/robot_latency.svg)\n",
        "USB adds at most 0.5 ms (two frames a packet, 1 ms in batches of whiskerd), the ring what `ring.json` says (6 us in the middle, waiting reader). Neither shows: the waits for",
        "the block and for the paper's row of 100 ms are larger by orders. The largest simulated part is the whisker's own bending. A distance is known when the whisker lets go, seconds after the touch: that is how the paper measures.\n",
    ]


def _instructions(found: dict) -> list[str]:
    if "skipped" in found:
        return ["## Instructions of the netbook side\n", f"{found['skipped']}.\n"]
    rows = [[name, f"{1e-6 * f['per_s']:.1f}", f"{100 * f['atom_share']:.1f} %"] for name, f in found.items()]
    return [
        "## Instructions of the netbook side\n",
        "User instructions per simulated second, and their share of the paper's Atom (0.8e9 a second). Pilot and `whisker-base` by `perf stat` in lock-step runs with six whiskers,",
        "start-up taken off; whiskerd as `tools/benches host` counts it with 28 lanes. The pilot is Python on numpy: most of it is the interpreter. The kernel's share is not in.\n",
        _table(["program", "million per second", "share"], rows),
    ]
