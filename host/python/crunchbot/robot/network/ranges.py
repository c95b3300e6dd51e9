"""What each number, text and sequence of the robot's messages may be: the one table that every decoder applies.

Keys are "package/msg/Type:field" of the message that holds the field itself. A field without an entry cannot be decoded.
Limits are those of the machine, with room to spare: what is outside them is a mistake or an attack, never a measurement.
"""

import math
from dataclasses import dataclass
from typing import Any

from ...nav.faults import ROW_MOST_M, ROW_MOST_RAD

FAR_M = 1e5  # of any place, sums of the odometry included
TURNED_RAD = 1e7  # of any angle that is summed: half a year of turning
ROWS_MOST = 2**31  # of a stream: almost seven years
COUNT_MOST = 2**63 - 1
NAME_MOST, TEXT_MOST = 128, 4096  # characters
CELLS_MOST = 512  # of a row: whiskers times textures
COUNTERS_MOST = 256
COMPONENTS_MOST = 2000  # of a Belief
GRID_MOST = 1_100_000  # cells of an occupancy grid: the mapper's reach, at its cells, squared, with room to spare
TILES_MOST, FACES_MOST, CORNERS_MOST = 4096, 1024, 2048  # of a TouchMap
SHARE_MOST = 1.01  # of a share of a belief, with room for rounding


@dataclass(frozen=True)
class Range:
    """Limits of a number, or of each element of a sequence or array; of a text: its length in characters.

    low, high: one for all elements, or one for each element of a fixed array. count: elements of a sequence at most.
    finite: False where nan and infinities are allowed as well. The numbers are both included.
    """

    low: float | tuple[float, ...] = -math.inf
    high: float | tuple[float, ...] = math.inf
    count: int = 0
    finite: bool = True


def about(most: float, **more: Any) -> Range:
    """The range from -most to most."""
    return Range(-most, most, **more)


def up_to(most: float, **more: Any) -> Range:
    """The range from 0 to most."""
    return Range(0, most, **more)


NAME, TEXT, FLAG, COUNTER = up_to(NAME_MOST), up_to(TEXT_MOST), up_to(1), up_to(COUNT_MOST)
INNER = Range()  # a message within a message: its own fields have the limits
COVARIANCE = about(FAR_M**2)
ROW, PLACE = (ROW_MOST_M, ROW_MOST_M, ROW_MOST_RAD), (FAR_M, FAR_M, TURNED_RAD)

