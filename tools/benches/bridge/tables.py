"""Tables of docs/results/robot.md and docs/boards.md."""

from ..store import read_result
from ..tables import lined, table

WAYS, CELLS = ("out_ns", "in_ns", "through_ns"), ("LUT", "FF", "block RAM", "distributed RAM")
GOAL_MHZ = 60.0


def placed(*lanes: str) -> str:
    """The default command of every board at these numbers of lanes."""
    rows = []
    for board in (board for _, board in sorted(read_result("bridge")["boards"].items())):
        for run in (run for run in board["runs"] if "seed" in run and str(run["lanes"]) in lanes):
            ways = [f"{run[way]:.1f} of {board['limits'][way]:.1f} ns" if board["limits"] else "-" for way in WAYS]
            least = board["least"].get("shortest_in_ns")
            rows.append(
                [f"{board['title']} ({board['part']}, grade {board['speed']}), {run['lanes']}", str(run["seed"])]
                + [f"{run['fmax_mhz']:.1f} MHz: {100 * (run['fmax_mhz'] / GOAL_MHZ - 1):.1f} % to spare", *ways]
                + ["-" if least is None else f"{run['shortest_in_ns']:.1f} of {least:.1f} ns"]
                + [*(str(run["used"][cell]) for cell in CELLS), "; ".join(run["problems"]) or "none"]
            )
    head = ["board, lanes", "seed", "clock reached (goal: 60)", "out", "in", "through", "shortest in, at least", *CELLS]
    return table([*head, "problem"], rows)


def chain() -> str:
    found = read_result("chain_speed")
    links = sorted(found["bridge"], key=lambda link: "hardware" not in link)  # the hardware's own settings first
    rows = [{"what": f"bridge and nodes, {link}"} | run for link in links for run in found["bridge"][link]]
    whole = {"what": "whole chain to the pilot, SCK/6", "cycles_per_tick": None}
    rows += [whole | run for run in found["whole_chain"]]
    columns = {"what runs": "{what}", "lanes": "{lanes}", "cycles per tick": "{cycles_per_tick:.0f}"}
    return lined(rows, columns | {"times real time": "{realtime_factor:.2f}"})


def levels() -> str:
    found = dict(sorted(read_result("levels").items(), key=lambda row: ("rtl" in row[0], "hardware" not in row[0])))
    first, *others = found
    rows = []
    for runs in zip(*found.values(), strict=True):
        factors = [run["realtime_factor"] for run in runs]
        rows.append(
            [str(runs[0]["lanes"]), *(f"{f:.3g}" for f in factors), *(f"{factors[0] / f:.3g}" for f in factors[1:])]
        )
    return table(["lanes", *found, *(f"{first} / {other}" for other in others)], rows)


def demo_errors() -> str:
    run = read_result("demo")
    rows = []
    for key, name in {
        "adaptive": "adaptive",
        "pose": "grid",
        "foveal": "foveal grid",
        "odometry": "odometry alone",
    }.items():
        p90 = run.get(f"{key}_error_p90_m")
        rows.append([name, f"{1000 * run[f'{key}_error_median_m']:.0f}", "" if p90 is None else f"{1000 * p90:.0f}"])
    return table(["estimate", "median position error, mm", "90 % of the rows, mm"], rows)
