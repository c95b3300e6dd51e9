#!/usr/bin/env python3
"""Floor texture: errors, times and stability of the paper's classifier, the default method and peers.

    make bench, or .venv/bin/python tools/bench_texture.py [--fabricslide DIR] [--borealtc DIR]

Simulated floors (level 1) are drawn from seeds that nothing was developed on. Real recordings are not part of this
project: clone github.com/wngfra/FabricSlide (MIT) and github.com/norlab-ulaval/BorealTC (MIT) and give their folders
data/fabric and data/borealtc, here or as FABRICSLIDE_DIR and BOREALTC_DIR; without them their part is skipped by name.
Parts that are done are kept in build/bench/texture. Writes bench/results/texture.json and docs/charts/texture_*.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from texture_trials import LOOK, SURFACES, TICK_S, borealtc, drives, fabricslide, faults, strips
from tqdm import tqdm

from whisker.report.figures import SETTINGS
from whisker.texture import TextureModel, classify
from whisker.texture_rung import plain_features
from whisker.texture_train import train

ROOT = Path(__file__).resolve().parent.parent
RESULTS, CHARTS, CACHE = ROOT / "bench/results", ROOT / "docs/charts", ROOT / "build/bench/texture"
PEERS, VENV = Path(__file__).resolve().parent / "texture_peers", ROOT / "build/bench/texture-peers-venv"
HZ, WINDOW = 2000.0, 200
TRAIN_SEED, TEST_SEEDS, STRIP_SEEDS = 6000, (6001, 6002), (6100, 6101, 6102)
INSIDE_M, BORDER_S, WRONG_S = 0.05, 0.15, 0.1
METHODS = ("naive Bayes (paper)", "default")


def models(recordings: dict) -> dict:
    return {METHODS[0]: TextureModel.train(recordings), METHODS[1]: train(recordings, HZ)}


def decide(model, samples: np.ndarray, window: int = WINDOW, sequential: bool = False) -> list:
    """Decisions with `label` by number (-1: unknown), `best` class and `end` of the window, in samples."""
    found = classify(model, np.arange(len(samples)) * TICK_S, samples, 1000.0 * window * TICK_S, sequential)
    for d in found:
        d.end = round(d.t_s / TICK_S) + 1
        d.best = int(np.argmax(list(d.loglik.values())))
        d.number = model.classes.index(d.label) if d.label in model.classes else -1
    return found


def summary(pairs: list[tuple[int, object]]) -> dict:
    """Of (truth, decision): accuracy of the likeliest class, refusals, wrong answers given, calibration error."""
    truth, best, label = (np.array(v) for v in zip(*((k, d.best, d.number) for k, d in pairs), strict=True))
    confidence = np.array([d.confidence for _, d in pairs])
    right = best == truth
    return {
        "windows": len(pairs), "accuracy": right.mean(), "refused": (label < 0).mean(),
        "wrong_answers": ((label >= 0) & (label != truth)).mean(), "confidence": confidence.mean(),
        "calibration_error": calibration_error(right, confidence), "borders": np.mean([d.border for _, d in pairs]),
    }  # fmt: skip


def calibration_error(right: np.ndarray, confidence: np.ndarray, bins: int = 10) -> float:
    """Expected calibration error over equal bins of confidence."""
    place = np.minimum((confidence * bins).astype(int), bins - 1)
    each = [(place == b).mean() * abs(right[place == b].mean() - confidence[place == b].mean()) for b in set(place)]
    return float(np.sum(each))


def single_surfaces() -> dict:
    """Error against decision time on drives over one surface, and sequential decisions."""
    known, out = models(drives(TRAIN_SEED)), {}
    tests = [(k, r) for seed in TEST_SEEDS for k, group in enumerate(drives(seed).values()) for r in group]
    for name, model in known.items():
        for window in (12, 25, 50, 100, 200, 400, 800):
            pairs = [(k, d) for k, r in tests for d in decide(model, r, window)]
            out[f"{name}|{window}"] = summary(pairs)
        looks = [(k, d) for k, r in tests for d in decide(model, r, WINDOW, True)]
        counts = [np.diff([0, *(d.end for d in decide(model, r, WINDOW, True))]) for _, r in tests]
        out[f"{name}|sequential"] = summary(looks) | {"samples": np.concatenate(counts).mean()}
    return out


def borders() -> dict:
    """Strips of tiles: accuracy inside, borders reported and false, wrong textures after a border, refusals."""
    known = models(drives(TRAIN_SEED))
    driven = [(s, v) for seed in STRIP_SEEDS for v in (0.1, 0.15, 0.2) for s in strips(seed, v)]
    return {name: strip_scores([strip_score(model, s, v) for s, v in driven]) for name, model in known.items()}


def strip_score(model, strip, speed_m_s: float) -> dict:
    found = decide(model, strip.counts)
    crossings = (np.flatnonzero(np.diff(strip.surface)) + 1) * LOOK  # samples, to within LOOK of them
    flagged = np.array([d.end for d in found if d.border])
    slack = LOOK
    seen = [bool(((flagged > c) & (flagged <= c + BORDER_S / TICK_S + slack)).any()) for c in crossings]
    near = [(abs(f - WINDOW / 2 - crossings) <= 2 * WINDOW).any() for f in flagged]
    events = sum(1 for n, f in enumerate(flagged) if not near[n] and (n == 0 or f - flagged[n - 1] > WINDOW))
    inside, late = [], 0
    for d in found:
        look = min((d.end - 1) // LOOK, len(strip.surface) - 1)
        start = max(0, (d.end - WINDOW) // LOOK)
        truth = int(strip.surface[look])
        if (
            min(strip.inside_m[look], strip.inside_m[start]) >= INSIDE_M
            and (strip.surface[start : look + 1] == truth).all()
        ):
            inside.append((truth, d))
        since = d.end - crossings[crossings <= d.end]
        if len(since) and WRONG_S / TICK_S + slack < since.min() <= 2 * WINDOW + slack:
            late += d.number >= 0 and d.number != truth
    return {
        "seen": seen,
        "false": events,
        "metres": strip.metres,
        "inside": inside,
        "late": int(late),
        "all": len(found),
    }


def strip_scores(parts: list[dict]) -> dict:
    seen = np.concatenate([p["seen"] for p in parts])
    metres = sum(p["metres"] for p in parts)
    scores = summary([pair for p in parts for pair in p["inside"]])
    return scores | {
        "borders_crossed": len(seen), "reported_in_150_ms": seen.mean(), "metres": metres,
        "false_borders_per_10_m": 10 * sum(p["false"] for p in parts) / metres,
        "wrong_later_than_100_ms_per_border": sum(p["late"] for p in parts) / len(seen),
    }  # fmt: skip


def stability() -> dict:
    """Every fault, method by method; a texture never trained; half a window on each side of a border."""
    known, rng, out = models(drives(TRAIN_SEED)), np.random.default_rng(6), {}
    tests = drives(TEST_SEEDS[0], seconds=4.0)
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
        rest = models({k: v for k, v in drives(TRAIN_SEED).items() if k != left_out})
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


def cost() -> dict:
    """Error against time per decision at 100 ms; peers take the default's features, whose time is added."""
    recordings, tests = drives(TRAIN_SEED), drives(TEST_SEEDS[0])
    known, out = models(recordings), {}
    cut = {
        s: np.concatenate([r[: len(r) // WINDOW * WINDOW].reshape(-1, WINDOW, 2) for g in part.values() for r in g])
        for s, part in (("train", recordings), ("test", tests))
    }
    label = {s: np.repeat(np.arange(3), len(cut[s]) // 3) for s in cut}
    for name, model in known.items():
        pairs = list(zip(label["test"], (decide(model, w)[0] for w in cut["test"]), strict=True))
        out[name] = {"error": 1.0 - summary(pairs)["accuracy"], "us": own_time(model, cut["test"])}
    floor = known[METHODS[1]].rungs[0].floor
    features = {f"{s}_features": plain_features(cut[s], False, floor) for s in cut}
    start = time.perf_counter_ns()
    plain_features(cut["test"], False, floor)
    reduce_us = (time.perf_counter_ns() - start) / 1e3 / len(cut["test"])
    for name, peer in peers(cut | features | {f"{s}_label": v for s, v in label.items()}).items():
        out[name] = {"error": peer["error"], "us": peer["us"] + (0.0 if "kernels" in name else reduce_us)}
    return out


def own_time(model, windows: np.ndarray) -> float:
    """us per window of 200 samples and two channels in C, a long stream at once; the least of five passes."""
    samples = np.concatenate(windows)
    if isinstance(model, TextureModel):
        run = lambda: [model.loglik(w) for w in windows]  # noqa: E731
    else:
        run = lambda: model.judge(samples, WINDOW)  # noqa: E731
    spent = []
    for _ in range(5):
        start = time.process_time_ns()
        run()
        spent.append((time.process_time_ns() - start) / 1e3 / len(windows))
    return min(spent)


def peers(arrays: dict) -> dict:
    pip = [
        VENV / "bin/pip",
        "install",
        "-q",
        "--disable-pip-version-check",
        "--require-hashes",
        "--only-binary",
        ":all:",
    ]
    if not (VENV / "ready").exists():
        for command in ([sys.executable, "-m", "venv", VENV], [*pip, "-r", PEERS / "requirements.lock"]):
            if subprocess.run(command, capture_output=True).returncode:
                print("texture: scikit-learn and convolution kernels skipped: requirements.lock cannot be installed")
                return {}
        (VENV / "ready").touch()
    with tempfile.TemporaryDirectory() as folder:
        np.savez(Path(folder) / "w.npz", **arrays)
        one = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        command = [VENV / "bin/python", PEERS / "peer.py", Path(folder) / "w.npz"]
        return json.loads(subprocess.run(command, capture_output=True, check=True, env=os.environ | one).stdout)


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


def draw(results: dict) -> dict[str, Figure]:
    """Error against decision time, and against time to decide; windows too short for a method are not drawn."""
    figures = {}
    with matplotlib.rc_context(SETTINGS):
        if "single_surfaces" in results:
            figures["texture_time"] = draw_time(results["single_surfaces"])
        if "cost" in results:
            figures["texture_cost"] = draw_cost(results["cost"])
    return figures


def draw_time(scores: dict) -> Figure:
    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    axes = figure.subplots()
    for name, style in zip(METHODS, ({"color": "#c25700", "ls": "--", "marker": "^"}, {"color": "#0b5394", "marker": "o"}), strict=True):  # fmt: skip
        points = [
            (int(key.split("|")[1]), s)
            for key, s in scores.items()
            if key.startswith(name) and "seq" not in key and s["refused"] < 1.0
        ]
        axes.plot(
            [w / 2 for w, _ in points], [100 * (1 - s["accuracy"]) + 0.01 for _, s in points], label=name, **style
        )
        s = scores[f"{name}|sequential"]
        axes.plot(s["samples"] / 2, 100 * (1 - s["accuracy"]) + 0.01, "*", color=style["color"], ms=12, label=f"{name}, sequential")  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="decision time (ms)", ylabel="wrong decisions (%, + 0.01)")
    axes.set_title("Simulated floors, 0.05 to 0.2 m/s, recordings not trained on", fontsize=10)
    axes.legend()
    return figure


def draw_cost(scores: dict) -> Figure:
    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    axes = figure.subplots()
    for (name, s), marker in zip(scores.items(), "^oDsvPX*", strict=False):
        axes.plot(s["us"], 100 * s["error"] + 0.01, marker, color="#0b5394" if name in METHODS else "#6b6b6b", ms=8, label=name)  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="time per decision (us)", ylabel="wrong decisions (%, + 0.01)")
    axes.set_title("100 ms windows of two axes at 2 kHz, one core", fontsize=10)
    axes.legend(fontsize=8)
    return figure


def run(build: Path, fresh: bool, real: dict[str, str | None] | None = None) -> None:
    """Measure what is not yet measured, and redraw. `build` is not used: the C library comes with the Python module."""
    CACHE.mkdir(parents=True, exist_ok=True)
    given = {n: (real or {}).get(n) or os.environ.get(f"{n.upper()}_DIR") for n in ("fabricslide", "borealtc")}
    parts = {"cost": cost, "single_surfaces": single_surfaces, "borders": borders, "stability": stability}
    for name, measure in (("fabricslide", fabrics), ("borealtc", terrains)):
        if given[name]:
            parts[name] = lambda measure=measure, name=name: measure(Path(given[name]))
        elif not (CACHE / f"{name}.json").exists():
            print(f"texture: {name} skipped: give --{name} DIR or {name.upper()}_DIR (see the module's text)")
    results = {}
    for name, measure in tqdm(parts.items(), desc="texture"):
        kept = CACHE / f"{name}.json"
        if fresh or not kept.exists():
            kept.write_text(json.dumps(measure(), indent=1, default=float) + "\n")
        results[name] = json.loads(kept.read_text())
    RESULTS.mkdir(parents=True, exist_ok=True)
    (RESULTS / "texture.json").write_text(json.dumps(results, indent=1) + "\n")
    for name, figure in draw(results).items():
        for ending in ("svg", "png"):
            figure.savefig(CHARTS / f"{name}.{ending}", dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build-dir", type=Path, default=ROOT / "build/release")
    parser.add_argument("--fresh", action="store_true", help="forget what is already measured")
    parser.add_argument("--fabricslide", metavar="DIR", help="FabricSlide's data/fabric")
    parser.add_argument("--borealtc", metavar="DIR", help="BorealTC's data/borealtc")
    options = parser.parse_args()
    matplotlib.rcParams["svg.hashsalt"] = "whisker"
    run(options.build_dir, options.fresh, {"fabricslide": options.fabricslide, "borealtc": options.borealtc})


if __name__ == "__main__":
    main()
