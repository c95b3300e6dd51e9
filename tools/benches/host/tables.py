"""Tables of docs/results/host.md."""

from ..store import read_result
from ..tables import lined, named, table
from .ring import PEERS

TRANSPORTS = [peer for peer in PEERS if peer != "memory"]


def found() -> tuple[dict, list[int]]:
    """By peer, mode, pace and readers; the numbers of readers."""
    rows = {(r["peer"], r["mode"], r["pace"], r["readers"]): r for r in read_result("ring")["rows"]}
    return rows, sorted({n for *_, n in rows} - {0})


def ring(mode: str) -> str:
    rows, readers = found()

    def latency(peer: str, n: int, which: str) -> str:
        us = rows.get((peer, mode, "2khz", n), {"latency_us": {}})["latency_us"].get(which)
        return "-" if us is None else f"{us:.2f}" if us < 10 else f"{us:.0f}"

    def rate(peer: str, n: int) -> str:
        per_s = rows.get((peer, mode, "flat", n), {"delivered_per_s": None})["delivered_per_s"]
        return "-" if per_s is None else f"{per_s / 1e6:.2f} M" if per_s >= 1e6 else f"{per_s / 1e3:.0f} k"

    lines = [
        [PEERS[peer][0], " / ".join(latency(peer, n, "p50") for n in readers)]
        + [" / ".join(latency(peer, n, which) for n in readers[:2]) for which in ("p99", "p99.9")]
        + [" / ".join(rate(peer, n) for n in readers)]
        for peer in (*TRANSPORTS, "memory")
        if (peer, mode, "2khz", 1) in rows
    ]
    counts = " / ".join(map(str, readers))
    head = ["transport", f"p50, us: {counts} readers", "p99, us: 1 / 2", "p99.9, us: 1 / 2"]
    return table([*head, f"frames a second to every reader: {counts}"], lines)


def instructions() -> str:
    return lined(
        named(read_result("host")["instructions_per_frame"], "batch"),
        {
            "frames in a transfer": "{batch}",
            "instructions a frame": "{total:.0f}",
            "ours of these": lambda row: f"{row['libwhisker and whiskerd']:.0f}",
            "share of the netbook": "{atom_share:100*.2f} %",
        },
    )


def record() -> str:
    found = read_result("record")
    hour = found["hour"]
    return table(
        ["recording", "value"],
        [
            ["frames lost", f"{hour['lost']} of {hour['frames']}"],
            ["bytes a sample", f"{hour['bytes_per_sample']:.2f}"],
            ["the same, a robot that stands", f"{found['still']['bytes_per_sample']:.2f}"],
            ["share of the netbook", f"{100 * found['atom_share']:.1f} %"],
        ],
    )
