"""Small texture models of the default method, made of nothing: sizes and numbers are possible, no surface is known."""

import numpy as np

from crunchbot.touch.texture.classifier import Classifier, Reducer
from crunchbot.touch.texture.novelty import ROW, Novelty
from crunchbot.touch.texture.spectral import SpectralModel

CHANNELS, LENGTH, CLASSES = 2, 64, 3
FEATURES = Reducer(np.ones(CHANNELS), LENGTH).count
LIMITS = {"spike": [9.0, 9.0], "still": [1.0, 1.0], "low": [0.0, 0.0], "high": [65535.0, 65535.0]}
LIMITS = {name: np.array(values) for name, values in LIMITS.items()}


def classifier() -> Classifier:
    arrays = np.zeros(0), np.zeros((FEATURES, CLASSES)), np.zeros(CLASSES)
    return Classifier(LENGTH, np.ones(CHANNELS), *arrays, span=np.full(CHANNELS, 1e4))


def novelty() -> Novelty:
    return Novelty(LENGTH, np.ones(ROW), np.eye(FEATURES), np.zeros((CLASSES, FEATURES)), np.ones(FEATURES))


def model(**limits) -> SpectralModel:
    return SpectralModel(["A", "B", "C"], 2000.0, [classifier()], LIMITS | limits)
