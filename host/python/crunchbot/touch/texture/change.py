"""Where the surface under a whisker changes: numbers fitted here, arithmetic in C (host/nav/touch/texture/texture_change.h)."""

from dataclasses import dataclass

import numpy as np

from ...native import doubles, ffi, lib
from .classifier import blocks_of, feature_count, made, plain_features, pointers

SHRINK = 0.05  # share of the diagonal in covariances
ROW = 4  # blocks over which their dependence is measured
GROUP = 24  # blocks of which the largest ratio counts: while the blocks around one event are held, it shows in all
FALSE_EVERY = 1000  # blocks of one surface with one false change: 250 windows of four, 2.5 m at 0.1 m/s and 100 ms
TAIL = 0.2  # share of the groups that the tail is fitted to
NEVER = 1e9  # nats
BANDS = 9  # of a channel, the upper three octaves by thirds: a whisker rings below, at 23, 70 and 155 Hz
RULE = {"steady": 2, "apart": 2, "weight": 2, "bias": 1}  # arrays of a rule and their dimensions ...
AT = ("", "edge_")  # ... within a tile, and at an edge


@dataclass
class Change:
    """A detector for blocks of `length` samples; the arrays as in nav_texture_change_numbers, `edge_` those at an edge."""

    length: int
    share: float
    limit: float
    floor: np.ndarray  # (channels,)
    steady: np.ndarray  # (F, classes)
    apart: np.ndarray  # (classes, classes)
    weight: np.ndarray  # (F, classes)
    bias: np.ndarray  # (classes,)
    edge_steady: np.ndarray
    edge_apart: np.ndarray
    edge_weight: np.ndarray
    edge_bias: np.ndarray

    ARRAYS = {"floor": 1} | {f"{at}{n}": d for at in ("", "edge_") for n, d in RULE.items()}
    NUMBERS = ("length", "share", "limit")

    def native(self) -> ffi.CData:
        """A detector of its own, with nothing held; ValueError when a size or number is impossible."""
        features, classes = feature_count(self.floor, self.length, False), len(self.bias)
        shapes = {"steady": (features, classes), "apart": (classes, classes), "weight": (features, classes)}
        shapes |= {"bias": (classes,)}
        given = pointers(self, "change", {"floor": self.floor.shape} | {at + n: shapes[n] for at in AT for n in RULE})
        inside, edge = ({name: given.pop(at + name) for name in RULE} for at in AT)
        sizes = {"classes": classes, "channels": len(self.floor)} | {name: getattr(self, name) for name in self.NUMBERS}
        return made("change", sizes | given | {"inside": inside, "edge": edge}, "change")

    def ratios(self, samples: np.ndarray) -> np.ndarray:
        """The likeliest change after every block of samples (n, channels), nats; without the first blocks, which are too few."""
        detector, after = self.native(), ffi.new("int *")
        shape = (self.length, len(self.floor))
        found = [
            lib.nav_texture_change_weigh(detector, doubles(block, "block", shape), after)
            for block in blocks_of(samples, *shape)
        ]
        return np.array(found[2 * lib.NAV_TEXTURE_CHANGE_AFTER_MOST :])


def fit_change(
    parts: list[np.ndarray], labels: np.ndarray, folds: np.ndarray, length: int, floor: np.ndarray
) -> Change | None:
    """Fits the detector to cleaned recordings (n, channels), their classes and folds; the limit from recordings left out in turn.

    None when they are too short for a limit."""
    if min(map(len, parts)) < length:
        return None
    features = [plain_features(blocks_of(part, length, len(floor)), False, floor) for part in parts]
    found = _fit(features, labels, length, floor)
    peaks = []
    for fold in sorted(set(folds)) if len(set(folds)) > 1 else ():
        kept = [n for n in range(len(parts)) if folds[n] != fold]
        if len(set(labels[kept])) == len(set(labels)):
            twin = _fit([features[n] for n in kept], labels[kept], length, floor)
            peaks += [p for n in np.flatnonzero(folds == fold) for p in _peaks(twin.ratios(parts[n]))]
    found.limit = _limit(np.array(peaks))
    return found if found.limit < NEVER else None


def _above(features: np.ndarray, channels: int) -> np.ndarray:
    """The features (m, F) with 0 for all but bands of the upper octaves and the steps: below, a whisker rings after an edge."""
    each = (features.shape[1] - channels * (channels - 1) // 2) // channels
    keep = [c * each + i for c in range(channels) for i in (*range(max(0, each - 2 - BANDS), each - 2), each - 1)]
    out = np.zeros_like(features)
    out[:, keep] = features[:, keep]
    return out


def _fit(features: list[np.ndarray], labels: np.ndarray, length: int, floor: np.ndarray) -> Change:
    inside, edge = (_rule(f, labels) for f in (features, [_above(f, len(floor)) for f in features]))
    share = _share(features, inside["steady"])
    return Change(length, share, NEVER, floor, **inside, **{f"edge_{name}": a for name, a in edge.items()})


def _rule(features: list[np.ndarray], labels: np.ndarray) -> dict[str, np.ndarray]:
    classes = int(labels.max()) + 1
    mine = [[f for f, label in zip(features, labels, strict=True) if label == k] for k in range(classes)]
    middle = np.array([np.concatenate(group).mean(axis=0) for group in mine])
    class_cov, drive_cov = np.zeros((2, middle.shape[1], middle.shape[1]))
    for group, centre in zip(mine, middle, strict=True):
        count = classes * sum(map(len, group))
        class_cov += sum((f - centre).T @ (f - centre) for f in group) / count
        drive_cov += sum((f - f.mean(axis=0)).T @ (f - f.mean(axis=0)) for f in group) / count
    steady, weight = (np.linalg.solve(_shrunk(cov), middle.T) for cov in (drive_cov, class_cov))
    gram = middle @ steady
    apart = np.diag(gram)[:, None] + np.diag(gram) - 2.0 * gram
    return {"steady": steady, "apart": apart, "weight": weight, "bias": -0.5 * np.einsum("kf,fk->k", middle, weight)}


def _shrunk(cov: np.ndarray) -> np.ndarray:
    return (1.0 - SHRINK) * cov + np.diag(SHRINK * np.diag(cov) + 1e-6)


def _share(features: list[np.ndarray], steady: np.ndarray) -> float:
    """How much less the mean of neighbouring blocks varies than one block, over what it would if they were independent."""
    one = row = 1e-12
    for f in features:
        if len(f) < ROW:
            continue
        scores = f[: len(f) // ROW * ROW] @ (steady - steady.mean(axis=1, keepdims=True))
        scores = scores - scores.mean(axis=0)
        one += (scores**2).sum() / ROW
        row += ROW * (scores.reshape(-1, ROW, scores.shape[1]).mean(axis=1) ** 2).sum()
    return float(min(1.0, one / row))


def _peaks(ratios: np.ndarray) -> np.ndarray:
    whole = len(ratios) // GROUP
    return ratios[: whole * GROUP].reshape(whole, GROUP).max(axis=1) if whole else ratios[:0]


def _limit(peaks: np.ndarray) -> float:
    """The ratio that one group in FALSE_EVERY / GROUP exceeds: its tail is taken as exponential."""
    if len(peaks) * TAIL < 2:
        return NEVER
    start = float(np.quantile(peaks, 1.0 - TAIL))
    excess = float((peaks[peaks > start] - start).mean()) if (peaks > start).any() else 0.0
    return max(0.0, start + excess * float(np.log(TAIL * FALSE_EVERY / GROUP)))
