"""Arena, belief and robot as grids and markers: pictures of a scene in standard messages."""

import math
from typing import Any

import numpy as np

from ...occupancy import Pose as Place
from ...occupancy import from_map, to_map
from ...scene import Robot, Scene
from ..network.ros import Header, MapMetaData, OccupancyGrid, Point, Pose, Vector3
from .types import make

CELLS_MOST = 1000  # along a side of a map
MAP_CELL_M, BELIEF_CELL_M = 0.02, 0.05
FREE, SOLID, UNKNOWN = 0, 100, -1
BODY_HEIGHT_M, WHISKER_M, TIP_M = 0.09, 0.004, 0.012
# Marker.type
LINE_STRIP, SPHERE, CYLINDER = 4, 2, 3
# red, green, blue, opacity; contacts and free whiskers differ in brightness too
BODY, FREE_WHISKER, TOUCHING, TIP = (
    (0.4, 0.45, 0.5, 0.6),
    (0.25, 0.25, 0.25, 1.0),
    (1.0, 0.6, 0.1, 1.0),
    (0.1, 0.5, 0.7, 1.0),
)


def pose(x: float, y: float, theta: float = 0.0, z: float = 0.0) -> Pose:
    """m and rad."""
    made = Pose.planar(x, y, theta)
    made.position.z = z
    return made


def occupancy(scene: Scene, header: Header) -> OccupancyGrid:
    """Of boxes, of ground that was never mapped, and of the walls as a border of one cell."""
    arena = scene.arena
    cell = max(MAP_CELL_M, max(arena.size_m) / CELLS_MOST)
    columns, rows = (math.ceil(size / cell - 1e-9) for size in arena.size_m)
    cells = np.full((rows + 2, columns + 2), SOLID, np.int8)
    cells[1:-1, 1:-1] = FREE
    for boxes, value in ((arena.unknown, UNKNOWN), (arena.obstacles, SOLID)):
        for x0, y0, x1, y1 in boxes:
            across = slice(1 + math.floor(x0 / cell + 1e-9), 1 + math.ceil(x1 / cell - 1e-9))
            cells[1 + math.floor(y0 / cell + 1e-9) : 1 + math.ceil(y1 / cell - 1e-9), across] = value
    corner = to_map(np.array([(-cell, -cell, 0.0)]), scene.origin)[0].tolist()
    return _grid(cells, cell, corner, header)


def belief(message: Any, scene: Scene, header: Header) -> OccupancyGrid:
    """Of a belief's mass: 100 in the cell that holds most."""
    arena = scene.arena
    x, y, _ = from_map(np.column_stack([message.x, message.y, message.theta]), scene.origin).T
    cell = max(BELIEF_CELL_M, max(arena.size_m) / CELLS_MOST)
    columns, rows = (max(1, math.ceil(size / cell - 1e-9)) for size in arena.size_m)
    mass = np.zeros((rows, columns))
    column = np.clip((x / cell).astype(int), 0, columns - 1)
    row = np.clip((y / cell).astype(int), 0, rows - 1)
    np.add.at(mass, (row, column), message.weight)
    share = mass / mass.max() if mass.max() > 0.0 else mass
    return _grid(np.rint(100 * share).astype(np.int8), cell, scene.origin, header)


def _grid(cells: np.ndarray, cell_m: float, origin: Place, header: Header) -> OccupancyGrid:
    rows, columns = cells.shape
    info = MapMetaData(resolution=cell_m, width=columns, height=rows, origin=pose(*origin))
    return OccupancyGrid(header, info, cells.ravel())


def robot_markers(robot: Robot, touching: dict[str, float], header: Header) -> Any:
    """visualization_msgs/MarkerArray of body and whiskers in the robot's frame. touching: by whisker, the distance of its
    contact from its base, m, or nan where that is not known."""
    diameter = 2.0 * robot.body_radius_m
    body = _marker(
        header, "body", 0, CYLINDER, BODY, (diameter, diameter, BODY_HEIGHT_M), pose(0.0, 0.0, 0.0, BODY_HEIGHT_M / 2)
    )
    made = [body]
    for number, whisker in enumerate(robot.whiskers):
        if whisker.role == "texture":
            made.append(_marker(header, "tips", number, SPHERE, TIP, (TIP_M,) * 3, pose(*whisker.tip_m)))
            continue
        is_touching = whisker.name in touching
        reach = touching.get(whisker.name, math.nan)
        length = whisker.length_m if math.isnan(reach) else min(reach, whisker.length_m)
        (x, y), (c, s) = whisker.base_m, (math.cos(whisker.yaw_rad), math.sin(whisker.yaw_rad))
        line = _marker(
            header,
            "whiskers",
            number,
            LINE_STRIP,
            TOUCHING if is_touching else FREE_WHISKER,
            (WHISKER_M, 0.0, 0.0),
            pose(0.0, 0.0),
        )
        line.points = [Point(x + d * c, y + d * s, BODY_HEIGHT_M / 2) for d in (0.0, length)]
        made.append(line)
        end = _marker(
            header,
            "contacts",
            number,
            SPHERE,
            TOUCHING,
            (TIP_M,) * 3,
            pose(x + length * c, y + length * s, 0.0, BODY_HEIGHT_M / 2),
        )
        end.action = 0 if is_touching else 2  # ADD, DELETE
        made.append(end)
    return make("visualization_msgs/MarkerArray", markers=made)


def _marker(header, namespace: str, number: int, kind: int, colour, scale, place) -> Any:
    red, green, blue, opacity = colour
    x, y, z = scale
    return make(
        "visualization_msgs/Marker",
        header=header,
        ns=namespace,
        id=number,
        type=kind,
        pose=place,
        scale=Vector3(x, y, z),
        color=make("std_msgs/ColorRGBA", r=red, g=green, b=blue, a=opacity),
        frame_locked=True,
    )
