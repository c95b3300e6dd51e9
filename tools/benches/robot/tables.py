"""Tables of docs/results/robot.md."""

from crunchbot_lab.report.figures import TITLES as FILTERS

from ..store import read_result
from ..tables import lined, named


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
