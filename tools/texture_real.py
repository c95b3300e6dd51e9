"""Public recordings that a user gives: whole trials of fabrics, and terrains with whole runs held out."""

from pathlib import Path

import numpy as np
from texture_scores import METHODS
from texture_trials import borealtc, fabricslide
from tqdm import tqdm

from whisker.texture import TextureModel
from whisker.texture_train import train


def fabrics(folder: Path) -> dict:
    """Whole trials, with repeats, a speed or a force left out."""
    trials, out = fabricslide(folder), {}
    for what in ("repeat", "speed", "force"):
        right = []
        for value in tqdm(sorted({t[1][what] for t in trials}), desc=f"FabricSlide, {what} left out"):
            kept = group((n, x) for n, w, x in trials if w[what] != value)
            held = [(n, x) for n, w, x in trials if w[what] == value]
            right.append(trial_scores(kept, held))
        out[what] = {name: float(np.concatenate([r[name] for r in right]).mean()) for name in right[0]}
    return out


def trial_scores(kept: dict, held: list) -> dict[str, np.ndarray]:
    bayes, spectral = TextureModel.train(kept), train(kept, 35.6)
    names = list(kept)
    return {
        METHODS[0]: np.array([names[bayes.loglik(x).argmax()] == n for n, x in held]),
        METHODS[1]: np.array([names[spectral.judge(x, len(x))[0].loglik.argmax()] == n for n, x in held]),
    }


def terrains(folder: Path, folds: int = 5) -> dict:
    """Windows of 1.7 s, whole runs held out: the runs of each terrain in turn, shuffled once."""
    runs, right = borealtc(folder), {name: [] for name in METHODS}
    rng, fold = np.random.default_rng(6), np.zeros(len(runs), int)
    for name in {n for n, _ in runs}:
        mine = rng.permutation([i for i, (n, _) in enumerate(runs) if n == name])
        fold[mine] = np.arange(len(mine)) % folds
    for f in tqdm(range(folds), desc="BorealTC, runs left out"):
        kept = group(run for run, at in zip(runs, fold, strict=True) if at != f)
        bayes, spectral, names = TextureModel.train(kept), train(kept, 100.0), list(kept)
        for n, x in (run for run, at in zip(runs, fold, strict=True) if at == f):
            right[METHODS[1]] += [names[d.loglik.argmax()] == n for d in spectral.judge(x, 170)]
            windows = x[: len(x) // 170 * 170].reshape(-1, 170, x.shape[1])
            right[METHODS[0]] += [names[bayes.loglik(w).argmax()] == n for w in windows]
    return {name: float(np.mean(v)) for name, v in right.items()}


def group(pairs) -> dict[str, list[np.ndarray]]:
    out: dict[str, list] = {}
    for name, samples in pairs:
        out.setdefault(name, []).append(samples)
    return out
