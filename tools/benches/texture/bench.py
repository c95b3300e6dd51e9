"""Floor texture: errors, times and stability of the paper's classifier, the default method and peers.

    make bench, or .venv/bin/python tools/benches texture [--fabricslide DIR] [--borealtc DIR] [--vulpi DIR]

Simulated floors (level 1) are drawn from seeds that nothing was developed on. Real recordings are not part of this
project: clone github.com/wngfra/FabricSlide (MIT) and github.com/norlab-ulaval/BorealTC (MIT) and give their folders
data/fabric, data/borealtc and data/vulpi (in BorealTC), here or as FABRICSLIDE_DIR, BOREALTC_DIR and VULPI_DIR; without
them their parts are skipped by name.
Writes bench/results/texture.json.
"""

import argparse
import os
from pathlib import Path

from tqdm import tqdm

from .. import store
from .cost import cost
from .real import boreal, fabrics, vulpi_terrains
from .simulated import borders, other_robot, refusals, single_surfaces, stability

CACHE = store.kept("texture")
FLOORS = (cost, single_surfaces, other_robot, borders, refusals, stability)
PARTS = {f.__name__: f for f in FLOORS}
REAL = {  # by the folder that is given
    "fabricslide": {"fabricslide": fabrics},
    "borealtc": {"borealtc": boreal},
    "vulpi": {"vulpi": vulpi_terrains},
}


def run(build: Path, **folders: str | None) -> None:
    """Measure what is not yet measured. `build` is not used: the C library comes with the Python module."""
    given = {n: folders.get(n) or os.environ.get(f"{n.upper()}_DIR") for n in REAL}
    parts = dict(PARTS)
    for folder, name, measure in ((f, n, m) for f, some in REAL.items() for n, m in some.items()):
        if given[folder]:
            parts[name] = lambda measure=measure, folder=folder: measure(Path(given[folder]))
        elif (CACHE / f"{name}.json").exists():
            parts[name] = None  # what was measured when its folder was given
        else:
            store.leave_out(name, f"give --{folder} DIR or {folder.upper()}_DIR (tools/benches texture --help)")
    results = {}
    for name, measure in tqdm(parts.items(), desc="texture"):
        results[name] = store.once(CACHE / f"{name}.json", measure)
    store.write_result("texture", results)


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--fabricslide", metavar="DIR", help="FabricSlide's data/fabric")
    parser.add_argument("--borealtc", metavar="DIR", help="BorealTC's data/borealtc")
    parser.add_argument("--vulpi", metavar="DIR", help="BorealTC's data/vulpi")
