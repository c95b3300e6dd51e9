"""A row of a running robot as Observations of one row, for what takes those."""

import math

import numpy as np

from ..nav.observations import Observations
from ..observation import NORMAL, POINT, Quantity, Row
from ..scene import Scene
from .network.rows import time_text


def observed(row: Row, scene: Scene) -> Observations:
    """A row as Observations of one."""
    tips, rays, layout = len(scene.robot.of_role("texture")), len(scene.robot.of_role("object")), scene.layout
    texture = row.read(layout.of(Quantity.TEXTURE)).reshape(1, tips, len(scene.arena.textures))
    radial = row.read(layout.of(Quantity.DISTANCE), empty=math.inf).reshape(1, rays) / 1000.0
    touched = ((Quantity.NORMAL, len(NORMAL)), (Quantity.POINT, len(POINT)))
    normal, point = (row.find(layout.of(quantity)).reshape(1, rays, width) for quantity, width in touched)
    own = row.find(layout.of(Quantity.READING))[None] if scene.robot.sensors else None
    motion = np.asarray(row.motion, np.float64)[None]
    return Observations(np.array([row.t_s]), [time_text(row)], motion, texture, radial, None, own, normal, point)
