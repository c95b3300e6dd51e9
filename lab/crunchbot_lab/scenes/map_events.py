"""What a mapper says has happened, against the truth: loops that closed, and kidnaps that were noticed and joined."""

import math
from dataclasses import dataclass

import numpy as np

from crunchbot.nav.mapper import LOOP_KINDS
from crunchbot.nav.mapping import Mapped
from crunchbot.scene import Arena

from .map_meetings import Meeting, at, of_corners, of_faces, of_tiles, planes, touched
from .map_scoring import best_motion

CORNER_M = 0.1  # between both places of a corner that is one
LATE_ROWS = 30  # after a meeting, within which a closure of it must come
FALSE_M = 0.3  # median error after a join that is a false one
AFTER_ROWS = 100  # that it is judged by


@dataclass(frozen=True)
class Judged:
    """A closure against the truth: whether both times it was one thing; of a face, whether of one face of the arena."""

    row: int
    right: bool
    same: bool
    planes: frozenset[int]  # of faces: that both points are of
    place: np.ndarray  # (2,) m, where the thing was met

    def closes(self, meeting: Meeting) -> bool:
        """Whether this is the closure of that meeting."""
        near = math.isnan(meeting.x) or math.hypot(*(self.place - (meeting.x, meeting.y))) <= CORNER_M
        there = not self.planes or meeting.thing in self.planes
        return self.right and near and there and meeting.first <= self.row <= meeting.last + LATE_ROWS


def _judge_face(mapped: Mapped, arena: Arena, loop: np.void) -> Judged:
    truth, plane_of = mapped.rows.truth, planes(arena)
    now = touched(arena, truth[loop["to"]], np.array([loop["x"], loop["y"]]))
    then = touched(arena, truth[loop["from"]], np.array([loop["from_x"], loop["from_y"]]))
    both = frozenset(plane_of[list(now)].tolist()) & frozenset(plane_of[list(then)].tolist())
    return Judged(int(loop["to"]), bool(both), bool(now & then), both, at(truth[loop["to"]], loop["x"], loop["y"]))


def _judge_place(mapped: Mapped, within_m: float, loop: np.void) -> Judged:
    now = at(mapped.rows.truth[loop["to"]], loop["x"], loop["y"])
    then = at(mapped.rows.truth[loop["from"]], loop["from_x"], loop["from_y"])
    one = math.hypot(*(now - then)) <= within_m
    return Judged(int(loop["to"]), one, one, frozenset(), now)


def judged(mapped: Mapped, arena: Arena, kind: str) -> list[Judged]:
    """The closures of a kind, in their order."""
    loops, lattice = mapped.touched.loops, mapped.touched.lattice
    mine = loops[loops["kind"] == LOOP_KINDS.index(kind)]
    if kind == "face":
        return [_judge_face(mapped, arena, loop) for loop in mine]
    tile_m = lattice.pitch if lattice else arena.tile_m
    return [_judge_place(mapped, CORNER_M if kind == "corner" else tile_m / 2, loop) for loop in mine]


def closures_score(mapped: Mapped, arena: Arena) -> dict[str, float | None]:
    """Of each kind of closure: how many there are, the share that is right, the share that the mapper itself expects to be
    false (`stated_false`: the mean of 1 - probability), and of the true meetings of such things the share with a right
    closure in time (`recall`). Names of those of faces have nothing before them.

    Of a face, one is right when both touched points are of one plane of the true arena; `closures_same` counts those of
    one face of it. Of a corner or tiles, when both places are one, within CORNER_M or half a tile.
    """
    loops, found = mapped.touched.loops, {}
    for kind, meetings in zip(LOOP_KINDS, (of_faces, of_corners, of_tiles), strict=True):
        mine, before = judged(mapped, arena, kind), "" if kind == "face" else f"{kind}_"
        stated = 1.0 - loops["probability"][loops["kind"] == LOOP_KINDS.index(kind)]
        closed = [any(one.closes(meeting) for one in mine) for meeting in meetings(mapped, arena)]
        found |= {
            f"{before}closures": float(len(mine)),
            f"{before}closures_right": _mean([one.right for one in mine]),
            f"{before}closures_stated_false": _mean(stated.tolist()),
            f"{before}closures_recall": _mean(closed),
        }
        if kind == "face":
            found["closures_same"] = _mean([one.same for one in mine])
    return found


def _mean(values: list) -> float | None:
    return float(np.mean(values)) if values else None


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
