"""Public recordings that a user gives: whole trials of fabrics, and terrains with whole runs held out."""

from pathlib import Path

import numpy as np
from tqdm import tqdm

from whisker.touch.texture.model import TextureModel, posterior
from whisker.touch.texture.train import calibration_error, train

from .scores import METHODS, refusal_cut
from .trials import borealtc, fabricslide

FABRIC_HZ = 35.6
TERRAIN_HZ, TERRAIN_WINDOW = 100.0, 170  # samples: the unit of decision, trained for as such


def fabrics(folder: Path) -> dict:
    """Whole trials, with repeats, a speed or a force left out; trained for windows as long as the shortest trial."""
    trials, out = fabricslide(folder), {}
    shortest_ms = 1000.0 * min(len(x) for *_, x in trials) / FABRIC_HZ
    for what in ("repeat", "speed", "force"):
        found = {name: [] for name in METHODS}
        for value in tqdm(sorted({t[1][what] for t in trials}), desc=f"FabricSlide, {what} left out"):
            kept = group((n, x) for n, w, x in trials if w[what] != value)
            held = [(n, x) for n, w, x in trials if w[what] == value]
            for name, decisions in trial_decisions(kept, held, shortest_ms).items():
                found[name] += decisions
        out[what] = {name: scores(decisions) for name, decisions in found.items()}
    return out


def trial_decisions(kept: dict, held: list, window_ms: float) -> dict[str, list[tuple]]:
    bayes, spectral = TextureModel.train(kept), train(kept, FABRIC_HZ, window_ms)
    names = list(kept)
    return {
        METHODS[0]: [paper_decision(bayes, x, names, n) for n, x in held],
        METHODS[1]: [decision(spectral.judge(x, len(x))[0], names, n) for n, x in held],
    }


def terrains(folder: Path, folds: int = 5) -> dict:
    """Windows of 1.7 s, whole runs held out: the runs of each terrain in turn, shuffled once."""
    runs, found = borealtc(folder), {name: [] for name in METHODS}
    rng, fold = np.random.default_rng(6), np.zeros(len(runs), int)
    for name in dict.fromkeys(n for n, _ in runs):
        mine = rng.permutation([i for i, (n, _) in enumerate(runs) if n == name])
        fold[mine] = np.arange(len(mine)) % folds
    for f in tqdm(range(folds), desc="BorealTC, runs left out"):
        kept = group(run for run, at in zip(runs, fold, strict=True) if at != f)
        bayes, names = TextureModel.train(kept), list(kept)
        spectral = train(kept, TERRAIN_HZ, 1000.0 * TERRAIN_WINDOW / TERRAIN_HZ)
        for n, x in (run for run, at in zip(runs, fold, strict=True) if at == f):
            found[METHODS[1]] += [decision(d, names, n) for d in spectral.judge(x, TERRAIN_WINDOW)]
            windows = x[: len(x) // TERRAIN_WINDOW * TERRAIN_WINDOW].reshape(-1, TERRAIN_WINDOW, x.shape[1])
            found[METHODS[0]] += [paper_decision(bayes, w, names, n) for w in windows]
    return {name: scores(decisions) for name, decisions in found.items()}


def decision(d, names: list[str], truth: str) -> tuple[bool, bool, float]:
    """Whether the likeliest class is right, whether it was told, and its confidence."""
    return names[int(d.loglik.argmax())] == truth, d.label >= 0, d.confidence


def paper_decision(bayes: TextureModel, samples: np.ndarray, names: list[str], truth: str) -> tuple[bool, bool, float]:
    """The same of equation 1, which always answers."""
    chance = posterior(bayes.loglik(samples))
    return names[int(chance.argmax())] == truth, True, float(chance.max())


def scores(decisions: list[tuple]) -> dict:
    """Accuracy, refusals, wrong answers given, calibration, and by how much the least confident tenth, refused, cuts them."""
    right, told, confidence = (np.array(v) for v in zip(*decisions, strict=True))
    return {
        "decisions": len(right), "accuracy": right.mean(), "refused": 1.0 - told.mean(),
        "wrong_answers": (told & ~right).mean(), "calibration_error": calibration_error(right, confidence),
        "cut_at_a_tenth_refused": refusal_cut(right, confidence),
    }  # fmt: skip


def group(pairs) -> dict[str, list[np.ndarray]]:
    out: dict[str, list] = {}
    for name, samples in pairs:
        out.setdefault(name, []).append(samples)
    return out
