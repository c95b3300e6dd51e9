"""Runs in the peers' own environment: risk.py WINDOWS.npz -> one JSON object, probabilities (m, classes) by method.

WINDOWS.npz as for peer.py, with train_run: the run of each training window. Probabilities are calibrated by a sigmoid
on runs held out in turn.
"""

import json
import sys

import numpy as np
from peer import Kernels
from sklearn.calibration import CalibratedClassifierCV
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.linear_model import LogisticRegression
from sklearn.model_selection import StratifiedGroupKFold
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

SPLITS = 3


def main() -> None:
    data = np.load(sys.argv[1])
    label, run = data["train_label"], data["train_run"]
    folds = list(StratifiedGroupKFold(SPLITS, shuffle=True, random_state=0).split(label, label, run))
    kernels = Kernels(data["train"])
    shapes = {
        s: np.concatenate([kernels.transform(p) for p in np.array_split(data[s], 1 + len(data[s]) // 100)])
        for s in ("train", "test")
    }
    features = {s: data[f"{s}_features"] for s in ("train", "test")}
    found = {}
    for name, model, x in (
        ("LDA, calibrated", LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto"), features),
        ("convolution kernels, calibrated", LogisticRegression(C=0.01, max_iter=200), shapes),
    ):
        made = CalibratedClassifierCV(make_pipeline(StandardScaler(), model), cv=folds)
        found[name] = made.fit(x["train"], label).predict_proba(x["test"]).round(6).tolist()
    print(json.dumps(found))


main()
