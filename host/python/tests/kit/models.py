"""Small texture models of the default method, made of nothing: sizes and numbers are possible, no surface is known."""

import numpy as np

from crunchbot.touch.texture.change import Change
from crunchbot.touch.texture.classifier import Classifier, feature_count
from crunchbot.touch.texture.novelty import STEPS, Novelty
from crunchbot.touch.texture.spectral import SpectralModel

CHANNELS, LENGTH, CLASSES = 2, 64, 3
FEATURES = feature_count(np.ones(CHANNELS), LENGTH, False)
LIMITS = {"spike": [9.0, 9.0], "still": [1.0, 1.0], "low": [0.0, 0.0], "high": [65535.0, 65535.0]}
LIMITS = {name: np.array(values) for name, values in LIMITS.items()}


def classifier() -> Classifier:
    sizes = {"shape": (0,), "centre": (FEATURES,), "weight": (FEATURES, CLASSES), "bias": (CLASSES,)}
    arrays = {name: np.zeros(shape) for name, shape in sizes.items()}
    ones = {"floor": np.ones(CHANNELS), "scale": np.ones(FEATURES)}
    return Classifier(LENGTH, False, 0, 0, **arrays, **ones, span=np.full(CHANNELS, 1e4))


def change() -> Change:
    wide, square = np.zeros((FEATURES, CLASSES)), np.zeros((CLASSES, CLASSES))
    rule = wide, square, wide, np.zeros(CLASSES)
    return Change(LENGTH, 0.5, 1.0, np.ones(CHANNELS), *rule, *rule)


def novelty() -> Novelty:
    rows = np.zeros((CLASSES + 1, FEATURES))
    return Novelty(LENGTH, 1.0, np.eye(FEATURES), rows, rows, np.ones(FEATURES), np.ones(STEPS))


def model(**limits) -> SpectralModel:
    return SpectralModel(["A", "B", "C"], 2000.0, [classifier()], LIMITS | limits)
