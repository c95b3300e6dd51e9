"""How good a map by touch is, and the poses it was made with: against a scene's true arena and path.

A map has a frame of its own. Poses are judged twice: brought onto the truth by their first pose alone ("anchored"), and
by the rigid motion that fits the whole path best ("aligned"). The map is judged by the latter.
"""

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from crunchbot.nav.mapper import TouchMap
from crunchbot.nav.mapping import Mapped
from crunchbot.scene import Arena

from .geometry import compose, textures

SURE = 0.8  # of a tile's texture, to be counted as said
FACE_M, FACE_RAD = 0.015, math.radians(1)
CORNER_M = 0.05  # within which a corner is the right one
MEET_M = 0.1  # from the ends of two faces to the corner that they make
REACH_M = 0.3  # from the path: corners that a whisker could have felt
SAMPLE_M = 0.05  # between the points of a face that are judged
CELL_OFF_M = 0.05  # of the middle of a solid cell
JUDGED = 200  # rows whose 90 % regions are judged, at most
CHI2_90 = -2.0 * math.log(0.1)  # of two dimensions


@dataclass(frozen=True)
class Motion:
    """A rigid motion: a turn by `turn` rad, then a shift by (x, y) m."""

    turn: float
    x: float
    y: float

    def points(self, points: np.ndarray) -> np.ndarray:
        """(n, 2) moved."""
        c, s = math.cos(self.turn), math.sin(self.turn)
        return points @ np.array([[c, s], [-s, c]]) + np.array([self.x, self.y])


def best_motion(points: np.ndarray, truth: np.ndarray) -> Motion:
    """The motion of `points` (n, 2) with the least mean squared distance from `truth` (n, 2)."""
    a, b = points - points.mean(axis=0), truth - truth.mean(axis=0)
    turn = math.atan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    x, y = truth.mean(axis=0) - Motion(turn, 0.0, 0.0).points(points.mean(axis=0))
    return Motion(turn, float(x), float(y))


def first_motion(poses: np.ndarray, truth: np.ndarray) -> Motion:
    """The motion that brings the first of the poses (n, 3) onto the first of the truth (n, 3)."""
    turn = float(truth[0, 2] - poses[0, 2])
    x, y = truth[0, :2] - Motion(turn, 0.0, 0.0).points(poses[0, :2])
    return Motion(turn, float(x), float(y))


def odometry_path(steps: np.ndarray) -> np.ndarray:
    """(n, 3) poses of odometry (n, 3) alone, from the origin; a step that is no number is none."""
    x, y, turn = np.where(np.isfinite(steps), steps, 0.0).T
    heading = np.cumsum(turn)
    before = heading - turn
    c, s = np.cos(before), np.sin(before)
    return np.column_stack([np.cumsum(c * x - s * y), np.cumsum(s * x + c * y), heading])


def trajectory(poses: np.ndarray, truth: np.ndarray) -> dict[str, float]:
    """Median and largest distance in m of poses (n, 3) from the truth (n, 3), aligned; the median, anchored."""
    aligned = np.hypot(*(best_motion(poses[:, :2], truth[:, :2]).points(poses[:, :2]) - truth[:, :2]).T)
    anchored = np.hypot(*(first_motion(poses, truth).points(poses[:, :2]) - truth[:, :2]).T)
    return {
        "error_median_m": float(np.median(aligned)),
        "error_p90_m": float(np.quantile(aligned, 0.9)),
        "anchored_median_m": float(np.median(anchored)),
    }


def coverage(poses: np.ndarray, covariance: np.ndarray, truth: np.ndarray) -> float | None:
    """Share of 90 % regions, anchored, that hold the truth; covariance (n, 3, 3). None: it is not known."""
    if not np.isfinite(covariance[:, :2, :2]).all():
        return None
    motion = first_motion(poses, truth)
    c, s = math.cos(motion.turn), math.sin(motion.turn)
    turn = np.array([[c, -s], [s, c]])
    rows = np.unique(np.linspace(1, len(poses) - 1, min(JUDGED, len(poses) - 1)).astype(int))
    off = motion.points(poses[rows, :2]) - truth[rows, :2]
    spread = turn @ covariance[rows, :2, :2] @ turn.T + 1e-9 * np.eye(2)
    scaled = np.einsum("ni,nij,nj->n", off, np.linalg.inv(spread), off)
    return float((scaled <= CHI2_90).mean())


