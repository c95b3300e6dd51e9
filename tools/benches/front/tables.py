"""Tables of docs/results.md: the figures of bench/headlines.toml, each with its origin; finished studies."""

import json
import tomllib

from crunchbot_lab.report.share import wilson

from ..host.ring import PEERS
from ..store import COMMAND_OF_RESULT, ORIGINS, RESULTS, ROOT, read_result
from ..tables import cell, table

HEADLINES = tomllib.loads((ROOT / "bench/headlines.toml").read_text())["figure"]
TEXTURE_WINDOWS = 1920  # of the held-out drives of benches/texture/cost.py


def fields(result: str) -> dict:
    """Of a result, for patterns; sums and choices that a pattern cannot make."""
    data = read_result(result)
    if result == "demo":
        return data | {"bound": 1e6 * wilson(data["frames_lost"], data["frames_sent"])[1]}
    if result == "nav_families":
        found = data["families"]["all"]
        low, high = wilson(found["locked"], found["draws"])
        return found | {"families": len(data["draws"]), "low": low, "high": high}
    if result == "ring":
        polling = {"mode": "poll", "pace": "2khz", "readers": 1}
        rows = {row["peer"]: row["latency_us"] for row in data["rows"] if polling.items() <= row.items()}
        others = sorted((row["p50"], PEERS[peer][0]) for peer, row in rows.items() if peer not in ("whisker", "memory"))
        return {peer: row["p50"] for peer, row in rows.items()} | {
            "rounds": data["rounds"],
            "slow": rows["whisker"]["p99"],
            "fastest": "; ".join(f"{title}: {p50:.2f}" for p50, title in others[:2]) or "no peer",
        }
    if result == "usb_soak":
        return data | {"bad": sum(data[key] for key in ("gaps", "duplicates", "wrong", "stale"))}
    if result == "levels":
        hardware = data["rtl, SCK/16, gap 3 us (hardware)"]
        runs = hardware[1]["runs"]
        spread = {"runs": len(runs), "low": min(runs), "high": max(runs)}
        return data | spread | {"hardware": hardware, "gateware": data["rtl, SCK/6, gap 0.5 us"]}
    if result == "texture":
        low, high = wilson(round(data["cost"]["default"]["error"] * TEXTURE_WINDOWS), TEXTURE_WINDOWS)
        return data | {"windows": TEXTURE_WINDOWS, "low": low, "high": high}
    if result == "nav_matrix":
        low, _ = wilson(round(data["rows"]["global start"]["adaptive"]["near_at_end"] * data["seeds"]), data["seeds"])
        return data | {"low": low}
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


def archive() -> str:
    """Of docs/results/archive.md."""
    studies = tomllib.loads((ROOT / "bench/archive.toml").read_text())["study"]
    return table(list(studies[0]), [list(study.values()) for study in studies])
