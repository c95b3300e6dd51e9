"""A folder of more than 25 files is several rooms."""

from collections import Counter
from pathlib import Path

from .tree import ROOT, tracked

MOST = 25
# Generated files, one per measurement or picture: nobody looks for an idea here.
STORES = ("bench/results", "docs/charts")


def complaints(root: Path = ROOT) -> list[str]:
    count = Counter(str(Path(path).parent) for path in tracked(root))
    return [
        f"{folder}: {n} files, {MOST} at most; make rooms of it, or merge what is one idea"
        for folder, n in sorted(count.items())
        if n > MOST and folder not in STORES
    ]
