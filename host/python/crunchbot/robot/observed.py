"""A row of a running robot as Observations of one row, for what takes those."""

import math

import numpy as np

from ..nav.observations import Observations
from ..observation import NORMAL, Quantity, Row
from ..scene import Scene
from .network.rows import time_text


def observed(row: Row, scene: Scene) -> Observations:
    """A row as Observations of one."""
    tips, rays, layout = len(scene.robot.of_role("texture")), len(scene.robot.of_role("object")), scene.layout
    texture = row.read(layout.of(Quantity.TEXTURE)).reshape(1, tips, len(scene.arena.textures))
    radial = row.read(layout.of(Quantity.DISTANCE), empty=math.inf).reshape(1, rays) / 1000.0
    normal = row.find(layout.of(Quantity.NORMAL)).reshape(1, rays, len(NORMAL))
    motion = np.asarray(row.motion, np.float64)[None]
    return Observations(np.array([row.t_s]), [time_text(row)], motion, texture, radial, None, None, normal)
