"""What a robot truly meets again: lines of faces, corners and stretches of the floor, by true poses and the arena alone."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from crunchbot.nav.mapping import Mapped
from crunchbot.scene import Arena

from .geometry import compose, textures
from .map_scoring import true_faces

NEAR_M = 0.03  # of a touched point from a face that it may be of
AWAY_M = 1.0  # way without a thing after which meeting it again is a closure that could be made
REACH_M, SHORTLY_M = 0.25, 0.3  # of touched points from their corner; way between those of both faces
GAP_M = 0.5  # way without a tile read again that ends a stretch of them
TILES_LEAST = 3  # in such a stretch


@dataclass(frozen=True)
class Meeting:
    """From row `first` to row `last` a thing is met again: number `thing` of its kind, at (x, y) m if that is one place."""

    first: int
    last: int
    thing: int
    x: float = math.nan
    y: float = math.nan


def planes(arena: Arena) -> np.ndarray:
    """(faces,) number of the plane of each true face: faces in one line with one normal are one thing to a mapper."""
    faces = true_faces(arena)
    off = np.cos(faces[:, 4]) * faces[:, 0] + np.sin(faces[:, 4]) * faces[:, 1]
    return np.unique(np.round(np.column_stack([faces[:, 4], off]), 3), axis=0, return_inverse=True)[1].reshape(-1)


def at(pose: np.ndarray, x: float, y: float) -> np.ndarray:
    """(2,) where a point of the robot's frame is, at a pose (3,)."""
    return compose(pose, np.array([x, y, 0.0]))[:2]


def touched(arena: Arena, pose: np.ndarray, point: np.ndarray) -> set[int]:
    """True faces that a touched point (2,) of the robot's frame at a true pose (3,) may be of; the nearest always."""
    faces, place = true_faces(arena), at(pose, *point)
    low, high = np.minimum(faces[:, :2], faces[:, 2:4]), np.maximum(faces[:, :2], faces[:, 2:4])
    off = np.hypot(*(place - np.clip(place, low, high)).T)
    before = np.cos(faces[:, 4]) * (pose[0] - faces[:, 0]) + np.sin(faces[:, 4]) * (pose[1] - faces[:, 1]) > 0.0
    off = np.where(before, off, np.inf)
    return set(np.flatnonzero(off <= max(NEAR_M, off.min())).tolist())


def ways(truth: np.ndarray) -> np.ndarray:
    """(n,) m that the robot had gone by each row."""
    return np.append(0.0, np.cumsum(np.hypot(*np.diff(truth[:, :2], axis=0).T)))


def _contacts(mapped: Mapped) -> Iterator[tuple[int, np.ndarray]]:
    """(row, point (2,) of the robot's frame) of every contact, in the rows' order."""
    found = []
    for number, whisker in enumerate(mapped.robot.of_role("object")):
        assert whisker.base_m is not None
        read, along = mapped.rows.radial_m[:, number], np.array([math.cos(whisker.yaw_rad), math.sin(whisker.yaw_rad)])
        found += [(int(row), np.array(whisker.base_m) + read[row] * along) for row in np.flatnonzero(np.isfinite(read))]
    yield from sorted(found, key=lambda contact: contact[0])


def of_faces(mapped: Mapped, arena: Arena) -> list[Meeting]:
    """Each time a whisker meets a plane after AWAY_M without it, where it can be of no other."""
    truth, plane_of, way = mapped.rows.truth, planes(arena), ways(mapped.rows.truth)
    last: dict[int, float] = {}
    out = []
    for row, point in _contacts(mapped):
        faces = touched(arena, truth[row], point)
        if len(faces) > 1:
            continue
        plane = int(plane_of[next(iter(faces))])
        if plane in last and way[row] - last[plane] > AWAY_M:
            out.append(Meeting(row, row, plane))
        last[plane] = way[row]
    return out


def corners(arena: Arena) -> list[tuple[float, float, int, int]]:
    """(x, y, face, face) where two true faces meet at right angles."""
    faces = true_faces(arena)
    low, high = np.minimum(faces[:, :2], faces[:, 2:4]) - 1e-6, np.maximum(faces[:, :2], faces[:, 2:4]) + 1e-6
    upright = np.abs(np.cos(faces[:, 4])) > 0.5
    out = []
    for a in np.flatnonzero(upright):
        for b in np.flatnonzero(~upright):
            corner = np.array([faces[a, 0], faces[b, 1]])
            if (low[[a, b]] <= corner).all() and (corner <= high[[a, b]]).all():
                out.append((float(corner[0]), float(corner[1]), int(a), int(b)))
    return out


def of_corners(mapped: Mapped, arena: Arena) -> list[Meeting]:
    """Each time both faces of a corner are touched near it, shortly after each other, after AWAY_M without that."""
    truth, way = mapped.rows.truth, ways(mapped.rows.truth)
    of_face: dict[int, list[int]] = {}
    places = corners(arena)
    for number, (_, _, a, b) in enumerate(places):
        of_face.setdefault(a, []).append(number)
        of_face.setdefault(b, []).append(number)
    touched_at: dict[tuple[int, int], float] = {}
    last: dict[int, float] = {}
    out = []
    for row, point in _contacts(mapped):
        faces, place = touched(arena, truth[row], point), at(truth[row], *point)
        if len(faces) > 1:
            continue
        face = next(iter(faces))
        for number in of_face.get(face, []):
            x, y, a, b = places[number]
            if math.hypot(place[0] - x, place[1] - y) > REACH_M:
                continue
            touched_at[number, face] = way[row]
            other = b if face == a else a
            if way[row] - touched_at.get((number, other), -math.inf) > SHORTLY_M:
                continue
            if number in last and way[row] - last[number] > AWAY_M:
                out.append(Meeting(row, row, number, x, y))
            last[number] = way[row]
    return out


def of_tiles(mapped: Mapped, arena: Arena) -> list[Meeting]:
    """Stretches in which TILES_LEAST tiles or more are read after AWAY_M without each."""
    truth, way = mapped.rows.truth, ways(mapped.rows.truth)
    read = []
    for number, tip in enumerate(mapped.robot.of_role("texture")):
        tiles = textures(arena, truth, tip)[1]
        known = np.isfinite(mapped.rows.texture[:, number]).any(axis=1)
        read += [(int(row), int(tiles[row])) for row in np.flatnonzero(known)]
    last: dict[int, float] = {}
    again: set[int] = set()
    out, first, newest = [], 0, 0
    for row, tile in sorted(read):
        if again and way[row] - way[newest] > GAP_M:
            out += [Meeting(first, newest, -1)] if len(again) >= TILES_LEAST else []
            again = set()
        if tile in last and way[row] - last[tile] > AWAY_M:
            first = first if again else row
            again.add(tile)
        if tile in again:
            newest = row
        last[tile] = way[row]
    return out + ([Meeting(first, newest, -1)] if len(again) >= TILES_LEAST else [])
