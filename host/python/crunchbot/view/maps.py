"""A mapper's messages as plain values for JSON: what page/map.js draws, live and in the demo's report."""

import base64
import math
from typing import Any

import numpy as np

NAME_MOST = 40  # characters of a texture's name
FREE_BELOW, NO_CELL = 20, 255  # per cent; a byte
GROUPS = {"tiles": "tile_", "faces": "face_", "corners": "corner_"}  # of the sequences of a TouchMap


def map_parts(touched: Any, grid: Any) -> dict:
    """A TouchMap, and an OccupancyGrid or None: numbers in m, rad and shares; numbers that are not finite are 0."""
    parts = {name: _rows(touched, before) for name, before in GROUPS.items()}
    lattice = [_real(value) for value in touched.lattice]
    names = [" ".join(name.split())[:NAME_MOST] for name in touched.textures]
    shown = {
        "seq": touched.observation_seq,
        "part": touched.part,
        "textures": names,
        "lattice": lattice if lattice[3] > 0.0 else None,
    }
    return shown | parts | {"grid": None if grid is None else _grid(grid)}


def _rows(touched: Any, before: str) -> list[list[float]]:
    """A group of sequences, in its order, as a row for each thing."""
    columns = [np.asarray(value).tolist() for key, value in vars(touched).items() if key.startswith(before)]
    return [[_real(value) for value in row] for row in zip(*columns, strict=True)]


def _grid(grid: Any) -> dict:
    """The cells as bytes in base64: per cent, or NO_CELL."""
    cells, cell = np.asarray(grid.data, np.int8), grid.info.resolution
    x, y, turn = grid.info.origin.xytheta
    place = {"x": _real(x), "y": _real(y), "turn": _real(turn), "cell": _real(cell)}
    free = np.count_nonzero((cells >= 0) & (cells < FREE_BELOW)) * cell**2
    coded = base64.b64encode(np.where(cells < 0, NO_CELL, cells).astype(np.uint8).tobytes()).decode()
    shape = {"columns": int(grid.info.width), "rows": int(grid.info.height)}
    return place | shape | {"free_m2": _real(free), "cells": coded}


def _real(value: float) -> float:
    return round(float(value), 4) if math.isfinite(value) else 0.0
