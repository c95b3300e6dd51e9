"""What the pilot leaves in files: observations.csv (docs/formats.md), and the floor whiskers' traces for the report."""

import csv
from typing import TextIO

import numpy as np

from ..observation import Row, cell
from ..pilot.behaviour import TICK_S
from ..pilot.pilot import Pilot

DEGREES_PER_COUNT = 180.0 / 65536.0


class Rows:
    """Observation rows, line by line, the header first."""

    def __init__(self, file: TextIO):
        self._file, self._begun = file, False

    def write(self, row: Row) -> None:
        lines = [] if self._begun else [list(row)]
        lines.append([cell(value) for value in row.values()])
        csv.writer(self._file, lineterminator="\n").writerows(lines)
        self._file.flush()
        self._begun = True


class Traces:
    """traces.csv: per block, the range of each floor whisker's deflection from the middle of its scale, degrees."""

    def __init__(self, file: TextIO, pilot: Pilot):
        self._lanes = pilot.texture_lanes
        self._writer = csv.writer(file, lineterminator="\n")
        names = [pilot.names[lane] for lane in self._lanes]
        self._writer.writerow(["t_s", *(f"{name}_{end}_deg" for name in names for end in ("min", "max"))])

    def write(self, first: int, samples: np.ndarray) -> None:
        """The block of 40 ticks from `first`: (40, lanes) of ring.SAMPLE."""
        cells = []
        for lane in self._lanes:
            good = samples[samples[:, lane]["status"] == 0, lane]
            about = np.hypot(good["alpha"] - 32768.0, good["beta"] - 32768.0) * DEGREES_PER_COUNT
            cells += [f"{about.min():.3f}", f"{about.max():.3f}"] if len(about) else ["", ""]
        self._writer.writerow([f"{first * TICK_S:.3f}", *cells])
