"""What a mapper says has happened, against the truth: loops that closed, and kidnaps that were noticed and joined."""

import math

import numpy as np

from crunchbot.nav.mapping import Mapped
from crunchbot.scene import Arena

from .geometry import compose
from .map_scoring import best_motion, true_faces

SURE = 0.999  # of a closure, to be judged
NEAR_M = 0.03  # of a touched point from a face that it may be of
AWAY_M = 1.0  # way without a face after which meeting it again is a closure that could be made
LATE_ROWS = 30  # after such a meeting, within which a closure of it must come
FALSE_M = 0.3  # median error after a join that is a false one
AFTER_ROWS = 100  # that it is judged by


def _planes(arena: Arena) -> np.ndarray:
    """(faces,) number of the plane of each true face: faces in one line with one normal are one thing to a mapper."""
    faces = true_faces(arena)
    off = np.cos(faces[:, 4]) * faces[:, 0] + np.sin(faces[:, 4]) * faces[:, 1]
    return np.unique(np.round(np.column_stack([faces[:, 4], off]), 3), axis=0, return_inverse=True)[1].reshape(-1)


def _touched(arena: Arena, pose: np.ndarray, point: np.ndarray) -> set[int]:
    """True faces that a touched point (2,) of the robot's frame at a true pose (3,) may be of; the nearest always."""
    faces = true_faces(arena)
    at = compose(pose[None], np.array([*point, 0.0]))[0, :2]
    low, high = np.minimum(faces[:, :2], faces[:, 2:4]), np.maximum(faces[:, :2], faces[:, 2:4])
    off = np.hypot(*(at - np.clip(at, low, high)).T)
    before = np.cos(faces[:, 4]) * (pose[0] - faces[:, 0]) + np.sin(faces[:, 4]) * (pose[1] - faces[:, 1]) > 0.0
    off = np.where(before, off, np.inf)
    return set(np.flatnonzero(off <= max(NEAR_M, off.min())).tolist())


def closures_score(mapped: Mapped, arena: Arena) -> dict[str, float | None]:
    """Closures of probability SURE and more. One is right when both touched points are of one plane of the true arena,
    `closures_same` counts those of one face of it. Recall: of the meetings of a plane after AWAY_M without it, the share
    with a right closure within LATE_ROWS."""
    truth, planes = mapped.rows.truth, _planes(arena)
    loops = mapped.touched.loops[mapped.touched.loops["probability"] >= SURE]
    right, same, closed = [], [], []
    for loop in loops:
        now = _touched(arena, truth[loop["to"]], np.array([loop["x"], loop["y"]]))
        then = _touched(arena, truth[loop["from"]], np.array([loop["from_x"], loop["from_y"]]))
        both = set(planes[list(now)]) & set(planes[list(then)])
        right.append(bool(both))
        same.append(bool(now & then))
        closed += [(int(loop["to"]), plane) for plane in both]
    met = _meetings(mapped, arena, planes)
    found = [any(p == plane and 0 <= row - k <= LATE_ROWS for row, p in closed) for k, plane in met]
    return {
        "closures": float(len(loops)),
        "closures_right": float(np.mean(right)) if right else None,
        "closures_same": float(np.mean(same)) if same else None,
        "closures_recall": float(np.mean(found)) if found else None,
    }


def _meetings(mapped: Mapped, arena: Arena, planes: np.ndarray) -> list[tuple[int, int]]:
    """(row, plane) where a whisker truly meets a plane again after a way of AWAY_M without it."""
    truth = mapped.rows.truth
    way = np.append(0.0, np.cumsum(np.hypot(*np.diff(truth[:, :2], axis=0).T)))
    last: dict[int, float] = {}
    out = []
    for number, whisker in enumerate(mapped.robot.of_role("object")):
        assert whisker.base_m is not None
        read = mapped.rows.radial_m[:, number]
        for row in np.flatnonzero(np.isfinite(read)):
            along = np.array([math.cos(whisker.yaw_rad), math.sin(whisker.yaw_rad)])
            faces = _touched(arena, truth[row], np.array(whisker.base_m) + read[row] * along)
            out += [(int(row), int(plane)) for plane in {*planes[list(faces)]} if len(faces) == 1]
    met = []
    for row, plane in sorted(out):
        if plane in last and way[row] - last[plane] > AWAY_M:
            met.append((row, plane))
        last[plane] = way[row]
    return met


def kidnaps_score(mapped: Mapped, kidnaps: tuple[int, ...]) -> dict[str, float | None]:
    """kidnaps: rows before which the robot was carried off. Rows until the first was noticed and until all were joined;
    joins after which the poses are more than FALSE_M off in the frame of the rows before the first kidnap; kidnaps said
    before there was any."""
    parts, truth, poses = mapped.parts[1:], mapped.rows.truth, mapped.table["pose"]
    first = min(kidnaps, default=len(truth))
    motion = best_motion(poses[:first, :2], truth[:first, :2])
    off = np.hypot(*(motion.points(poses[:, :2]) - truth[:, :2]).T)
    joins = [part.joined for part in parts if part.joined is not None and part.into == 0]
    wrong = sum(float(np.median(off[min(row, len(off) - 1) :][:AFTER_ROWS])) > FALSE_M for row in joins)
    noticed = [part.noticed - first for part in parts if part.noticed > first]
    whole = bool(kidnaps) and bool(joins) and not wrong and mapped.touched.frame == 0 and max(joins) > max(kidnaps)
    return {
        "alarms_false": float(sum(part.noticed <= first for part in parts)),
        "noticed_rows": float(noticed[0]) if noticed else None,
        "joined": float(whole) if kidnaps else None,
        "joined_rows": float(max(joins) - max(kidnaps)) if whole else None,
        "joined_false": float(wrong),
    }
