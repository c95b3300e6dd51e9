"""Rows, poses and readings of a robot for the viewer of rerun: `pip install 'crunchbot[rerun]'`, then `rerun`."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..observation import VALUE, Row
from ..occupancy import to_map
from ..scene import Scene

VIEWER = "rerun+http://127.0.0.1:9876/proxy"  # where `rerun` listens unless asked for another place
APPLICATION = "crunchbot"


class RerunSink:
    """Logs into a file.rrd, or into a viewer that runs; the timeline is the robot's clock. Use as a context manager."""

    def __init__(self, scene: Scene, file: str | Path | None = None, viewer: str = VIEWER):
        import rerun  # an extra of its own, which the list of all modules does without

        self._rr, self._paths = rerun, {}
        self._stream = rerun.RecordingStream(APPLICATION)
        if file is None:
            self._stream.connect_grpc(viewer)
        else:
            self._stream.save(file)
        x0y0x1y1 = np.array([(0.0, 0.0, *scene.arena.size_m), *scene.arena.obstacles])
        middles = np.column_stack([(x0y0x1y1[:, :2] + x0y0x1y1[:, 2:]) / 2, np.zeros(len(x0y0x1y1))])
        boxes = to_map(middles, scene.origin)
        sizes = np.column_stack([(x0y0x1y1[:, 2:] - x0y0x1y1[:, :2]) / 2, np.zeros(len(x0y0x1y1))])
        turns = [rerun.RotationAxisAngle((0, 0, 1), radians=scene.origin[2])] * len(boxes)
        walls = rerun.Boxes3D(centers=boxes * (1, 1, 0), half_sizes=sizes, rotation_axis_angles=turns)
        self._stream.log("arena", walls, static=True)

    def __enter__(self) -> "RerunSink":
        return self

    def __exit__(self, *exception) -> None:
        self.close()

    def row(self, row: Row) -> None:
        """Each cell that was read, as a number over time."""
        self._stream.set_time("robot", duration=row.t_s)
        for name, cell, value in zip(row.names, row.cells, row.numbers, strict=True):
            if cell == VALUE:
                self._stream.log(f"whiskers/{name}", self._rr.Scalars(value))

    def pose(self, t_s: float, pose: Sequence[float], who: str, confidence: float | None = None) -> None:
        """Where somebody has the robot on the map: x, y in m, heading in rad."""
        x, y, theta = pose
        path = self._paths.setdefault(who, [])
        path.append((x, y, 0.0))
        self._stream.set_time("robot", duration=t_s)
        arrow = self._rr.Arrows3D(
            origins=[path[-1]], vectors=[(0.15 * np.cos(theta), 0.15 * np.sin(theta), 0.0)], labels=[who]
        )
        self._stream.log(f"{who}/pose", arrow)
        if confidence is not None:
            self._stream.log(f"{who}/confidence", self._rr.Scalars(confidence))

    def close(self) -> None:
        """What was logged is in the file, or in the viewer; the paths, whole, at each time."""
        for who, path in self._paths.items():
            self._stream.log(f"{who}/path", self._rr.LineStrips3D([path]), static=True)
        self._stream.disconnect()
