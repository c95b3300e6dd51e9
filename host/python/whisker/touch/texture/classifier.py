"""The classifier for windows of one length: numbers in NumPy, arithmetic in C (host/nav/touch/texture_classifier.h)."""

from dataclasses import dataclass, field

import numpy as np

from ...native import as_doubles, doubles, ffi, lib

SEED = 2011  # of the random projections; any will do


@dataclass
class Classifier:
    """A classifier for windows of `length` samples; the arrays as in nav_texture_classifier_numbers."""

    length: int
    levels: bool
    shorter: int
    hidden: int
    floor: np.ndarray  # (channels,)
    centre: np.ndarray  # (F,)
    scale: np.ndarray  # (F,)
    weight: np.ndarray  # (F + hidden, classes)
    bias: np.ndarray  # (classes,)
    temper: float = 1.0
    span: np.ndarray | None = None  # (channels,) counts: the farthest that a window of this length may reach
    seed: int = SEED
    _made: object = field(default=None, repr=False, compare=False)

    ARRAYS = ("floor", "centre", "scale", "weight", "bias")
    NUMBERS = ("length", "levels", "shorter", "hidden", "temper", "seed")

    @property
    def native(self):
        """The C classifier; ValueError when the sizes do not fit each other or a number is impossible."""
        if self._made is None:
            self._made = self._make()
        return self._made

    def _make(self):
        features = feature_count(len(self.floor), self.length, self.levels, self.shorter)
        classes = len(self.bias)
        shapes = {"centre": (features,), "scale": (features,), "weight": (features + self.hidden, classes)}
        shapes |= {"floor": (len(self.floor),), "bias": (classes,)}
        for name, shape in shapes.items():
            setattr(self, name, as_doubles(getattr(self, name), f"classifier {self.length}: {name}", shape))
        numbers = ffi.new("struct nav_texture_classifier_numbers *")
        numbers.classes, numbers.channels, numbers.length = classes, len(self.floor), self.length
        numbers.levels, numbers.shorter = int(self.levels), self.shorter
        numbers.hidden, numbers.seed, numbers.temper = self.hidden, self.seed, self.temper
        for name in self.ARRAYS:
            setattr(numbers, name, doubles(getattr(self, name), name, shapes[name]))
        made = lib.nav_texture_classifier_new(numbers)
        if made == ffi.NULL:
            raise ValueError(f"classifier {self.length}: a size or number is out of range")
        return ffi.gc(made, lib.nav_texture_classifier_free)

    def expand(self, windows: np.ndarray) -> np.ndarray:
        """Windows (m, length, channels) -> standardised features and projections (m, F + hidden)."""
        shape, width = (self.length, len(self.floor)), len(self.centre) + self.hidden
        windows = as_doubles(windows, "windows", (None, *shape))
        out = np.empty((len(windows), width))
        for window, row in zip(windows, out, strict=True):
            lib.nav_texture_classifier_expand(
                self.native, doubles(window, "window", shape), doubles(row, "features", (width,))
            )
        return out


def feature_count(channels: int, length: int, levels: bool, shorter: int = 0) -> int:
    """Numbers that a window is reduced to; ValueError for a size out of range."""
    floor = doubles(np.zeros(channels), "floor", (channels,))
    made = lib.nav_texture_features_new(channels, length, int(levels), shorter, floor)
    if made == ffi.NULL:
        raise ValueError(f"texture: {channels} channels in windows of {length} samples are out of range")
    return lib.nav_texture_features_count(ffi.gc(made, lib.nav_texture_features_free))


def plain_features(windows: np.ndarray, levels: bool, floor: np.ndarray, shorter: int = 0) -> np.ndarray:
    """Windows (m, length, channels) -> features (m, F), not standardised; `shorter` as in nav_texture_features_new."""
    windows = as_doubles(windows, "windows", (None, None, None))
    _, length, channels = windows.shape
    floor = doubles(as_doubles(floor, "floor", (channels,)), "floor", (channels,))
    width = feature_count(channels, length, levels, shorter)
    out = np.empty((len(windows), width))
    made = lib.nav_texture_features_new(channels, length, int(levels), shorter, floor)
    made = ffi.gc(made, lib.nav_texture_features_free)
    for window, row in zip(windows, out, strict=True):
        given = doubles(window, "window", (length, channels)), doubles(row, "features", (width,))
        lib.nav_texture_features_work(made, *given)
    return out


def blocks_of(samples: np.ndarray, length: int, channels: int) -> np.ndarray:
    """Samples (n, channels) in whole blocks, (n // length, length, channels)."""
    samples = as_doubles(samples, "samples", (None, channels))
    whole = len(samples) // length
    return samples[: whole * length].reshape(whole, length, channels)
