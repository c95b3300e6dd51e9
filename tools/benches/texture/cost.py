"""Error against time per decision: ours in C, beside scikit-learn and convolution kernels in an environment of their
own."""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from crunchbot.touch.texture.classifier import plain_features
from crunchbot.touch.texture.model import TextureModel

from .. import store
from .scores import METHODS, WINDOW, decide, summary
from .simulated import TEST_SEEDS, TRAIN_SEED, trained
from .trials import drives

ROOT = Path(__file__).resolve().parents[3]
PEERS, VENV = Path(__file__).resolve().parent / "peers", ROOT / "build/bench/texture-peers-venv"


def cost() -> dict:
    """Error against time per decision at 100 ms; peers take the default's features, whose time is added."""
    recordings, tests = drives(TRAIN_SEED, TRAIN_SEED), drives(TEST_SEEDS[0], TRAIN_SEED)
    known, out = trained(), {}
    cut = {
        s: np.concatenate([r[: len(r) // WINDOW * WINDOW].reshape(-1, WINDOW, 2) for g in part.values() for r in g])
        for s, part in (("train", recordings), ("test", tests))
    }
    label = {s: np.repeat(np.arange(3), len(cut[s]) // 3) for s in cut}
    for name, model in known.items():
        pairs = list(zip(label["test"], (decide(model, w)[0] for w in cut["test"]), strict=True))
        out[name] = {"error": 1.0 - summary(pairs)["accuracy"], "us": own_time(model, cut["test"])}
    floor = known[METHODS[1]].classifiers[0].floor
    features = {f"{s}_features": plain_features(cut[s], floor) for s in cut}
    start = time.perf_counter_ns()
    plain_features(cut["test"], floor)
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


def peers(arrays: dict, program: str = "peer.py") -> dict:
    """What a program of the peers says of these arrays; nothing where they cannot be installed."""
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
        lock = PEERS / "requirements.lock"
        if error := store.failure((sys.executable, "-m", "venv", VENV), (*pip, "-r", lock)):
            store.leave_out("scikit-learn, convolution kernels", f"{lock.relative_to(ROOT)}: {error}")
            return {}
        (VENV / "ready").touch()
    with tempfile.TemporaryDirectory() as folder:
        np.savez(Path(folder) / "w.npz", **arrays)
        one = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        command = [VENV / "bin/python", PEERS / program, Path(folder) / "w.npz"]
        return json.loads(subprocess.run(command, capture_output=True, check=True, env=os.environ | one).stdout)
