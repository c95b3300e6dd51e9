"""Simulated floors: error against decision time, strips of tiles, refusals on closer surfaces, faults method by method."""

from functools import cache

import numpy as np

from .scores import METHODS, WINDOW, decide, models, strip_score, strip_scores, summary
from .trials import SURFACES, closer, drives, faults, strips

TRAIN_SEED, TEST_SEEDS, STRIP_SEEDS, OTHER_ROBOT = 6000, (6001, 6002), range(6100, 6115), 6050
SPEEDS_M_S = (0.1, 0.15, 0.2)  # of strips


@cache
def trained() -> dict:
    """Both methods, of one robot."""
    return models(drives(TRAIN_SEED, TRAIN_SEED))


def single_surfaces() -> dict:
    """Error against decision time on drives over one surface, and sequential decisions."""
    known, out = trained(), {}
    tests = [(k, r) for seed in TEST_SEEDS for k, group in enumerate(drives(seed, TRAIN_SEED).values()) for r in group]
    for name, model in known.items():
        for window in (50, 100, 200, 400, 800):
            pairs = [(k, d) for k, r in tests for d in decide(model, r, window)]
            out[f"{name}|{window}"] = summary(pairs)
        looks = [(k, d) for k, r in tests for d in decide(model, r, WINDOW, True)]
        counts = [np.diff([0, *(d.end for d in decide(model, r, WINDOW, True))]) for _, r in tests]
        out[f"{name}|sequential"] = summary(looks) | {"samples": np.concatenate(counts).mean()}
    return out


def borders() -> dict:
    """Strips of tiles: accuracy inside, wrong textures after a border and while an edge holds the tip, refusals."""
    known = trained()
    driven = [s for seed in STRIP_SEEDS for v in SPEEDS_M_S for s in strips(seed, TRAIN_SEED, v)]
    return {name: strip_scores([strip_score(model, strip) for strip in driven]) for name, model in known.items()}


def stability() -> dict:
    """Every fault, method by method; a texture never trained; half a window on each side of a border."""
    known, rng, out = trained(), np.random.default_rng(6), {}
    tests = drives(TEST_SEEDS[0], TRAIN_SEED, seconds=4.0)
    spoiled = faults(tests, rng)
    for fault, recordings in spoiled.items():
        for name, model in known.items():
            pairs = [(k, d) for k, g in enumerate(recordings.values()) for r in g for d in decide(model, r)]
            out[f"{fault}|{name}"] = summary(pairs)
    for name, pairs in never_trained(tests).items():
        out[f"texture never trained|{name}"] = summary(pairs)
    for name, model in known.items():
        pairs = [(k, d) for k, x in half_and_half(tests) for d in decide(model, x)[1:2]]
        out[f"half a window each side of a border|{name}"] = summary(pairs)
    return out


def never_trained(tests: dict) -> dict[str, list]:
    """Leave each surface out of training in turn: no answer but "unknown" is right (truth -2)."""
    found = {name: [] for name in METHODS}
    for left_out in SURFACES:
        rest = models({k: v for k, v in drives(TRAIN_SEED, TRAIN_SEED).items() if k != left_out})
        for name, model in rest.items():
            found[name] += [(-2, d) for r in tests[left_out] for d in decide(model, r)]
    return found


def half_and_half(tests: dict) -> list[tuple[int, np.ndarray]]:
    """300 samples of one surface, then 300 of another without a step between: the second window holds the border."""
    groups = list(tests.values())
    made = []
    for a in range(3):
        for b in range(3):
            for first, then in zip(groups[a], groups[b], strict=True) if a != b else ():
                made.append((b, np.concatenate([first[3000:3300], then[3000:3300] + first[3299] - then[3000]])))
    return made


def other_robot() -> dict:
    """Models of one robot on another's whiskers: 100 ms windows."""
    tests = [(k, r) for k, g in enumerate(drives(TEST_SEEDS[0], OTHER_ROBOT).values()) for r in g]
    known = trained()
    return {n: summary([(k, d) for k, r in tests for d in decide(model, r)]) for n, model in known.items()}


def refusals() -> dict:
    """Surfaces made closer, at 50 ms: how far the least confident tenth, left out, cuts the share of wrong answers."""
    rng = np.random.default_rng(60)
    known = models(closer(drives(TRAIN_SEED, TRAIN_SEED), rng))
    tests = [(k, r) for k, g in enumerate(closer(drives(TEST_SEEDS[0], TRAIN_SEED), rng).values()) for r in g]
    out = {}
    for name, model in known.items():
        pairs = [(k, d) for k, r in tests for d in decide(model, r, WINDOW // 2)]
        out[name] = summary(pairs)
    return out
