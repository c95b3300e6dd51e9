"""The navigator as a process of its own, the desktop's part: takes observation rows as they come, gives poses.

python -m whisker.demo.navigator_process --rows FIFO --scene DIR --out DIR
"""

import argparse
import csv
import sys
from contextlib import ExitStack
from pathlib import Path

from .. import scene as scenes
from ..robot.track import Track

FILTERS = ("grid", "foveal", "odometry")


def navigate(rows, tracks: list[Track]) -> None:
    """Every row to every filter, until the pilot closes its end."""
    for cells in csv.DictReader(rows):
        row = {name: float(text) if text else None for name, text in cells.items()}
        for track in tracks:
            track.take(cells["t_s"], row)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", required=True, type=Path, help="where the pilot writes, usually a FIFO")
    parser.add_argument("--scene", required=True, type=Path)
    parser.add_argument("--out", required=True, type=Path, help="folder for est_<filter>.csv")
    options = parser.parse_args(argv)
    try:
        with ExitStack() as stack:
            scene = scenes.load(options.scene)
            tracks = [Track(name, scene, options.out, stack) for name in FILTERS]
            navigate(stack.enter_context(open(options.rows, newline="")), tracks)
    except (OSError, ValueError) as error:
        print(f"navigator: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
