"""The node's image, executed: records, power cuts, cycles, stack, resets.

.venv/bin/python tools/benches image    bench/results/node_image.json
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from .. import store

ROOT = Path(__file__).resolve().parents[3]
IMAGE = ROOT / "firmware/images/node_wire.hex"
sys.path.insert(0, str(ROOT / "tests/rigs/node_image"))
import paths  # noqa: E402
import translate  # noqa: E402

TICKS, SEEDS = 10000, (1, 2, 3)
IRQS = {"INT1": 20, "T2": 7, "SPI1": 10, "SPI1 error": 9, "SPI2 error": 32, "DMA1": 14, "INT2": 29}
HANDLERS = {  # as image_port.h names them: the interrupt, and what it is for
    "SYNC": ("INT1", "SYNC: the sensor's first byte"),
    "BYTE": ("SPI1", "a byte of the frame, and the gap after it"),
    "LAST_BYTE": ("SPI1", "the frame's last byte: decoded, record armed"),
    "GAP": ("T2", "the gap is over: the next byte"),
    "RAISE": ("T2", "/SS up"),
    "LOWER": ("T2", "/SS down"),
    "READY": ("T2", "the sensor is ready, or has started"),
    "ORDER": ("DMA1", "the order: checked, link armed"),
    "SERVICE": ("DMA1", "a service order: taken"),
    "SELECT_UP": ("INT2", "select up after a whole transfer"),
    "SELECT_UP_BROKEN": ("INT2", "select up otherwise: link armed anew"),
    "SENSOR_OVERRUN": ("SPI1 error", "a byte of the sensor was lost"),
    "LINK_OVERFLOW": ("SPI2 error", "a word of the link was lost"),
}


class Node:
    """Programs with the image in them; what its interrupts cost, over all runs."""

    def __init__(self, build: Path, folder: Path):
        self.programs, self.folder = build / "tests/rigs/node_image", folder
        self.words = translate.flash_words(IMAGE)
        self.table = folder / "table"
        self.table.write_bytes(translate.table_of(self.words))
        self.costs: list[dict] = []

    def run(self, program: str, *words) -> str:
        costs = self.folder / "costs"
        environment = os.environ | {"NODE_IMAGE": str(self.table), "NODE_IMAGE_COSTS": str(costs)}
        command = [str(self.programs / program), *map(str, words)]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        if costs.exists():
            self.costs.append(json.loads(costs.read_text()))
            costs.unlink()
        return done.stdout

    def handlers(self) -> dict:
        out = {}
        for name in HANDLERS:
            ran = [c["handlers"][name] for c in self.costs if c["handlers"][name]["count"]]
            out[name] = {key: max(one[key] for one in ran) for key in ("most", "acts", "stack")}
            out[name] |= {"least": min(one["least"] for one in ran), "count": sum(one["count"] for one in ran)}
        return out

    def by_path(self) -> dict:
        loops: dict[int, int] = {}
        for costs in self.costs:
            for at, times in costs["loops"].items():
                loops[int(at) // 2] = max(loops.get(int(at) // 2, 0), times)
        constants = {at // 2 for costs in self.costs for at in costs["constants"]}
        program = paths.Program(self.words, loops, constants)
        return {name: program.worst(entry) for name, entry in paths.handlers(self.words, IRQS).items()}


def records(node: Node) -> list[dict]:
    out = []
    for seed in SEEDS:
        wanted = node.run("native_records", TICKS, seed).splitlines()
        found = node.run("image_records", TICKS, seed).splitlines()
        differing = sum(a != b for a, b in zip(wanted, found, strict=True))
        good = sum(line.endswith(" good") for line in found)
        out.append({"seed": seed, "ticks": TICKS, "good": good, "differing": differing})
    return out


def cuts(node: Node) -> dict:
    path = node.folder / "cuts"
    node.run("image_cuts", path)
    runs = [(step, one) for step in json.loads(path.read_text()) for one in step["runs"]]
    right = sum(one["reported"] and one["again"] and bool(one["fate"] & step["allowed"]) for step, one in runs)
    return {"runs": len(runs), "right": right, "ticks_most": max(one["ticks"] for _, one in runs)}


def run(build: Path) -> None:
    with tempfile.TemporaryDirectory() as folder:
        node = Node(build, Path(folder))
        result = {
            "records": records(node),
            "cuts": cuts(node),
            "resets": json.loads(node.run("image_check", "resets")),
        }
        result["storm"] = [json.loads(line) for line in node.run("image_storm", 0, 2).splitlines()]
        result |= {"handlers": node.handlers(), "by_path": node.by_path()}
        result["ram"] = max(c["ram"] for c in node.costs)
        result["boot_cycles"] = max(c["boot_cycles"] for c in node.costs)
        result["spoiled"] = sum(c["spoiled"] for c in node.costs)
    store.write_result("node_image", result)
