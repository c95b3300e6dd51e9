"""The table of docs/methods/mechanics.md."""

from ..store import read_result
from ..tables import table


def summary() -> str:
    found = read_result("mechanics")
    s, edges = found["summary"], found["edges"]
    return table(
        ["figure", "value"],
        [
            ["MuJoCo", found["mujoco"]],
            [
                f"base moment, {s['points']} points to slip-off, large deflection: worst",
                f"{s['large_worst_percent']:.1f} %",
            ],
            ["the same: RMS", f"{s['large_rms_percent']:.2f} %"],
            ["the same, closed form up to 5 degrees: worst", f"{s['closed_worst_percent_to_5_deg']:.1f} %"],
            ["natural frequencies: worst", f"{s['frequency_worst_percent']:.2f} %"],
            ["edges: cases in which chains of 20 and 40 links agree", f"{edges['chains_agree']} of {edges['cases']}"],
            ["in these `static` agrees with 20 links", f"{edges['static_met']}"],
            ["in these `modes` agrees with 20 links", f"{edges['modes_met']}"],
        ],
    )
