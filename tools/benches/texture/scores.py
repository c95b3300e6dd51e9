"""What the bench asks of a method: decisions, and figures made of them and of the truth."""

import numpy as np

from crunchbot.touch.texture.model import TextureModel, classify
from crunchbot.touch.texture.train import calibration_error, train

from .trials import LOOK, TICK_S

HZ, WINDOW = 2000.0, 200
INSIDE_M, WRONG_S = 0.05, 0.1
REFUSED = 0.1  # share of decisions that "unknown" may cost
REFUSED_MOST, SHRINK = 0.08, 0.3  # of windows of trained surfaces; share of the diagonal in a covariance
METHODS = ("naive Bayes (paper)", "default")


def models(recordings: dict) -> dict:
    return {METHODS[0]: TextureModel.train(recordings), METHODS[1]: train(recordings, HZ)}


def decide(model, samples: np.ndarray, window: int = WINDOW, sequential: bool = False) -> list:
    """Decisions with `label` by number (-1: unknown), `best` class and `end` of the window, in samples."""
    found = classify(model, np.arange(len(samples)) * TICK_S, samples, 1000.0 * window * TICK_S, sequential)
    for d in found:
        d.end = round(d.t_s / TICK_S) + 1
        d.best = model.classes.index(d.best)
        d.number = model.classes.index(d.label) if d.label in model.classes else -1
    return found


def summary(pairs: list[tuple[int, object]]) -> dict:
    """Of (truth, decision): accuracy of the likeliest class, refusals, wrong answers given, calibration error."""
    truth, best, label = (np.array(v) for v in zip(*((k, d.best, d.number) for k, d in pairs), strict=True))
    confidence = np.array([d.confidence for _, d in pairs])
    right = best == truth
    return {
        "windows": len(pairs),
        "accuracy": right.mean(),
        "refused": (label < 0).mean(),
        "wrong_answers": ((label >= 0) & (label != truth)).mean(),
        "confidence": confidence.mean(),
        "calibration_error": calibration_error(right, confidence),
        "cut_at_a_tenth_refused": refusal_cut(right, confidence),
    }


def refusal_cut(right: np.ndarray, confidence: np.ndarray) -> float:
    """By how much refusing the least confident tenth cuts the wrong decisions."""
    kept = np.argsort(-confidence, kind="stable")[: round((1 - REFUSED) * len(right))]
    return float((~right).sum() / max(1, (~right)[kept].sum()))


def strip_score(model, strip) -> dict:
    """One drive over many tiles. A tip that an edge holds meets the next tile when it is let go: until then it is at
    the border."""
    found = decide(model, strip.counts)
    left = strip.left()
    parts = {"inside": [], "late": 0, "held": 0, "held_wrong": 0}
    for d in found:
        first, last = max(0, d.end - WINDOW) // LOOK, min((d.end - 1) // LOOK, len(strip.surface) - 1)
        look, truth = slice(first, last + 1), int(strip.surface[last])
        wrong = d.number >= 0 and d.number != truth
        if strip.caught[look].any():
            parts["held"] += 1
            parts["held_wrong"] += wrong and d.number != int(strip.surface[max(0, first - LOOK)])
            continue
        if strip.inside_m[look].min() >= INSIDE_M and (strip.surface[look] == truth).all():
            parts["inside"].append((truth, d))
        since = d.end - left[left <= d.end]
        parts["late"] += bool(wrong and len(since) and WRONG_S / TICK_S + LOOK < since.min() <= 2 * WINDOW + LOOK)
    return parts | {"borders": len(left), "metres": strip.metres}


def strip_scores(parts: list[dict]) -> dict:
    """Of several drives together."""
    crossed, held = sum(p["borders"] for p in parts), max(1, sum(p["held"] for p in parts))
    return summary([pair for p in parts for pair in p["inside"]]) | {
        "borders_crossed": crossed,
        "metres": sum(p["metres"] for p in parts),
        "wrong_later_than_100_ms_per_border": sum(p["late"] for p in parts) / crossed,
        "windows_held_by_an_edge": held,
        "wrong_while_held": sum(p["held_wrong"] for p in parts) / held,
    }
