"""Kidnaps that a mapper says have happened, against the truth: noticed and joined."""

import numpy as np

from crunchbot.nav.mapping import Mapped

from .map_scoring import best_motion

FALSE_M = 0.3  # median error after a join that is a false one
AFTER_ROWS = 100  # that it is judged by


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
