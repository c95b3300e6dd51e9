"""bench/results/drills.json and the table of docs/results/drills.md, of one or more runs.

PYTHONPATH=tests:tools python -m drills.page build/drills/seed3/drills.json ...
"""

import json
import sys
from collections.abc import Iterable
from pathlib import Path
from statistics import median

import numpy as np
from benches.store import write_result

from .course import ANSWER_S, FOUND_S, STOP_S
from .faults import FAULTS
from .witness import NEAR_M

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/results/drills.md"
BEGIN, END = "<!-- table: written by tests/drills/page.py -->", "<!-- end -->"
HEADER = (
    "| fault | times | stop, s: median, worst | all answer, s: median, worst | near again, s: median, worst | lost | reported "
    "| failures |\n|---|---|---|---|---|---|---|---|\n"
)


def spread(values: Iterable[float | None]) -> str:
    """Median and worst; those that never came are said first."""
    values = list(values)
    known = [value for value in values if value is not None]
    never = f"{len(values) - len(known)} never" if len(known) < len(values) else ""
    reported = f"{median(known):.2f}, {max(known):.2f}" if known else ""
    return "; ".join(filter(None, (never, reported))) or "-"


def row(fault, events: list[dict]) -> str:
    stops = [e["stop_s"] for e in events if fault.commander and e["moving"]]
    found = [e["found_s"] for e in events if e["ready"]]
    gaps = [e["gap"] for e in events if e["gap"]]
    lost, reported = (
        f"{sum(g[key] for g in gaps):.0f} {gaps[0]['unit']}" if gaps else "-" for key in ("real", "reported")
    )
    failed = sum(bool(e["failures"]) for e in events)
    answered = [e["answered_s"] for e in events]
    cells = (fault.name, len(events), spread(stops), spread(answered), spread(found), lost, reported, failed)
    return "| " + " | ".join(map(str, cells)) + " |\n"


def table(runs: list[dict]) -> str:
    """What the runs gave, as Markdown."""
    events = [event for run in runs for event in run["events"]]
    errors = np.array([error for run in runs for error in run["errors_m"]])
    simulated, wall = (sum(run[key] for run in runs) for key in ("simulated_s", "wall_s"))
    seeds = ", ".join(str(run["seed"]) for run in runs)
    lines = [
        f"{simulated / 60:.1f} simulated minutes in {wall / 60:.1f} of the wall, seeds {seeds}, level ",
        runs[0]["level"],
    ]
    lines += [
        f"; {len(events)} faults, {sum(bool(e['failures']) for e in events)} with failures. Pose over all, faults "
    ]
    lines += [f"included: median {np.median(errors):.3f} m, p90 {np.quantile(errors, 0.9):.3f} m, "]
    lines += [f"{100 * np.mean(errors > NEAR_M):.1f} % of the answers off by more than {NEAR_M} m.\n\n", HEADER]
    for fault in FAULTS:
        if mine := [event for event in events if event["fault"] == fault.name]:
            lines.append(row(fault, mine))
    wrong = [
        f"- {e['fault']}, seed {run['seed']}, {e['at_s']:.1f} s: {w}\n"
        for run in runs
        for e in run["events"]
        for w in e["failures"]
    ]
    return "".join([*lines, "\nFailures:\n\n" if wrong else "", *wrong])


def summary(runs: list[dict]) -> dict:
    """For bench/results: the events as they were, errors as quantiles."""
    reported = []
    for run in runs:
        errors = np.array(run["errors_m"])
        quantiles = {f"error_p{q}_m": round(float(np.percentile(errors, q)), 4) for q in (50, 90, 99)}
        kept = {key: value for key, value in run.items() if key != "errors_m"}
        reported.append(kept | quantiles | {"answers": len(errors), "answers_off": int((errors > NEAR_M).sum())})
    return {"limits": {"stop_s": STOP_S, "answer_s": ANSWER_S, "near_s": FOUND_S, "near_m": NEAR_M}, "runs": reported}


def main(paths: list[str]) -> None:
    runs = [json.loads(Path(path).read_text()) for path in paths]
    write_result("drills", summary(runs))
    before, _, rest = PAGE.read_text().partition(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}\n\n{table(runs)}{END}{rest.partition(END)[2]}")


if __name__ == "__main__":
    main(sys.argv[1:])