def true_faces(arena: Arena) -> np.ndarray:
    """(n, 5) x0, y0, x1, y1 (m) and the direction of the outward normal (rad) of walls and boxes."""
    width, height = arena.size_m
    faces = [(0.0, 0.0, width, 0.0, math.pi / 2), (0.0, height, width, height, -math.pi / 2)]
    faces += [(0.0, 0.0, 0.0, height, 0.0), (width, 0.0, width, height, math.pi)]
    for x0, y0, x1, y1 in arena.obstacles:
        faces += [(x0, y0, x0, y1, math.pi), (x1, y0, x1, y1, 0.0)]
        faces += [(x0, y0, x1, y0, -math.pi / 2), (x0, y1, x1, y1, math.pi / 2)]
    return np.array(faces)


def faces_score(touched: TouchMap, motion: Motion, arena: Arena) -> dict[str, float | None]:
    """Points every SAMPLE_M along the map's faces: share within FACE_M and FACE_RAD of a true face, median distance."""
    truth, near, turned = true_faces(arena), [], []
    for face in touched.faces:
        ends = np.array([[face["x0"], face["y0"]], [face["x1"], face["y1"]]])
        count = max(int(math.hypot(*(ends[1] - ends[0])) / SAMPLE_M), 1)
        share = ((np.arange(count) + 0.5) / count)[:, None]
        points = motion.points(ends[0] + share * (ends[1] - ends[0]))
        clipped = np.clip(points[:, None], truth[:, :2], truth[:, 2:4])
        off = np.hypot(*np.moveaxis(points[:, None] - clipped, -1, 0))
        turn = np.remainder(face["normal"] + motion.turn - truth[:, 4] + math.pi, 2 * math.pi) - math.pi
        off = np.where(np.abs(turn) < math.pi / 4, off, np.inf)
        near += off.min(axis=1).tolist()
        turned += np.abs(turn)[off.argmin(axis=1)].tolist()
    if not near:
        return {"faces_right": None, "faces_median_m": None}
    right = (np.array(near) <= FACE_M) & (np.array(turned) <= FACE_RAD)
    return {"faces_right": float(right.mean()), "faces_median_m": float(np.median(near))}


def corners(touched: TouchMap) -> np.ndarray:
    """(n, 2) where two faces of the map meet at right angles or nearly."""
    found = []
    for a, b in combinations(touched.faces, 2):
        if a["face"] == b["face"] or abs(math.sin(a["normal"] - b["normal"])) < 0.5:
            continue
        normals = np.array([[math.cos(f["normal"]), math.sin(f["normal"])] for f in (a, b)])
        at = np.linalg.solve(normals, [normals[n] @ [f["x0"], f["y0"]] for n, f in enumerate((a, b))])
        ends = [min(math.hypot(*(at - [f[f"x{n}"], f[f"y{n}"]])) for n in (0, 1)) for f in (a, b)]
        if max(ends) <= MEET_M and all(math.hypot(*(at - other)) > CORNER_M for other in found):
            found.append(at)
    return np.array(found).reshape(-1, 2)


def corners_score(touched: TouchMap, motion: Motion, arena: Arena, path: np.ndarray) -> dict[str, float | None]:
    """Share of the true corners within reach of the path that the map has; share of the map's that are none."""
    truth = np.unique(true_faces(arena)[:, :4].reshape(-1, 2), axis=0)
    reached = truth[[np.hypot(*(path[:, :2] - corner).T).min() <= REACH_M for corner in truth]]
    made = motion.points(corners(touched))
    off = np.hypot(*np.moveaxis(made[:, None] - truth[None], -1, 0)).reshape(len(made), len(truth))
    found = np.hypot(*np.moveaxis(made[:, None] - reached[None], -1, 0)).reshape(len(made), len(reached))
    return {
        "corners_found": float((found.min(axis=0) <= CORNER_M).mean()) if found.size else 0.0,
        "corners_false": float((off.min(axis=1) > CORNER_M).mean()) if len(made) else None,
    }


