"""What a run of mutants found: the killed share with its interval, by language, and each survivor with its verdict.

Verdicts are given by a person, in verdicts.toml: `equivalent` with the reason why no test can notice the change.
"""

import tomllib
from collections import Counter
from pathlib import Path

from crunchbot_lab.report.share import wilson

VERDICTS = Path(__file__).with_name("verdicts.toml")
KEY = ("file", "text", "before", "after")  # of a verdict: `text` is the whole line, which outlives its number


def summarise(entries: list[dict], seed: int, commit: str) -> dict:
    """The result that is kept. Shares count the mutants that compile; an equivalent one is no survivor."""
    valid = [entry for entry in entries if entry["outcome"] != "invalid"]
    survivors = [entry | {"equivalent": verdict_of(entry)} for entry in valid if entry["outcome"] == "survived"]
    open_ones = [entry for entry in survivors if not entry["equivalent"]]
    judged, killed = len(valid) - (len(survivors) - len(open_ones)), len(valid) - len(survivors)
    low, high = wilson(killed, len(valid))
    languages = {}
    for suffix in ("c", "h", "py", "v"):
        outcomes = Counter(entry["outcome"] for entry in valid if entry["file"].endswith(f".{suffix}"))
        languages[suffix] = {"tried": outcomes.total(), "killed": outcomes["killed"]}
    line = (
        f"{killed} of {len(valid)} mutants killed ({killed / len(valid):.1%}, 95 % interval {low:.1%} to {high:.1%}); "
    )
    line += f"{len(survivors)} survive, {len(survivors) - len(open_ones)} of them equivalent"
    return {
        "line": line,
        "commit": commit,
        "seed": seed,
        "tried": len(valid),
        "killed": killed,
        "killed_share": killed / len(valid),
        "killed_share_interval": [low, high],
        "killed_share_without_equivalent": killed / judged if judged else 1.0,
        "by_language": languages,
        "by_nearest_tests": sum(entry["outcome"] == "killed" and entry["step"] == 0 for entry in valid),
        "survivors": survivors,
    }


def verdict_of(entry: dict) -> str:
    """Why a survivor changes no behaviour; empty: nobody has shown that."""
    if not VERDICTS.exists():
        return ""
    key = [entry[name] for name in KEY]
    verdicts = tomllib.loads(VERDICTS.read_text())["equivalent"]
    return next((verdict["reason"] for verdict in verdicts if [verdict[name] for name in KEY] == key), "")