_TABLE = {
    "builtin_interfaces/msg/Time": {"sec": up_to(10**9), "nanosec": up_to(10**9 - 1)},
    "std_msgs/msg/Header": {"stamp": INNER, "frame_id": NAME},
    "diagnostic_msgs/msg/KeyValue": {"key": NAME, "value": TEXT},
    "geometry_msgs/msg/Vector3": dict.fromkeys("xyz", about(1e3)),
    "geometry_msgs/msg/Point": dict.fromkeys("xyz", about(FAR_M)),
    "geometry_msgs/msg/Quaternion": dict.fromkeys("xyzw", about(1.0 + 1e-6)),
    "geometry_msgs/msg/Pose": {"position": INNER, "orientation": INNER},
    "geometry_msgs/msg/PoseStamped": {"header": INNER, "pose": INNER},
    "geometry_msgs/msg/PoseWithCovariance": {"pose": INNER, "covariance": COVARIANCE},
    "geometry_msgs/msg/PoseWithCovarianceStamped": {"header": INNER, "pose": INNER},
    "geometry_msgs/msg/Twist": {"linear": INNER, "angular": INNER},
    "geometry_msgs/msg/TwistWithCovariance": {"twist": INNER, "covariance": COVARIANCE},
    "nav_msgs/msg/Odometry": {"header": INNER, "child_frame_id": NAME, "pose": INNER, "twist": INNER},
    "nav_msgs/msg/MapMetaData": {
        "map_load_time": INNER,
        "resolution": up_to(FAR_M),
        "width": up_to(GRID_MOST),
        "height": up_to(GRID_MOST),
        "origin": INNER,
    },
    "nav_msgs/msg/OccupancyGrid": {"header": INNER, "info": INNER, "data": Range(-1, 100, count=GRID_MOST)},
    "sensor_msgs/msg/JointState": {
        "header": INNER,
        "name": up_to(NAME_MOST, count=CELLS_MOST),
        "position": about(1e3, count=CELLS_MOST, finite=False),  # a joint whose sample is bad has no angle
        "velocity": about(1e6, count=CELLS_MOST),
        "effort": about(1e6, count=CELLS_MOST),
    },
    "whisker_msgs/msg/Observation": {
        "header": INNER,
        "seq": up_to(ROWS_MOST),
        "kind": up_to(3),
        "motion": Range(tuple(-most for most in ROW), ROW),
        "pose": Range(tuple(-most for most in PLACE), PLACE),
        "names": up_to(NAME_MOST, count=CELLS_MOST),
        "cells": up_to(2, count=CELLS_MOST),
        "values": Range(count=CELLS_MOST, finite=False),  # judged by the filter, which counts those it refuses
    },
    "whisker_msgs/msg/Contact": {
        "header": INNER,
        "whisker": NAME,
        "touching": FLAG,
        "onset": INNER,
        "release": INNER,
        "measured": FLAG,
        "radius_m": about(10.0),
        "sigma_m": up_to(FAR_M),
        "part": up_to(2),
        "shape": up_to(2),
    },
    "whisker_msgs/msg/Behaviour": {"header": INNER, "state": NAME, "since": INNER, "reason": TEXT},
    "whisker_msgs/msg/Localisation": {
        "header": INNER,
        "filter": NAME,
        "pose": INNER,
        "confidence": up_to(SHARE_MOST),
        "observation_seq": COUNTER,
        "rows_integrated": up_to(ROWS_MOST + 1),
        "rows_skipped": COUNTER,
        "rows_missed": COUNTER,
        "first_seq": COUNTER,
        "prior": NAME,
    },
    "whisker_msgs/msg/Belief": {
        "header": INNER,
        "filter": NAME,
        "observation_seq": COUNTER,
        "components": up_to(2**31),
        "mass": up_to(SHARE_MOST),
        "x": about(FAR_M, count=COMPONENTS_MOST),
        "y": about(FAR_M, count=COMPONENTS_MOST),
        "theta": about(TURNED_RAD, count=COMPONENTS_MOST),
        "weight": up_to(SHARE_MOST, count=COMPONENTS_MOST),
        "sigma_m": up_to(FAR_M, count=COMPONENTS_MOST),
        "sigma_rad": up_to(TURNED_RAD, count=COMPONENTS_MOST),
    },
    "whisker_msgs/msg/TouchMap": {
        "header": INNER,
        "observation_seq": COUNTER,
        "part": up_to(2**31),
        "textures": up_to(NAME_MOST, count=CELLS_MOST),
        "lattice": Range((-FAR_M, -FAR_M, -TURNED_RAD, 0.0), (FAR_M, FAR_M, TURNED_RAD, FAR_M)),
        **dict.fromkeys(("tile_column", "tile_row"), about(FAR_M, count=TILES_MOST)),
        "tile_texture": up_to(CELLS_MOST, count=TILES_MOST),
        "tile_probability": up_to(SHARE_MOST, count=TILES_MOST),
        **dict.fromkeys(("face_x0", "face_y0", "face_x1", "face_y1"), about(FAR_M, count=FACES_MOST)),
        "face_normal": about(TURNED_RAD, count=FACES_MOST),
        "face_normal_sd": up_to(TURNED_RAD, count=FACES_MOST),
        "face_offset_sd": up_to(FAR_M, count=FACES_MOST),
        **dict.fromkeys(("corner_x", "corner_y"), about(FAR_M, count=CORNERS_MOST)),
        "corner_sd": up_to(FAR_M, count=CORNERS_MOST),
    },
    "whisker_msgs/msg/ProcessHealth": {
        "header": INNER,
        "process": NAME,
        "pid": up_to(2**31 - 1),
        "state": TEXT,
        "counters": Range(count=COUNTERS_MOST),
        "last_error": TEXT,
    },
    "whisker_msgs/msg/End": {"header": INNER, "messages": COUNTER, "reason": TEXT},
}
RANGES = {f"{schema}:{name}": limits for schema, fields in _TABLE.items() for name, limits in fields.items()}