def cells_score(cells: np.ndarray, motion: Motion, arena: Arena) -> dict[str, float | None]:
    """Of the middles of cells (n, 3), x, y and whether solid: shares of the solid ones that are within CELL_OFF_M of something
    solid, and of the free ones that are free."""
    points, solid = motion.points(cells[:, :2]), cells[:, 2] > 0
    width, height = arena.size_m
    off = np.minimum(np.minimum(points[:, 0], width - points[:, 0]), np.minimum(points[:, 1], height - points[:, 1]))
    for x0, y0, x1, y1 in arena.obstacles:  # negative: in something solid
        out = np.maximum(
            np.maximum(x0 - points[:, 0], points[:, 0] - x1), np.maximum(y0 - points[:, 1], points[:, 1] - y1)
        )
        off = np.minimum(off, out)
    near, free = off[solid] <= CELL_OFF_M, off[~solid] > 0.0
    return {
        "solid_right": float(near.mean()) if len(near) else None,
        "free_right": float(free.mean()) if len(free) else None,
    }


def tiles_score(mapped: Mapped, motion: Motion, arena: Arena) -> dict[str, float]:
    """Of the places where texture whiskers were: share whose tile the map has with a sure texture, and share of those that
    is the true one."""
    said, right = [], []
    lattice, tips = mapped.touched.lattice, mapped.robot.of_role("texture")
    truth = mapped.rows.truth
    if not tips:
        return {"tiles_said": 0.0, "tiles_right": None}
    for tip in tips:
        true, _ = textures(arena, truth, tip)
        places = compose(truth, np.array([*tip.tip_m, 0.0]))[:, :2]
        back = Motion(-motion.turn, 0.0, 0.0).points(places - np.array([motion.x, motion.y]))
        for point, texture in zip(back, true, strict=True):
            index, sure = _tile_at(mapped.touched, point) if lattice else (0, 0.0)
            said.append(sure >= SURE)
            right.append(index == texture)
    said, right = np.array(said), np.array(right)
    return {"tiles_said": float(said.mean()), "tiles_right": float(right[said].mean()) if said.any() else None}


def _tile_at(touched: TouchMap, point: np.ndarray) -> tuple[int, float]:
    lattice = touched.lattice
    c, s = math.cos(lattice.turn), math.sin(lattice.turn)
    x, y = point[0] - lattice.x, point[1] - lattice.y
    tile = (math.floor((c * x + s * y) / lattice.pitch), math.floor((c * y - s * x) / lattice.pitch))
    return touched.tiles.get(tile, (0, 0.0))


def score(mapped: Mapped, arena: Arena) -> dict[str, float | None]:
    """All figures of a run of the mapper over a scene whose rows have true poses."""
    cost = {"step_us_mean": float(mapped.step_us.mean()), "step_us_p99": float(np.quantile(mapped.step_us, 0.99))}
    return judged(mapped, arena) | cost


def judged(mapped: Mapped, arena: Arena) -> dict[str, float | None]:
    """The figures of poses and map, of any SLAM."""
    poses, truth = mapped.table["pose"], mapped.rows.truth
    motion = best_motion(poses[:, :2], truth[:, :2])
    beside = trajectory(odometry_path(mapped.rows.odometry), truth)
    return {
        **trajectory(poses, truth),
        "coverage_90": coverage(poses, mapped.table["covariance"], truth),
        **{f"odometry_{name}": value for name, value in beside.items()},
        **faces_score(mapped.touched, motion, arena),
        **corners_score(mapped.touched, motion, arena, truth),
        **tiles_score(mapped, motion, arena),
    }
