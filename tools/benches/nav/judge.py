"""What a state's answers to one draw are worth, figures over many draws, and paired differences of two states."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from crunchbot.nav import localise
from crunchbot.nav.scoring import heading_errors, lock_row, position_errors
from crunchbot_lab.scenes.making import Made

from .states import Answers

SURE, FAR_M, FAR_RAD = 0.9, 0.25, 0.5
NEAR_M = 0.06  # as published for the real runs
SETTLING_ROWS = 30  # after a kidnap, in which no filter can know
REGIONS = 20  # rows of a draw at which the region is judged
LEAST = 1e-3  # a confidence that is further from 0 or 1 means no more than that in a draw's rows

FIGURES = {  # columns of a table of `figures`, as tables.lined has them
    "locked": "{locked} of {draws}",
    "found": "{found} of {sought}",
    "rows to lock": "{rows_to_lock:.0f}",
    "error, mm": "{error_mm:.1f}",
    "within 6 cm, %": "{near:100*.0f}",
    "90 % region holds, %": "{coverage:100*.0f}",
    "after lock, %": "{coverage_locked:100*.0f}",
    "sure and wrong, %": "{sure_wrong:100*.2f}",
    "right when sure, %": "{right_when_sure:100*.1f}",
    "log score": "{log_score:.3f}",
}


def judged(made: Made, answers: Answers, folds: int = 1) -> dict:
    """Figures of one draw. Rows begin anew with each kidnap; locked: after the start and after every kidnap. Where an arena
    looks alike after half a turn, the image of the truth may be locked to, but a filter that is sure of it is wrong."""
    truth, confidence = made.observations.truth, answers.confidence
    place, turned = position_errors(answers.poses, truth), heading_errors(answers.poses, truth)
    off = np.minimum(place, position_errors(answers.poses, _image(made))) if folds == 2 else place
    starts = [0, *made.kidnaps]
    ends = [*made.kidnaps, len(off)]
    locks = [lock_row(off[first:end]) for first, end in zip(starts, ends, strict=True)]
    counted, after = np.ones(len(off), bool), np.zeros(len(off), bool)
    for first, end, lock in zip(starts, ends, locks, strict=True):
        counted[first : first + SETTLING_ROWS * (first > 0)] = False
        after[first if lock is None else first + lock : end] = lock is not None
    right = (place <= FAR_M) & (turned <= FAR_RAD)
    sure = (confidence > SURE) & counted
    believed = np.clip(confidence, LEAST, 1.0 - LEAST)
    score = np.log(np.where(right, believed, 1.0 - believed))
    at = np.array(localise.judged_rows(made.observations, REGIONS))
    known = np.isfinite(answers.levels) & counted[at]
    held = answers.levels <= 0.9
    return {
        "locked": all(lock is not None for lock in locks),
        "rows": [None if lock is None else int(lock) for lock in locks],
        "error_mm": 1e3 * float(np.median(off[after])) if after.any() else None,
        "near": float((off <= NEAR_M).mean()),
        "held": [int(held[known].sum()), int(known.sum())],
        "held_locked": [int(held[known & after[at]].sum()), int((known & after[at]).sum())],
        "sure": float(sure.sum() / counted.sum()),
        "sure_wrong": float((sure & ~right).sum() / counted.sum()),
        "log_score": float(score[counted].mean()),
        "us": float(answers.us.mean()),
    }


def _image(made: Made) -> np.ndarray:
    """The truth, turned by half a turn about the arena's middle."""
    truth = made.observations.truth
    return np.column_stack([np.array(made.scene.arena.size_m) - truth[:, :2], truth[:, 2] + math.pi])


def figures(draws: Sequence[dict]) -> dict:
    """Over draws; what has no value is None."""

    def share(key: str) -> float | None:
        held, known = (sum(draw[key][n] for draw in draws) for n in (0, 1))
        return held / known if known else None

    def mean(key: str) -> float:
        return float(np.mean([draw[key] for draw in draws]))

    rows = [row for draw in draws for row in draw["rows"]]
    found = [row for row in rows if row is not None]
    errors = [draw["error_mm"] for draw in draws if draw["error_mm"] is not None]
    return {
        "draws": len(draws),
        "locked": sum(draw["locked"] for draw in draws),
        "found": len(found),
        "sought": len(rows),
        "rows_to_lock": float(np.median(found)) if found else None,
        "error_mm": float(np.median(errors)) if errors else None,
        "near": mean("near"),
        "coverage": share("held"),
        "coverage_locked": share("held_locked"),
        "sure_wrong": mean("sure_wrong"),
        "right_when_sure": 1.0 - mean("sure_wrong") / mean("sure") if mean("sure") else None,
        "log_score": mean("log_score"),
        "us": mean("us"),
    }


def _share(draw: dict, key: str) -> float | None:
    held, known = draw[key]
    return held / known if known else None


def _log(value: float | None) -> float | None:
    return None if value is None else math.log(max(value, 1e-9))


# What is compared of two states on the same draw. Errors and times: natural logarithms of their ratio.
COMPARED: dict[str, Callable[[dict], float | None]] = {
    "locked": lambda draw: float(draw["locked"]),
    "log_score": lambda draw: draw["log_score"],
    "sure_wrong": lambda draw: draw["sure_wrong"],
    "coverage": lambda draw: _share(draw, "held"),
    "error": lambda draw: _log(draw["error_mm"]),
    "time": lambda draw: _log(draw["us"]),
}


def differences(ours: Sequence[dict], base: Sequence[dict]) -> dict[str, list[float]]:
    """Mean of our value less the base's over the draws that have both, its standard error, and their number."""
    out = {}
    for name, value in COMPARED.items():
        pairs = [(value(a), value(b)) for a, b in zip(ours, base, strict=True)]
        off = np.array([a - b for a, b in pairs if a is not None and b is not None])
        error = float(off.std(ddof=1) / math.sqrt(len(off))) if len(off) > 1 else math.nan
        out[name] = [float(off.mean()) if len(off) else math.nan, error, len(off)]
    return out
