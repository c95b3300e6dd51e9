"""One filter of a navigator with its two files: est_<name>.csv, and covariance_<name>.csv for the report's ellipses."""

from contextlib import ExitStack
from pathlib import Path
from typing import TextIO

import numpy as np

from ..nav import localise
from ..outputs import opened
from ..scene import Scene
from .network.rows import Step

FILES = (("est", localise.ESTIMATE_HEADER), ("covariance", "t_s,xx_m2,xy_m2,yy_m2"))


class Track:
    """Steps a filter and writes what it believes after every row, line by line."""

    def __init__(
        self,
        name: str,
        scene: Scene,
        out: Path | None,
        stack: ExitStack,
        resumed: bool = False,
        components: np.ndarray | None = None,
        normals: bool = False,
        overwrite: bool = False,
    ):
        """`out`: the folder of the files, which `stack` closes; None: no files. resumed: go on behind what they hold.

        components: what is believed already, in place of the scene's prior. normals: as Filter has it.
        """
        self.name, self.filter = name, localise.Filter(name, scene, components=components, normals=normals)
        self._poses = self._covariances = None
        if out is not None:
            self._poses, self._covariances = (
                _opened(out / f"{kind}_{name}.csv", header, resumed, overwrite, stack) for kind, header in FILES
            )

    def take(self, step: Step) -> localise.Estimate:
        """Motion first where it is long, then the row."""
        for row in step.lead():
            self.filter.step(row)
        row = step.last()
        t_s, estimate = row.t_text, self.filter.step(row)
        if self._poses:
            c = estimate.covariance
            print(estimate.line(t_s), file=self._poses, flush=True)
            print(f"{t_s},{c[0, 0]:.6g},{c[0, 1]:.6g},{c[1, 1]:.6g}", file=self._covariances, flush=True)
        return estimate


def _opened(path: Path, header: str, resumed: bool, overwrite: bool, stack: ExitStack) -> TextIO:
    file = stack.enter_context(path.open("a") if resumed else opened(path, overwrite))
    if file.tell() == 0:
        print(header, file=file, flush=True)
    return file
