"""Tables of docs/results/robot.md."""

from crunchbot_lab.report.figures import TITLES as FILTERS

from ..store import read_result
from ..tables import lined, named, table
from .levels import SCORES, TITLES

LEAST_SEEDS = 5  # of an interval that is worth reporting


def levels() -> str:
    rows = []
    for name, level in read_result("robot_levels")["levels"].items():
        cells = [f"{scale * level['quartiles'][key][1]:.{digits}f}" for key, (_, scale, digits) in SCORES.items()]
        rows.append([TITLES[name], str(level["seeds"]), f"{level['realtime_factor']:.3g}", *cells])
    return table(["level", "seeds", "times real time", *(title for title, *_ in SCORES.values())], rows)


def pairs() -> str:
    def interval(pair: dict, key: str, scale: float, digits: int) -> str:
        mean = f"{scale * pair[key]['mean']:+.{digits}f}"
        if pair["seeds"] < LEAST_SEEDS:
            return mean
        low, high = (scale * value for value in pair[key]["interval"])
        mark = "**" if low > 0 or high < 0 else ""
        return f"{mark}{mean}{mark} ({low:+.{digits}f} to {high:+.{digits}f})"

    rows = []
    for name, pair in read_result("robot_levels")["pairs"].items():
        ours, theirs = (TITLES[part] for part in name.split(" - "))
        cells = [interval(pair, key, scale, digits) for key, (_, scale, digits) in SCORES.items()]
        rows.append([f"{ours} less {theirs}", str(pair["seeds"]), *cells])
    return table(["pair", "seeds", *(title for title, *_ in SCORES.values())], rows)


def long() -> str:
    runs = read_result("robot_long")
    return lined(
        named(
            {run: {name: found["filters"][name] for name in FILTERS} for run, found in runs.items()}, "run", "filter"
        ),
        {
            "run": "{run}",
            "estimate": lambda row: FILTERS[row["filter"]],
            "median (m)": "{median_m:.3f}",
            "90 % (m)": "{p90_m:.3f}",
            "largest (m)": "{max_m:.3f}",
            "time lost": "{lost_share:100*.1f} %",
            "losses": "{losses}",
            "longest (s)": "{longest_loss_s:.1f}",
        },
    )


def long_met() -> str:
    return lined(
        named(read_result("robot_long"), "run"),
        {
            "run": "{run}",
            "driven (m)": "{driven_m:.0f}",
            "tiles": "{tiles_visited} of {tiles}",
            "contacts": "{contacts}",
            "whisks measured": "{whisks}",
            "texture right": "{texture_accuracy:100*.1f} %",
            "times real time, wall": lambda run: f"{run['simulated_s'] / run['chain_wall_s']:.2f}",
        },
    )
