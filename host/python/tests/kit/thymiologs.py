"""Logs of a Thymio (docs/formats.md) as tests write them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image


def write_log(folder: Path, floor: np.ndarray, path: np.ndarray, left: Sequence[float], right: Sequence[float]) -> None:
    """A log, and its floor beside it. `floor`: grey levels, pixels of 1 cm; `path`: a line each, x, y (m), heading (rad)."""
    folder.mkdir(parents=True)
    Image.fromarray(floor.astype(np.uint8)).save(folder.parent / "map.png")
    half = path[:, 2] / 2
    np.savetxt(folder / "gt.txt", path)
    np.savetxt(folder / "odom_pose.txt", path[:, :2])
    np.savetxt(folder / "odom_quaternion.txt", np.column_stack([np.sin(half), np.cos(half)]))
    np.savetxt(folder / "sensor_left.txt", left)
    np.savetxt(folder / "sensor_right.txt", right)


def write_plain(folder: Path, rows: int) -> None:
    """A log of `rows` lines on a chessboard."""
    path = np.column_stack([0.1 + 0.01 * np.arange(rows), np.full(rows, 0.25), np.zeros(rows)])
    write_log(folder, np.indices((50, 50)).sum(axis=0) % 2 * 255, path, [60.0] * rows, [60.0] * rows)
