"""Tables of docs/results.md: the figures of bench/headlines.toml, each with its origin; every chart's command."""

import json
import tomllib

from ..store import CHARTS, COMMAND_OF_CHART, COMMAND_OF_RESULT, ORIGINS, RESULTS, ROOT, read_result
from ..tables import cell, table

HEADLINES = tomllib.loads((ROOT / "bench/headlines.toml").read_text())["figure"]


def fields(result: str) -> dict:
    """Of a result, for patterns; sums and choices that a pattern cannot make."""
    data = read_result(result)
    if result == "nav_families":
        return data["families"]["all"] | {"families": len(data["draws"])}
    if result == "ring":
        polling = {"mode": "poll", "pace": "2khz", "readers": 1}
        return {row["peer"]: row["latency_us"]["p50"] for row in data["rows"] if polling.items() <= row.items()}
    if result == "usb_soak":
        return data | {"bad": sum(data[key] for key in ("gaps", "duplicates", "wrong", "stale"))}
    if result == "levels":
        hardware = data["rtl, SCK/16, gap 3 us (hardware)"]
        runs = hardware[1]["runs"]
        spread = {"runs": len(runs), "low": min(runs), "high": max(runs)}
        return data | spread | {"hardware": hardware, "gateware": data["rtl, SCK/6, gap 0.5 us"]}
    if result == "map":
        return data["families"]
    return data


def headlines() -> str:
    origins = json.loads((RESULTS / ORIGINS).read_text())
    rows = []
    for one in HEADLINES:
        found, origin = fields(one["result"]), origins[one["result"]]
        commit = f"{origin['commit']}, stored by {origin['stored_by']}" if "stored_by" in origin else origin["commit"]
        value, n, beside = (cell(one[key], found) for key in ("value", "n", "beside"))
        made = f"`{COMMAND_OF_RESULT[one['result']]}`"
        rows.append([one["title"], value, one["unit"], n, beside, made, commit, origin["machine"]])
    return table(["figure", "value", "unit", "n, how sure", "compared with", "made by", "commit", "machine"], rows)


def charts() -> str:
    rows = [
        [f"[{name}](charts/{name}.svg)", f"`.venv/bin/python {command}`"]
        for name, command in sorted(COMMAND_OF_CHART.items())
        if (CHARTS / f"{name}.svg").exists()
    ]
    return table(["chart", "command"], rows)
