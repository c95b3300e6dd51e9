"""The navigator as a process of its own, the desktop's part: takes observation rows as they come, gives poses.

python -m whisker.demo.navigator_process --rows FIFO --scene DIR --out DIR
"""

import argparse
import csv
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TextIO

from .. import localise
from .. import scene as scenes

FILTERS = ("grid", "foveal", "odometry")
KINDS = ("est", "covariance")
COVARIANCE_HEADER = "t_s,xx_m2,xy_m2,yy_m2"


class Track:
    """One filter and its two files: est_<name>.csv, and covariance_<name>.csv for the report's ellipses."""

    def __init__(self, name: str, scene: scenes.Scene, poses: TextIO, covariances: TextIO):
        self._filter, self._poses, self._covariances = localise.Filter(name, scene), poses, covariances
        print(localise.ESTIMATE_HEADER, file=self._poses)
        print(COVARIANCE_HEADER, file=self._covariances)

    def take(self, t_s: str, row: dict[str, float | None]) -> None:
        estimate = self._filter.step(row)
        c = estimate.covariance
        print(estimate.line(t_s), file=self._poses, flush=True)
        print(f"{t_s},{c[0, 0]:.6g},{c[0, 1]:.6g},{c[1, 1]:.6g}", file=self._covariances, flush=True)


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
            files = {
                n: [stack.enter_context(open(options.out / f"{kind}_{n}.csv", "w")) for kind in KINDS] for n in FILTERS
            }
            tracks = [Track(name, scene, *files[name]) for name in FILTERS]
            navigate(stack.enter_context(open(options.rows, newline="")), tracks)
    except (OSError, ValueError) as error:
        print(f"navigator: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
