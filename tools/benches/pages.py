"""Writes every page of docs/results again from bench/results, and docs/results.md; measures nothing.

.venv/bin/python tools/benches page
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from . import headlines, studies
from .contact import page as contact
from .mechanics import edges
from .nav import map_peers, maps, unseen
from .nav import page as nav
from .node import image
from .node import page as node
from .radial import real
from .robot import page as robot
from .store import RESULTS, ROOT, read_result, write_page
from .texture import page as texture

NAV = ("matrix", "tracking", "locks", "budgets", "balance", "variation", "soak", "pareto", "cost", "passes")
ROBOT = ("levels", "long", "odometry", "latency", "instructions")


def of(write: Callable[..., str], *results: str) -> Callable[[], str]:
    """A page that a function writes of some results."""
    return lambda: write(*map(read_result, results))


def parts(write: Callable[[dict], str], room: str, names: tuple[str, ...]) -> str:
    """A page of those parts that have been measured."""
    stored = [name for name in names if (RESULTS / f"{room}_{name}.json").exists()]
    return write({name: read_result(f"{room}_{name}") for name in stored})


PAGES: dict[str, Callable[[], str]] = {
    "docs/results.md": headlines.page,
    "docs/results/contact.md": of(contact.page, "contact"),
    "docs/results/demo.md": of(studies.demo, "demo", "localisation"),
    "docs/results/host.md": of(studies.host, "host", "record", "view", "fuzz", "damage", "usb_soak"),
    "docs/results/mechanics.md": of(edges.page, "mechanics", "mechanics_edges"),
    "docs/results/nav.md": partial(parts, nav.document, "nav", NAV),
    "docs/results/map.md": of(maps.page, "map"),
    "docs/results/map_peers.md": of(map_peers.page, "map_peers"),
    "docs/results/nav_unseen.md": of(unseen.page, "nav_unseen", "nav_designs", "nav_ablations", "nav_left_out"),
    "docs/results/node_faults.md": of(node.page, "node", "node_faults", "node_cuts"),
    "docs/results/node_image.md": of(image.page, "node_image"),
    "docs/results/radial.md": of(studies.radial, "radial"),
    "docs/results/radial_real.md": of(real.page, "radial_real"),
    "docs/results/ring.md": of(studies.ring, "ring"),
    "docs/results/robot.md": partial(parts, robot.page, "robot", ROBOT),
    "docs/results/simulation.md": of(studies.simulation, "chain_speed", "levels", "levels_shares", "pace"),
    "docs/results/texture.md": of(texture.page, "texture"),
}


def run(_build: Path) -> None:
    for path, make in PAGES.items():
        write_page(ROOT / path, make())
    print(f"{len(PAGES)} pages of docs/results")
