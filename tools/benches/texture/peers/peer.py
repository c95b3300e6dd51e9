"""Runs in the peers' own environment: peer.py WINDOWS.npz -> one JSON object, error and time per decision by method.

WINDOWS.npz: train, test (m, length, channels) raw counts; train_features, test_features (m, F); train_label,
test_label. Times are of one window at a time, as a robot asks, with what each method needs to reduce the window itself;
methods that take host/nav's features add nothing for them: cost.py does.
"""

import itertools
import json
import sys
import time

import numpy as np
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis, QuadraticDiscriminantAnalysis
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.linear_model import RidgeClassifierCV
from sklearn.naive_bayes import GaussianNB
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

TIMED = 200
QUANTILES = (0.25, 0.5, 0.75)


class Kernels:
    """Convolution kernels of the MiniRocket class: 84 kernels of 9 taps, six of -1 and three of 2, dilated; shares
    above bias."""

    def __init__(self, windows):
        self.taps = np.array(
            [[2.0 if i in threes else -1.0 for i in range(9)] for threes in itertools.combinations(range(9), 3)]
        )
        self.dilations = [d for d in (1, 2, 4, 8, 16) if 8 * d < windows.shape[1]]
        some = windows[:: max(1, len(windows) // 100)]
        self.bias = [np.quantile(c, QUANTILES, axis=(0, 2)) for c in self._convolved(some)]

    def _convolved(self, windows):
        centred = windows - windows.mean(axis=1, keepdims=True)
        for channel, d in itertools.product(range(windows.shape[2]), self.dilations):
            views = np.lib.stride_tricks.sliding_window_view(centred[:, :, channel], 8 * d + 1, axis=1)[:, :, ::d]
            yield np.einsum("mtk,fk->mft", views, self.taps)

    def transform(self, windows):
        shares = [
            (c[None] > b[:, None, :, None]).mean(axis=3)
            for c, b in zip(self._convolved(windows), self.bias, strict=True)
        ]
        return np.concatenate([s.transpose(1, 0, 2).reshape(len(windows), -1) for s in shares], axis=1)


def timed(predict, items) -> float:
    """Median time of one decision, us."""
    spent = []
    for item in items[:TIMED]:
        start = time.perf_counter_ns()
        predict(item[None])
        spent.append((time.perf_counter_ns() - start) / 1e3)
    return float(np.median(spent))


def main() -> None:
    data = np.load(sys.argv[1])
    label, truth = data["train_label"], data["test_label"]
    found = {}
    for name, model in {
        "Gaussian naive Bayes": GaussianNB(),
        "LDA": make_pipeline(StandardScaler(), LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto")),
        "quadratic": make_pipeline(StandardScaler(), QuadraticDiscriminantAnalysis(reg_param=0.1)),
        "gradient boosting": HistGradientBoostingClassifier(max_iter=50, random_state=0),
    }.items():
        model.fit(data["train_features"], label)
        wrong = float((model.predict(data["test_features"]) != truth).mean())
        found[name] = {"error": wrong, "us": timed(model.predict, data["test_features"])}
    kernels = Kernels(data["train"])
    ridge = make_pipeline(StandardScaler(), RidgeClassifierCV(alphas=np.logspace(-2, 4, 7)))
    ridge.fit(kernels.transform(data["train"]), label)
    decide = lambda windows: ridge.predict(kernels.transform(windows))  # noqa: E731
    wrong = np.concatenate([decide(part) for part in np.array_split(data["test"], max(1, len(truth) // 100))]) != truth
    found["convolution kernels"] = {"error": float(wrong.mean()), "us": timed(decide, data["test"])}
    print(json.dumps(found))


if __name__ == "__main__":
    main()
