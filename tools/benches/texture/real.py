"""Public recordings that a user gives: whole trials of fabrics, terrains with whole runs held out, surfaces left
out."""

from pathlib import Path

import numpy as np
from tqdm import tqdm

from crunchbot.touch.texture.classifier import plain_features
from crunchbot.touch.texture.model import TextureModel, posterior
from crunchbot.touch.texture.train import calibration_error, train

from .cost import peers
from .scores import METHODS, refusal_cut
from .trials import borealtc, fabricslide, vulpi

FABRIC_HZ = 35.6
BOREAL_HZ, VULPI_HZ, TERRAIN_S = 100.0, 50.0, 1.7  # the unit of decision, trained for as such
FOLDS = 5
ROW = 4  # windows of a recording before those counted where a surface is left out


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


def boreal(folder: Path) -> dict:
    return terrains(borealtc(folder), BOREAL_HZ)


def vulpi_terrains(folder: Path) -> dict:
    return terrains(vulpi(folder), VULPI_HZ)


def folds_of(runs: list) -> np.ndarray:
    """The runs of each terrain in turn, shuffled once."""
    rng, fold = np.random.default_rng(6), np.zeros(len(runs), int)
    for name in dict.fromkeys(n for n, _ in runs):
        mine = rng.permutation([i for i, (n, _) in enumerate(runs) if n == name])
        fold[mine] = np.arange(len(mine)) % FOLDS
    return fold


def terrains(runs: list, hz: float) -> dict:
    """Windows of 1.7 s and sequential decisions, whole runs held out; peers on the same windows."""
    window, fold = round(TERRAIN_S * hz), folds_of(runs)
    found = {name: [] for name in (*METHODS, "default, sequential")}
    for f in tqdm(range(FOLDS), desc="runs left out"):
        kept, held = ([r for r, at in zip(runs, fold, strict=True) if (at == f) == out] for out in (False, True))
        bayes, names = TextureModel.train(group(kept)), list(group(kept))
        spectral = train(group(kept), hz, 1000.0 * TERRAIN_S)
        for n, x in held:
            found[METHODS[1]] += [decision(d, names, n) for d in spectral.judge(x, window)]
            found["default, sequential"] += [decision(d, names, n) for d in spectral.judge(x, window, True)]
            found[METHODS[0]] += [paper_decision(bayes, w, names, n) for w in windows_of(x, window)]
        for name, decisions in peer_decisions(kept, held, names, window, spectral.classifiers[0].floor).items():
            found.setdefault(name, []).extend(decisions)
    return {name: scores(decisions) for name, decisions in found.items()}


def peer_decisions(kept: list, held: list, names: list[str], window: int, floor: np.ndarray) -> dict[str, list[tuple]]:
    """Calibrated peers, each window's decision: they always answer."""
    arrays = {}
    for part, runs in (("train", kept), ("test", held)):
        cut = [windows_of(x, window) for _, x in runs]
        arrays[part] = np.concatenate(cut)
        arrays[f"{part}_features"] = plain_features(arrays[part], floor)
        arrays[f"{part}_label"] = np.repeat([names.index(n) for n, _ in runs], list(map(len, cut)))
        arrays[f"{part}_run"] = np.repeat(np.arange(len(runs)), list(map(len, cut)))
    truth = arrays["test_label"]
    return {
        name: [(int(np.argmax(p)) == k, True, float(np.max(p))) for p, k in zip(chances, truth, strict=True)]
        for name, chances in peers(arrays, "risk.py").items()
    }


def windows_of(x: np.ndarray, window: int) -> np.ndarray:
    return x[: len(x) // window * window].reshape(-1, window, x.shape[1])


def decision(d, names: list[str], truth: str) -> tuple[bool, bool, float]:
    """Whether the likeliest class is right, whether it was given as answer, and its confidence."""
    return names[d.best] == truth, d.label >= 0, d.confidence


def paper_decision(bayes: TextureModel, samples: np.ndarray, names: list[str], truth: str) -> tuple[bool, bool, float]:
    """The same of equation 1, which always answers."""
    chance = posterior(bayes.loglik(samples))
    return names[int(chance.argmax())] == truth, True, float(chance.max())


def scores(decisions: list[tuple]) -> dict:
    """Accuracy, refusals, wrong answers given, calibration, and by how much the least confident tenth, refused, cuts
    them."""
    right, reported, confidence = (np.array(v) for v in zip(*decisions, strict=True))
    return {
        "decisions": len(right),
        "accuracy": right.mean(),
        "refused": 1.0 - reported.mean(),
        "wrong_answers": (reported & ~right).mean(),
        "calibration_error": calibration_error(right, confidence),
        "cut_at_a_tenth_refused": refusal_cut(right, confidence),
        "area_under_risk_coverage": area(right, confidence),
    }


def area(right: np.ndarray, confidence: np.ndarray) -> float:
    """Under the share of wrong decisions against the share kept, the most confident first."""
    wrong = ~right[np.argsort(-confidence, kind="stable")]
    return float((np.cumsum(wrong) / np.arange(1, len(wrong) + 1)).mean())


def group(pairs) -> dict[str, list[np.ndarray]]:
    out: dict[str, list] = {}
    for name, samples in pairs:
        out.setdefault(name, []).append(samples)
    return out
