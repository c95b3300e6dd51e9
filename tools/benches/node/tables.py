"""Tables of docs/results/node_faults.md."""

from ..store import read_result
from ..tables import lined, table

LOST = ((0, 0), (1, 1), (2, 2), (3, 10), (11, 50), (51, 300))  # groups of ticks


def faults() -> str:
    """By ticks lost: how many faults, and the worst of the six sets of parts."""
    costs = [(max(run["lost"] for run in row["runs"]), row["most"], row["fault"]) for row in read_result("node_faults")]
    rows = []
    for least, most in LOST:
        inside = [cost for cost in costs if least <= cost[0] <= most]
        worst = max(inside)
        rows.append(
            [
                f"{least}" if least == most else f"{least} to {most}",
                str(len(inside)),
                worst[2],
                f"{worst[0]} of {worst[1]}",
            ]
        )
    return table(["ticks lost", "faults", "the costliest", "its ticks, of those allowed"], rows)


def storm() -> str:
    found = read_result("node")["storm"]
    what = {
        "schedules": "schedules of random faults",
        "ticks": "ticks",
        "bad": "records flagged",
        "missed_line": "good samples hurt on the sensor's line that pass start byte, error word, sum and step by arithmetic",
        "missed_link": "good samples hurt on the link that pass CRC-8 and tick by arithmetic",
        "displaced": "sound samples read up to 49 us before their tick (see below)",
        "unexplained": "**hurt and good otherwise: unexplained**",
        "unforeseen": "bits hurt otherwise than the log foresees",
        "spurious": "bad records without a fault",
        "stuck": "nodes that did not come back",
        "violations": "breaches of a data sheet by the firmware, or words displaced where the log has no arming",
        "overwritten": "words of the link that its arming displaced amid a transfer at a wrong time, each in a record reported as bad",
    }
    return table(["what", "count"], [[text, f"{found[name]:,}".replace(",", " ")] for name, text in what.items()])


def image() -> str:
    records = read_result("node_image")["records"]
    return lined(
        [read_result("node_image")["cuts"]],
        {
            "ticks": lambda row: f"{sum(one['ticks'] for one in records):,}",
            "records that differ": lambda row: sum(one["differing"] for one in records),
            "updates right": "{right} of {runs}",
            "ticks until records return, at most": "{ticks_most}",
        },
    )
